#pragma once
// The part of the agreed state that is not of bodies: the keys of a session, and how many events there were.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "sdk/core/news/news.hpp"

namespace tandem {

/// Server and clients hold the same one after each frame, as its hash proves. Not thread-safe.
class SessionWorld {
 public:
  using Keys = std::map<std::string, std::vector<std::byte>, std::less<>>;

  SessionWorld();

  /// Whether the news of a frame may follow: no key goes that is not there, and all that are then there fit.
  /// Errors: kMalformed.
  [[nodiscard]] Result<void> check(const News& news) const;
  /// Applies news that passed check().
  void apply(const News& news);

  [[nodiscard]] const Keys& keys() const { return keys_; }
  [[nodiscard]] std::size_t keys_bytes() const { return keys_bytes_; }
  /// Events up to now: each has the number that this is with it.
  [[nodiscard]] std::uint64_t event_count() const { return event_count_; }
  /// The world hash: idl/PROTOCOL.md, "State hash".
  [[nodiscard]] std::uint64_t hash() const { return hash_; }

  /// Maximum size of what write() writes.
  static constexpr std::size_t kMaxBytes = 16 + kMaxKeys * kMaxKeyRecordBytes + kMaxKeysBytes;
  /// The body of section 0x8e.
  void write(ByteWriter& out) const;
  /// Reads untrusted bytes. Errors: kMalformed.
  [[nodiscard]] static Result<SessionWorld> read(std::span<const std::byte> section,
                                                 const WorldFeatures& features);

 private:
  void change(const KeyChange& change);
  void hash_keys();
  void hash_all();

  Keys keys_;
  std::size_t keys_bytes_ = 0;
  std::uint64_t event_count_ = 0;
  std::uint64_t events_hash_ = 0;  ///< of all events up to now
  std::uint64_t keys_hash_ = 0;
  std::uint64_t hash_ = 0;
  std::vector<std::byte> hashed_;  ///< kept to reuse its memory
};

}  // namespace tandem
