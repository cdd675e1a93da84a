#include <utility>

#include "sdk/transport/dds/node.hpp"

namespace tandem::transport {
namespace {

using dds::Node;
using dds::Reader;

class DdsMonitor final : public Monitor {
 public:
  struct Endpoints {
    Node node;
    Reader<SessionMessage> sessions;
    Reader<ServerStatusMessage> servers;
    Reader<ClientStatusMessage> clients;
  };

  explicit DdsMonitor(Endpoints endpoints) : endpoints_(std::move(endpoints)) {}

  void list_sessions(std::vector<Received<SessionMessage>>& out) override {
    endpoints_.sessions.take(Limits{}, dropped_,
                             [this](auto writer, Received<SessionMessage>&& announcement) {
                               book_.put(writer, std::move(announcement));
                             });
    book_.update([this](std::uint64_t writer) { return endpoints_.sessions.state(writer); });
    book_.list_live(out);
  }
  void take(std::vector<Received<ServerStatusMessage>>& out) override {
    endpoints_.servers.take(Limits{}, dropped_, out);
  }
  void take(std::vector<Received<ClientStatusMessage>>& out) override {
    endpoints_.clients.take(Limits{}, dropped_, out);
  }
  void wait(std::chrono::nanoseconds timeout) override { endpoints_.node.wait(timeout); }

 private:
  Endpoints endpoints_;
  SessionBook book_;
  std::atomic<std::uint64_t> dropped_ = 0;
};

}  // namespace

Result<std::unique_ptr<Monitor>> make_dds_monitor(const DdsOptions& options) {
  auto node = Node::create(options, "tandem monitor", "*");
  if (!node) return tl::unexpected(node.error());
  auto sessions = node->reader<SessionMessage>("sessions");
  if (!sessions) return tl::unexpected(sessions.error());
  auto servers = node->reader<ServerStatusMessage>("server status");
  if (!servers) return tl::unexpected(servers.error());
  auto clients = node->reader<ClientStatusMessage>("client status");
  if (!clients) return tl::unexpected(clients.error());
  return std::make_unique<DdsMonitor>(DdsMonitor::Endpoints{std::move(*node), std::move(*sessions),
                                                            std::move(*servers), std::move(*clients)});
}

}  // namespace tandem::transport
