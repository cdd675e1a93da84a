// Writes a recording of fixed messages: write_capture FILE none|zstd. mcap_test.py knows what they say.

#include <cstdio>
#include <memory>
#include <string_view>

#include "services/follow/recording/mcap_writer.hpp"

namespace {

using namespace tandem::transport;
using tandem::recording::Compression;

constexpr tandem::Epoch kEpoch = 1'700'000'000'123;

SessionMessage session() {
  SessionMessage message;
  message.epoch = kEpoch;
  message.capacity = 10;
  message.lattice_unit = 1.0 / 1024;
  message.session = "arena";
  message.types = {BodyType{"sand", 0.25F, 0xFF8800FF, Shape::kSphere},
                   BodyType{"box", 1.5F, 7, Shape::kBox, {1, 2, 3.5F}}};
  StreamMessage stream;
  stream.layout.codec = "entropy";
  stream.layout.codec_tables = Bytes(3, std::byte{0xAB});
  stream.layout.parameters.codec.threshold = 100;
  stream.layout.predictor_constants = {1, -2};
  stream.layout_hash = 0xFEDCBA9876543210;
  message.streams = {stream};
  return message;
}

DeltaMessage delta() {
  DeltaMessage message;
  message.epoch = kEpoch;
  message.stream = {2, 3};
  message.frame = 8;
  message.server_time_ns = 1'700'000'001'000'000'000;
  message.hash = 0x0123456789ABCDEF;
  message.payload = Bytes(5, std::byte{0x11});
  return message;
}

ScheduledInputMessage input() {
  ScheduledInputMessage message;
  message.number = 1;
  message.frame = 9;
  message.kind = static_cast<std::uint32_t>(ScheduledKind::kDrive);
  message.values = {0, -980, 0, 12};
  return message;
}

AckMessage acknowledgement() {
  AckMessage message;
  message.client = 77;
  message.clock_ns = -5;
  message.snapshot_parts = 4;
  message.missing = {1, 2};
  return message;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(argv[1], "wb"), std::fclose);
  if (!file) return 1;
  const auto sink = [&](std::span<const std::byte> bytes) -> tandem::Result<void> {
    if (std::fwrite(bytes.data(), 1, bytes.size(), file.get()) == bytes.size()) return {};
    return tandem::fail(tandem::ErrorCode::kIo, "not written");
  };
  tandem::recording::McapWriter writer(
      sink, std::string_view(argv[2]) == "zstd" ? Compression::kZstd : Compression::kNone);
  writer.add(session(), 10, 10);
  writer.add(delta(), 1'700'000'001'005'000'000, delta().server_time_ns);
  writer.add(input(), 30, 30);
  writer.add(acknowledgement(), 40, 40);
  return writer.finish() && std::fflush(file.get()) == 0 ? 0 : 1;
}
