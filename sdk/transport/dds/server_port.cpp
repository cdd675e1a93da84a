#include <dds/ddsc/dds_statistics.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/transport/dds/announcements.hpp"

namespace tandem::transport {
namespace {

using namespace std::chrono_literals;

using dds::Node;
using dds::Reader;
using dds::Topic;
using dds::Writer;

/// Bytes that Cyclone DDS sent again for a writer, since its start. Its interface for this is provisional:
/// what it does not know is 0.
std::uint64_t repeated_bytes_of(dds_entity_t writer) {
  dds_statistics* const statistics = dds_create_statistics(writer);
  const dds_stat_keyvalue* const repeated = dds_lookup_statistic(statistics, "rexmit_bytes");
  const bool known = repeated != nullptr && repeated->kind == DDS_STAT_KIND_UINT64;
  const std::uint64_t bytes = known ? repeated->u.u64 : 0;
  dds_delete_statistics(statistics);
  return bytes;
}

/// The offers of frames that another one encodes say of these no more than that; complete_layouts() puts it
/// back.
SessionMessage without_repeats(SessionMessage session) {
  for (StreamMessage& stream : session.streams) {
    if (stream.carries == stream.id.id) continue;
    StreamMessage rest;
    rest.id = stream.id;
    rest.carries = stream.carries;
    rest.delay_ms = stream.delay_ms;
    rest.cap_kbit_s = stream.cap_kbit_s;
    rest.layout.groups.clear();
    rest.layout.codec.clear();
    rest.layout.predictor.clear();
    stream = std::move(rest);
  }
  return session;
}

class DdsServerPort final : public ServerPort {
 public:
  struct Endpoints {
    Node node;
    Writer<SessionMessage> session;
    Writer<ScheduledInputMessage> scheduled;
    Writer<ReplyMessage> reply;
    Writer<ServerStatusMessage> status;
    Writer<ServerStatusMessage> figures;  // the same for clients, more rarely
    dds::Announcements others;
    Reader<InputMessage> input;
    Reader<AckMessage> ack;
    Reader<StandbyMessage> standby;
    Reader<CommandMessage> command;
  };

  DdsServerPort(Endpoints endpoints, const DdsOptions& options)
      : endpoints_(std::move(endpoints)),
        session_(options.session),
        secure_(!options.secure.empty()),
        delta_depth_(static_cast<std::int32_t>(options.delta_depth)),
        repeated_bytes_(options.repeated_bytes) {}

  // One after the other, the writers of a server whose clients cannot answer would take a second each.
  ~DdsServerPort() override {
    dds::WriterEnds ends;
    for (auto& stream : streams_) ends.add(stream);
    for (auto& [id, client] : clients_) ends.add(client.snapshot), ends.add(client.reply);
    for (auto& [id, standby] : standbys_) ends.add(standby);
    if (journal_) ends.add(*journal_);
    if (former_progress_) ends.add(*former_progress_);
    ends.add(endpoints_.session), ends.add(endpoints_.scheduled);
    ends.add(endpoints_.reply), ends.add(endpoints_.status), ends.add(endpoints_.figures);
    ends.run();
  }
  DdsServerPort(const DdsServerPort&) = delete;
  DdsServerPort& operator=(const DdsServerPort&) = delete;

  [[nodiscard]] ParticipantId self() const override { return endpoints_.node.self(); }

  void take_sessions(std::vector<Received<SessionMessage>>& out) override {
    endpoints_.others.refresh(session_, dropped_, [this](const ParticipantId& server) {
      return following_ ? following_->journal.shows_life(server) : std::nullopt;
    });
    endpoints_.others.book().list_live(out);
    dds::CallOut& call_out = endpoints_.node.call_out();
    const std::int64_t now_ns = steady_ns();
    if (call_out.began_lately(now_ns) || (following_ && out.empty())) call_out.again(now_ns);
  }

