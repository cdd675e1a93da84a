#pragma once
// The socket between a server and its engine, and the one at which engines knock.

#include <sys/types.h>

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "services/engines/door/wire.hpp"
#include "services/program/system/descriptor.hpp"

namespace tandem::engine::door {

inline constexpr std::size_t kMaxPathBytes = 107;  ///< of a socket's path

/// A stream socket that never makes its owner wait. Not thread-safe.
class Channel {
 public:
  Channel() = default;
  explicit Channel(system::Descriptor socket);

  [[nodiscard]] bool open() const { return socket_.is_open(); }
  [[nodiscard]] int descriptor() const { return socket_.get(); }
  /// The process that connected; 0: not known, or on another machine.
  [[nodiscard]] pid_t peer() const { return peer_; }
  /// Who connected, for people.
  [[nodiscard]] std::string from() const;
  Reader& reader() { return reader_; }
  /// Messages to send; flush() sends them.
  std::vector<std::byte>& out() { return out_; }
  /// The descriptor goes along with the next byte.
  void pass(int descriptor) { passed_ = descriptor; }
  /// Sends what the socket takes. Errors: kIo (the engine hung up).
  [[nodiscard]] Result<void> flush();
  [[nodiscard]] bool unsent() const { return sent_ < out_.size(); }
  /// Receives until there is a whole message, or nothing more. Errors: kIo (the engine hung up), kMalformed.
  [[nodiscard]] Result<std::optional<Reader::Message>> receive();
  void close() { socket_ = {}; }

 private:
  system::Descriptor socket_;
  pid_t peer_ = 0;
  Reader reader_;
  std::vector<std::byte> out_;
  std::size_t sent_ = 0;
  int passed_ = -1;
};

/// Listens at a path that only this user can open, which it removes at its end; or at a port. Not
/// thread-safe.
class Listener {
 public:
  Listener() = default;
  /// Errors: kIo (the path cannot be made), kConflict (somebody listens there).
  static Result<Listener> open(const std::string& path);
  /// `host`: an address of IPv4 or IPv6 in numbers; port 0: any free one. Errors: kIo, kInvalidArgument.
  static Result<Listener> open_port(const std::string& host, std::uint16_t port);
  Listener(Listener&& other) noexcept;
  Listener& operator=(Listener&& other) noexcept;
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  ~Listener();

  [[nodiscard]] int descriptor() const { return socket_.get(); }
  /// Where engines find it: a path, or tcp:HOST:PORT.
  [[nodiscard]] const std::string& place() const { return place_; }
  [[nodiscard]] bool is_port() const { return is_port_; }
  /// The next engine that knocked; at a path, if it is of this user. `told` gets a line about one that is
  /// not.
  [[nodiscard]] std::optional<Channel> accept(std::string& told);

 private:
  system::Descriptor socket_;
  std::string place_;
  bool is_port_ = false;
};

}  // namespace tandem::engine::door
