#include "services/planning/wishes.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "sdk/core/tables/codec_table.hpp"
#include "services/planning/number.hpp"

namespace tandem::planning {
namespace {

const StreamOption* find_option(std::string_view key) {
  const auto* const found = std::find_if(kStreamOptions.begin(), kStreamOptions.end(),
                                         [key](const StreamOption& option) { return option.key == key; });
  return found == kStreamOptions.end() ? nullptr : found;
}

std::string known_keys() {
  std::string keys;
  for (const StreamOption& option : kStreamOptions) {
    if (!keys.empty()) keys += ", ";
    keys += option.key;
  }
  return keys;
}

/// Stores a value in its field; returns false for an invalid one.
struct Set {
  std::string_view value;
  Wishes* wishes;

  bool operator()(std::string Wishes::*field) const {
    wishes->*field = std::string(value);
    return !value.empty();
  }
  bool operator()(double Wishes::*field) const {
    const auto read = number<double>(value);
    if (read) wishes->*field = *read;
    return read.has_value();
  }
  template <class T>
  bool operator()(std::optional<T> Wishes::*field) const {
    const auto read = number<T>(value);
    if (read) wishes->*field = *read;
    return read.has_value();
  }
};

Result<void> set(std::string_view key, std::string_view value, Wishes& wishes) {
  const auto wrong = [](std::string what) { return fail(ErrorCode::kInvalidArgument, std::move(what)); };
  const StreamOption* const option = find_option(key);
  if (option == nullptr) return wrong(fmt::format("'{}' is none of {}", key, known_keys()));
  if (!std::visit(Set{value, &wishes}, option->field))
    return wrong(fmt::format("'{}' cannot be read as {}", value, key));
  if (option->automatic) wishes.automatic = *option->automatic;
  return {};
}

bool says(const StreamWishes& stream, std::string_view key) {
  return std::ranges::any_of(stream.settings, [key](const auto& setting) { return setting.first == key; });
}

bool in_range(const StreamOption& option, std::string_view value) {
  if (option.most == 0) return true;
  const auto read = number<double>(value);
  return read && *read >= option.least && *read <= option.most;
}

/// An unknown codec excludes nothing here; it is refused where the session is planned.
CodecTraits traits_of(const std::string& codec) {
  const auto traits = codec_traits(codec);
  return traits ? *traits : CodecTraits{.reads_threshold = true, .takes_budget = true};
}

}  // namespace

Result<StreamWishes> read_stream(const std::string& text) {
  const auto wrong = [&text](const std::string& what) {
    return fail(ErrorCode::kInvalidArgument, fmt::format("'{}': {}", text, what));
  };
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos || colon + 1 == text.size())
    return wrong("NAME:PREDICTOR, or NAME:key=value,...");
  StreamWishes stream{.name = text.substr(0, colon)};
  Wishes ignored;
  for (std::size_t begin = colon + 1; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string item = text.substr(begin, end - begin);
    begin = end + 1;
    const std::size_t equals = item.find('=');
    const std::string key = equals == std::string::npos ? "predictor" : item.substr(0, equals);
    const std::string value = equals == std::string::npos ? item : item.substr(equals + 1);
    if (const auto good = set(key, value, ignored); !good) return wrong(good.error().message);
    if (says(stream, key)) return wrong(fmt::format("{} is said twice", key));
    stream.settings.emplace_back(key, value);
  }
  return stream;
}

Result<Wishes> wishes_of(const Wishes& common, const StreamWishes& stream) {
  Wishes wishes = common;
  wishes.streams.clear();
  for (const auto& [key, value] : stream.settings)
    if (auto good = set(key, value, wishes); !good) return tl::unexpected(good.error());
  if (!traits_of(wishes.codec).reads_threshold) wishes.automatic = false;
  return wishes;
}

Result<void> check_stream(const Wishes& common, const StreamWishes& stream) {
  const auto wrong = [&stream](const std::string& what) {
    return fail(ErrorCode::kInvalidArgument, fmt::format("{}: {}", stream.name, what));
  };
  const auto wishes = wishes_of(common, stream);
  if (!wishes) return wrong(wishes.error().message);
  for (const auto& [key, value] : stream.settings) {
    const StreamOption* const option = find_option(key);
    if (!in_range(*option, value)) return wrong(fmt::format("a {} is {}", key, option->takes));
  }
  const CodecTraits traits = traits_of(wishes->codec);
  const bool steered = says(stream, "target-bandwidth");
  if (says(stream, "threshold") && (steered || says(stream, "max-error")))
    return wrong("either a threshold, or one that is chosen at run time by target-bandwidth and max-error");
  if (steered && !traits.reads_threshold)
    return wrong(fmt::format("codec {} has no threshold to reach a target-bandwidth with", wishes->codec));
  if (says(stream, "max-error") && !wishes->automatic)
    return wrong("max-error needs target-bandwidth, or an automatic threshold");
  if (says(stream, "budget") && !traits.takes_budget) return wrong("a budget needs codec limited or tracker");
  return {};
}

}  // namespace tandem::planning
