#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "sdk/core/lattice/hash.hpp"
#include "sdk/transport/clock.hpp"
#include "sdk/transport/dds/announcements.hpp"

namespace tandem::transport {
namespace {

using dds::Node;
using dds::Reader;
using dds::Topic;
using dds::Writer;

class DdsClientPort final : public ClientPort {
 public:
  struct Endpoints {
    Node node;
    dds::Announcements servers;
    Writer<AckMessage> ack;
    std::optional<Writer<InputMessage>> input;  // empty: its identity may send none
    Writer<ClientStatusMessage> status;
  };

  DdsClientPort(Endpoints endpoints, const DdsOptions& options)
      : endpoints_(std::move(endpoints)), options_(options) {}

  [[nodiscard]] ParticipantId self() const override { return endpoints_.node.self(); }

  void take_sessions(std::vector<Received<SessionMessage>>& out) override {
    refresh();
    tell_servers();
    endpoints_.servers.book().take_current(out);
  }
  void pass_over_session(PassOver until) override { endpoints_.servers.book().pass_over_current(until); }
  [[nodiscard]] bool server_alive() override {
    refresh();
    const SessionBook& book = endpoints_.servers.book();
    return trouble().empty() && (epoch_ ? book.epoch_live(*epoch_) : book.any_live());
  }
  [[nodiscard]] std::string trouble() override { return dds_fault(); }
  [[nodiscard]] bool hears_all_servers() const override { return true; }

  Result<void> open_stream(const SessionMessage& session, const StreamMessage& stream,
                           ClientId client) override {
    if (epoch_ != session.epoch) {
      // New readers, because the old ones may already have been handed scheduled inputs of the new epoch,
      // which are sent once to each reader.
      close_streams();
    }
    if (!common_) {
      auto scheduled = endpoints_.node.reader<ScheduledInputMessage>("scheduled inputs");
      if (!scheduled) return tl::unexpected(scheduled.error());
      auto reply = endpoints_.node.reader<ReplyMessage>(
          "replies", {.partitions = {options_.session, client_partition(options_.session, client)}});
      if (!reply) return tl::unexpected(reply.error());
      common_.emplace(Common{std::move(*scheduled), std::move(*reply), client});
      epoch_ = session.epoch;
    }
    const Limits limits{stream.max_delta_bytes, stream.max_snapshot_bytes};
    if (const auto open = streams_.find(stream.id.id); open != streams_.end()) {
      open->second.set_limits(limits);
      return {};
    }
    // As deep as the writer's history; otherwise repaired samples would displace each other after a lost
    // link. It takes memory only while the application does not take the samples.
    const auto depth = static_cast<std::int32_t>(
        delta_depth(session.frame_rate_hz, session.window_ceiling, stream.max_delta_bytes));
    auto delta = reader<DeltaMessage>("deltas", stream.id.id, {.depth = depth});
    if (!delta) return tl::unexpected(delta.error());
    streams_.emplace(stream.id.id, Stream{std::move(*delta), {}}).first->second.set_limits(limits);
    return {};
  }
  void close_stream(std::uint32_t stream) override {
    close_snapshots(stream);
    streams_.erase(stream);
  }
  void close_streams() override {
    wanted_snapshots_.reset();
    streams_.clear();
    common_.reset();
    epoch_.reset();
  }
  Result<void> open_snapshots(std::uint32_t stream) override {
    const auto open = streams_.find(stream);
    if (open == streams_.end()) return fail(ErrorCode::kOutOfOrder, "that stream is not open");
    if (auto there = read_snapshots(common_->client); !there) return there;
    snapshots_->set_limits(open->second.limits);
    wanted_snapshots_ = stream;
    return {};
  }
  void close_snapshots(std::uint32_t stream) override {
    if (wanted_snapshots_ == stream) wanted_snapshots_.reset();
  }
  /// Reads snapshots from now on, as long as the port lives. A DDS reader takes nothing from a writer before
  /// its first heartbeat, and a join need not wait for that round trip.
  Result<void> read_snapshots(ClientId client) {
    if (snapshots_ && snapshots_client_ == client) return {};
    auto snapshots = endpoints_.node.reader<SnapshotMessage>(
        "snapshots", {.partitions = {client_partition(options_.session, client)}});
    if (!snapshots) return tl::unexpected(snapshots.error());
    snapshots_.emplace(std::move(*snapshots));
    snapshots_client_ = client;
    return {};
  }

