#pragma once
// Messages on their way to viewers.

#include <cstddef>
#include <memory>
#include <span>

#include "sdk/wire/envelope.hpp"

namespace tandem::gateway {

/// One envelope, made once and shared by all its viewers. In front of it is room for the sender's framing, so
/// that it need not be copied.
class Outgoing {
 public:
  static constexpr std::size_t kHeadroom = 32;

  template <class M>
  explicit Outgoing(const M& message) : buffer_(kHeadroom) {
    transport::write_envelope(message, buffer_);
  }
  [[nodiscard]] std::size_t size() const { return buffer_.size() - kHeadroom; }
  [[nodiscard]] std::span<const std::byte> envelope() const { return std::span(buffer_).subspan(kHeadroom); }
  /// For the one thread that sends, which may write into the kHeadroom bytes before it. A server's frames are
  /// framed alike for every viewer.
  [[nodiscard]] std::byte* to_send() { return buffer_.data() + kHeadroom; }

 private:
  transport::Bytes buffer_;
};
using OutgoingPtr = std::shared_ptr<Outgoing>;

template <class M>
[[nodiscard]] OutgoingPtr make_outgoing(const M& message) {
  return std::make_shared<Outgoing>(message);
}

}  // namespace tandem::gateway
