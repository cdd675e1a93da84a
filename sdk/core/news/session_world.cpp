#include "sdk/core/news/session_world.hpp"

#include <array>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/hash.hpp"

namespace tandem {

SessionWorld::SessionWorld() { hash_keys(); }

Result<void> SessionWorld::check(const News& news) const {
  std::size_t count = keys_.size(), bytes = keys_bytes_;
  for (const KeyChange& change : news.keys) {
    const auto known = keys_.find(change.key);
    if (known == keys_.end() && !change.value)
      return fail(ErrorCode::kMalformed, "a key goes that is not there");
    if (known != keys_.end()) {
      --count;
      bytes -= known->first.size() + known->second.size();
    }
    if (!change.value) continue;
    ++count;
    bytes += change.key.size() + change.value->size();
  }
  if (count > kMaxKeys || bytes > kMaxKeysBytes)
    return fail(ErrorCode::kMalformed, "more keys than a session may have");
  return {};
}

void SessionWorld::change(const KeyChange& change) {
  auto known = keys_.find(change.key);
  if (known != keys_.end()) keys_bytes_ -= known->first.size() + known->second.size();
  if (!change.value) {
    TANDEM_ASSERT(known != keys_.end());
    keys_.erase(known);
    return;
  }
  if (known == keys_.end()) known = keys_.emplace(std::string(change.key), std::vector<std::byte>()).first;
  known->second.assign(change.value->begin(), change.value->end());
  keys_bytes_ += known->first.size() + known->second.size();
}

void SessionWorld::apply(const News& news) {
  TANDEM_ASSERT(check(news).has_value());
  if (news.empty()) return;
  for (const KeyChange& each : news.keys) change(each);
  if (!news.events.empty()) {
    event_count_ += news.events.size();
    hashed_.resize(8 + news.events_body.size());
    ByteWriter out(hashed_);
    out.put(events_hash_);
    out.put_bytes(news.events_body);
    events_hash_ = hash_bytes(out.written());
  }
  if (news.keys.empty()) return hash_all();
  hash_keys();
}

void SessionWorld::hash_keys() {
  constexpr std::size_t kLengthsBytes = 1 + 4;
  hashed_.resize(keys_bytes_ + kLengthsBytes * keys_.size());
  ByteWriter out(hashed_);
  for (const auto& [key, value] : keys_) {
    out.put(static_cast<std::uint8_t>(key.size()));
    out.put_bytes(std::as_bytes(std::span(key)));
    out.put(static_cast<std::uint32_t>(value.size()));
    out.put_bytes(value);
  }
  TANDEM_ASSERT(!out.overflow());
  keys_hash_ = hash_bytes(out.written());
  hash_all();
}

void SessionWorld::hash_all() {
  const std::array<std::uint64_t, 3> all{events_hash_, event_count_, keys_hash_};
  hash_ = hash_bytes(std::as_bytes(std::span(all)));
}

void SessionWorld::write(ByteWriter& out) const {
  out.put(event_count_);
  out.put(events_hash_);
  for (const auto& [key, value] : keys_) write_key_change({key, value}, out);
}

Result<SessionWorld> SessionWorld::read(std::span<const std::byte> section, const WorldFeatures& features) {
  ByteReader in(section);
  SessionWorld world;
  world.event_count_ = in.get<std::uint64_t>();
  world.events_hash_ = in.get<std::uint64_t>();
  if (!in.ok()) return fail(ErrorCode::kMalformed, "truncated world");
  News news;
  if (auto read = read_key_changes(in, news.keys); !read) return tl::unexpected<Error>(read.error());
  const bool counts = world.event_count_ != 0 || world.events_hash_ != 0;
  if ((counts && !features.events) || (!news.keys.empty() && !features.keys))
    return fail(ErrorCode::kMalformed, "a world with what the session does not have");
  if (auto fits = world.check(news); !fits) return tl::unexpected<Error>(fits.error());
  for (const KeyChange& each : news.keys) world.change(each);
  world.hash_keys();
  return world;
}

}  // namespace tandem
