#include "services/tandemd/configuration/places.hpp"

#include <fmt/format.h>

#include "services/tandemd/configuration/settings.hpp"

namespace tandem::daemon {
namespace {

/// The place of the field that the flag sets, and the field; both empty if it does not come from the file.
std::pair<std::string, std::string> find_place(const Places& places, const std::string& flag) {
  for (const Setting& setting : settings()) {
    if (flag_of(setting.field) != flag) continue;
    if (const auto place = places.find(setting.field); place != places.end())
      return {place->second, setting.field};
  }
  return {};
}

}  // namespace

Error placed(const Places& places, Error error) {
  const auto file = places.find("");
  const std::size_t colon = error.message.find(": ");
  if (file == places.end() || !error.message.starts_with("--") || colon == std::string::npos) return error;
  const std::string flag = error.message.substr(0, colon), what = error.message.substr(colon + 2);
  auto [place, field] = find_place(places, flag);
  const auto stream = places.find("stream:" + what.substr(0, what.find(": ")));
  if (flag == "--stream" && stream != places.end()) place = stream->second;
  if (!place.empty()) {
    error.message = fmt::format("{}: field \"{}\": {}", place, field, what);
  } else if (what.starts_with("give ")) {
    error.message = fmt::format("{}: field \"{}\" is missing: {}", file->second, flag.substr(2), what);
  }
  return error;
}

Error placed(const Places& places, std::string_view field, const Error& error) {
  if (!field.empty())
    return placed(places, {error.code, fmt::format("{}: {}", flag_of(field), error.message)});
  const std::string word = error.message.substr(0, error.message.find(' '));
  if (const auto place = places.find(word); !word.empty() && place != places.end())
    return {error.code, fmt::format("{}: field \"{}\": {}", place->second, word, error.message)};
  const auto file = places.find("");
  return file == places.end() ? error : Error{error.code, fmt::format("{}: {}", file->second, error.message)};
}

}  // namespace tandem::daemon
