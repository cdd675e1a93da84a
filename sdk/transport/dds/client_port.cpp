#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/hash.hpp"
#include "sdk/transport/dds/announcements.hpp"
#include "sdk/transport/dds/peers.hpp"
#include "sdk/wire/client_id.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/wire/units.hpp"
#include "sdk/workers/doorbell.hpp"

namespace tandem::transport {
namespace {

using dds::Node;
using dds::Reader;
using dds::Topic;
using dds::Writer;

/// How often a port that has lost its network tries to join another.
constexpr std::int64_t kRetryNs = 1'000'000'000;

class DdsClientPort final : public ClientPort {
 public:
  struct Endpoints {
    Node node;
    dds::Announcements servers;
    Writer<AckMessage> ack;
    std::optional<Writer<InputMessage>> input;  // empty: its identity may send none
    Writer<ClientStatusMessage> status;
    dds::Entity publications;  // a reader of the writers that discovery knows

    static Result<Endpoints> open(const DdsOptions& options);
  };

  DdsClientPort(Endpoints endpoints, DdsOptions options)
      : endpoints_(std::move(endpoints)), options_(std::move(options)), self_(endpoints_->node.self()) {}

  [[nodiscard]] ParticipantId self() const override { return self_; }

  void take_sessions(std::vector<Received<SessionMessage>>& out) override {
    refresh();
    if (!endpoints_) return;
    tell_servers();
    endpoints_->servers.book().take_current(out);
  }
  void pass_over_session(PassOver until) override {
    if (endpoints_) endpoints_->servers.book().pass_over_current(until);
  }
  [[nodiscard]] bool server_alive() override {
    refresh();
    if (!endpoints_ || !trouble().empty()) return false;
    const SessionBook& book = endpoints_->servers.book();
    return epoch_ ? book.epoch_live(*epoch_) : book.any_live();
  }
  [[nodiscard]] bool server_ended() override {
    return endpoints_ && epoch_ && endpoints_->servers.book().ended(*epoch_);
  }
  [[nodiscard]] std::string trouble() override {
    std::string fault = dds_fault();
    if (!fault.empty()) return fault;
    return network_.empty() && others_seen_ > 1
               ? "another version of Tandem serves session " + options_.session +
                     ": server and clients have to be of one version"
               : network_;
  }
  [[nodiscard]] std::optional<ClientId> take_renewal() override { return std::exchange(renewal_, {}); }
  [[nodiscard]] bool hears_all_servers() const override { return true; }

  Result<void> open_stream(const SessionMessage& session, const StreamMessage& stream,
                           ClientId client) override {
    if (epoch_ != session.epoch) {
      // New readers, because the old ones may already have been handed scheduled inputs of the new epoch,
      // which are sent once to each reader.
      close_streams();
    }
    if (!common_) {
      Common common{.scheduled = {}, .reply = {}, .client = client};
      if (auto opened = open(common); !opened) return opened;
      common_.emplace(std::move(common));
      epoch_ = session.epoch;
    }
    const Limits limits{stream.max_delta_bytes, stream.max_snapshot_bytes};
    if (const auto there = streams_.find(stream.id.id); there != streams_.end()) {
      there->second.set_limits(limits);
      return {};
    }
    // As deep as the writer's history; otherwise repaired samples would displace each other after a lost
    // link. It takes memory only while the application does not take the samples.
    const auto depth = static_cast<std::int32_t>(
        delta_depth(session.frame_rate_hz, session.window_ceiling, stream.max_delta_bytes));
    Stream made{.deltas = {}, .limits = limits, .depth = depth};
    if (auto opened = open(stream.id.id, made); !opened) return opened;
    streams_.emplace(stream.id.id, std::move(made));
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
    if (snapshots_) snapshots_->set_limits(open->second.limits);
    wanted_snapshots_ = stream;
    return {};
  }
  void close_snapshots(std::uint32_t stream) override {
    if (wanted_snapshots_ == stream) wanted_snapshots_.reset();
  }
  /// Reads snapshots from now on, as long as the port lives. A DDS reader takes nothing from a writer before
  /// its first heartbeat, and a join need not wait for that round trip.
  Result<void> read_snapshots(ClientId client) {
    if (!endpoints_ || (snapshots_ && snapshots_client_ == client)) return {};
    auto snapshots = endpoints_->node.reader<SnapshotMessage>(
        "snapshots", {.partitions = {client_partition(options_.session, client)}});
    if (!snapshots) return tl::unexpected(snapshots.error());
    snapshots_.emplace(std::move(*snapshots));
    snapshots_client_ = client;
    return {};
  }

