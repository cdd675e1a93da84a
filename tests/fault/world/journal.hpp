#pragma once
// What happened in a world, in order.

#include <cstdint>
#include <string>
#include <vector>

namespace tandem::world {

struct Event {
  std::int64_t at_ns = 0;
  std::string who, what;
};

class Journal {
 public:
  void add(std::int64_t at_ns, std::string who, std::string what);
  [[nodiscard]] const std::vector<Event>& events() const { return events_; }
  /// A line for each event, the last `most` of them.
  [[nodiscard]] std::string text(std::size_t most = SIZE_MAX) const;
  /// Equal for equal runs, with everything that was folded in.
  [[nodiscard]] std::uint64_t digest() const { return digest_; }
  void fold(std::uint64_t value);

 private:
  std::vector<Event> events_;
  std::uint64_t digest_ = 14695981039346656037ULL;
};

}  // namespace tandem::world
