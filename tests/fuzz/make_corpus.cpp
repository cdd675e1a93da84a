// Writes the seed corpus: make_corpus FOLDER. Small states, so that a fuzzer runs fast.

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "sdk/core/timeline/timeline.hpp"
#include "sdk/wire/cdr.hpp"
#include "sdk/wire/port.hpp"
#include "services/follow/recording/mcap_writer.hpp"
#include "tests/property/synthetic.hpp"
#include "tests/unit/transport/random_messages.hpp"

namespace tandem {
namespace {

constexpr std::uint32_t kCapacity = 24;  // as in the fuzz targets
constexpr StreamParameters kParameters{{200, 16, 64}};

bool write_file(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream file(path, std::ios::binary);
  for (const std::byte byte : bytes) file.put(static_cast<char>(byte));
  return static_cast<bool>(file.flush());
}

// The state that fuzz_delta decodes onto, moved a little, much and not at all; with and without lifecycle.
bool write_deltas(const std::filesystem::path& folder) {
  const std::vector<synthetic::Coded> all = synthetic::all_coded();
  for (std::size_t which = 0; which < all.size(); ++which) {
    const auto& [codec, groups] = all[which];
    for (const std::uint64_t moved_one_in : {1U, 6U}) {
      for (const bool lively : {false, true}) {
        synthetic::Random random(1);
        State state = synthetic::random_state(random, kCapacity, 4, groups);
        State target = synthetic::random_target(random, state, moved_one_in);
        std::vector<LifecycleRecord> lifecycle;
        if (lively) lifecycle = synthetic::random_lifecycle(random, state, target, 4);
        DeltaCodec delta = synthetic::make_delta(
            codec, kCapacity, synthetic::with_turn_steps(kParameters, codec, groups), {}, groups);
        if (lively) {
          StreamParameters changed = delta.parameters();
          changed.codec = {100, 8, 32, 30000, 5000, changed.codec.turn_step / 2, changed.codec.spin_step / 3};
          changed.step.decay = 900;
          delta.set_parameters(changed);
        }
        if (lively) delta.round_next();
        std::vector<std::byte> bytes(1 + delta.bound());
        bytes[0] = static_cast<std::byte>(which);
        const auto encoded = delta.encode(state, target, lifecycle, kNoBudget, std::span(bytes).subspan(1));
        bytes.resize(1 + encoded.size_bytes);
        const std::string name = std::string(codec) + (groups.orientation ? "-turning-" : "-") +
                                 std::to_string(moved_one_in) + (lively ? "-lifecycle" : "");
        if (!write_file(folder / "delta" / name, bytes)) return false;
      }
    }
  }
  return true;
}

// A message of every topic, behind the byte that says which.
bool write_messages(const std::filesystem::path& folder) {
  transport::RandomMessages random(1);
  std::uint8_t topic = 0;
  const auto write = [&]<class M>(const M& message) {
    transport::Bytes bytes{std::byte{topic++}};
    transport::write_cdr(message, bytes);
    return write_file(folder / "cdr" / M::kTopic, bytes);
  };
  return write(random.make<transport::SessionMessage>()) && write(random.make<transport::DeltaMessage>()) &&
         write(random.make<transport::ScheduledInputMessage>()) &&
         write(random.make<transport::SnapshotMessage>()) && write(random.make<transport::ReplyMessage>()) &&
         write(random.make<transport::InputMessage>()) && write(random.make<transport::AckMessage>()) &&
         write(random.make<transport::ServerStatusMessage>()) &&
         write(random.make<transport::ClientStatusMessage>());
}

// Streams for fuzz_tracker: a few deltas in a row, with an edit of the coder's state between them.
bool write_streams(const std::filesystem::path& folder, const Groups& groups) {
  constexpr std::uint32_t kBodies = 12;  // as in fuzz_tracker
  for (const std::uint64_t moved_one_in : {2U, 6U}) {
    synthetic::Random random(1);
    State state = synthetic::random_state(random, kBodies, 4, groups);
    DeltaCodec delta = synthetic::make_delta("tracker", kBodies, kParameters, {}, groups);
    std::vector<std::byte> payload(delta.bound());
    std::vector<std::byte> stream;
    for (int frame = 0; frame < 4; ++frame) {
      State target = state;
      for (Slot slot = 0; slot < kBodies; ++slot) {
        if (state.alive()[slot] == 0 || !random.one_in(moved_one_in)) continue;
        BodyState body = state.body(slot);
        for (std::int32_t& p : body.p) p = std::clamp(p + random.even(500), -kPositionLimit, kPositionLimit);
        if (groups.orientation) body.q = turned(body.q, {random.even(1 << 26), random.even(1 << 26), 0});
        target.set_body(slot, body);
      }
      if (frame == 2) delta.set_parameters({{100, 16, 64, 30000, 5000}, {900}});
      if (frame == 3) delta.round_next();
      const auto size = delta.encode(state, target, {}, kNoBudget, payload).size_bytes;
      if (size >= 128) return false;
      stream.push_back(static_cast<std::byte>(size));
      stream.insert(stream.end(), payload.begin(), payload.begin() + static_cast<std::ptrdiff_t>(size));
      for (const int byte : {129, frame, 0, 7}) stream.push_back(static_cast<std::byte>(byte));
    }
    if (!write_file(
            folder / "tracker" /
                ((groups.orientation ? "turning-" : "moved-") + ("one-in-" + std::to_string(moved_one_in))),
            stream))
      return false;
  }
  return true;
}

bool write_snapshots(const std::filesystem::path& folder, const synthetic::Coded& coded,
                     const std::string& name) {
  Layout layout;
  layout.capacity = kCapacity;
  layout.type_count = synthetic::kTypes;
  layout.codec = coded.codec;
  if (coded.groups.orientation) {
    layout.groups = {kPositionGroup, kOrientationGroup};
    layout.radii = {synthetic::kRadii.begin(), synthetic::kRadii.end()};
  }
  layout.parameters = synthetic::with_turn_steps(kParameters, coded.codec, coded.groups);
  layout.predictor = "ballistic";
  for (const std::uint64_t dead_one_in : {0U, 1U, 3U}) {
    synthetic::Random random(2);
    auto server = ServerTimeline::create(layout, 1);
    if (!server) return false;
    server->start(10, synthetic::random_state(random, kCapacity, dead_one_in, groups_of(layout)),
                  Drive{{0, -640, 0}, 10});
    for (std::uint64_t number = 1; number <= dead_one_in; ++number) {
      if (!server->schedule({number, 11 + number, Drive{{1, 2, 3}, 4}})) return false;
    }
    std::vector<std::byte> bytes;
    server->snapshot(bytes);
    if (!write_file(folder / "snapshot" / (name + "dead-one-in-" + std::to_string(dead_one_in)), bytes))
      return false;
  }
  return true;
}

// A session of a few frames; of two files, one has no checksums, so that what is changed in its chunk is
// read.
bool write_recordings(const std::filesystem::path& folder) {
  transport::SessionMessage session;
  session.session = "fuzz";
  session.epoch = 1;
  session.capacity = kCapacity;
  session.lattice_unit = 0.001;
  session.types.resize(1);
  transport::StreamMessage stream;
  stream.max_delta_bytes = stream.max_snapshot_bytes = 10'000;
  stream.layout.codec = "quantized";
  stream.layout.parameters = kParameters;
  session.streams = {stream};
  transport::complete_layouts(session);
  session.streams[0].layout_hash = transport::layout_hash(session, session.streams[0]);
  for (const auto compression : {recording::Compression::kNone, recording::Compression::kZstd}) {
    auto server = ServerTimeline::create(session.streams[0].layout, 1);
    if (!server) return false;
    synthetic::Random random(3);
    server->start(0, synthetic::random_state(random, kCapacity, 0), Drive{{0, -640, 0}, 10});
    transport::Bytes file;
    recording::McapWriter writer(
        [&file](std::span<const std::byte> bytes) -> Result<void> {
          file.insert(file.end(), bytes.begin(), bytes.end());
          return {};
        },
        compression);
    // Readers take the types for granted: without the text a seed is a twentieth.
    for (const char* topic : {transport::SessionMessage::kTopic, transport::SnapshotMessage::kTopic,
                              transport::ScheduledInputMessage::kTopic, transport::DeltaMessage::kTopic}) {
      writer.declare({.topic = topic,
                      .message_encoding = "cdr",
                      .schema_name = topic,
                      .schema_encoding = "",
                      .schema = ""});
    }
    writer.add(session, 1, 1);
    transport::SnapshotMessage snapshot;
    snapshot.epoch = 1;
    server->snapshot(snapshot.bytes);
    snapshot.total_bytes = static_cast<std::uint32_t>(snapshot.bytes.size());
    writer.add(snapshot, 2, 2);
    const ScheduledDrive drive{.number = 1, .frame = 2, .drive = {{0, -64, 0}, 10}};
    if (!server->schedule(drive)) return false;
    writer.add(transport::ScheduledInputMessage{.epoch = 1,
                                                .number = 1,
                                                .frame = 2,
                                                .source_client = 0,
                                                .source_number = 0,
                                                .kind = 1,
                                                .values = {0, -64, 0, 10}},
               3, 3);
    for (int i = 0; i < 3; ++i) {
      const auto frame = server->advance(server->state(), {});
      transport::DeltaMessage delta;
      delta.epoch = 1;
      delta.frame = frame.frame;
      delta.last_input = frame.last_input;
      delta.hash = frame.hash;
      delta.payload.assign(frame.payload.begin(), frame.payload.end());
      writer.add(delta, 4 + i, 4);
    }
    writer.end_chunk();
    const bool plain = compression == recording::Compression::kNone;
    const std::size_t header_bytes = 8 + 9 + 4 + 4 + std::string_view("tandem " TANDEM_VERSION).size();
    if (plain) std::fill_n(&file[header_bytes + 9 + 24], 4, std::byte{0});
    if (!write_file(folder / "recording" / (plain ? "plain" : "zstd"), file)) return false;
  }
  return true;
}

}  // namespace
}  // namespace tandem

int main(int argc, char** argv) {
  if (argc != 2 || argv[1][0] == '-') {
    std::fputs("usage: make_corpus FOLDER\n", stderr);
    return 2;
  }
  const std::filesystem::path folder(argv[1]);
  if (tandem::write_messages(folder) && tandem::write_deltas(folder) && tandem::write_streams(folder, {}) &&
      tandem::write_streams(folder, tandem::synthetic::kTurning) &&
      tandem::write_snapshots(folder, {"quantized", {}}, "") &&
      tandem::write_snapshots(folder, {"tracker", tandem::synthetic::kTurning}, "turning-") &&
      tandem::write_snapshots(folder, {"quantized", tandem::synthetic::kTurning}, "quantized-turning-") &&
      tandem::write_recordings(folder))
    return 0;
  std::fprintf(stderr, "could not write to %s\n", argv[1]);
  return 1;
}
