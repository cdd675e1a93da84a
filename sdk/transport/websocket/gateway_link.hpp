#pragma once
// A connection to a gateway that is made again whenever it ends. A thread of its own does the work.

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "sdk/transport/websocket/web_address.hpp"
#include "sdk/wire/cdr.hpp"
#include "tandem/result.hpp"

namespace tandem::transport {

/// What the owner of a link hears and hands over. Called by the link's thread, one call at a time.
struct LinkHandler {
  std::function<void()> opened;
  std::function<void(std::span<const std::byte>)> received;
  /// Another attempt follows by itself. `why`: one line for people.
  std::function<void(std::string why)> closed;
  std::function<std::optional<Bytes>()> next_message;  ///< to be sent
  /// True if the last connection brought a session, so that the next attempt need not wait long.
  std::function<bool()> was_useful;
};

class GatewayLink {
 public:
  /// `authorities`: file of certificates (PEM) that a gateway's certificate is checked by; empty: the
  /// system's. Errors: kIo (no such file, or no certificate in it), kTransport.
  [[nodiscard]] static Result<std::unique_ptr<GatewayLink>> start(WebAddress address,
                                                                  const std::string& authorities,
                                                                  std::size_t most_message_bytes,
                                                                  LinkHandler handler);
  /// Ends the connection and waits for the thread, at worst until the system's resolver of names answers.
  ~GatewayLink();
  GatewayLink(const GatewayLink&) = delete;
  GatewayLink& operator=(const GatewayLink&) = delete;

  /// There is something to be sent. Any thread.
  void notify();

 private:
  struct Impl;
  explicit GatewayLink(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::transport
