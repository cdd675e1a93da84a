#include "services/follow/recording/recorder.hpp"

#include <algorithm>
#include <span>
#include <string>
#include <utility>

#include "sdk/client/following/scheduled_inputs.hpp"
#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/units.hpp"
#include "services/follow/recording/mcap_reader.hpp"
#include "services/program/json/json.hpp"

namespace tandem::recording {

namespace {

constexpr const char* kEvents = "/events";
// https://docs.foxglove.dev/docs/visualization/message-schemas/log, without the descriptions.
constexpr std::string_view kLogSchema =
    R"({"title":"foxglove.Log","type":"object","properties":{
"timestamp":{"type":"object","title":"time","properties":{"sec":{"type":"integer"},"nsec":{"type":"integer"}}},
"level":{"type":"integer"},"message":{"type":"string"},"name":{"type":"string"},"file":{"type":"string"},"line":{"type":"integer"}}})";

std::string one_line(std::string_view text) {
  std::string line(text);
  std::ranges::replace_if(
      line, [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
  return line;
}

}  // namespace

Result<Recorder> Recorder::create(const std::string& path, Compression compression, Existing existing) {
  return OutputFile::create(path, existing).map([&](OutputFile&& file) {
    return Recorder(std::move(file), compression);
  });
}

Recorder::Recorder(OutputFile file, Compression compression)
    : file_(std::make_unique<OutputFile>(std::move(file))) {
  const auto sink = [to = file_.get()](std::span<const std::byte> bytes) { return to->write(bytes); };
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
  counted_.fixed_bytes = writer_->size_bytes();
  settle();
}

std::int64_t Recorder::stamp(client::Now now) {
  if (!offset_ns_) offset_ns_ = now.wall_ns - now.steady_ns;
  stamp_ns_ = std::max(stamp_ns_ + 1, now.steady_ns + *offset_ns_);
  return stamp_ns_;
}

template <class M>
void Recorder::write(const M& message, client::Now now, std::optional<std::int64_t> published_ns) {
  Share& share = counted_.topics[M::kTopic];
  ++share.messages;
  const std::int64_t stamp_ns = stamp(now);
  share.bytes += writer_->add(message, stamp_ns, published_ns.value_or(stamp_ns));
}

void Recorder::settle() {
  if (!good() || writer_->size_bytes() == settled_bytes_) return;  // a chunk is still open, or lost
  TANDEM_ASSERT(writer_->size_bytes() > settled_bytes_);
  settled_bytes_ = writer_->size_bytes();
  totals_ = counted_;
}

void Recorder::end_chunk() {
  writer_->end_chunk();
  settle();
}

template <class M>
void Recorder::add_plain(const M& message, client::Now now, std::optional<std::int64_t> published_ns) {
  write(message, now, published_ns);
  settle();
}

void Recorder::add(const transport::SessionMessage& session, client::Now now) {
  if (!session_ || session_->epoch != session.epoch) unpromised_.clear();
  session_ = session;
  stream_ = session.streams.front().id;
  add_plain(session, now);
}

void Recorder::add(const transport::SnapshotMessage& snapshot, client::Now now) {
  stream_ = snapshot.stream;
  start(snapshot, now);
}

// A chunk is closed with the message that reaches kChunkBytes, and a start holds a session, a snapshot and
// inputs: the reader takes all that a lawful stream can become.
static_assert(kMaxChunkBytes >= std::uint64_t{transport::kMaxSnapshotBytes} + transport::kMaxSampleBytes +
                                    client::ScheduledInputs::kKept * sizeof(double) *
                                        (transport::kMaxScheduledValues + 16) &&
              kMaxChunkBytes >= McapWriter::kChunkBytes + transport::kMaxDeltaBytes + 1024);

// All that a reader needs to begin here stands in one chunk.
void Recorder::start(const transport::SnapshotMessage& snapshot, client::Now now) {
  end_chunk();
  const std::uint64_t before = writer_->size_bytes();
  if (session_) write(*session_, now);
  write(snapshot, now);
  for (const auto& [number, input] : unpromised_) write(input, now);
  writer_->end_chunk();
  counted_.start_bytes += writer_->size_bytes() - before;
  started_ns_ = now.steady_ns;
  if (good()) named_ = file_->take_name();
  settle();
}

void Recorder::add(const transport::ScheduledInputMessage& input, client::Now now) {
  unpromised_.emplace(input.number, input);
  if (unpromised_.size() > client::ScheduledInputs::kKept) unpromised_.erase(unpromised_.begin());
  add_plain(input, now);
}

void Recorder::add(Epoch epoch, const client::CompleteDelta& delta, client::Now now) {
  write(client::to_message(delta, epoch, stream_), now, delta.server_time_ns);
  unpromised_.erase(unpromised_.begin(), unpromised_.upper_bound(delta.last_input));
  ++counted_.frames;
  counted_.payload_bytes += delta.payload.size();
  settle();
}

void Recorder::add(const transport::ReplyMessage& reply, client::Now now) {
  add_plain(reply, now, reply.server_time_ns);
}
void Recorder::add(const transport::ServerStatusMessage& status, client::Now now) { add_plain(status, now); }
void Recorder::add(const transport::AckMessage& ack, client::Now now) { add_plain(ack, now); }
void Recorder::add(const transport::InputMessage& input, client::Now now) { add_plain(input, now); }
void Recorder::add(const transport::ClientStatusMessage& status, client::Now now) { add_plain(status, now); }

void Recorder::add_event(std::string_view who, std::string_view what, client::Now now) {
  writer_->declare({.topic = kEvents,
                    .message_encoding = "json",
                    .schema_name = "foxglove.Log",
                    .schema_encoding = "jsonschema",
                    .schema = kLogSchema});
  const std::int64_t stamp_ns = stamp(now);
  const std::string text = Json({{"timestamp", {{"sec", stamp_ns / kSecond}, {"nsec", stamp_ns % kSecond}}},
                                 {"level", 2},
                                 {"name", one_line(who)},
                                 {"message", one_line(what)},
                                 {"file", ""},
                                 {"line", 0}})
                               .dump();
  Share& share = counted_.topics[kEvents];
  ++share.messages;
  share.bytes += text.size();
  writer_->add(kEvents, std::as_bytes(std::span(text)), stamp_ns, stamp_ns);
  settle();
}

bool Recorder::snapshot_due(std::int64_t steady_ns) const {
  return started_ns_ && steady_ns - *started_ns_ >= kSnapshotNs;
}

void Recorder::cut_snapshot(Frame frame, transport::Bytes snapshot, client::Now now) {
  TANDEM_ASSERT(session_);
  transport::SnapshotMessage message;
  message.epoch = session_->epoch;
  message.stream = stream_;
  message.frame = frame;
  message.total_bytes = static_cast<std::uint32_t>(snapshot.size());
  message.bytes = std::move(snapshot);
  end_chunk();
  ++counted_.snapshots_cut;
  start(message, now);
}

Result<void> Recorder::finish() {
  end_chunk();
  const std::uint64_t before = writer_->size_bytes();
  auto finished = writer_->finish();
  totals_.fixed_bytes += writer_->size_bytes() - before;
  totals_.file_bytes = file_->written_bytes();
  if (!file_->has_name()) totals_ = {};  // there will be no file
  // Done now, and not with this object: DDS ends before it, and may hang until the process is ended.
  file_->discard();
  if (!named_) return named_;
  if (!finished) return finished;
  return file_->close();
}

}  // namespace tandem::recording
