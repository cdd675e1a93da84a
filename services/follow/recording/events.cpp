#include "services/follow/recording/events.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "sdk/wire/plain_text.hpp"

namespace tandem::recording {
namespace {

constexpr std::string_view kTopic = "/events";
constexpr std::string_view kSpace = " \t\r\n";

// Reads the text that begins at `at`, behind its quotation mark, and goes behind its end. Characters that are
// escaped by their number become '?'.
std::string read_text(std::string_view json, std::size_t& at) {
  std::string text;
  for (; at < json.size() && json[at] != '"'; ++at) {
    if (json[at] != '\\' || at + 1 == json.size()) {
      text += json[at];
      continue;
    }
    const char escaped = json[++at];
    const bool is_number = escaped == 'u';
    if (is_number) at = std::min(at + 4, json.size() - 1);
    const bool is_itself = escaped == '"' || escaped == '\\' || escaped == '/';
    text += is_itself ? escaped : is_number ? '?' : ' ';
  }
  ++at;
  return text;
}

// The first text of that name, in whatever object; empty if there is none.
std::string text_of(std::string_view json, std::string_view name) {
  std::size_t at = 0;
  while ((at = json.find('"', at)) != std::string_view::npos) {
    const std::string found = read_text(json, ++at);
    const std::size_t colon = json.find_first_not_of(kSpace, std::min(at, json.size()));
    if (found != name || colon == std::string_view::npos || json[colon] != ':') continue;
    std::size_t value = json.find_first_not_of(kSpace, colon + 1);
    if (value == std::string_view::npos || json[value] != '"') continue;
    return read_text(json, ++value);
  }
  return {};
}

std::optional<RecordedEvent> read_event(const McapMessage& message) {
  if (message.encoding != "json") return std::nullopt;
  const std::string_view json(reinterpret_cast<const char*>(message.content.data()), message.content.size());
  const std::string what = text_of(json, "message"), who = text_of(json, "name");
  if (what.empty()) return std::nullopt;
  const std::string text = who.empty() ? what : who + ": " + what;
  return RecordedEvent{message.log_time_ns, transport::plain_text(text, kMaxEventBytes)};
}

}  // namespace

std::vector<RecordedEvent> read_events(McapReader& reader) {
  std::vector<RecordedEvent> events;
  for (const McapReader::Place& place : reader.chunks_with(kTopic)) {
    if (events.size() >= kMaxEvents) break;
    static_cast<void>(reader.visit(place, [&](const McapMessage& message) {
      if (message.topic == kTopic) {
        if (auto event = read_event(message)) events.push_back(std::move(*event));
      }
      return events.size() < kMaxEvents;
    }));
  }
  std::ranges::stable_sort(events, {}, &RecordedEvent::time_ns);
  return events;
}

}  // namespace tandem::recording
