#include <nats/nats.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <utility>

#include "sdk/transport/nats/nats_bus.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/wire/units.hpp"
#include "sdk/workers/doorbell.hpp"

namespace tandem::transport {
namespace {

// A dead connection is noticed after kPingMs * (kPings + 1), and made anew.
constexpr std::int64_t kPingMs = 1000, kConnectMs = 2000, kReconnectMs = 250, kWriteMs = 2000;
constexpr int kPings = 2;
constexpr std::int64_t kPatienceNs = kSecond;  // a connection that is not there yet is no trouble so long
constexpr int kReconnectBytes = 1024;          // what cannot be sent now is asked for again, not sent late
constexpr std::size_t kMaxPendingBytes = 128U << 20U;
constexpr int kMaxPending = 1 << 16;

Error translate(natsStatus status, const std::string& what) {
  return {ErrorCode::kTransport, what + ": " + natsStatus_GetText(status)};
}

class CnatsBus final : public NatsBus {
 public:
  explicit CnatsBus(const NatsOptions& options)
      : url_(without_password(options.url)),
        bell_(options.bell != nullptr ? options.bell : std::make_shared<Doorbell>()) {}
  ~CnatsBus() override {
    for (auto& [subject, subscription] : subscriptions_) {
      natsSubscription_Unsubscribe(subscription);
      natsSubscription_Destroy(subscription);
    }
    // Flushes, so that others are told that it leaves.
    if (connection_ != nullptr && connected()) natsConnection_FlushTimeout(connection_, 200);
    // Waits for callbacks that run: they hold a pointer to this.
    natsConnection_Close(connection_);
    while (connection_ != nullptr && !closed_.load()) closed_.wait(false);
    natsConnection_Destroy(connection_);
  }
  CnatsBus(const CnatsBus&) = delete;
  CnatsBus& operator=(const CnatsBus&) = delete;

  Result<void> open(const NatsOptions& options) {
    natsOptions* made = nullptr;
    if (const natsStatus status = natsOptions_Create(&made); status != NATS_OK)
      return tl::unexpected(translate(status, "NATS"));
    const std::unique_ptr<natsOptions, decltype(&natsOptions_Destroy)> owner(made, &natsOptions_Destroy);
    std::vector<std::string> urls;
    for (std::size_t at = 0; at <= options.url.size();) {
      const std::size_t end = std::min(options.url.find(',', at), options.url.size());
      urls.push_back(options.url.substr(at, end - at));
      at = end + 1;
    }
    std::vector<const char*> texts;
    for (const std::string& url : urls) {
      if (!is_nats_url(url))
        return fail(ErrorCode::kInvalidArgument,
                    without_password(url) + " does not begin with nats:// or tls://");
      texts.push_back(url.c_str());
      // libnats takes tls:// for a plain connection, on which it would send the password.
      if (url.starts_with("tls://")) natsOptions_SetSecure(made, true);
    }
    const auto set = [](natsStatus status, const char* what) -> Result<void> {
      if (status == NATS_OK) return {};
      return fail(ErrorCode::kInvalidArgument, std::string(what) + ": " + natsStatus_GetText(status));
    };
    if (auto good =
            set(natsOptions_SetServers(made, texts.data(), static_cast<int>(texts.size())), "the NATS URL");
        !good)
      return good;
    if (!options.credentials.empty()) {
      if (auto good = set(natsOptions_SetUserCredentialsFromFiles(made, options.credentials.c_str(), nullptr),
                          options.credentials.c_str());
          !good)
        return good;
    }
    if (!options.tls_ca.empty()) {
      if (auto good = set(natsOptions_LoadCATrustedCertificates(made, options.tls_ca.c_str()),
                          (options.tls_ca + " has no whole certificate").c_str());
          !good)
        return good;
    }
    natsOptions_SetName(made, options.name.c_str());
    natsOptions_SetSendAsap(made, true);
    natsOptions_SetNoEcho(made, true);
    natsOptions_SetTimeout(made, kConnectMs);
    natsOptions_SetPingInterval(made, kPingMs);
    natsOptions_SetMaxPingsOut(made, kPings);
    natsOptions_SetWriteDeadline(made, kWriteMs);
    natsOptions_SetMaxReconnect(made, -1);
    natsOptions_SetReconnectWait(made, kReconnectMs);
    natsOptions_SetReconnectJitter(made, kReconnectMs / 2, kReconnectMs / 2);
    natsOptions_SetReconnectBufSize(made, kReconnectBytes);
    natsOptions_SetMaxPendingMsgs(made, kMaxPending);
    natsOptions_UseGlobalMessageDelivery(made, true);  // one thread for all, so that they keep their order
    if (options.once) {
      natsOptions_SetAllowReconnect(made, false);
    } else {
      natsOptions_SetRetryOnFailedConnect(made, true, &CnatsBus::on_change, this);
    }
    natsOptions_SetReconnectedCB(made, &CnatsBus::on_change, this);
    natsOptions_SetDisconnectedCB(made, &CnatsBus::on_disconnected, this);
    natsOptions_SetClosedCB(made, &CnatsBus::on_closed, this);
    natsOptions_SetErrorHandler(made, &CnatsBus::on_error, this);
    const natsStatus status = natsConnection_Connect(&connection_, made);
    if (status != NATS_OK && status != NATS_NOT_YET_CONNECTED) {
      const char* const why = nats_GetLastError(nullptr);
      return fail(ErrorCode::kTransport,
                  "the NATS server " + url_ + " cannot be reached: " +
                      (why != nullptr && *why != 0 ? why : natsStatus_GetText(status)));
    }
    return {};
  }

