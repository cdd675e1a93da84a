#pragma once
// The page about one client or one stream.

#include "services/tool/top/screen/pages.hpp"

namespace tandem::top {

/// All that is known of what is chosen, without a title. Lines may be too long and too many.
[[nodiscard]] Page details(const Overview& overview, const View& view, const Rows& rows, Size size,
                           Moment now, Alphabet alphabet);

}  // namespace tandem::top