  [[nodiscard]] bool vouches_for_servers() const override { return secure_; }
  Result<void> open_streams(std::uint32_t count) override {
    if (count == 0 || count > kMaxStreams) return fail(ErrorCode::kInvalidArgument, "1 to 8 streams");
    while (streams_.size() < count) {
      const auto stream = static_cast<std::uint32_t>(streams_.size());
      // The writers of stream 0 share the node's publisher.
      const std::string partition = stream == 0 ? std::string() : stream_partition(session_, stream);
      auto delta = endpoints_.node.writer<DeltaMessage>("deltas", delta_depth_, partition);
      if (!delta) return tl::unexpected(delta.error());
      streams_.push_back(std::move(*delta));
    }
    return {};
  }

  Result<void> write(const SessionMessage& message) override {
    carried_.clear();
    for (const StreamMessage& stream : message.streams)
      if (stream.carries != stream.id.id) carried_.push_back(stream.id.id);
    return endpoints_.session.write(without_repeats(message));
  }
  Result<void> write(const DeltaMessage& message) override {
    if (message.stream.id >= streams_.size()) return not_open();
    if (repeated_bytes_ != nullptr) count_repeats();
    return streams_[message.stream.id].write(message);
  }
  Result<void> write(const ScheduledInputMessage& message) override {
    return endpoints_.scheduled.write(message);
  }
  Result<void> write(ClientId to, const SnapshotMessage& message) override {
    const auto own = clients_.find(to);
    if (own == clients_.end()) return fail(ErrorCode::kInvalidArgument, "a client that is not open");
    return own->second.snapshot.write(message);
  }
  Result<void> write(const ReplyMessage& message) override {
    const auto own = clients_.find(message.client);
    if (own != clients_.end()) return own->second.reply.write(message);
    if (asked_for_.contains(message.client)) {  // its writers could not be made before
      if (auto opened = open_client(message.client); !opened) return opened;
      return write(message);
    }
    auto written = endpoints_.reply.write(message);
    if (written) remember_stranger(message.client);
    return written;
  }
  Result<void> write(const ServerStatusMessage& message) override {
    if (suits_clients(message))
      if (auto written = endpoints_.figures.write(message); !written) return written;
    return endpoints_.status.write(message);
  }
  [[nodiscard]] double observer_bytes_per_s(double messages, double bytes) const override {
    return DdsWire::of_observer(messages, bytes);
  }
  void show_life() override {
    for (auto& stream : streams_) stream.show_life();
    if (journal_) journal_->show_life();
  }

  Result<void> open_client(ClientId client) override {
    if (clients_.contains(client)) return {};
    asked_for_.insert(client);
    const std::string partition = client_partition(session_, client);
    auto snapshot = endpoints_.node.writer<SnapshotMessage>(
        "snapshots", Topic<SnapshotMessage>::kQos.writer_depth, partition);
    if (!snapshot) return tl::unexpected(snapshot.error());
    auto reply =
        endpoints_.node.writer<ReplyMessage>("replies", Topic<ReplyMessage>::kQos.writer_depth, partition);
    if (!reply) return tl::unexpected(reply.error());
    {
      const std::scoped_lock lock(clients_mutex_);
      clients_.emplace(client, Client{std::move(*snapshot), std::move(*reply)});
    }
    forget_stranger(client);  // otherwise the earlier answer could be taken as a new one
    return {};
  }
  void close_client(ClientId client) override {
    asked_for_.erase(client);
    const std::scoped_lock lock(clients_mutex_);
    clients_.erase(client);
  }

  void take(std::vector<Received<InputMessage>>& out) override { endpoints_.input.take(dropped_, out); }
  void take(std::vector<Received<AckMessage>>& out) override { endpoints_.ack.take(dropped_, out); }

