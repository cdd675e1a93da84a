#include "services/recording/recorder.hpp"

#include <cerrno>
#include <cstring>
#include <utility>

#include "sdk/client/scheduled_inputs.hpp"

namespace tandem::recording {

Result<Recorder> Recorder::create(const std::string& path, Compression compression) {
  File file(std::fopen(path.c_str(), "wb"));
  if (!file) return fail(ErrorCode::kIo, path + ": cannot create: " + std::strerror(errno));
  std::setvbuf(file.get(), nullptr, _IONBF, 0);  // a chunk is whole on the disk as soon as it is written
  return Recorder(path, std::move(file), compression);
}

Recorder::Recorder(std::string path, File file, Compression compression)
    : path_(std::move(path)), file_(std::move(file)) {
  const auto sink = [name = path_, to = file_.get()](std::span<const std::byte> bytes) -> Result<void> {
    if (std::fwrite(bytes.data(), 1, bytes.size(), to) == bytes.size()) return {};
    return fail(ErrorCode::kIo, name + ": cannot write: " + std::strerror(errno));
  };
  writer_ = std::make_unique<McapWriter>(sink, compression);
  writer_->declare<transport::SessionMessage>();
  writer_->declare<transport::SnapshotMessage>();
  writer_->declare<transport::ScheduledInputMessage>();
  writer_->declare<transport::DeltaMessage>();
  writer_->declare<transport::ReplyMessage>();
  writer_->declare<transport::ServerStatusMessage>();
  writer_->declare<transport::AckMessage>();
  writer_->declare<transport::InputMessage>();
  writer_->declare<transport::ClientStatusMessage>();
  writer_->end_chunk();
  totals_.fixed_bytes = writer_->size_bytes();
}

template <class M>
void Recorder::write(const M& message, std::int64_t wall_ns, std::int64_t publish_ns) {
  Share& share = totals_.topics[M::kTopic];
  ++share.messages;
  share.bytes += writer_->add(message, wall_ns, publish_ns);
}

void Recorder::add(const transport::SessionMessage& session, std::int64_t wall_ns) {
  if (!session_ || session_->epoch != session.epoch) unpromised_.clear();
  session_ = session;
  write(session, wall_ns, wall_ns);
}

void Recorder::add(const transport::SnapshotMessage& snapshot, std::int64_t wall_ns) {
  stream_ = snapshot.stream;
  start(snapshot, wall_ns);
}

// All that a reader needs to begin here stands in one chunk.
void Recorder::start(const transport::SnapshotMessage& snapshot, std::int64_t wall_ns) {
  writer_->end_chunk();
  const std::uint64_t before = writer_->size_bytes();
  if (session_) write(*session_, wall_ns, wall_ns);
  write(snapshot, wall_ns, wall_ns);
  for (const auto& [number, input] : unpromised_) write(input, wall_ns, wall_ns);
  writer_->end_chunk();
  totals_.start_bytes += writer_->size_bytes() - before;
  started_ns_ = wall_ns;
}

void Recorder::add(const transport::ScheduledInputMessage& input, std::int64_t wall_ns) {
  unpromised_.emplace(input.number, input);
  if (unpromised_.size() > client::ScheduledInputs::kKept) unpromised_.erase(unpromised_.begin());
  write(input, wall_ns, wall_ns);
}

void Recorder::add(Epoch epoch, const client::CompleteDelta& delta, std::int64_t wall_ns) {
  write(client::to_message(delta, epoch, stream_), wall_ns, delta.server_time_ns);
  unpromised_.erase(unpromised_.begin(), unpromised_.upper_bound(delta.last_input));
  ++totals_.frames;
  totals_.payload_bytes += delta.payload.size();
}

void Recorder::add(const transport::ReplyMessage& reply, std::int64_t wall_ns) {
  write(reply, wall_ns, reply.server_time_ns);
}
void Recorder::add(const transport::ServerStatusMessage& status, std::int64_t wall_ns) {
  write(status, wall_ns, wall_ns);
}
void Recorder::add(const transport::AckMessage& ack, std::int64_t wall_ns) { write(ack, wall_ns, wall_ns); }
void Recorder::add(const transport::InputMessage& input, std::int64_t wall_ns) {
  write(input, wall_ns, wall_ns);
}
void Recorder::add(const transport::ClientStatusMessage& status, std::int64_t wall_ns) {
  write(status, wall_ns, wall_ns);
}

bool Recorder::snapshot_due(std::int64_t wall_ns) const {
  return started_ns_ && wall_ns - *started_ns_ >= kSnapshotNs;
}

void Recorder::cut_snapshot(const ClientTimeline& timeline, std::int64_t wall_ns) {
  timeline.snapshot(snapshot_);
  transport::SnapshotMessage message;
  message.epoch = session_->epoch;
  message.stream = stream_;
  message.frame = timeline.applied();
  message.total_bytes = static_cast<std::uint32_t>(snapshot_.size());
  message.bytes = snapshot_;
  start(message, wall_ns);
  ++totals_.snapshots_cut;
}

Result<void> Recorder::finish() {
  writer_->end_chunk();
  const std::uint64_t before = writer_->size_bytes();
  auto finished = writer_->finish();
  totals_.file_bytes = writer_->size_bytes();
  totals_.fixed_bytes += totals_.file_bytes - before;
  if (!finished) return finished;
  if (std::fclose(file_.release()) != 0)
    return fail(ErrorCode::kIo, path_ + ": cannot write: " + std::strerror(errno));
  return {};
}

}  // namespace tandem::recording
