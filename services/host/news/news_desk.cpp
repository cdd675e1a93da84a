#include "services/host/news/news_desk.hpp"

#include <algorithm>
#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::host {
namespace {

// Of an event that waits, beside its bytes, and of the length of the keys that wait, in a checkpoint.
constexpr std::size_t kMaxWaitingBytes = 1 + 4 + 4 + 1 + 2, kMaxLengthBytes = 4;
constexpr const char* kNoKeys = "the session has no keys: ask for them when the server starts";
constexpr const char* kNoEvents = "the session has no events: ask for them when the server starts";
constexpr const char* kNoKey = "a key has 1 to 64 characters of ASCII without control characters";

}  // namespace

NewsDesk::NewsDesk(const WorldFeatures& features, std::uint32_t capacity)
    : features_(features), capacity_(capacity), told_(features.any() ? kMaxNewsBytes : 0) {}

std::optional<std::size_t> NewsDesk::wanted_bytes(std::string_view key) const {
  if (const auto changed = changed_.find(key); changed != changed_.end())
    return changed->second ? std::optional(key.size() + changed->second->size()) : std::nullopt;
  const auto known = world_.keys().find(key);
  if (known == world_.keys().end()) return std::nullopt;
  return key.size() + known->second.size();
}

void NewsDesk::want(std::string_view key, Value value) {
  if (const auto before = wanted_bytes(key)) {
    --wanted_keys_;
    wanted_keys_bytes_ -= *before;
  }
  if (value) {
    ++wanted_keys_;
    wanted_keys_bytes_ += key.size() + value->size();
  }
  changed_.insert_or_assign(std::string(key), std::move(value));
}

Result<void> NewsDesk::set_key(std::string_view key, std::span<const std::byte> value) {
  if (!features_.keys) return fail(ErrorCode::kUnsupported, kNoKeys);
  if (!is_key(key)) return fail(ErrorCode::kInvalidArgument, kNoKey);
  const std::lock_guard lock(mutex_);
  const auto before = wanted_bytes(key);
  const std::size_t keys = wanted_keys_ + (before ? 0 : 1);
  const std::size_t bytes = wanted_keys_bytes_ - before.value_or(0) + key.size() + value.size();
  if (keys > kMaxKeys) return fail(ErrorCode::kCapacity, "a session has at most 256 keys");
  if (bytes > kMaxKeysBytes)
    return fail(ErrorCode::kCapacity, "a session has at most 65,536 bytes of keys and their values");
  want(key, std::vector(value.begin(), value.end()));
  return {};
}

Result<void> NewsDesk::remove_key(std::string_view key) {
  if (!features_.keys) return fail(ErrorCode::kUnsupported, kNoKeys);
  if (!is_key(key)) return fail(ErrorCode::kInvalidArgument, kNoKey);
  const std::lock_guard lock(mutex_);
  if (wanted_bytes(key)) want(key, std::nullopt);
  return {};
}

Result<void> NewsDesk::broadcast(std::uint32_t kind, std::span<const std::byte> bytes,
                                 std::optional<Slot> slot) {
  if (!features_.events) return fail(ErrorCode::kUnsupported, kNoEvents);
  if (bytes.size() > kMaxEventBytes)
    return fail(ErrorCode::kInvalidArgument, "an event has at most 1,024 bytes");
  if (kind >= kFirstReservedKind)
    return fail(ErrorCode::kInvalidArgument, "kinds of events from 2^31 on are the protocol's own");
  if (slot && *slot >= capacity_) return fail(ErrorCode::kInvalidArgument, "there is no such slot");
  const std::lock_guard lock(mutex_);
  if (waiting_.size() == kMaxWaiting)
    return fail(ErrorCode::kCapacity, "1,024 events wait already for frames that have room");
  waiting_.push_back({kind, slot, std::nullopt, {bytes.begin(), bytes.end()}});
  return {};
}

void NewsDesk::take(const Mirror& mirror) {
  const std::lock_guard lock(mutex_);
  ByteWriter out(told_);
  if (!changed_.empty()) take_keys(out);
  const std::size_t keys_bytes = out.size();
  if (!waiting_.empty()) take_events(mirror, out);
  TANDEM_ASSERT(!out.overflow());
  told_bytes_ = out.size();
  told_events_ = out.size() > keys_bytes;
  if (told_bytes_ == 0) return;
  const auto rest = read_news(told(), features_, capacity_, news_);
  TANDEM_ASSERT(rest && rest->empty());
  world_.apply(news_);
  TANDEM_ASSERT(world_.keys().size() == wanted_keys_ && world_.keys_bytes() == wanted_keys_bytes_);
}

void NewsDesk::write_changed(ByteWriter& out) const {
  for (const auto& [key, value] : changed_) {
    KeyChange change{key, std::nullopt};
    if (value) change.value = *value;
    write_key_change(change, out);
  }
}

void NewsDesk::take_keys(ByteWriter& out) {
  std::erase_if(changed_, [this](const auto& change) {
    const auto known = world_.keys().find(change.first);
    return known == world_.keys().end() ? !change.second : change.second && *change.second == known->second;
  });
  if (changed_.empty()) return;
  put_section(SectionType::kKeys, out, [this](ByteWriter& body) { write_changed(body); });
  changed_.clear();
}

