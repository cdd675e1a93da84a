// Any text as an input script: refused naming the file, or finite inputs in ascending order.

#include <algorithm>
#include <cmath>

#include "services/engines/scenes/script.hpp"
#include "tests/fuzz/scratch_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tandem::fuzz::ScratchFolder folder;
  const std::string path = folder.put("any.textproto", {data, size});
  const auto script = tandem::scenes::load_input_script(path, 1.0 / 30);
  if (!script) {
    if (script.error().message.find("any.textproto") == std::string::npos) std::abort();
    return 0;
  }
  const bool ascending = std::is_sorted(script->begin(), script->end(),
                                        [](const auto& a, const auto& b) { return a.frame < b.frame; });
  const bool finite = std::all_of(script->begin(), script->end(), [](const auto& scripted) {
    return std::all_of(scripted.input.values.begin(), scripted.input.values.end(),
                       [](double value) { return std::isfinite(value); });
  });
  if (!ascending || !finite) std::abort();
  return 0;
}
