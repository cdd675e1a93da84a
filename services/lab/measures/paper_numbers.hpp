#pragma once
// The thesis's numbers that `tandem bench` prints beside its own.

#include <cstdint>
#include <optional>
#include <string_view>

namespace tandem::lab {

/// Table 5.3 in Mbit/s, if it has this scene, size and codec.
[[nodiscard]] std::optional<double> paper_mbit_per_s(int scene, std::uint32_t bodies, std::string_view codec);

/// Bodies in contact per frame: table 5.3, and table 5.6 for 20,000 bodies.
[[nodiscard]] std::optional<double> paper_colliding_per_frame(int scene, std::uint32_t bodies);

/// Table 5.5: users of a scene in measurements of update rates, which are more than in table 5.2.
[[nodiscard]] std::optional<std::uint32_t> paper_framerate_users(int scene);

/// Table 5.6: updates per second of a phone. `method`: client-only, or the codec (none, entropy, limited).
[[nodiscard]] std::optional<double> paper_updates_per_s(int scene, std::uint32_t bodies,
                                                        std::string_view method);

}  // namespace tandem::lab