  [[nodiscard]] bool connected() const override {
    return connection_ != nullptr && natsConnection_Status(connection_) == NATS_CONN_STATUS_CONNECTED;
  }
  [[nodiscard]] std::size_t most_bytes() const override {
    const std::int64_t most = natsConnection_GetMaxPayload(connection_);
    return most > 0 ? static_cast<std::size_t>(most) : 64'000;
  }

  using NatsBus::subscribe;
  Result<void> subscribe(const std::string& subject, const std::string& group) override {
    if (subscriptions_.contains(subject)) return {};
    natsSubscription* made = nullptr;
    const natsStatus status =
        group.empty()
            ? natsConnection_Subscribe(&made, connection_, subject.c_str(), &CnatsBus::on_message, this)
            : natsConnection_QueueSubscribe(&made, connection_, subject.c_str(), group.c_str(),
                                            &CnatsBus::on_message, this);
    if (status != NATS_OK) return tl::unexpected(translate(status, subject));
    natsSubscription_SetPendingLimits(made, kMaxPending, static_cast<int>(kMaxPendingBytes));
    subscriptions_.emplace(subject, made);
    return {};
  }
  void unsubscribe(const std::string& subject) override {
    const auto found = subscriptions_.find(subject);
    if (found == subscriptions_.end()) return;
    natsSubscription_Unsubscribe(found->second);
    natsSubscription_Destroy(found->second);
    subscriptions_.erase(found);
  }
  Result<void> publish(const std::string& subject, std::span<const std::byte> bytes) override {
    if (!connected()) return fail(ErrorCode::kTransport, "the NATS server cannot be reached");
    const natsStatus status =
        natsConnection_Publish(connection_, subject.c_str(), bytes.data(), static_cast<int>(bytes.size()));
    if (status != NATS_OK) return tl::unexpected(translate(status, subject));
    return {};
  }
  void take(std::vector<NatsArrival>& out) override {
    const std::lock_guard lock(mutex_);
    std::move(queue_.begin(), queue_.end(), std::back_inserter(out));
    queue_.clear();
    queued_bytes_ = 0;
  }
  [[nodiscard]] std::uint64_t overrun() const override { return overrun_.load(); }
  [[nodiscard]] std::uint64_t lost() const override { return lost_.load(); }
  [[nodiscard]] std::string trouble() const override {
    if (connected()) {
      const std::lock_guard lock(mutex_);
      return refusal_;
    }
    if (steady_ns() - down_since_ns_.load() < kPatienceNs) return {};
    const char* last = nullptr;
    const natsStatus status = natsConnection_GetLastError(connection_, &last);
    std::string why = last != nullptr && *last != 0 ? last
                      : status == NATS_OK           ? ""
                                                    : natsStatus_GetText(status);
    return "the NATS server " + url_ + " cannot be reached" + (why.empty() ? "" : ": " + why);
  }
  void wait(std::chrono::nanoseconds timeout) override { bell_->wait(timeout); }
  void wake() override { bell_->ring(); }
  Result<std::int64_t> round_trip_ns() override {
    std::int64_t ns = 0;
    const natsStatus status =
        connected() ? natsConnection_GetRTT(connection_, &ns) : NATS_CONNECTION_DISCONNECTED;
    if (status != NATS_OK) return tl::unexpected(translate(status, url_));
    return ns;
  }
  [[nodiscard]] std::uint64_t refusals() const override { return refusals_.load(); }

