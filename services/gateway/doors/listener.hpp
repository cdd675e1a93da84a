#pragma once
// The socket that takes connections, also while the process has no file descriptor left.

#include <sys/socket.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "tandem/result.hpp"

namespace tandem::gateway {

/// Not thread-safe.
class Listener {
 public:
  /// Port 0: any free one. Errors: kIo.
  [[nodiscard]] static Result<Listener> open(const std::string& address, std::uint16_t port);
  Listener(Listener&& other) noexcept;
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  Listener& operator=(Listener&&) = delete;
  ~Listener();

  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] std::uint16_t port() const;

  enum class Outcome : std::uint8_t { kNothing, kConnection, kNoDescriptor };
  struct Accepted {
    Outcome outcome = Outcome::kNothing;
    int fd = -1;  ///< the caller's; does not block
    sockaddr_storage peer{};
  };
  /// Without a free descriptor (kNoDescriptor) the connection was closed by means of one in reserve, or waits
  /// if there is no such one either. The caller then does something else for a while.
  [[nodiscard]] Accepted accept();

 private:
  explicit Listener(int fd);
  int fd_ = -1;
  int reserve_ = -1;
};

/// Raises the process's limit of descriptors, as far as it may, to what so many connections need. Returns how
/// many connections fit.
[[nodiscard]] std::size_t connections_that_fit(std::size_t wanted);

}  // namespace tandem::gateway
