#pragma once
// The thesis's numbers that `bench_lab framerate` prints beside its own.

#include <cstdint>
#include <optional>
#include <string_view>

namespace tandem::lab {

/// Table 5.5: users of a scene in measurements of update rates, which are more than in table 5.2.
[[nodiscard]] std::optional<std::uint32_t> paper_framerate_users(int scene);

/// Table 5.6: updates per second of a phone. `method`: client-only, or the codec (none, entropy, limited).
[[nodiscard]] std::optional<double> paper_updates_per_s(int scene, std::uint32_t bodies,
                                                        std::string_view method);

}  // namespace tandem::lab
