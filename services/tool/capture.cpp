#include "services/tool/capture.hpp"

#include <array>
#include <bit>
#include <string_view>

#include "sdk/core/lattice/bytes.hpp"

namespace tandem::tool {
namespace {

constexpr std::string_view kMagic = "TNDMCAP1";
enum RecordType : std::uint32_t { kSession = 1, kSnapshot = 2, kScheduled = 3, kDelta = 4 };

// Appends little-endian fields to a growing buffer.
class Fields {
 public:
  explicit Fields(std::vector<std::byte>& out) : out_(out) { out_.clear(); }
  template <std::integral T>
  Fields& put(T value) {
    std::array<std::byte, sizeof(T)> bytes{};
    ByteWriter(bytes).put(value);
    out_.insert(out_.end(), bytes.begin(), bytes.end());
    return *this;
  }
  Fields& put(double value) { return put(std::bit_cast<std::uint64_t>(value)); }
  Fields& put(float value) { return put(std::bit_cast<std::uint32_t>(value)); }
  Fields& put_bytes(std::span<const std::byte> bytes) {
    put(static_cast<std::uint32_t>(bytes.size()));
    out_.insert(out_.end(), bytes.begin(), bytes.end());
    return *this;
  }
  Fields& put_text(std::string_view text) {
    return put_bytes(std::as_bytes(std::span(text.data(), text.size())));
  }

 private:
  std::vector<std::byte>& out_;
};

}  // namespace

Result<CaptureFile> CaptureFile::create(const std::string& path) {
  auto file = OutputFile::create(path);
  if (!file) return tl::unexpected<Error>(file.error());
  CaptureFile capture(std::move(*file));
  if (auto ok = capture.file_.write(std::as_bytes(std::span(kMagic.data(), kMagic.size()))); !ok) {
    return tl::unexpected<Error>(ok.error());
  }
  return capture;
}

void CaptureFile::write(std::uint32_t type) {
  if (failure_) return;
  std::array<std::byte, 8> header{};
  ByteWriter out(header);
  out.put(type);
  out.put(static_cast<std::uint32_t>(body_.size()));
  auto written = file_.write(header);
  if (written) written = file_.write(body_);
  if (!written) failure_ = written.error();
}

void CaptureFile::add(const transport::SessionMessage& s) {
  const transport::StreamMessage& stream = s.streams.front();
  const Layout& layout = stream.layout;
  const CodecParameters& first = layout.parameters.codec;
  Fields fields(body_);
  fields.put_text(s.session)
      .put(s.epoch)
      .put(s.protocol_version)
      .put(stream.layout_hash)
      .put(layout.capacity);
  fields.put(s.frame_rate_hz).put(s.lattice_unit).put(layout.lead).put(s.window_ceiling);
  fields.put(stream.max_delta_bytes).put(stream.max_snapshot_bytes).put_text(layout.codec);
  fields.put(first.threshold).put(first.position_step).put(first.velocity_step).put_text(layout.predictor);
  fields.put(stream.client_cost_ns).put_text(s.scene).put_text(s.scene_description);
  fields.put(static_cast<std::uint32_t>(layout.predictor_constants.size()));
  for (const std::int32_t value : layout.predictor_constants) fields.put(value);
  fields.put(static_cast<std::uint32_t>(s.types.size()));
  for (const auto& type : s.types) fields.put_text(type.name).put(type.radius).put(type.colour_rgba);
  fields.put_bytes(layout.codec_tables);
  write(kSession);
}

void CaptureFile::add(const transport::SnapshotMessage& snapshot) {
  Fields(body_).put(snapshot.epoch).put(snapshot.frame).put_bytes(snapshot.bytes);
  write(kSnapshot);
}

void CaptureFile::add(const transport::ScheduledInputMessage& input) {
  Fields fields(body_);
  fields.put(input.epoch)
      .put(input.number)
      .put(input.frame)
      .put(input.source_client)
      .put(input.source_number);
  fields.put(input.kind).put(static_cast<std::uint32_t>(input.values.size()));
  for (const std::int32_t value : input.values) fields.put(value);
  write(kScheduled);
}

void CaptureFile::add(Epoch epoch, const client::CompleteDelta& delta) {
  Fields fields(body_);
  fields.put(epoch).put(delta.frame).put(delta.last_input).put(delta.server_time_ns).put(delta.hash);
  fields.put_bytes(delta.payload);
  write(kDelta);
}

Result<void> CaptureFile::commit() {
  if (failure_) return tl::unexpected<Error>(*failure_);
  return file_.commit();
}

}  // namespace tandem::tool