  void take(std::vector<Received<DeltaMessage>>& out) override {
    for (auto& [id, stream] : streams_)
      if (stream.deltas) stream.deltas->take(dropped_, out);
  }
  void take(std::vector<Received<ScheduledInputMessage>>& out) override {
    if (common_ && common_->scheduled) common_->scheduled->take(dropped_, out);
  }
  void take(std::vector<Received<SnapshotMessage>>& out) override {
    if (!snapshots_) return;
    const std::size_t before = out.size();
    snapshots_->take(dropped_, out);
    if (!wanted_snapshots_) out.resize(before);  // late parts of a snapshot that is complete
  }
  void take(std::vector<Received<ReplyMessage>>& out) override {
    if (common_ && common_->reply) common_->reply->take(dropped_, out);
  }
  void take(std::vector<Received<ServerStatusMessage>>& out) override {
    if (!endpoints_) return;
    auto& statuses = endpoints_->servers.statuses();
    std::move(statuses.begin(), statuses.end(), std::back_inserter(out));
    statuses.clear();
  }

  Result<void> write(const AckMessage& message) override {
    return endpoints_ ? endpoints_->ack.write(message) : no_network();
  }
  Result<void> write(const InputMessage& message) override {
    if (!endpoints_) return no_network();
    if (!endpoints_->input)
      return fail(ErrorCode::kOutOfOrder, "the identity in " + options_.secure + " is an observer's");
    return endpoints_->input->write(message);
  }
  Result<void> write(const ClientStatusMessage& message) override {
    return endpoints_ ? endpoints_->status.write(message) : no_network();
  }

  [[nodiscard]] std::uint64_t dropped() const override { return dropped_.load(); }
  [[nodiscard]] std::uint64_t wire_bytes(std::int64_t now_ns) const override {
    // The status writer has half of the lease, and repeats its sign of life after 0.8 of that.
    const double own_life_s = 0.4 * std::chrono::duration<double>(options_.lease).count();
    const double passed_s = static_cast<double>(std::max<std::int64_t>(0, now_ns - opened_ns_)) * 1e-9;
    return options_.wire->bytes() + static_cast<std::uint64_t>(DdsWire::in_any_case(own_life_s) * passed_s);
  }
  void wait(std::chrono::nanoseconds timeout) override { options_.bell->wait(timeout); }
  void wake() override { options_.bell->ring(); }

 private:
  struct Stream {
    std::optional<Reader<DeltaMessage>> deltas;  // empty while there is no network
    Limits limits;
    std::int32_t depth = 0;

    void set_limits(const Limits& in_force) {
      limits = in_force;
      if (deltas) deltas->set_limits(limits);
    }
  };
  /// The endpoints that all streams of an epoch share.
  struct Common {
    std::optional<Reader<ScheduledInputMessage>> scheduled;  // empty while there is no network
    std::optional<Reader<ReplyMessage>> reply;
    ClientId client = 0;
  };

  [[nodiscard]] tl::unexpected<Error> no_network() const { return fail(ErrorCode::kTransport, network_); }

  Result<void> open(std::uint32_t id, Stream& stream) {
    if (!endpoints_) return {};
    dds::ReaderOptions options{.depth = stream.depth};
    if (id != 0) options.partitions = {stream_partition(options_.session, id)};
    auto deltas = endpoints_->node.reader<DeltaMessage>("deltas", options);
    if (!deltas) return tl::unexpected(deltas.error());
    stream.deltas.emplace(std::move(*deltas));
    stream.set_limits(stream.limits);
    return {};
  }
  Result<void> open(Common& common) {
    if (!endpoints_) return {};
    auto scheduled = endpoints_->node.reader<ScheduledInputMessage>("scheduled inputs");
    if (!scheduled) return tl::unexpected(scheduled.error());
    auto reply = endpoints_->node.reader<ReplyMessage>(
        "replies", {.partitions = {options_.session, client_partition(options_.session, common.client)}});
    if (!reply) return tl::unexpected(reply.error());
    common.scheduled.emplace(std::move(*scheduled));
    common.reply.emplace(std::move(*reply));
    return {};
  }

