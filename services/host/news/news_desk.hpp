#pragma once
// Where a server's application leaves keys and events, until a frame tells them.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/core/news/session_world.hpp"
#include "services/host/streams/mirror.hpp"
#include "tandem/result.hpp"

namespace tandem::host {

/// Holds the session's world, and what the next frames will change of it. Bounded. set_key(), remove_key()
/// and broadcast() may be called from any thread, also by the simulation in its step; all else is the host's.
class NewsDesk {
 public:
  static constexpr std::size_t kMaxWaiting = 1024;  ///< events

  NewsDesk(const WorldFeatures& features, std::uint32_t capacity);

  /// From the next frame on the key has this value. Errors: kUnsupported (the session has no keys),
  /// kInvalidArgument (no key), kCapacity (more than a session holds).
  [[nodiscard]] Result<void> set_key(std::string_view key, std::span<const std::byte> value);
  /// From the next frame on there is no such key; nothing happens if there is none now. Errors: kUnsupported,
  /// kInvalidArgument.
  [[nodiscard]] Result<void> remove_key(std::string_view key);
  /// Clients are told on the next frame that has room, in the order of these calls. `slot`: the body that it
  /// is about, as it is after the step of the next frame; or the one that the slot held last. Errors:
  /// kUnsupported (the session has no events), kInvalidArgument (more than 1,024 bytes, a reserved kind, no
  /// slot), kCapacity (too many wait).
  [[nodiscard]] Result<void> broadcast(std::uint32_t kind, std::span<const std::byte> bytes,
                                       std::optional<Slot> slot);

  /// Takes what the next frame tells, and applies it. `mirror`: shows that frame.
  void take(const Mirror& mirror);
  /// The sections that were taken last; valid until the next take().
  [[nodiscard]] std::span<const std::byte> told() const { return std::span(told_).first(told_bytes_); }
  [[nodiscard]] bool told_events() const { return told_events_; }

  /// Writes the world, and what waits to be told; both replace the content.
  void save(std::vector<std::byte>& world, std::vector<std::byte>& waiting) const;
  /// Begins with what save() wrote, but for what the session has no feature for. Before the first take().
  /// Errors: kMalformed.
  [[nodiscard]] Result<void> restore(std::span<const std::byte> world, std::span<const std::byte> waiting);
  /// Another server told this of the next frame, also of what waits here. Errors: kMalformed.
  [[nodiscard]] Result<void> follow(std::span<const std::byte> told);

  /// At the frame that was taken last.
  [[nodiscard]] const SessionWorld& world() const { return world_; }

 private:
  struct Waiting {
    std::uint32_t kind = 0;
    std::optional<Slot> slot;
    std::optional<std::uint8_t> reuse;  ///< once a step was made since
    std::vector<std::byte> bytes;
  };
  using Value = std::optional<std::vector<std::byte>>;  ///< empty: no such key

  /// Size of key and value, as wanted at last; empty if it shall not be there.
  [[nodiscard]] std::optional<std::size_t> wanted_bytes(std::string_view key) const;
  void want(std::string_view key, Value value);
  /// Nothing is wanted but what is there.
  void settle();
  [[nodiscard]] Result<void> restore_waiting(std::span<const std::byte> bytes);
  /// The records of all keys that changed.
  void write_changed(ByteWriter& out) const;
  void take_keys(ByteWriter& out);
  void take_events(const Mirror& mirror, ByteWriter& out);

  const WorldFeatures features_;
  const std::uint32_t capacity_;
  mutable std::mutex mutex_;  // guards all but told_
  SessionWorld world_;
  std::map<std::string, Value, std::less<>> changed_;  // since the last take()
  std::size_t wanted_keys_ = 0, wanted_keys_bytes_ = 0;
  std::deque<Waiting> waiting_;
  std::vector<std::byte> told_;
  std::size_t told_bytes_ = 0;
  bool told_events_ = false;
  News news_;  // kept to reuse its memory
};

}  // namespace tandem::host
