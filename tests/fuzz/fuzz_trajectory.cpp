// Any pair of files as a recorded trajectory: refused naming a file, or every row can be read. The first two
// bytes say how many of the rest are the sidecar.

#include "services/lab/trajectories/trajectory.hpp"
#include "tests/fuzz/scratch_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tandem::fuzz::ScratchFolder folder;
  if (size < 2) return 0;
  const std::span rest(data + 2, size - 2);
  const std::size_t sidecar = std::min<std::size_t>(data[0] + 256U * data[1], rest.size());
  static_cast<void>(folder.put("any.json", rest.first(sidecar)));
  auto opened = tandem::lab::RecordedTrajectory::open(folder.put("any.npy", rest.subspan(sidecar)));
  if (!opened) {
    if (opened.error().message.find("any.") == std::string::npos) std::abort();
    return 0;
  }
  for (std::uint64_t frame = 0; frame < (*opened)->frames(); ++frame) (*opened)->step();
  return 0;
}
