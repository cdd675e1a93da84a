#include "services/follow/recording/events.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "sdk/wire/plain_text.hpp"

namespace tandem::recording {
namespace {

constexpr std::string_view kTopic = "/events";
// Another program may have written anything. A log line is short.
constexpr std::size_t kMaxJsonBytes = 1U << 16U;

std::optional<RecordedEvent> read_event(const McapMessage& message) {
  if (message.encoding != "json" || message.content.size() > kMaxJsonBytes) return std::nullopt;
  const std::string_view written(reinterpret_cast<const char*>(message.content.data()),
                                 message.content.size());
  const auto json = nlohmann::json::parse(written, nullptr, false);
  const auto text_of = [&json](const char* name) {
    const auto found = json.is_object() ? json.find(name) : json.end();
    return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
  };
  const std::string what = text_of("message"), who = text_of("name");
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
