#include "services/tool/capture.hpp"

#include <utility>

namespace tandem::tool {

Result<CaptureFile> CaptureFile::create(const std::string& path) {
  auto file = OutputFile::create(path);
  if (!file) return tl::unexpected<Error>(file.error());
  return CaptureFile(std::move(*file));
}

CaptureFile::CaptureFile(OutputFile file)
    : file_(std::make_unique<OutputFile>(std::move(file))),
      writer_([to = file_.get()](std::span<const std::byte> bytes) { return to->write(bytes); }) {}

void CaptureFile::add(const transport::SessionMessage& session, std::int64_t wall_ns) {
  writer_.add(session, wall_ns, wall_ns);
}

void CaptureFile::add(const transport::SnapshotMessage& snapshot, std::int64_t wall_ns) {
  stream_ = snapshot.stream;
  writer_.add(snapshot, wall_ns, wall_ns);
}

void CaptureFile::add(const transport::ScheduledInputMessage& input, std::int64_t wall_ns) {
  writer_.add(input, wall_ns, wall_ns);
}

void CaptureFile::add(Epoch epoch, const client::CompleteDelta& delta, std::int64_t wall_ns) {
  transport::DeltaMessage message;
  message.epoch = epoch;
  message.stream = stream_;
  message.frame = delta.frame;
  message.last_input = delta.last_input;
  message.server_time_ns = delta.server_time_ns;
  message.hash = delta.hash;
  message.payload = delta.payload;
  writer_.add(message, wall_ns, delta.server_time_ns);
}

Result<void> CaptureFile::commit() {
  if (auto finished = writer_.finish(); !finished) return finished;
  return file_->commit();
}

}  // namespace tandem::tool
