#include "services/program/configuration/places.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tandem::configuration {

std::string usual_flag(std::string_view field) {
  std::string flag = fmt::format("--{}", field);
  std::ranges::replace(flag, '_', '-');
  return flag;
}

Error placed(const Places& places, Error error) {
  const std::size_t colon = error.message.find(": ");
  if (places.file.empty() || !error.message.starts_with("--") || colon == std::string::npos) return error;
  const std::string flag = error.message.substr(0, colon), what = error.message.substr(colon + 2);
  const auto field = places.field_of_flag.find(flag);
  if (field != places.field_of_flag.end()) {
    // One of a list may have a line of its own.
    const auto own = places.of_field.find(field->second + ":" + what.substr(0, what.find(": ")));
    const std::string& place = own != places.of_field.end() ? own->second : places.of_field.at(field->second);
    error.message = fmt::format("{}: field \"{}\": {}", place, field->second, what);
  } else if (what.starts_with("give ")) {
    std::string name = flag.substr(2);
    std::ranges::replace(name, '-', '_');
    error.message = fmt::format("{}: field \"{}\" is missing: {}", places.file, name, what);
  }
  return error;
}

Error placed(const Places& places, std::string_view field, const Error& error) {
  if (!field.empty())
    return placed(places, {error.code, fmt::format("{}: {}", usual_flag(field), error.message)});
  const std::string word = error.message.substr(0, error.message.find(' '));
  if (const auto place = places.of_field.find(word); !word.empty() && place != places.of_field.end())
    return {error.code, fmt::format("{}: field \"{}\": {}", place->second, word, error.message)};
  return places.file.empty() ? error : Error{error.code, fmt::format("{}: {}", places.file, error.message)};
}

}  // namespace tandem::configuration
