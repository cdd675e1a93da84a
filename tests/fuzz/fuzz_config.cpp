// Any text as a server's configuration: refused naming the file, or options within their ranges.

#include "sdk/core/lattice/state.hpp"
#include "services/tandemd/configuration/config.hpp"
#include "tests/fuzz/scratch_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tandem::fuzz::ScratchFolder folder;
  const auto file = tandem::daemon::load_config(folder.put("any.textproto", {data, size}));
  if (!file) {
    if (file.error().message.find("any.textproto") == std::string::npos) std::abort();
    return 0;
  }
  const auto options = tandem::daemon::check_config(file->config);
  if (options &&
      (options->choice.bodies == 0 || options->choice.bodies > tandem::kMaxCapacity || options->lead > 1))
    std::abort();
  return 0;
}
