#pragma once
// Checkpoints of engines consist of values and columns in the machine's own layout, and a checksum.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace tandem::engine {

static_assert(std::endian::native == std::endian::little, "checkpoints hold the machine's own layout");

/// Appends to bytes of the caller.
class CheckpointWriter {
 public:
  explicit CheckpointWriter(std::vector<std::byte>& out) : out_(out) {}
  template <class T>
  void column(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes(values.data(), values.size() * sizeof(T));
  }
  template <class T>
  void value(const T& v) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes(&v, sizeof v);
  }

 private:
  void bytes(const void* from, std::size_t size) {
    const auto* first = static_cast<const std::byte*>(from);
    out_.insert(out_.end(), first, first + size);
  }
  std::vector<std::byte>& out_;
};

/// Reads what a writer wrote. Beyond the end it changes nothing, and ok() is false.
class CheckpointReader {
 public:
  explicit CheckpointReader(std::span<const std::byte> in) : in_(in) {}
  template <class T>
  void column(std::vector<T>& values) {
    bytes(values.data(), values.size() * sizeof(T));
  }
  template <class T>
  void value(T& v) {
    bytes(&v, sizeof v);
  }
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] bool at_end() const { return ok_ && in_.empty(); }

 private:
  void bytes(void* to, std::size_t size) {
    ok_ = ok_ && in_.size() >= size;
    if (!ok_ || size == 0) return;
    std::memcpy(to, in_.data(), size);
    in_ = in_.subspan(size);
  }
  std::span<const std::byte> in_;
  bool ok_ = true;
};

[[nodiscard]] inline std::uint64_t checksum(std::span<const std::byte> bytes) {
  return XXH3_64bits(bytes.data(), bytes.size());
}

/// The head of every checkpoint.
struct CheckpointHead {
  std::uint64_t magic;
  std::uint64_t world;    ///< fingerprint()
  std::uint64_t waiting;  ///< inputs that have not acted
};

/// Appends the checksum of what `out` holds from `begin` on.
inline void seal(std::vector<std::byte>& out, std::size_t begin) {
  CheckpointWriter(out).value(checksum(std::span<const std::byte>(out).subspan(begin)));
}
/// The bytes before the checksum; empty if the checksum is wrong.
[[nodiscard]] inline std::optional<std::span<const std::byte>> unsealed(std::span<const std::byte> bytes) {
  std::uint64_t sum = 0;
  if (bytes.size() < sizeof sum) return std::nullopt;
  const std::span<const std::byte> body = bytes.first(bytes.size() - sizeof sum);
  CheckpointReader(bytes.last(sizeof sum)).value(sum);
  return sum == checksum(body) ? std::optional(body) : std::nullopt;
}

}  // namespace tandem::engine
