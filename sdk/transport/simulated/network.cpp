#include "sdk/transport/simulated/network.hpp"

#include <map>
#include <utility>

#include "sdk/transport/simulated/fabric.hpp"
#include "sdk/wire/limits.hpp"

namespace tandem::transport::simulated {
namespace {

constexpr std::uint32_t kSessionReaderDepth = 8;
constexpr std::uint32_t kScheduledDepth = 4096;
constexpr std::uint32_t kInputDepth = 64;
constexpr std::uint32_t kSnapshotWriterDepth = 64;
constexpr std::uint32_t kSnapshotReaderDepth = 4096;
constexpr std::uint32_t kJournalDepth = 4096;
constexpr std::uint32_t kCheckpointDepth = 256;

/// The common part of both kinds of port: a participant and its samples.
class Member {
 public:
  Member(std::shared_ptr<Fabric> fabric, std::string session)
      : fabric_(std::move(fabric)), session_(std::move(session)), self_(fabric_->add_participant(session_)) {}
  Member(const Member&) = delete;
  Member& operator=(const Member&) = delete;
  // A process that was killed says nothing.
  ~Member() {
    if (!fabric_->killed(self_)) fabric_->close_participant(self_);
  }

  [[nodiscard]] Fabric& fabric() const { return *fabric_; }
  [[nodiscard]] Fabric::Index index() const { return self_; }
  [[nodiscard]] ParticipantId id() const { return fabric_->id(self_); }
  [[nodiscard]] const std::string& session() const { return session_; }
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

  template <class M>
  Fabric::Index writer(std::uint32_t depth = 1, const std::string& partition = {}) {
    return fabric_->add_writer(self_, kTopic<M>, depth, partition);
  }
  template <class M>
  Fabric::Index reader(std::uint32_t depth = 1, const std::vector<std::string>& partitions = {{}}) {
    return fabric_->add_reader(self_, kTopic<M>, depth, partitions);
  }
  template <class M>
  void take(Fabric::Index reader, const Limits& limits, std::vector<Received<M>>& out) {
    if (fabric_->killed(self_)) return;
    fabric_->take(reader, [&](Fabric::Index from, const AnyMessage& any) {
      const M& message = std::get<M>(any);
      if (within_limits(message, limits)) {
        out.push_back(Received<M>{message, fabric_->id(from)});
      } else {
        ++dropped_;
      }
    });
  }
  /// Takes announcements into the book, which afterwards knows who is alive.
  void refresh(Fabric::Index reader, SessionBook& book) {
    if (fabric_->killed(self_)) return;
    fabric_->take(reader, [&](Fabric::Index from, const AnyMessage& any) {
      const auto& message = std::get<SessionMessage>(any);
      if (within_limits(message, Limits{}) && message.session == session_) {
        book.put(from, Received<SessionMessage>{message, fabric_->id(from)});
      } else {
        ++dropped_;
      }
    });
    book.update([&](std::uint64_t from, const ParticipantId& /*participant*/) {
      return fabric_->state(self_, static_cast<Fabric::Index>(from));
    });
  }

 private:
  std::shared_ptr<Fabric> fabric_;
  std::string session_;
  Fabric::Index self_;
  std::uint64_t dropped_ = 0;
};

class SimulatedServerPort final : public ServerPort {
 public:
  SimulatedServerPort(std::shared_ptr<Fabric> fabric, const std::string& session, std::uint32_t delta_depth)
      : member_(std::move(fabric), session),
        delta_depth_(delta_depth),
        session_(member_.writer<SessionMessage>()),
        scheduled_(member_.writer<ScheduledInputMessage>(kScheduledDepth)),
        reply_(member_.writer<ReplyMessage>()),
        status_(member_.writer<ServerStatusMessage>()),
        others_(member_.reader<SessionMessage>(kSessionReaderDepth)),
        input_(member_.reader<InputMessage>(kInputDepth)),
        ack_(member_.reader<AckMessage>(16)),
        standby_(member_.reader<StandbyMessage>(16)),
        command_(member_.reader<CommandMessage>(8)) {
    open_stream();
  }

