#pragma once
// A file descriptor with an owner.

#include <unistd.h>

#include <utility>

namespace tandem::system {

/// Closes its file descriptor when it is destroyed. Not thread-safe.
class Descriptor {
 public:
  Descriptor() = default;
  /// Takes over `number`, the result of a system call; below 0: none.
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    Descriptor old(std::exchange(number_, other.release()));
    return *this;
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }

  /// Below 0: none.
  [[nodiscard]] int get() const { return number_; }
  [[nodiscard]] bool is_open() const { return number_ >= 0; }
  /// Hands the descriptor to the caller, who then has to close it.
  [[nodiscard]] int release() { return std::exchange(number_, -1); }
  /// Closes it now. Returns false, with the reason in errno, if the system found only now that something that
  /// was written is lost.
  [[nodiscard]] bool close() { return ::close(release()) == 0; }

 private:
  int number_ = -1;
};

}  // namespace tandem::system