void NewsDesk::take_events(const Mirror& mirror, ByteWriter& out) {
  for (Waiting& waiting : waiting_)
    if (waiting.slot && !waiting.reuse) waiting.reuse = mirror.last_reuse(*waiting.slot);
  put_section(SectionType::kEvents, out, [this](ByteWriter& body) {
    const std::size_t begin = body.size();
    for (std::size_t count = 0; count < kMaxFrameEvents && !waiting_.empty(); ++count) {
      const Waiting& next = waiting_.front();
      WorldEvent event{.kind = next.kind, .body = {}, .bytes = next.bytes};
      if (next.slot) event.body = {*next.slot, *next.reuse};
      if (body.size() - begin + bytes_of(event) > kMaxFrameEventBytes) break;
      write_event(event, body);
      waiting_.pop_front();
    }
  });
}

void NewsDesk::settle() {
  changed_.clear();
  wanted_keys_ = world_.keys().size();
  wanted_keys_bytes_ = world_.keys_bytes();
}

void NewsDesk::save(std::vector<std::byte>& world, std::vector<std::byte>& waiting) const {
  const std::lock_guard lock(mutex_);
  world.resize(SessionWorld::kMaxBytes);
  ByteWriter out(world);
  world_.write(out);
  world.resize(out.size());
  std::size_t bytes = kMaxNewsBytes;
  for (const Waiting& event : waiting_) bytes += kMaxWaitingBytes + event.bytes.size();
  waiting.resize(bytes);
  ByteWriter rest(waiting);
  write_changed(rest);
  rest.put_length_before(0);
  for (const Waiting& event : waiting_) {
    const bool about = event.slot.has_value(), known = event.reuse.has_value();
    rest.put(static_cast<std::uint8_t>((about ? 1 : 0) + (known ? 2 : 0)));
    rest.put(event.kind);
    rest.put(event.slot.value_or(0));
    rest.put(event.reuse.value_or(0));
    rest.put(static_cast<std::uint16_t>(event.bytes.size()));
    rest.put_bytes(event.bytes);
  }
  TANDEM_ASSERT(!out.overflow() && !rest.overflow());
  waiting.resize(rest.size());
}

Result<void> NewsDesk::restore(std::span<const std::byte> world, std::span<const std::byte> waiting) {
  const std::lock_guard lock(mutex_);
  auto read = SessionWorld::read(world, {.keys = true, .events = true});
  if (!read) return tl::unexpected(read.error());
  // Of a session that had other features nothing is kept.
  if ((!read->keys().empty() && !features_.keys) || (read->event_count() > 0 && !features_.events)) return {};
  world_ = std::move(*read);
  settle();
  return restore_waiting(waiting);
}

Result<void> NewsDesk::restore_waiting(std::span<const std::byte> bytes) {
  ByteReader in(bytes);
  const auto size = static_cast<std::size_t>(in.get_leb128(kMaxLengthBytes));
  ByteReader keys(in.get_bytes(size));
  std::vector<KeyChange> changes;
  if (auto read = read_key_changes(keys, changes); !read) return read;
  for (const KeyChange& change : changes)
    want(change.key, change.value ? Value(std::vector(change.value->begin(), change.value->end())) : Value());
  while (in.remaining() > 0) {
    Waiting event;
    const auto flags = in.get<std::uint8_t>();
    event.kind = in.get<std::uint32_t>();
    const auto slot = in.get<std::uint32_t>();
    const auto reuse = in.get<std::uint8_t>();
    if ((flags & 1U) != 0) event.slot = slot;
    if ((flags & 2U) != 0) event.reuse = reuse;
    const auto content = in.get_bytes(in.get<std::uint16_t>());
    event.bytes.assign(content.begin(), content.end());
    const bool fits = slot < capacity_ && event.bytes.size() <= kMaxEventBytes &&
                      event.kind < kFirstReservedKind && waiting_.size() < kMaxWaiting;
    if (!in.ok() || !fits) break;
    waiting_.push_back(std::move(event));
  }
  if (!in.at_end() || wanted_keys_ > kMaxKeys || wanted_keys_bytes_ > kMaxKeysBytes)
    return fail(ErrorCode::kMalformed, "the keys or events that wait cannot be read");
  if (!features_.keys) settle();
  if (!features_.events) waiting_.clear();
  return {};
}

Result<void> NewsDesk::follow(std::span<const std::byte> told) {
  const std::lock_guard lock(mutex_);
  const auto rest = read_news(told, features_, capacity_, news_);
  if (!rest) return tl::unexpected(rest.error());
  if (auto fits = world_.check(news_); !fits) return fits;
  if (!rest->empty()) return fail(ErrorCode::kMalformed, "news of a frame with more behind them");
  world_.apply(news_);
  settle();
  const std::size_t events = std::min(waiting_.size(), news_.events.size());
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(events));
  return {};
}

}  // namespace tandem::host
