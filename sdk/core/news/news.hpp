#pragma once
// What a frame tells beside bodies: keys that changed, and events. idl/PROTOCOL.md, "News".

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "sdk/core/lattice/bytes.hpp"
#include "sdk/core/lattice/state.hpp"
#include "sdk/core/layout/layout.hpp"
#include "sdk/core/layout/sections.hpp"
#include "tandem/result.hpp"

namespace tandem {

inline constexpr std::size_t kMaxKeys = 256;         ///< of a session, after each frame
inline constexpr std::size_t kMaxKeyBytes = 64;      ///< of one key, at least 1
inline constexpr std::size_t kMaxKeysBytes = 65536;  ///< of all keys and their values, after each frame
inline constexpr std::size_t kMaxEventBytes = 1024;  ///< of one event
inline constexpr std::size_t kMaxFrameEvents = 64;
inline constexpr std::size_t kMaxFrameEventBytes = 16384;  ///< of the section
/// Kinds of events from this one on are the protocol's own.
inline constexpr std::uint32_t kFirstReservedKind = 1U << 31U;
/// Size of a key's record beside key and value: both lengths.
inline constexpr std::size_t kMaxKeyRecordBytes = 1 + 3;
/// Maximum size of both sections. In a frame all keys may go, and as many come.
inline constexpr std::size_t kMaxNewsBytes = 2 * kMaxSectionHeaderBytes +
                                             kMaxKeys * (kMaxKeyBytes + 2 * kMaxKeyRecordBytes) +
                                             kMaxKeysBytes + kMaxFrameEventBytes;

/// A key that has another value from this frame on, or is gone. What it points to is the sender's.
struct KeyChange {
  std::string_view key;
  std::optional<std::span<const std::byte>> value;  ///< empty: the key is gone
};

/// Something that happened on a frame. `bytes` point to what is the sender's.
struct WorldEvent {
  struct Body {
    Slot slot = 0;
    std::uint8_t reuse = 0;
    friend bool operator==(const Body&, const Body&) = default;
  };
  std::uint32_t kind = 0;
  std::optional<Body> body;  ///< that it is about; it may be gone already
  std::span<const std::byte> bytes;
};

/// The news of one frame.
struct News {
  std::vector<KeyChange> keys;     ///< ascending by key, each once
  std::vector<WorldEvent> events;  ///< in the order in which they happened
  std::span<const std::byte> events_body;

  [[nodiscard]] bool empty() const { return keys.empty() && events.empty(); }
};

/// True for 1 to 64 characters of ASCII from the space on to '~'.
[[nodiscard]] bool is_key(std::string_view key);

void write_key_change(const KeyChange& change, ByteWriter& out);
void write_event(const WorldEvent& event, ByteWriter& out);
/// What write_event() writes.
[[nodiscard]] std::size_t bytes_of(const WorldEvent& event);

/// Reads the records of keys up to the end of `in`. Untrusted; checks each one and their order. Errors:
/// kMalformed.
[[nodiscard]] Result<void> read_key_changes(ByteReader& in, std::vector<KeyChange>& out);

/// Reads the sections of news that a payload begins with, and returns what stands behind them. `out` points
/// into the payload. Untrusted; SessionWorld::check() has to follow. Errors: kMalformed.
[[nodiscard]] Result<std::span<const std::byte>> read_news(std::span<const std::byte> payload,
                                                           const WorldFeatures& features,
                                                           std::uint32_t capacity, News& out);

}  // namespace tandem
