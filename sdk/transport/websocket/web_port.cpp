#include "sdk/transport/websocket/web_port.hpp"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <string>
#include <type_traits>
#include <variant>

#include "sdk/transport/network/wire_bytes.hpp"

namespace tandem::transport {

void WebPort::connected(bool anew) {
  disconnected();
  connected_ = true;
  anew_ = anew;
  ++connections_;
  std::memcpy(gateway_.bytes.data(), &connections_, sizeof connections_);
}

void WebPort::disconnected() {
  connected_ = false;
  server_alive_ = told_ = false;
  session_.reset();
  server_status_.reset();
  status_is_new_ = false;
  std::apply([](auto&... queue) { (queue.clear(), ...); }, queues_);
  out_.clear();
}

Result<void> WebPort::receive(std::span<const std::byte> bytes) {
  wire_bytes_ += websocket_wire_bytes(bytes.size());
  auto message = bytes.size() <= kMaxMessageBytes ? read_gateway_envelope(bytes, limits_)
                                                  : fail(ErrorCode::kMalformed, "a message above 128 MiB");
  auto accepted = std::move(message).and_then([&](GatewayMessage&& any) {
    return std::visit([&](auto& content) { return accept(std::move(content), bytes.size()); }, any);
  });
  if (!accepted) ++dropped_;
  return accepted;
}

std::optional<Bytes> WebPort::next_message() {
  if (out_.empty()) return std::nullopt;
  Bytes message = std::move(out_.front());
  out_.pop_front();
  wire_bytes_ += websocket_wire_bytes(message.size());
  return message;
}

template <class M>
Result<void> WebPort::accept(M&& message, std::size_t size) {
  if constexpr (std::is_same_v<M, SessionMessage>) {
    session_ = std::move(message);
    server_alive_ = true;
  } else if constexpr (std::is_same_v<M, ServerStatusMessage>) {
    server_status_ = std::move(message);
    status_is_new_ = true;
  } else if constexpr (std::is_same_v<M, AbsentMessage>) {
    server_alive_ = false;
    session_.reset();
  } else if constexpr (!std::is_same_v<M, UnknownMessage>) {
    return put(queue<M>(), std::move(message), size);
  }
  return {};
}

template <class M>
Result<void> WebPort::put(Queue<M>& queue, M message, std::size_t size) {
  if (!queue.open) return {};
  size += sizeof(M);
  if (queue.bytes + size > kMaxQueuedBytes && !queue.messages.empty()) {
    return fail(ErrorCode::kCapacity, std::string(M::kTopic) + ": too much waits to be taken");
  }
  queue.bytes += size;
  queue.messages.push_back({std::move(message), gateway_});
  return {};
}

void WebPort::take_sessions(std::vector<Received<SessionMessage>>& out) {
  if (!session_) return;
  told_ = true;
  out.push_back({*std::exchange(session_, std::nullopt), gateway_});
}

// The gateway sends what it follows itself; there is nothing to subscribe to.
Result<void> WebPort::open_stream(const SessionMessage& session, const StreamMessage& stream,
                                  ClientId /*client*/) {
  if (epoch_ != session.epoch) close_streams();
  epoch_ = session.epoch;
  streams_[stream.id.id] = {.max_delta_bytes = stream.max_delta_bytes,
                            .max_snapshot_bytes = stream.max_snapshot_bytes};
  set_limits();
  queue<DeltaMessage>().open = queue<ScheduledInputMessage>().open = queue<ReplyMessage>().open = true;
  return {};
}

// Uses the limits of the largest stream; the client ignores streams that it no longer follows.
void WebPort::set_limits() {
  limits_ = {};
  if (streams_.empty()) return;
  limits_ = {.max_delta_bytes = 0, .max_snapshot_bytes = 0};
  for (const auto& [id, limits] : streams_) {
    limits_.max_delta_bytes = std::max(limits_.max_delta_bytes, limits.max_delta_bytes);
    limits_.max_snapshot_bytes = std::max(limits_.max_snapshot_bytes, limits.max_snapshot_bytes);
  }
}

void WebPort::close_stream(std::uint32_t stream) {
  streams_.erase(stream);
  set_limits();
  if (streams_.empty()) close_streams();
}

void WebPort::close_streams() {
  epoch_ = 0;
  streams_.clear();
  set_limits();
  std::apply([](auto&... queue) { (queue.close(), ...); }, queues_);
}

Result<void> WebPort::open_snapshots(std::uint32_t /*stream*/) {
  queue<SnapshotMessage>().open = true;
  return {};
}

void WebPort::close_snapshots(std::uint32_t /*stream*/) { queue<SnapshotMessage>().close(); }

template <class M>
void WebPort::take_all(std::vector<Received<M>>& out) {
  auto& messages = queue<M>().messages;
  std::move(messages.begin(), messages.end(), std::back_inserter(out));
  queue<M>().clear();
}

void WebPort::take(std::vector<Received<DeltaMessage>>& out) { take_all(out); }
void WebPort::take(std::vector<Received<ScheduledInputMessage>>& out) { take_all(out); }
void WebPort::take(std::vector<Received<SnapshotMessage>>& out) { take_all(out); }
void WebPort::take(std::vector<Received<ReplyMessage>>& out) { take_all(out); }

void WebPort::take(std::vector<Received<ServerStatusMessage>>& out) {
  if (status_is_new_) out.push_back({*server_status_, gateway_});
  status_is_new_ = false;
}

template <class M>
Result<void> WebPort::send(const M& message) {
  // On a new connection nothing goes out that the client sends because of an older one.
  if (!server_alive_ || !told_) return fail(ErrorCode::kTransport, "no server behind the connection");
  if (out_.size() >= kMaxQueuedOut) return fail(ErrorCode::kTransport, "the connection takes nothing");
  write_envelope(message, out_.emplace_back());
  return {};
}

Result<void> WebPort::write(const AckMessage& message) { return send(message); }
Result<void> WebPort::write(const InputMessage& message) { return send(message); }
Result<void> WebPort::write(const ClientStatusMessage& message) { return send(message); }

}  // namespace tandem::transport
