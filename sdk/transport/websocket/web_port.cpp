#include "sdk/transport/websocket/web_port.hpp"

#include <algorithm>
#include <string>
#include <variant>

namespace tandem::transport {

void WebPort::connected(bool anew) {
  disconnected();
  connected_ = true;
  anew_ = anew;
  ++connections_;
  for (std::size_t i = 0; i < sizeof connections_; ++i) {
    gateway_.bytes[i] = static_cast<std::uint8_t>(connections_ >> (8U * i));
  }
}

void WebPort::disconnected() {
  connected_ = false;
  server_alive_ = told_ = false;
  session_.reset();
  server_status_.reset();
  status_is_new_ = false;
  deltas_.clear();
  inputs_.clear();
  replies_.clear();
  snapshots_.clear();
  out_.clear();
}

Result<void> WebPort::receive(std::span<const std::byte> bytes) {
  auto message = bytes.size() <= kMaxMessageBytes ? read_gateway_envelope(bytes, limits_)
                                                  : fail(ErrorCode::kMalformed, "a message above 128 MiB");
  Result<void> accepted;
  if (!message) {
    accepted = tl::unexpected<Error>(std::move(message.error()));
  } else {
    accepted = std::visit([&](auto& content) { return accept(std::move(content), bytes.size()); }, *message);
  }
  if (!accepted) ++dropped_;
  return accepted;
}

std::optional<Bytes> WebPort::next_message() {
  if (out_.empty()) return std::nullopt;
  Bytes message = std::move(out_.front());
  out_.pop_front();
  return message;
}

Result<void> WebPort::accept(SessionMessage&& message, std::size_t /*size*/) {
  session_ = std::move(message);
  server_alive_ = true;
  return {};
}
Result<void> WebPort::accept(DeltaMessage&& message, std::size_t size) {
  return put(deltas_, std::move(message), size);
}
Result<void> WebPort::accept(ScheduledInputMessage&& message, std::size_t size) {
  return put(inputs_, std::move(message), size);
}
Result<void> WebPort::accept(SnapshotMessage&& message, std::size_t size) {
  return put(snapshots_, std::move(message), size);
}
Result<void> WebPort::accept(ReplyMessage&& message, std::size_t size) {
  return put(replies_, std::move(message), size);
}
Result<void> WebPort::accept(ServerStatusMessage&& message, std::size_t /*size*/) {
  server_status_ = std::move(message);
  status_is_new_ = true;
  return {};
}
Result<void> WebPort::accept(const AbsentMessage& /*message*/, std::size_t /*size*/) {
  server_alive_ = false;
  session_.reset();
  return {};
}
Result<void> WebPort::accept(const UnknownMessage& /*message*/, std::size_t /*size*/) { return {}; }

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
  deltas_.open = inputs_.open = replies_.open = true;
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
  deltas_.close();
  inputs_.close();
  replies_.close();
  snapshots_.close();
}

Result<void> WebPort::open_snapshots(std::uint32_t /*stream*/) {
  snapshots_.open = true;
  return {};
}

void WebPort::close_snapshots(std::uint32_t /*stream*/) { snapshots_.close(); }

namespace {

template <class Q, class M>
void move_all(Q& queue, std::vector<Received<M>>& out) {
  for (Received<M>& received : queue.messages) out.push_back(std::move(received));
  queue.messages.clear();
  queue.bytes = 0;
}

}  // namespace

void WebPort::take(std::vector<Received<DeltaMessage>>& out) { move_all(deltas_, out); }
void WebPort::take(std::vector<Received<ScheduledInputMessage>>& out) { move_all(inputs_, out); }
void WebPort::take(std::vector<Received<SnapshotMessage>>& out) { move_all(snapshots_, out); }
void WebPort::take(std::vector<Received<ReplyMessage>>& out) { move_all(replies_, out); }

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