  [[nodiscard]] ParticipantId self() const override { return member_.id(); }
  void take_sessions(std::vector<Received<SessionMessage>>& out) override {
    member_.refresh(others_, book_);
    book_.list_live(out);
  }
  Result<void> open_streams(std::uint32_t count) override {
    if (count == 0 || count > kMaxStreams) return fail(ErrorCode::kInvalidArgument, "1 to 8 streams");
    while (streams_.size() < count) open_stream();
    return {};
  }
  Result<void> write(const SessionMessage& message) override {
    return member_.fabric().write(session_, 0, message);
  }
  Result<void> write(const DeltaMessage& message) override {
    if (message.stream.id >= streams_.size()) return not_open();
    return member_.fabric().write(streams_[message.stream.id], 0, message);
  }
  Result<void> write(const ScheduledInputMessage& message) override {
    return member_.fabric().write(scheduled_, 0, message);
  }
  Result<void> write(ClientId to, const SnapshotMessage& message) override {
    const auto own = clients_.find(to);
    if (own == clients_.end()) return fail(ErrorCode::kInvalidArgument, "a client that is not open");
    return member_.fabric().write(own->second.snapshot, 0, message);
  }
  Result<void> write(const ReplyMessage& message) override {
    const auto own = clients_.find(message.client);
    return member_.fabric().write(own == clients_.end() ? reply_ : own->second.reply, message.client,
                                  message);
  }
  Result<void> write(const ServerStatusMessage& message) override {
    return member_.fabric().write(status_, message.stream, message);
  }
  Result<void> open_client(ClientId client) override {
    if (clients_.contains(client)) return {};
    const std::string partition = client_partition(member_.session(), client);
    clients_.emplace(client, Client{member_.writer<SnapshotMessage>(kSnapshotWriterDepth, partition),
                                    member_.writer<ReplyMessage>(1, partition)});
    member_.fabric().forget(reply_, client);
    return {};
  }
  void close_client(ClientId client) override {
    const auto own = clients_.find(client);
    if (own == clients_.end()) return;
    member_.fabric().close_writer(own->second.snapshot);
    member_.fabric().close_writer(own->second.reply);
    clients_.erase(own);
  }
  void take(std::vector<Received<InputMessage>>& out) override { member_.take(input_, Limits{}, out); }
  void take(std::vector<Received<AckMessage>>& out) override { member_.take(ack_, Limits{}, out); }
  [[nodiscard]] bool joined(const ParticipantId& participant, ClientId client,
                            std::uint32_t stream) override {
    const auto own = clients_.find(client);
    return stream < streams_.size() && own != clients_.end() &&
           member_.fabric().reaches(streams_[stream], participant) &&
           member_.fabric().reaches(scheduled_, participant) &&
           member_.fabric().reaches(own->second.snapshot, participant);
  }
  [[nodiscard]] bool alive(const ParticipantId& participant) override {
    return member_.fabric().hears(ack_, participant);
  }
  [[nodiscard]] bool ended(const ParticipantId& participant) override {
    return member_.fabric().ended(participant);
  }
  [[nodiscard]] std::uint64_t dropped() const override { return member_.dropped(); }
  void wait(std::chrono::nanoseconds /*timeout*/) override {}

  void take(std::vector<Received<StandbyMessage>>& out) override { member_.take(standby_, Limits{}, out); }
  void take(std::vector<Received<CommandMessage>>& out) override { member_.take(command_, Limits{}, out); }
  Result<void> open_standby(ClientId standby) override {
    if (!journal_) journal_ = member_.writer<JournalMessage>(kJournalDepth);
    if (!standbys_.contains(standby))
      standbys_.emplace(standby, member_.writer<CheckpointMessage>(
                                     kCheckpointDepth, client_partition(member_.session(), standby)));
    return {};
  }
  void close_standby(ClientId standby) override {
    const auto own = standbys_.find(standby);
    if (own == standbys_.end()) return;
    member_.fabric().close_writer(own->second);
    standbys_.erase(own);
  }
  [[nodiscard]] bool follows(const ParticipantId& participant, ClientId standby) override {
    const auto own = standbys_.find(standby);
    return own != standbys_.end() && member_.fabric().reaches(own->second, participant) &&
           member_.fabric().reaches(*journal_, participant);
  }
  Result<void> write(const JournalMessage& message) override {
    if (!journal_) return fail(ErrorCode::kInvalidArgument, "nobody stands by");
    return member_.fabric().write(*journal_, 0, message);
  }
  Result<void> write(ClientId to, const CheckpointMessage& message) override {
    const auto own = standbys_.find(to);
    if (own == standbys_.end()) return fail(ErrorCode::kInvalidArgument, "a standby that is not open");
    return member_.fabric().write(own->second, 0, message);
  }
  Result<void> follow(ClientId standby) override {
    following_ =
        Following{member_.reader<JournalMessage>(kJournalDepth),
                  member_.reader<CheckpointMessage>(1024, {client_partition(member_.session(), standby)}),
                  member_.writer<StandbyMessage>()};
    return {};
  }
  void unfollow() override {
    if (!following_) return;
    member_.fabric().close_reader(following_->journal);
    member_.fabric().close_reader(following_->checkpoints);
    member_.fabric().close_writer(following_->progress);
    following_.reset();
  }
  void take(std::vector<Received<JournalMessage>>& out) override {
    if (following_) member_.take(following_->journal, Limits{}, out);
  }
  void take(std::vector<Received<CheckpointMessage>>& out) override {
    if (following_) member_.take(following_->checkpoints, Limits{}, out);
  }
  Result<void> write(const StandbyMessage& message) override {
    if (!following_) return fail(ErrorCode::kOutOfOrder, "this server does not stand by");
    return member_.fabric().write(following_->progress, message.standby, message);
  }

