#include <iterator>
#include <optional>
#include <utility>

#include "sdk/transport/dds/announcements.hpp"
#include "sdk/transport/dds/peers.hpp"

namespace tandem::transport {
namespace {

class DdsMonitor final : public Monitor {
 public:
  struct Endpoints {
    dds::Node node;
    dds::Announcements servers;
    dds::Reader<ClientStatusMessage> clients;
    dds::Entity participants;  // a reader of the participants that discovery knows
  };

  explicit DdsMonitor(Endpoints endpoints) : endpoints_(std::move(endpoints)) {}

  void list_sessions(std::vector<Received<SessionMessage>>& out) override {
    refresh();
    endpoints_.servers.book().list_live(out);
  }
  void take(std::vector<Stamped<ServerStatusMessage>>& out) override {
    refresh();
    auto& statuses = endpoints_.servers.statuses();
    std::move(statuses.begin(), statuses.end(), std::back_inserter(out));
    statuses.clear();
  }
  void take(std::vector<Stamped<ClientStatusMessage>>& out) override {
    endpoints_.clients.take(dropped_, out);
  }
  std::optional<Peer> describe(const ParticipantId& client) override {
    return dds::describe_writer(endpoints_.participants.get(), endpoints_.clients.get(), client);
  }
  // Its writer is made when it is needed, as most monitors only watch.
  Result<void> write(const CommandMessage& message) override {
    if (!command_) {
      auto writer = endpoints_.node.writer<CommandMessage>("commands");
      if (!writer) return tl::unexpected(writer.error());
      command_.emplace(std::move(*writer));
    }
    return command_->write(message);
  }
  void wait(std::chrono::nanoseconds timeout) override { endpoints_.node.wait(timeout); }

 private:
  void refresh() {
    endpoints_.servers.refresh("", dropped_, [](const ParticipantId&) { return false; });
  }

  Endpoints endpoints_;
  std::optional<dds::Writer<CommandMessage>> command_;
  std::atomic<std::uint64_t> dropped_ = 0;
};

}  // namespace

Result<std::unique_ptr<Monitor>> make_dds_monitor(const DdsOptions& options) {
  auto node = dds::Node::create(options, "tandem monitor", "*", dds::Purpose::kWatch);
  if (!node) return tl::unexpected(node.error());
  auto servers = dds::Announcements::create(*node);
  if (!servers) return tl::unexpected(servers.error());
  auto clients = node->reader<ClientStatusMessage>("client status");
  if (!clients) return tl::unexpected(clients.error());
  auto participants = dds::make_participant_reader(*node);
  if (!participants) return tl::unexpected(participants.error());
  return std::make_unique<DdsMonitor>(DdsMonitor::Endpoints{std::move(*node), std::move(*servers),
                                                            std::move(*clients), std::move(*participants)});
}

}  // namespace tandem::transport