  [[nodiscard]] bool joined(const ParticipantId& participant, ClientId client,
                            std::uint32_t stream) override {
    return stream < streams_.size() && reads(streams_[stream].get(), participant) &&
           reads(endpoints_.scheduled.get(), participant) && reads_snapshots(participant, client);
  }
  [[nodiscard]] bool alive(const ParticipantId& participant) override {
    return endpoints_.ack.alive(participant) || endpoints_.input.alive(participant);
  }
  [[nodiscard]] bool acts(const ParticipantId& participant) override {
    return endpoints_.input.state_of(participant) != WriterState::kGone;
  }
  [[nodiscard]] bool ended(const ParticipantId& participant) override {
    return endpoints_.ack.state_of(participant) == WriterState::kGone &&
           endpoints_.input.state_of(participant) == WriterState::kGone;
  }
  [[nodiscard]] std::uint64_t dropped() const override { return dropped_.load(); }
  void wait(std::chrono::nanoseconds timeout) override { endpoints_.node.wait(timeout); }
  void wake() override { endpoints_.node.wake(); }

  void take(std::vector<Received<StandbyMessage>>& out) override { endpoints_.standby.take(dropped_, out); }
  void take(std::vector<Received<CommandMessage>>& out) override { endpoints_.command.take(dropped_, out); }
  Result<void> open_standby(ClientId standby) override {
    if (standbys_.contains(standby)) return {};
    auto checkpoints = endpoints_.node.writer<CheckpointMessage>(
        "checkpoints", Topic<CheckpointMessage>::kQos.writer_depth, client_partition(session_, standby));
    if (!checkpoints) return tl::unexpected(checkpoints.error());
    auto journal = journal_ ? Result<Writer<JournalMessage>>(fail(ErrorCode::kConflict, ""))
                            : endpoints_.node.writer<JournalMessage>("journal");
    if (!journal_ && !journal) return tl::unexpected(journal.error());
    const std::scoped_lock lock(clients_mutex_);
    if (!journal_) journal_.emplace(std::move(*journal));
    standbys_.emplace(standby, std::move(*checkpoints));
    return {};
  }
  void close_standby(ClientId standby) override {
    const std::scoped_lock lock(clients_mutex_);
    standbys_.erase(standby);
  }
  [[nodiscard]] bool follows(const ParticipantId& participant, ClientId standby) override {
    const std::scoped_lock lock(clients_mutex_);
    const auto own = standbys_.find(standby);
    TANDEM_ASSERT(own == standbys_.end() || journal_);
    return own != standbys_.end() && reads(own->second.get(), participant) &&
           reads(journal_->get(), participant);
  }
  Result<void> write(const JournalMessage& message) override {
    if (!journal_) return fail(ErrorCode::kInvalidArgument, "nobody stands by");
    return journal_->write(message);
  }
  Result<void> write(ClientId to, const CheckpointMessage& message) override {
    const auto own = standbys_.find(to);
    if (own == standbys_.end()) return fail(ErrorCode::kInvalidArgument, "a standby that is not open");
    return own->second.write(message);
  }

  Result<void> follow(ClientId standby) override {
    auto journal = endpoints_.node.reader<JournalMessage>("journal");
    if (!journal) return tl::unexpected(journal.error());
    auto checkpoints = endpoints_.node.reader<CheckpointMessage>(
        "checkpoints", {.partitions = {client_partition(session_, standby)}});
    if (!checkpoints) return tl::unexpected(checkpoints.error());
    auto progress = endpoints_.node.writer<StandbyMessage>("standby");
    if (!progress) return tl::unexpected(progress.error());
    following_.emplace(Following{std::move(*journal), std::move(*checkpoints), std::move(*progress)});
    return {};
  }
  void unfollow() override {
    if (!following_) return;
    // Deleting a writer would wait for acknowledgements of the server that is gone.
    former_progress_.emplace(std::move(following_->progress));
    following_.reset();
  }
  void take(std::vector<Received<JournalMessage>>& out) override {
    if (following_) following_->journal.take(dropped_, out);
  }
  void take(std::vector<Received<CheckpointMessage>>& out) override {
    if (following_) following_->checkpoints.take(dropped_, out);
  }
  Result<void> write(const StandbyMessage& message) override {
    if (!following_) return fail(ErrorCode::kOutOfOrder, "this server does not stand by");
    return following_->progress.write(message);
  }

