#pragma once
// What was published lately, to be sent again to whom it was lost.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "sdk/transport/nats/nats_wire.hpp"
#include "sdk/wire/messages.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::transport::nats {

/// Messages under ascending numbers without a gap; a number may have several, as a delta in parts has. Keeps
/// the last kKeptNs, within a limit of bytes. Not thread-safe.
class SentLog {
 public:
  static constexpr std::int64_t kKeptNs = 30 * kSecond;
  using Message = std::shared_ptr<const Bytes>;

  explicit SentLog(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// A number that does not follow the last one empties the log first.
  void add(std::uint64_t number, Message message, std::int64_t now_ns);
  [[nodiscard]] Beat::Range range() const;
  /// Appends the messages of `count` numbers from `first` on that are kept, in order, until they would have
  /// more than `most_bytes`, though always those of one number. Returns their bytes.
  std::size_t list(std::uint64_t first, std::uint32_t count, std::size_t most_bytes,
                   std::vector<Message>& out) const;

 private:
  struct Entry {
    std::vector<Message> messages;
    std::size_t bytes = 0;
    std::int64_t at_ns = 0;
  };
  std::size_t most_bytes_;
  std::size_t bytes_ = 0;
  std::uint64_t first_ = 1;  // number of the first entry
  std::deque<Entry> entries_;
};

}  // namespace tandem::transport::nats
