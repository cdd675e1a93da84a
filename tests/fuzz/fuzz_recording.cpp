// Any bytes as a recording: refused, or played to its end; with a jump, too.

#include "services/follow/recording/playback.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using tandem::recording::Playback;
  auto playback = Playback::open(std::as_bytes(std::span(data, size)));
  if (!playback) return 0;
  for (const double from_s : {0.0, (*playback)->length_s()}) {
    (*playback)->seek(from_s);
    for (auto step = (*playback)->next(); step && *step != Playback::Step::kEnd; step = (*playback)->next()) {
    }
  }
  return 0;
}
