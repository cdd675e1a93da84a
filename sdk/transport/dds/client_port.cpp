#include <optional>
#include <utility>

#include "sdk/core/lattice/hash.hpp"
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
    Writer<InputMessage> input;
    Writer<ClientStatusMessage> status;
  };

  DdsClientPort(Endpoints endpoints, const DdsOptions& options)
      : endpoints_(std::move(endpoints)), options_(options) {}

  [[nodiscard]] ParticipantId self() const override { return endpoints_.node.self(); }

  void take_sessions(std::vector<Received<SessionMessage>>& out) override {
    refresh();
    endpoints_.servers.book().take_current(out);
  }
  void pass_over_session(PassOver until) override { endpoints_.servers.book().pass_over_current(until); }
  [[nodiscard]] bool server_alive() override {
    refresh();
    const SessionBook& book = endpoints_.servers.book();
    return epoch_ ? book.epoch_live(*epoch_) : book.any_live();
  }

  Result<void> open_stream(const SessionMessage& session, const StreamMessage& stream,
                           ClientId client) override {
    limits_ = Limits{stream.max_delta_bytes, stream.max_snapshot_bytes};
    if (stream_ && epoch_ == session.epoch) {
      stream_->delta.set_limits(limits_);
      if (snapshots_) snapshots_->set_limits(limits_);
      return {};
    }
    // New readers, because the old ones may already have been handed scheduled inputs of the new epoch, which
    // are sent once to each reader.
    stream_.reset();
    epoch_ = session.epoch;
    // As deep as the writer's, or what was repaired after a lost link would push itself out. It is memory
    // only while the application does not take it.
    const auto depth = static_cast<std::int32_t>(
        delta_depth(session.frame_rate_hz, session.window_ceiling, stream.max_delta_bytes));
    auto delta = endpoints_.node.reader<DeltaMessage>("deltas", {.depth = depth});
    if (!delta) return tl::unexpected(delta.error());
    auto scheduled = endpoints_.node.reader<ScheduledInputMessage>("scheduled inputs");
    if (!scheduled) return tl::unexpected(scheduled.error());
    auto reply = endpoints_.node.reader<ReplyMessage>(
        "replies", {.partitions = {options_.session, reply_partition(options_.session, client)}});
    if (!reply) return tl::unexpected(reply.error());
    delta->set_limits(limits_);
    stream_.emplace(Stream{std::move(*delta), std::move(*scheduled), std::move(*reply)});
    return {};
  }
  void close_stream() override {
    snapshots_.reset();
    stream_.reset();
    epoch_.reset();
  }
  Result<void> open_snapshots() override {
    if (snapshots_) return {};
    auto reader = endpoints_.node.reader<SnapshotMessage>("snapshots");
    if (!reader) return tl::unexpected(reader.error());
    reader->set_limits(limits_);
    snapshots_.emplace(std::move(*reader));
    return {};
  }
  void close_snapshots() override { snapshots_.reset(); }

  void take(std::vector<Received<DeltaMessage>>& out) override {
    if (stream_) stream_->delta.take(dropped_, out);
  }
  void take(std::vector<Received<ScheduledInputMessage>>& out) override {
    if (stream_) stream_->scheduled.take(dropped_, out);
  }
  void take(std::vector<Received<SnapshotMessage>>& out) override {
    if (snapshots_) snapshots_->take(dropped_, out);
  }
  void take(std::vector<Received<ReplyMessage>>& out) override {
    if (stream_) stream_->reply.take(dropped_, out);
  }
  [[nodiscard]] std::optional<Received<ServerStatusMessage>> take_status() override {
    return std::exchange(server_status_, std::nullopt);
  }

  Result<void> write(const AckMessage& message) override { return endpoints_.ack.write(message); }
  Result<void> write(const InputMessage& message) override { return endpoints_.input.write(message); }
  Result<void> write(const ClientStatusMessage& message) override { return endpoints_.status.write(message); }

  [[nodiscard]] std::uint64_t dropped() const override { return dropped_.load(); }
  void wait(std::chrono::nanoseconds timeout) override { endpoints_.node.wait(timeout); }
  void wake() override { endpoints_.node.wake(); }

 private:
  struct Stream {
    Reader<DeltaMessage> delta;
    Reader<ScheduledInputMessage> scheduled;
    Reader<ReplyMessage> reply;
  };

  void refresh() {
    endpoints_.servers.refresh(options_.session, dropped_, [this](const ParticipantId& server) {
      return stream_ && (stream_->delta.alive(server) || stream_->reply.alive(server));
    });
    auto& statuses = endpoints_.servers.statuses();
    if (!statuses.empty()) server_status_ = std::move(statuses.back());
    statuses.clear();
  }

  Endpoints endpoints_;
  DdsOptions options_;
  std::optional<Stream> stream_;
  std::optional<Reader<SnapshotMessage>> snapshots_;
  std::optional<Received<ServerStatusMessage>> server_status_;
  std::optional<Epoch> epoch_;  // of the open stream
  Limits limits_;               // of the open stream
  std::atomic<std::uint64_t> dropped_ = 0;
};

}  // namespace

Result<std::unique_ptr<ClientPort>> make_dds_client_port(const DdsOptions& options) {
  if (auto named = check_session_name(options.session); !named) return tl::unexpected(named.error());
  auto node = Node::create(options, "tandem client " + to_hex(options.client), options.session);
  if (!node) return tl::unexpected(node.error());
  auto ack = node->writer<AckMessage>("acknowledgements");
  if (!ack) return tl::unexpected(ack.error());
  auto input = node->writer<InputMessage>("inputs");
  if (!input) return tl::unexpected(input.error());
  auto status = node->writer<ClientStatusMessage>("client status");
  if (!status) return tl::unexpected(status.error());
  auto servers = dds::Announcements::create(*node);
  if (!servers) return tl::unexpected(servers.error());
  return std::make_unique<DdsClientPort>(
      DdsClientPort::Endpoints{std::move(*node), std::move(*servers), std::move(*ack), std::move(*input),
                               std::move(*status)},
      options);
}

}  // namespace tandem::transport