  void take(std::vector<Received<DeltaMessage>>& out) override {
    for (auto& [id, stream] : streams_) stream.deltas.take(dropped_, out);
  }
  void take(std::vector<Received<ScheduledInputMessage>>& out) override {
    if (common_) common_->scheduled.take(dropped_, out);
  }
  void take(std::vector<Received<SnapshotMessage>>& out) override {
    if (!snapshots_) return;
    const std::size_t before = out.size();
    snapshots_->take(dropped_, out);
    if (!wanted_snapshots_) out.resize(before);  // late parts of a snapshot that is complete
  }
  void take(std::vector<Received<ReplyMessage>>& out) override {
    if (common_) common_->reply.take(dropped_, out);
  }
  void take(std::vector<Received<ServerStatusMessage>>& out) override {
    auto& statuses = endpoints_.servers.statuses();
    std::move(statuses.begin(), statuses.end(), std::back_inserter(out));
    statuses.clear();
  }

  Result<void> write(const AckMessage& message) override { return endpoints_.ack.write(message); }
  Result<void> write(const InputMessage& message) override {
    if (!endpoints_.input)
      return fail(ErrorCode::kOutOfOrder, "the identity in " + options_.secure + " is an observer's");
    return endpoints_.input->write(message);
  }
  Result<void> write(const ClientStatusMessage& message) override { return endpoints_.status.write(message); }

  [[nodiscard]] std::uint64_t dropped() const override { return dropped_.load(); }
  void wait(std::chrono::nanoseconds timeout) override { endpoints_.node.wait(timeout); }
  void wake() override { endpoints_.node.wake(); }

 private:
  struct Stream {
    Reader<DeltaMessage> deltas;
    Limits limits;

    void set_limits(const Limits& in_force) {
      limits = in_force;
      deltas.set_limits(limits);
    }
  };
  /// The endpoints that all streams of an epoch share.
  struct Common {
    Reader<ScheduledInputMessage> scheduled;
    Reader<ReplyMessage> reply;
    ClientId client = 0;
  };

  template <class M>
  Result<Reader<M>> reader(const std::string& name, std::uint32_t stream, dds::ReaderOptions options) {
    if (stream != 0) options.partitions = {stream_partition(options_.session, stream)};
    return endpoints_.node.reader<M>(name, options);
  }

  // Called until a session is followed: a server that has heard of a client makes the writers for it while
  // the client still learns of the session.
  void tell_servers() {
    constexpr std::int64_t kSpacingNs = 100'000'000;
    const std::int64_t now_ns = steady_ns();
    if (common_ || options_.client == 0 || now_ns - told_ns_ < kSpacingNs) return;
    told_ns_ = now_ns;
    AckMessage looking;
    looking.client = options_.client;
    looking.clock_ns = now_ns;
    static_cast<void>(endpoints_.ack.write(looking));
  }

  void refresh() {
    endpoints_.servers.refresh(options_.session, dropped_, [this](const ParticipantId& server) {
      const auto delivers = [&server](auto& open) { return open.second.deltas.alive(server); };
      return std::ranges::any_of(streams_, delivers) || (common_ && common_->reply.alive(server));
    });
  }

  Endpoints endpoints_;
  DdsOptions options_;
  std::map<std::uint32_t, Stream> streams_;  // by id
  std::optional<Common> common_;             // set when a stream was opened
  std::optional<Epoch> epoch_;               // epoch of what is open
  std::optional<Reader<SnapshotMessage>> snapshots_;
  ClientId snapshots_client_ = 0;
  std::optional<std::uint32_t> wanted_snapshots_;  // stream whose snapshots are wanted
  std::int64_t told_ns_ = INT64_MIN / 2;
  std::atomic<std::uint64_t> dropped_ = 0;
};

}  // namespace

Result<std::unique_ptr<ClientPort>> make_dds_client_port(const DdsOptions& options) {
  if (auto named = check_session_name(options.session); !named) return tl::unexpected(named.error());
  auto node = Node::create(options, "tandem client " + to_hex(options.client), options.session,
                           options.acts ? dds::Purpose::kAct : dds::Purpose::kObserve);
  if (!node) return tl::unexpected(node.error());
  // First, as a server takes a client without it for an observer.
  std::optional<Writer<InputMessage>> input;
  if (node->may_act()) {
    auto made = node->writer<InputMessage>("inputs");
    if (!made) return tl::unexpected(made.error());
    input.emplace(std::move(*made));
  }
  auto ack = node->writer<AckMessage>("acknowledgements");
  if (!ack) return tl::unexpected(ack.error());
  auto status = node->writer<ClientStatusMessage>("client status");
  if (!status) return tl::unexpected(status.error());
  auto servers = dds::Announcements::create(*node);
  if (!servers) return tl::unexpected(servers.error());
  auto port = std::make_unique<DdsClientPort>(
      DdsClientPort::Endpoints{std::move(*node), std::move(*servers), std::move(*ack), std::move(input),
                               std::move(*status)},
      options);
  if (options.client != 0) {
    if (auto there = port->read_snapshots(options.client); !there) return tl::unexpected(there.error());
  }
  return port;
}

}  // namespace tandem::transport