  // Cyclone DDS looks at the machine's addresses once, so another address needs another participant.
  void follow_network() {
    if (endpoints_) {
      const NetworkState state = endpoints_->node.domain().network();
      network_ = state == NetworkState::kThere ? std::string() : endpoints_->node.domain().network_line();
      if (state == NetworkState::kMoved) leave();
    }
    if (endpoints_ || steady_ns() < retry_ns_) return;
    retry_ns_ = steady_ns() + kRetryNs;
    if (auto joined = join_anew(); !joined) {
      leave();
      network_ = joined.error().message;
    }
  }
  void leave() {
    for (auto& [id, stream] : streams_) stream.deltas.reset();
    if (common_) {
      common_->scheduled.reset();
      common_->reply.reset();
    }
    snapshots_.reset();
    endpoints_.reset();
  }
  Result<void> join_anew() {
    DdsOptions options = options_;
    options.client = random_client_id();
    auto endpoints = Endpoints::open(options);
    if (!endpoints) return tl::unexpected(endpoints.error());
    endpoints_.emplace(std::move(*endpoints));
    for (auto& [id, stream] : streams_)
      if (auto opened = open(id, stream); !opened) return opened;
    if (common_) {
      common_->client = options.client;
      if (auto opened = open(*common_); !opened) return opened;
    }
    if (auto opened = read_snapshots(options.client); !opened) return opened;
    TANDEM_ASSERT(!wanted_snapshots_ || (snapshots_ && streams_.contains(*wanted_snapshots_)));
    if (wanted_snapshots_) snapshots_->set_limits(streams_.at(*wanted_snapshots_).limits);
    options_.client = options.client;
    self_ = endpoints_->node.self();
    renewal_ = options.client;
    network_.clear();
    return {};
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
    static_cast<void>(endpoints_->ack.write(looking));
  }

  void refresh() {
    follow_network();
    if (!endpoints_) return;
    endpoints_->servers.refresh(options_.session, dropped_, [this](const ParticipantId& server) {
      std::optional<bool> shows;
      for (auto& [id, stream] : streams_)
        if (const auto here = stream.deltas->shows_life(server)) shows = shows.value_or(false) || *here;
      return shows;
    });
    const std::int64_t now_ns = steady_ns();
    if (endpoints_->servers.book().any_live()) {
      others_seen_ = 0;
      looked_ns_ = now_ns;
      return;
    }
    endpoints_->node.call_out().again(now_ns);
    look_for_other_versions(now_ns);
  }

  // Types of another version do not match, so nothing but discovery tells of such a server. One that is just
  // being matched is not seen twice.
  void look_for_other_versions(std::int64_t now_ns) {
    if (now_ns - looked_ns_ < kSecond / 2) return;
    looked_ns_ = now_ns;
    const bool seen = dds::has_other_version(endpoints_->publications.get(), endpoints_->servers.sessions(),
                                             SessionMessage::kTopic, options_.session);
    others_seen_ = seen ? others_seen_ + 1 : 0;
  }

  std::optional<Endpoints> endpoints_;  // empty while there is no network
  DdsOptions options_;
  ParticipantId self_;
  std::map<std::uint32_t, Stream> streams_;  // by id
  std::optional<Common> common_;             // set when a stream was opened
  std::optional<Epoch> epoch_;               // epoch of what is open
  std::optional<Reader<SnapshotMessage>> snapshots_;
  ClientId snapshots_client_ = 0;
  std::optional<std::uint32_t> wanted_snapshots_;  // stream whose snapshots are wanted
  std::string network_;                            // why there is none, or it is not of use
  std::optional<ClientId> renewal_;
  std::int64_t retry_ns_ = 0;
  std::int64_t told_ns_ = INT64_MIN / 2;
  std::int64_t opened_ns_ = steady_ns();
  std::int64_t looked_ns_ = opened_ns_;  // for servers of another version
  std::uint32_t others_seen_ = 0;        // how often in a row there was one, and none of this version
  std::atomic<std::uint64_t> dropped_ = 0;
};

Result<DdsClientPort::Endpoints> DdsClientPort::Endpoints::open(const DdsOptions& options) {
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
  auto servers = dds::Announcements::create(
      *node, {}, options.every_status ? std::string() : figures_partition(options.session));
  if (!servers) return tl::unexpected(servers.error());
  auto publications = dds::make_publication_reader(node->participant());
  if (!publications) return tl::unexpected(publications.error());
  return Endpoints{std::move(*node), std::move(*servers), std::move(*ack),
                   std::move(input), std::move(*status),  std::move(*publications)};
}

}  // namespace

Result<std::unique_ptr<ClientPort>> make_dds_client_port(const DdsOptions& options) {
  if (auto named = check_session_name(options.session); !named) return tl::unexpected(named.error());
  DdsOptions here = options;
  if (here.bell == nullptr) here.bell = std::make_shared<Doorbell>();  // outlives a participant
  if (here.wire == nullptr) here.wire = std::make_shared<DdsWireCount>();
  auto endpoints = DdsClientPort::Endpoints::open(here);
  if (!endpoints) return tl::unexpected(endpoints.error());
  auto port = std::make_unique<DdsClientPort>(std::move(*endpoints), here);
  if (options.client != 0) {
    if (auto there = port->read_snapshots(options.client); !there) return tl::unexpected(there.error());
  }
  return port;
}

}  // namespace tandem::transport
