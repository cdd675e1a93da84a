#include <iterator>
#include <optional>
#include <utility>

#include "sdk/transport/dds/announcements.hpp"
#include "sdk/transport/dds/peers.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/wire/units.hpp"
#include "sdk/workers/doorbell.hpp"

namespace tandem::transport {
namespace {

class DdsMonitor final : public Monitor {
 public:
  struct Endpoints {
    dds::Node node;
    dds::Announcements servers;
    dds::Reader<ClientStatusMessage> clients;
    dds::Entity participants;  // a reader of the participants that discovery knows

    static Result<Endpoints> open(const DdsOptions& options);
  };

  DdsMonitor(Endpoints endpoints, DdsOptions options)
      : endpoints_(std::move(endpoints)), options_(std::move(options)) {}

  void list_sessions(std::vector<Received<SessionMessage>>& out) override {
    refresh();
    if (endpoints_) endpoints_->servers.book().list_live(out);
  }
  void take(std::vector<Stamped<ServerStatusMessage>>& out) override {
    refresh();
    if (!endpoints_) return;
    auto& statuses = endpoints_->servers.statuses();
    std::move(statuses.begin(), statuses.end(), std::back_inserter(out));
    statuses.clear();
  }
  void take(std::vector<Stamped<ClientStatusMessage>>& out) override {
    if (endpoints_) endpoints_->clients.take(dropped_, out);
  }
  std::optional<Peer> describe(const ParticipantId& client) override {
    if (!endpoints_) return std::nullopt;
    return dds::describe_writer(endpoints_->participants.get(), endpoints_->clients.get(), client);
  }
  // Its writer is made when it is needed, as most monitors only watch.
  Result<void> write(const CommandMessage& message) override {
    if (!endpoints_) return fail(ErrorCode::kTransport, network_);
    if (!command_) {
      auto writer = endpoints_->node.writer<CommandMessage>("commands");
      if (!writer) return tl::unexpected(writer.error());
      command_.emplace(std::move(*writer));
    }
    return command_->write(message);
  }
  void wait(std::chrono::nanoseconds timeout) override { options_.bell->wait(timeout); }
  [[nodiscard]] std::string trouble() const override { return network_; }

 private:
  // Cyclone DDS looks at the machine's addresses once, so another address needs another participant.
  void follow_network() {
    if (endpoints_) {
      const NetworkState state = endpoints_->node.domain().network();
      network_ = state == NetworkState::kThere ? std::string() : endpoints_->node.domain().network_line();
      if (state == NetworkState::kMoved) {
        command_.reset();
        endpoints_.reset();
      }
    }
    if (endpoints_ || steady_ns() < retry_ns_) return;
    retry_ns_ = steady_ns() + kSecond;
    auto opened = Endpoints::open(options_);
    network_ = opened ? std::string() : opened.error().message;
    if (opened) endpoints_.emplace(std::move(*opened));
  }
  void call_out() {
    if (!endpoints_) return;
    dds::CallOut& call_out = endpoints_->node.call_out();
    const std::int64_t now_ns = steady_ns();
    if (call_out.began_lately(now_ns) || !endpoints_->servers.book().any_live()) call_out.again(now_ns);
  }
  void refresh() {
    follow_network();
    if (endpoints_)
      endpoints_->servers.refresh("", dropped_,
                                  [](const ParticipantId&) -> std::optional<bool> { return {}; });
    call_out();
  }

  std::optional<Endpoints> endpoints_;  // empty while there is no network
  DdsOptions options_;
  std::optional<dds::Writer<CommandMessage>> command_;
  std::string network_;  // why there is none, or it is not of use
  std::int64_t retry_ns_ = 0;
  std::atomic<std::uint64_t> dropped_ = 0;
};

Result<DdsMonitor::Endpoints> DdsMonitor::Endpoints::open(const DdsOptions& options) {
  auto node = dds::Node::create(options, "tandem monitor", "*", dds::Purpose::kWatch);
  if (!node) return tl::unexpected(node.error());
  auto servers = dds::Announcements::create(*node);
  if (!servers) return tl::unexpected(servers.error());
  auto clients = node->reader<ClientStatusMessage>("client status");
  if (!clients) return tl::unexpected(clients.error());
  auto participants = dds::make_participant_reader(node->participant());
  if (!participants) return tl::unexpected(participants.error());
  return Endpoints{std::move(*node), std::move(*servers), std::move(*clients), std::move(*participants)};
}

}  // namespace

Result<std::unique_ptr<Monitor>> make_dds_monitor(const DdsOptions& options) {
  DdsOptions here = options;
  if (here.bell == nullptr) here.bell = std::make_shared<Doorbell>();  // outlives a participant
  auto endpoints = DdsMonitor::Endpoints::open(here);
  if (!endpoints) return tl::unexpected(endpoints.error());
  return std::make_unique<DdsMonitor>(std::move(*endpoints), here);
}

}  // namespace tandem::transport