 private:
  struct Following {
    Reader<JournalMessage> journal;
    Reader<CheckpointMessage> checkpoints;
    Writer<StandbyMessage> progress;
  };
  struct Client {
    Writer<SnapshotMessage> snapshot;
    Writer<ReplyMessage> reply;
  };

  void count_repeats() {
    const auto now = std::chrono::steady_clock::now();
    if (now < next_count_) return;
    next_count_ = now + std::chrono::seconds(1);
    std::uint64_t repeated = 0;
    for (const auto& writer : streams_) repeated += repeated_bytes_of(writer.get());
    repeated_bytes_->fetch_add(repeated - counted_repeats_, std::memory_order_relaxed);
    counted_repeats_ = repeated;
  }

  // Whether clients are told, too: for some seconds after somebody new can hear it, and then what has
  // changed.
  bool suits_clients(const ServerStatusMessage& status) {
    const auto now = std::chrono::steady_clock::now();
    dds_publication_matched_status_t matched{};
    if (dds_get_publication_matched_status(endpoints_.figures.get(), &matched) == DDS_RETCODE_OK &&
        matched.total_count_change > 0)
      newcomers_until_ = now + kForNewcomers;
    if (status.stream >= told_.size()) told_.resize(std::size_t{status.stream} + 1);
    Told& told = told_[status.stream];
    const auto passed = now - told.at;
    const double change = std::abs(status.mbit_per_s - told.mbit_per_s);
    // What an offer of another one's frames takes changes with that one.
    const bool changed =
        std::ranges::find(carried_, status.stream) == carried_.end() &&
        change > std::max(kLeastChange, kChange * std::max(status.mbit_per_s, told.mbit_per_s));
    if (now >= newcomers_until_ && passed < (changed ? kChangedFigures : kSameFigures)) return false;
    told = {.at = now, .mbit_per_s = status.mbit_per_s};
    return true;
  }

  static tl::unexpected<Error> not_open() {
    return fail(ErrorCode::kInvalidArgument, "a stream that is not open");
  }

  bool reads_snapshots(const ParticipantId& participant, ClientId client) {
    const std::scoped_lock lock(clients_mutex_);
    const auto own = clients_.find(client);
    return own != clients_.end() && reads(own->second.snapshot.get(), participant);
  }

  static bool reads(dds_entity_t writer, const ParticipantId& participant) {
    std::vector<dds_instance_handle_t> readers(64);
    for (;;) {
      const dds_return_t matched = dds_get_matched_subscriptions(writer, readers.data(), readers.size());
      if (matched < 0) return false;
      const auto count = static_cast<std::size_t>(matched);
      const bool complete = count <= readers.size();
      readers.resize(count);
      if (complete) break;
    }
    return std::ranges::any_of(readers, [&](dds_instance_handle_t reader) {
      const dds::Endpoint endpoint(dds_get_matched_subscription_data(writer, reader));
      return endpoint && dds::to_participant_id(endpoint->participant_key) == participant;
    });
  }
  // The writer that all clients read keeps the last answer to each stranger for late readers. It keeps only
  // the latest few, so that strangers cannot fill memory.
  void remember_stranger(ClientId client) {
    if (std::ranges::find(strangers_, client) != strangers_.end()) return;
    strangers_.push_back(client);
    if (strangers_.size() > kMaxStrangers) forget_stranger(strangers_.front());
  }
  void forget_stranger(ClientId client) {
    if (std::erase(strangers_, client) == 0) return;
    tandem_TandemReply key{};
    key.client = client;
    static_cast<void>(dds_dispose(endpoints_.reply.get(), &key));
  }

