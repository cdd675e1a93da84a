#pragma once
// A slot of the engine as engine::Bodies.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "services/engines/door/wire.hpp"

namespace tandem::engine::door {

/// Reads slots that the engine may write to at any time: what decides anything by its value is copied first,
/// and the layout is the server's own. Not thread-safe.
class Columns {
 public:
  explicit Columns(const Layout& layout);

  /// Takes the bodies of a slot of Layout::slot_bytes, which stays mapped. `events`: those since the last
  /// call; otherwise there are none, because the bodies are those of a start.
  void read(std::span<const std::byte> slot, bool with_events);
  [[nodiscard]] const Bodies& bodies() const { return bodies_; }
  [[nodiscard]] std::span<const Event> events() const { return events_; }

 private:
  /// An axis of a column: where it is, or its copy as floats.
  [[nodiscard]] std::span<const float> floats(std::span<const std::byte> slot, const Column& column,
                                              std::uint32_t axis, std::vector<float>& copy) const;

  Layout layout_;
  std::array<std::vector<float>, 13> copies_;  // of columns of doubles
  std::vector<std::uint8_t> alive_, before_;
  std::vector<std::uint16_t> type_;
  std::vector<Event> events_;
  Bodies bodies_;
};

}  // namespace tandem::engine::door