 private:
  struct Client {
    Fabric::Index snapshot = 0, reply = 0;
  };
  struct Following {
    Fabric::Index journal = 0, checkpoints = 0, progress = 0;
  };
  void open_stream() {
    const auto stream = static_cast<std::uint32_t>(streams_.size());
    streams_.push_back(
        member_.writer<DeltaMessage>(delta_depth_, stream_partition(member_.session(), stream)));
  }
  static tl::unexpected<Error> not_open() {
    return fail(ErrorCode::kInvalidArgument, "a stream that is not open");
  }

  Member member_;
  std::uint32_t delta_depth_;
  Fabric::Index session_, scheduled_, reply_, status_;
  Fabric::Index others_, input_, ack_, standby_, command_;
  std::vector<Fabric::Index> streams_;  // their delta writers
  std::map<ClientId, Client> clients_;
  std::optional<Fabric::Index> journal_;
  std::map<ClientId, Fabric::Index> standbys_;  // their writers of checkpoints
  std::optional<Following> following_;
  SessionBook book_;
};

class SimulatedClientPort final : public ClientPort {
 public:
  SimulatedClientPort(std::shared_ptr<Fabric> fabric, const std::string& session, std::uint32_t delta_depth)
      : member_(std::move(fabric), session),
        delta_depth_(delta_depth),
        ack_(member_.writer<AckMessage>()),
        input_(member_.writer<InputMessage>(kInputDepth)),
        status_(member_.writer<ClientStatusMessage>()),
        sessions_(member_.reader<SessionMessage>(kSessionReaderDepth)),
        server_status_(member_.reader<ServerStatusMessage>(8)) {}

  [[nodiscard]] ParticipantId self() const override { return member_.id(); }
  void take_sessions(std::vector<Received<SessionMessage>>& out) override {
    member_.refresh(sessions_, book_);
    book_.take_current(out);
  }
  void pass_over_session(PassOver until) override { book_.pass_over_current(until); }
  [[nodiscard]] bool hears_all_servers() const override { return true; }
  [[nodiscard]] bool server_alive() override {
    member_.refresh(sessions_, book_);
    return common_ ? book_.epoch_live(common_->epoch) : book_.any_live();
  }
  Result<void> open_stream(const SessionMessage& session, const StreamMessage& stream,
                           ClientId client) override {
    if (common_ && common_->epoch != session.epoch) close_streams();
    if (!common_)
      common_ =
          Common{session.epoch, member_.reader<ScheduledInputMessage>(kScheduledDepth),
                 member_.reader<ReplyMessage>(1, {{}, client_partition(member_.session(), client)}), client};
    const auto [open, is_new] = streams_.try_emplace(stream.id.id);
    if (is_new) open->second.deltas = member_.reader<DeltaMessage>(delta_depth_, partitions(stream.id.id));
    open->second.limits = Limits{stream.max_delta_bytes, stream.max_snapshot_bytes};
    return {};
  }
  void close_stream(std::uint32_t stream) override {
    close_snapshots(stream);
    if (const auto open = streams_.find(stream); open != streams_.end()) {
      member_.fabric().close_reader(open->second.deltas);
      streams_.erase(open);
    }
  }
  void close_streams() override {
    while (!streams_.empty()) close_stream(streams_.begin()->first);
    if (!common_) return;
    member_.fabric().close_reader(common_->scheduled);
    member_.fabric().close_reader(common_->reply);
    common_.reset();
  }
  Result<void> open_snapshots(std::uint32_t stream) override {
    const auto open = streams_.find(stream);
    if (open == streams_.end()) return fail(ErrorCode::kOutOfOrder, "that stream is not open");
    if (!open->second.snapshots)
      open->second.snapshots = member_.reader<SnapshotMessage>(
          kSnapshotReaderDepth, {client_partition(member_.session(), common_->client)});
    return {};
  }
  void close_snapshots(std::uint32_t stream) override {
    const auto open = streams_.find(stream);
    if (open == streams_.end() || !open->second.snapshots) return;
    member_.fabric().close_reader(*open->second.snapshots);
    open->second.snapshots.reset();
  }
  void take(std::vector<Received<DeltaMessage>>& out) override {
    for (const auto& [id, stream] : streams_) member_.take(stream.deltas, stream.limits, out);
  }
  void take(std::vector<Received<ScheduledInputMessage>>& out) override {
    if (common_) member_.take(common_->scheduled, Limits{}, out);
  }
  void take(std::vector<Received<SnapshotMessage>>& out) override {
    for (const auto& [id, stream] : streams_) {
      if (stream.snapshots) member_.take(*stream.snapshots, stream.limits, out);
    }
  }
  void take(std::vector<Received<ReplyMessage>>& out) override {
    if (common_) member_.take(common_->reply, Limits{}, out);
  }
  void take(std::vector<Received<ServerStatusMessage>>& out) override {
    member_.take(server_status_, Limits{}, out);
  }
  Result<void> write(const AckMessage& message) override {
    return member_.fabric().write(ack_, message.client, message);
  }
  Result<void> write(const InputMessage& message) override {
    return member_.fabric().write(input_, message.client, message);
  }
  Result<void> write(const ClientStatusMessage& message) override {
    return member_.fabric().write(status_, message.client, message);
  }
  [[nodiscard]] std::uint64_t dropped() const override { return member_.dropped(); }
  void wait(std::chrono::nanoseconds /*timeout*/) override {}