  // Clients are told of a stream's figures that differ by so much, and of others, at least so long after the
  // last time; monitors each second.
  static constexpr double kChange = 0.3, kLeastChange = 0.001;  // the second in Mbit/s
  static constexpr std::chrono::nanoseconds kChangedFigures = 8s, kSameFigures = 20s, kForNewcomers = 3s;
  struct Told {
    std::chrono::steady_clock::time_point at{};
    double mbit_per_s = 0;
  };

  static constexpr std::size_t kMaxStrangers = 64;

  Endpoints endpoints_;
  std::string session_;
  bool secure_;
  std::int32_t delta_depth_;
  std::vector<Writer<DeltaMessage>> streams_;
  // Only the writing thread changes these, so it reads without the lock.
  std::map<ClientId, Client> clients_;
  std::optional<Writer<JournalMessage>> journal_;
  std::map<ClientId, Writer<CheckpointMessage>> standbys_;
  std::mutex clients_mutex_;
  std::set<ClientId> asked_for_;    // used by the writing thread: clients whose writers exist or are tried
                                    // again
  std::deque<ClientId> strangers_;  // used by the writing thread
  std::vector<Told> told_;          // by stream; used by the writing thread
  std::vector<std::uint32_t> carried_;  // ids of the offers of frames that another one encodes
  std::chrono::steady_clock::time_point newcomers_until_{};
  std::optional<Following> following_;
  std::optional<Writer<StandbyMessage>> former_progress_;
  std::atomic<std::uint64_t> dropped_ = 0;
  std::atomic<std::uint64_t>* repeated_bytes_;
  std::uint64_t counted_repeats_ = 0;                   // used by the writing thread
  std::chrono::steady_clock::time_point next_count_{};  // used by the writing thread
};

}  // namespace

Result<std::unique_ptr<ServerPort>> make_dds_server_port(const DdsOptions& options) {
  if (auto named = check_session_name(options.session); !named) return tl::unexpected(named.error());
  auto node = Node::create(options, "tandemd " + options.session, options.session, dds::Purpose::kServe,
                           dds::Repeat::kSoon);
  if (!node) return tl::unexpected(node.error());
  auto session = node->writer<SessionMessage>("session");
  auto scheduled = node->writer<ScheduledInputMessage>("scheduled inputs");
  auto reply = node->writer<ReplyMessage>("replies");
  auto status = node->writer<ServerStatusMessage>("server status");
  auto figures = node->writer<ServerStatusMessage>("figures", Topic<ServerStatusMessage>::kQos.writer_depth,
                                                   figures_partition(options.session));
  // Polled now and then, because the announcements of others must not wake the simulation.
  auto others = dds::Announcements::create(*node, {.ignore_own = true, .watched = false});
  auto input = node->reader<InputMessage>("inputs");
  auto ack = node->reader<AckMessage>("acknowledgements");
  auto standby = node->reader<StandbyMessage>("standbys");
  auto command = node->reader<CommandMessage>("commands");
  const Error* failed = nullptr;
  const auto check = [&failed](const auto& part) {
    if (!part && failed == nullptr) failed = &part.error();
  };
  check(session), check(scheduled), check(reply), check(status), check(figures);
  check(others), check(input), check(ack), check(standby), check(command);
  if (failed != nullptr) return tl::unexpected(*failed);
  auto port = std::make_unique<DdsServerPort>(
      DdsServerPort::Endpoints{std::move(*node), std::move(*session), std::move(*scheduled),
                               std::move(*reply), std::move(*status), std::move(*figures), std::move(*others),
                               std::move(*input), std::move(*ack), std::move(*standby), std::move(*command)},
      options);
  if (auto opened = port->open_streams(1); !opened) return tl::unexpected(opened.error());
  return port;
}

}  // namespace tandem::transport
