#pragma once
// The socket that takes connections, also while the process has no file descriptor left.

#include <sys/socket.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "services/program/system/descriptor.hpp"
#include "tandem/result.hpp"

namespace tandem::gateway {

/// Not thread-safe.
class Listener {
 public:
  /// Port 0: any free one. Errors: kIo.
  [[nodiscard]] static Result<Listener> open(const std::string& address, std::uint16_t port);

  [[nodiscard]] int fd() const { return socket_.get(); }
  [[nodiscard]] std::uint16_t port() const;

  enum class Outcome : std::uint8_t { kNothing, kConnection, kNoDescriptor };
  struct Accepted {
    Outcome outcome = Outcome::kNothing;
    system::Descriptor connection;  ///< does not block
    sockaddr_storage peer{};
  };
  /// Without a free descriptor (kNoDescriptor) the connection was closed by means of one in reserve, or waits
  /// if there is no such one either. The caller then does something else for a while.
  [[nodiscard]] Accepted accept();

 private:
  explicit Listener(system::Descriptor socket);
  system::Descriptor socket_;
  system::Descriptor reserve_;
};

/// Answers a new connection by HTTP with 429 (too many requests), as far as that needs no waiting.
void say_too_many(const system::Descriptor& connection);

/// Limits how much of a connection waits in the kernel, so that what is sent next is decided late.
void keep_little_unsent(int connection);

/// The bytes that came by a TCP connection since its start; 0 if that is not known.
[[nodiscard]] std::uint64_t received_bytes(int connection);

/// Raises the process's limit of descriptors, as far as it may, to what so many connections need. Returns how
/// many connections fit.
[[nodiscard]] std::size_t connections_that_fit(std::size_t wanted);

}  // namespace tandem::gateway
