#pragma once
// Training of the paper's codecs: quantisation ranges and Huffman code lengths from one run of a scene.

#include <functional>

#include "services/scenes/trained.hpp"
#include "services/server/session_plan.hpp"
#include "services/tool/scene_source.hpp"
#include "tandem/result.hpp"

namespace tandem::tool {

/// Runs twice the source that `make` makes of `scene`: with `selective` for the largest residuals, then for
/// the symbol counts with `quantized` and 1.1 x those residuals as ranges (paper, 3.3.2). `choice.codec` is
/// not used; `progress` gets the frame out of 2 x frames. Errors: what the source, the session and the
/// timeline refuse.
[[nodiscard]] Result<scenes::TrainedTable> train(scenes::Scene scene, server::SessionChoice choice,
                                                 const std::function<Result<Source>()>& make,
                                                 std::uint64_t frames,
                                                 const std::function<void(Frame)>& progress);

}  // namespace tandem::tool
