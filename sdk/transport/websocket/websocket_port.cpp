#include "sdk/transport/websocket/websocket_port.hpp"

#include <algorithm>
#include <mutex>
#include <utility>
#include <vector>

#include "sdk/transport/websocket/gateway_link.hpp"
#include "sdk/transport/websocket/web_port.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/workers/doorbell.hpp"

namespace tandem::transport {
namespace {

/// How long a first connection takes before a client says so.
constexpr std::int64_t kPatienceNs = 2'000'000'000;

/// A WebPort whose messages a GatewayLink carries. The lock is held for as long as a message is read or
/// queued.
class WebSocketPort final : public ClientPort {
 public:
  Result<void> start(WebAddress address, const std::string& authorities) {
    no_answer_ = address.text() + " does not answer";
    auto link = GatewayLink::start(std::move(address), authorities, WebPort::kMaxMessageBytes,
                                   {.opened = [this] { opened(); },
                                    .received = [this](std::span<const std::byte> bytes) { received(bytes); },
                                    .closed = [this](std::string why) { closed(std::move(why)); },
                                    .next_message = [this] { return next_message(); },
                                    .was_useful = [this] { return useful_; }});
    if (!link) return tl::unexpected<Error>(link.error());
    link_ = std::move(*link);
    return {};
  }

  [[nodiscard]] ParticipantId self() const override { return {}; }
  void take_sessions(std::vector<Received<SessionMessage>>& out) override {
    locked([&] { port_.take_sessions(out); });
  }
  void pass_over_session(PassOver /*until*/) override {}  // a gateway has one
  [[nodiscard]] bool server_alive() override {
    return locked([&] { return port_.server_alive(); });
  }
  [[nodiscard]] bool hears_all_servers() const override { return true; }
  [[nodiscard]] bool collects() const override { return true; }
  [[nodiscard]] std::string trouble() override {
    return locked([&] {
      const bool waits = trouble_.empty() && !port_.is_connected() && steady_ns() - began_ns_ > kPatienceNs;
      return waits ? no_answer_ : trouble_;
    });
  }
  Result<void> open_stream(const SessionMessage& session, const StreamMessage& stream,
                           ClientId client) override {
    return locked([&] { return port_.open_stream(session, stream, client); });
  }
  void close_stream(std::uint32_t stream) override {
    locked([&] { port_.close_stream(stream); });
  }
  void close_streams() override {
    locked([&] { port_.close_streams(); });
  }
  Result<void> open_snapshots(std::uint32_t stream) override {
    return locked([&] { return port_.open_snapshots(stream); });
  }
  void close_snapshots(std::uint32_t stream) override {
    locked([&] { port_.close_snapshots(stream); });
  }

  void take(std::vector<Received<DeltaMessage>>& out) override { take_from_port(out); }
  void take(std::vector<Received<ScheduledInputMessage>>& out) override { take_from_port(out); }
  void take(std::vector<Received<SnapshotMessage>>& out) override { take_from_port(out); }
  void take(std::vector<Received<ReplyMessage>>& out) override { take_from_port(out); }
  void take(std::vector<Received<ServerStatusMessage>>& out) override { take_from_port(out); }

  Result<void> write(const AckMessage& message) override { return send(message); }
  Result<void> write(const InputMessage& message) override { return send(message); }
  Result<void> write(const ClientStatusMessage& message) override { return send(message); }

  [[nodiscard]] std::uint64_t dropped() const override {
    const std::lock_guard lock(mutex_);
    return port_.dropped();
  }
  [[nodiscard]] std::uint64_t wire_bytes(std::int64_t now_ns) const override {
    const std::lock_guard lock(mutex_);
    return port_.wire_bytes(now_ns);
  }
  void wait(std::chrono::nanoseconds timeout) override { bell_.wait(timeout); }
  void wake() override { bell_.ring(); }

 private:
  template <class Do>
  auto locked(Do&& act) -> decltype(act()) {
    const std::lock_guard lock(mutex_);
    return act();
  }
  template <class M>
  void take_from_port(std::vector<Received<M>>& out) {
    locked([&] { port_.take(out); });
  }
  template <class M>
  Result<void> send(const M& message) {
    auto written = locked([&] { return port_.write(message); });
    if (written) link_->notify();
    return written;
  }

  // The link's thread
  void opened() {
    locked([&] {
      port_.connected();
      trouble_.clear();
    });
    useful_ = false;
  }
  void received(std::span<const std::byte> bytes) {
    locked([&] {
      static_cast<void>(port_.receive(bytes));  // the port counts what it refuses
      useful_ = useful_ || port_.server_alive();
    });
    bell_.ring();
  }
  void closed(std::string why) {
    locked([&] {
      port_.disconnected();
      trouble_ = std::move(why);
    });
    useful_ = false;
    bell_.ring();
  }
  std::optional<Bytes> next_message() {
    return locked([&] { return port_.next_message(); });
  }

  mutable std::mutex mutex_;
  WebPort port_;
  std::string trouble_, no_answer_;
  const std::int64_t began_ns_ = steady_ns();
  bool useful_ = false;  // the link's thread alone
  Doorbell bell_;
  std::unique_ptr<GatewayLink> link_;  // last: its thread ends first
};

bool is_token(std::string_view text) {
  constexpr std::size_t kMaxTokenBytes = 4096;
  return text.size() <= kMaxTokenBytes &&
         std::ranges::all_of(text, [](char c) { return c > ' ' && c < '\x7f'; });
}

}  // namespace

Result<std::unique_ptr<ClientPort>> make_websocket_client_port(const WebSocketOptions& options) {
  auto address = read_web_address(options.url);
  if (!address) return tl::unexpected<Error>(address.error());
  if (!options.token.empty()) address->token = options.token;
  if (!is_token(address->token))
    return fail(ErrorCode::kInvalidArgument, "a token is at most 4,096 printable characters without spaces");
  if (!options.tls_ca.empty() && !address->encrypted)
    return fail(ErrorCode::kInvalidArgument,
                "tls_ca is for wss://: over ws:// nothing is encrypted or checked");
  auto port = std::make_unique<WebSocketPort>();
  if (auto started = port->start(std::move(*address), options.tls_ca); !started)
    return tl::unexpected<Error>(started.error());
  return port;
}

}  // namespace tandem::transport