 private:
  static void on_message(natsConnection* /*connection*/, natsSubscription* /*subscription*/, natsMsg* message,
                         void* self) {
    auto* const bus = static_cast<CnatsBus*>(self);
    const auto size = static_cast<std::size_t>(natsMsg_GetDataLength(message));
    const auto* const data = reinterpret_cast<const std::byte*>(natsMsg_GetData(message));
    {
      const std::lock_guard lock(bus->mutex_);
      if (bus->queued_bytes_ + size > kMaxPendingBytes) {
        bus->overrun_.fetch_add(1);
      } else {
        bus->queued_bytes_ += size;
        bus->queue_.push_back({natsMsg_GetSubject(message), Bytes(data, data + size)});
      }
    }
    natsMsg_Destroy(message);
    bus->bell_->ring();
  }
  static void on_change(natsConnection* /*connection*/, void* self) {
    static_cast<CnatsBus*>(self)->bell_->ring();
  }
  static void on_disconnected(natsConnection* /*connection*/, void* self) {
    static_cast<CnatsBus*>(self)->down_since_ns_.store(steady_ns());
    static_cast<CnatsBus*>(self)->lost_.fetch_add(1);
    static_cast<CnatsBus*>(self)->bell_->ring();
  }
  static void on_closed(natsConnection* /*connection*/, void* self) {
    auto* const bus = static_cast<CnatsBus*>(self);
    bus->bell_->ring();
    bus->closed_.store(true);
    bus->closed_.notify_all();
  }
  // What the server says of a violated permission comes here.
  static void on_error(natsConnection* connection, natsSubscription* /*subscription*/, natsStatus status,
                       void* self) {
    auto* const bus = static_cast<CnatsBus*>(self);
    if (status == NATS_SLOW_CONSUMER) {
      bus->overrun_.fetch_add(1);
    } else if (status == NATS_NOT_PERMITTED) {
      const char* last = nullptr;
      natsConnection_GetLastError(connection, &last);
      bus->refusals_.fetch_add(1);
      const std::lock_guard lock(bus->mutex_);
      // The first tells enough; others differ by the subject only.
      if (bus->refusal_.empty())
        bus->refusal_ = "the NATS server " + bus->url_ + " does not permit it" +
                        (last != nullptr && *last != 0 ? ": " + std::string(last) : "");
    }
    bus->bell_->ring();
  }

  const std::string url_;
  natsConnection* connection_ = nullptr;
  std::map<std::string, natsSubscription*> subscriptions_;
  const std::shared_ptr<Doorbell> bell_;
  std::atomic<bool> closed_{false};
  std::atomic<std::int64_t> down_since_ns_{steady_ns()};
  std::atomic<std::uint64_t> overrun_{0}, refusals_{0}, lost_{0};
  mutable std::mutex mutex_;
  std::vector<NatsArrival> queue_;
  std::size_t queued_bytes_ = 0;
  std::string refusal_;
};

}  // namespace

Result<std::unique_ptr<NatsBus>> make_nats_bus(const NatsOptions& options) {
  if (auto good = check_nats_files(options); !good) return tl::unexpected(good.error());
  auto bus = std::make_unique<CnatsBus>(options);
  if (auto opened = bus->open(options); !opened) return tl::unexpected(opened.error());
  return std::unique_ptr<NatsBus>(std::move(bus));
}

}  // namespace tandem::transport
