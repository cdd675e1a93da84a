#include "sdk/core/news/news.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"

namespace tandem {
namespace {

constexpr std::size_t kMaxValueLengthBytes = 3, kMaxKindBytes = 5, kMaxSlotBytes = 4, kMaxLengthBytes = 2;

tl::unexpected<Error> malformed(const char* what) { return fail(ErrorCode::kMalformed, what); }

Result<void> read_events(std::span<const std::byte> section, std::uint32_t capacity, News& out) {
  if (section.empty() || section.size() > kMaxFrameEventBytes)
    return malformed("section of events that is empty or too long");
  ByteReader in(section);
  while (in.remaining() > 0) {
    WorldEvent event;
    const std::uint64_t kind = in.get_leb128(kMaxKindBytes);
    const std::uint64_t slot = in.get_leb128(kMaxSlotBytes);
    if (slot > 0) event.body = {static_cast<Slot>(slot - 1), in.get<std::uint8_t>()};
    const std::uint64_t length = in.get_leb128(kMaxLengthBytes);
    event.bytes = in.get_bytes(static_cast<std::size_t>(length));
    if (!in.ok()) return malformed("truncated event");
    if (kind > UINT32_MAX || slot > capacity || length > kMaxEventBytes ||
        out.events.size() == kMaxFrameEvents)
      return malformed("event out of range, or too many of them");
    event.kind = static_cast<std::uint32_t>(kind);
    out.events.push_back(event);
  }
  out.events_body = section;
  return {};
}

}  // namespace

bool is_key(std::string_view key) {
  return !key.empty() && key.size() <= kMaxKeyBytes &&
         std::all_of(key.begin(), key.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

void write_key_change(const KeyChange& change, ByteWriter& out) {
  TANDEM_ASSERT(is_key(change.key));
  out.put(static_cast<std::uint8_t>(change.key.size()));
  out.put_bytes(std::as_bytes(std::span(change.key)));
  out.put_leb128(change.value ? 1 + change.value->size() : 0);
  if (change.value) out.put_bytes(*change.value);
}

void write_event(const WorldEvent& event, ByteWriter& out) {
  TANDEM_ASSERT(event.bytes.size() <= kMaxEventBytes);
  out.put_leb128(event.kind);
  out.put_leb128(event.body ? std::uint64_t{event.body->slot} + 1 : 0);
  if (event.body) out.put(event.body->reuse);
  out.put_leb128(event.bytes.size());
  out.put_bytes(event.bytes);
}

std::size_t bytes_of(const WorldEvent& event) {
  const std::size_t body = event.body ? leb128_bytes(std::uint64_t{event.body->slot} + 1) + 1 : 1;
  return leb128_bytes(event.kind) + body + leb128_bytes(event.bytes.size()) + event.bytes.size();
}

Result<void> read_key_changes(ByteReader& in, std::vector<KeyChange>& out) {
  while (in.remaining() > 0) {
    KeyChange change;
    const std::span<const std::byte> key = in.get_bytes(in.get<std::uint8_t>());
    change.key = {reinterpret_cast<const char*>(key.data()), key.size()};
    const std::uint64_t length = in.get_leb128(kMaxValueLengthBytes);
    if (length > 0) change.value = in.get_bytes(static_cast<std::size_t>(length - 1));
    if (!in.ok()) return malformed("truncated key");
    if (!is_key(change.key)) return malformed("key that is empty, too long or not printable");
    if (!out.empty() && change.key <= out.back().key) return malformed("keys do not ascend");
    if (out.size() == 2 * kMaxKeys) return malformed("too many keys");
    out.push_back(change);
  }
  return {};
}

Result<std::span<const std::byte>> read_news(std::span<const std::byte> payload,
                                             const WorldFeatures& features, std::uint32_t capacity,
                                             News& out) {
  out.keys.clear();
  out.events.clear();
  out.events_body = {};
  ByteReader in(payload);
  std::span<const std::byte> behind = payload;
  std::uint8_t previous = 0;
  while (features.any() && in.remaining() > 0) {
    const auto section = next_section(in);
    if (!section) return tl::unexpected<Error>(section.error());
    const auto type = static_cast<SectionType>(section->type);
    const bool is_keys = features.keys && type == SectionType::kKeys;
    const bool is_events = features.events && type == SectionType::kEvents;
    // Behind one that may be skipped, news may follow; whoever reads the rest skips it again.
    if (!is_keys && !is_events && (section->type & kCriticalSection) == 0) continue;
    if (!is_keys && !is_events) break;
    if (section->type <= previous) return malformed("sections of news out of order or repeated");
    previous = section->type;
    ByteReader body(section->body);
    if (is_keys && section->body.empty()) return malformed("section of keys without any");
    const auto read = is_keys ? read_key_changes(body, out.keys) : read_events(section->body, capacity, out);
    if (!read) return tl::unexpected<Error>(read.error());
    behind = payload.last(in.remaining());
  }
  return behind;
}

}  // namespace tandem