 private:
  struct Stream {
    Fabric::Index deltas = 0;
    std::optional<Fabric::Index> snapshots;
    Limits limits;
  };
  /// The endpoints that all streams of an epoch share.
  struct Common {
    Epoch epoch = 0;
    Fabric::Index scheduled = 0, reply = 0;
    ClientId client = 0;
  };
  [[nodiscard]] std::vector<std::string> partitions(std::uint32_t stream) const {
    return {stream_partition(member_.session(), stream)};
  }

  Member member_;
  std::uint32_t delta_depth_;
  Fabric::Index ack_, input_, status_, sessions_, server_status_;
  std::map<std::uint32_t, Stream> streams_;  // by id
  std::optional<Common> common_;             // set when a stream was opened
  SessionBook book_;
};

class SimulatedCommandPort final : public CommandPort {
 public:
  SimulatedCommandPort(std::shared_ptr<Fabric> fabric, const std::string& session)
      : member_(std::move(fabric), session), command_(member_.writer<CommandMessage>()) {}
  Result<void> write(const CommandMessage& message) override {
    return member_.fabric().write(command_, 0, message);
  }

 private:
  Member member_;
  Fabric::Index command_;
};

}  // namespace

Network::Network(const NetworkOptions& options) : fabric_(std::make_shared<Fabric>(options)) {}
std::int64_t Network::now_ns() const { return fabric_->now_ns(); }
void Network::advance_to(std::int64_t now_ns) { fabric_->advance_to(now_ns); }
std::optional<std::int64_t> Network::next_event_ns() const { return fabric_->next_event_ns(); }

Result<std::unique_ptr<ServerPort>> Network::make_server(const std::string& session,
                                                         std::uint32_t delta_depth) {
  if (auto named = check_session_name(session); !named) return tl::unexpected(named.error());
  return std::make_unique<SimulatedServerPort>(fabric_, session, delta_depth);
}

Result<std::unique_ptr<ClientPort>> Network::make_client(const std::string& session,
                                                         std::uint32_t delta_depth) {
  if (auto named = check_session_name(session); !named) return tl::unexpected(named.error());
  return std::make_unique<SimulatedClientPort>(fabric_, session, delta_depth);
}

Result<std::unique_ptr<CommandPort>> Network::make_commander(const std::string& session) {
  if (auto named = check_session_name(session); !named) return tl::unexpected(named.error());
  return std::make_unique<SimulatedCommandPort>(fabric_, session);
}

void Network::set_link(const ParticipantId& from, const ParticipantId& to, const LinkModel& link) {
  fabric_->set_link(from, to, link);
}
void Network::set_all_links(const LinkModel& link) { fabric_->set_all_links(link); }
void Network::set_cut(const ParticipantId& a, const ParticipantId& b, bool cut) {
  fabric_->set_cut(a, b, cut);
  fabric_->set_cut(b, a, cut);
}
void Network::set_cut_one_way(const ParticipantId& from, const ParticipantId& to, bool cut) {
  fabric_->set_cut(from, to, cut);
}
void Network::set_frozen(const ParticipantId& participant, bool frozen) {
  fabric_->set_frozen(participant, frozen);
}
void Network::kill(const ParticipantId& participant) { fabric_->kill(participant); }
const NetworkCounts& Network::counts() const { return fabric_->counts(); }
std::uint64_t Network::delivered_to(const ParticipantId& participant) const {
  return fabric_->delivered_to(participant);
}

}  // namespace tandem::transport::simulated
