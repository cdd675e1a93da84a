#pragma once
// The memory that a server shares with its engine.

#include <cstddef>
#include <span>
#include <string>

#include "services/program/system/descriptor.hpp"
#include "tandem/result.hpp"

namespace tandem::engine::door {

/// Memory without a name that cannot shrink or grow, so that reading it never fails. Its pages are there when
/// it is made. Not thread-safe.
class Segment {
 public:
  Segment() = default;
  /// Errors: kIo (there is not that much memory).
  static Result<Segment> make(std::size_t bytes);
  Segment(Segment&& other) noexcept;
  Segment& operator=(Segment&& other) noexcept;
  Segment(const Segment&) = delete;
  Segment& operator=(const Segment&) = delete;
  ~Segment();

  [[nodiscard]] std::span<std::byte> bytes() const { return bytes_; }
  [[nodiscard]] int descriptor() const { return descriptor_.get(); }
  /// Where a process of the same user can open it.
  [[nodiscard]] std::string path() const;

 private:
  system::Descriptor descriptor_;
  std::span<std::byte> bytes_;
};

}  // namespace tandem::engine::door
