// A tandemd of two streams, read by a client of the second that is nothing but endpoints and a timeline.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "sdk/core/lattice/hash.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "sdk/transport/dds/node.hpp"
#include "sdk/wire/clock.hpp"
#include "tests/integration/transport/child.hpp"
#include "tests/integration/transport/loopback.hpp"

namespace tandem::transport {
namespace {

using test::Child;
using test::eventually;
using namespace std::chrono_literals;

constexpr std::uint32_t kRich = 1;
constexpr ClientId kClient = 99;

/// Frames and hashes of a log `epoch,frame,hash`.
std::map<Frame, std::string> hashes(const std::filesystem::path& path) {
  std::map<Frame, std::string> read;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    const auto first = line.find(','), second = line.find(',', first + 1);
    if (second == std::string::npos || line.size() != second + 17) continue;  // still being written
    read[std::stoull(line.substr(first + 1))] = line.substr(second + 1);
  }
  return read;
}

/// A participant of stream kRich: acknowledges in the session's partition, reads deltas and snapshots from
/// theirs.
class StreamReader {
 public:
  explicit StreamReader(const DdsOptions& options)
      : node_(std::move(
            *dds::Node::create(options, "a client of stream 1", options.session, dds::Purpose::kObserve))),
        ack_(std::move(*node_.writer<AckMessage>("acknowledgements"))),
        sessions_(std::move(*node_.reader<SessionMessage>("session"))),
        inputs_(std::move(*node_.reader<ScheduledInputMessage>("scheduled inputs"))),
        deltas_(std::move(*node_.reader<DeltaMessage>(
            "deltas", {.depth = 4096, .partitions = {stream_partition(options.session, kRich)}}))),
        snapshots_(std::move(*node_.reader<SnapshotMessage>(
            "snapshots", {.partitions = {client_partition(options.session, kClient)}}))) {}

  /// Takes what came, acknowledges.
  void poll() {
    node_.wait(5ms);
    std::vector<Received<SessionMessage>> sessions;
    sessions_.take(dropped_, sessions);
    for (auto& received : sessions) session = std::move(received.message);
    std::vector<Received<ScheduledInputMessage>> inputs;
    inputs_.take(dropped_, inputs);
    for (auto& received : inputs) scheduled_.push_back(received.message);
    std::vector<Received<SnapshotMessage>> parts;
    snapshots_.take(dropped_, parts);
    for (auto& received : parts) add(received.message);
    std::vector<Received<DeltaMessage>> deltas;
    deltas_.take(dropped_, deltas);
    for (auto& received : deltas) {
      strange = strange || received.message.stream.id != kRich;
      deltas_kept_.push_back(std::move(received.message));
    }
    follow();
    acknowledge();
  }

  std::optional<SessionMessage> session;
  std::optional<ClientTimeline> timeline;
  bool strange = false;  // something of another stream arrived
  std::string failure;

 private:
  void add(const SnapshotMessage& part) {
    if (timeline || part.stream.id != kRich) return;
    frame_ = part.frame;
    part_count_ = part.parts;
    parts_.try_emplace(part.part, part);
    if (parts_.size() < part.parts) return;
    Bytes whole;
    for (const auto& [at, message] : parts_)
      whole.insert(whole.end(), message.bytes.begin(), message.bytes.end());
    auto made = ClientTimeline::create(session->streams[kRich].layout);
    if (auto loaded = made->load(whole, session->epoch, part.stream); !loaded) {
      failure = loaded.error().message;
      return;
    }
    timeline.emplace(std::move(*made));
  }
  void follow() {
    if (!timeline || !failure.empty()) return;
    for (const auto& input : scheduled_) {
      if (input.number <= timeline->inputs_held()) continue;
      static_cast<void>(timeline->schedule({input.number,
                                            input.frame,
                                            {{input.values[0], input.values[1], input.values[2]},
                                             static_cast<std::uint16_t>(input.values[3])}}));
    }
    for (const auto& delta : deltas_kept_) {
      if (delta.frame != timeline->applied() + 1 || timeline->inputs_held() < delta.last_input) continue;
      if (auto applied = timeline->apply(delta.frame, delta.last_input, delta.hash, delta.payload); !applied)
        failure = applied.error().message;
    }
  }
  void acknowledge() {
    if (!session) return;
    AckMessage ack;
    ack.client = kClient;
    ack.epoch = session->epoch;
    ack.stream.id = kRich;
    ack.phase = timeline ? Phase::kPlaying : Phase::kJoining;
    ack.applied = ack.simulated = timeline ? timeline->applied() : 0;
    ack.join_attempt = 1;
    if (!timeline && part_count_ > 0) {
      ack.snapshot_frame = frame_;
      ack.snapshot_parts = part_count_;
      for (std::uint32_t part = 0; part < part_count_ && ack.missing.size() < 2 * kMaxMissingRuns; ++part)
        if (!parts_.contains(part)) ack.missing.insert(ack.missing.end(), {part, 1});
    }
    ack.clock_ns = steady_ns();
    static_cast<void>(ack_.write(ack));
  }

  dds::Node node_;
  dds::Writer<AckMessage> ack_;
  dds::Reader<SessionMessage> sessions_;
  dds::Reader<ScheduledInputMessage> inputs_;
  dds::Reader<DeltaMessage> deltas_;
  dds::Reader<SnapshotMessage> snapshots_;
  std::atomic<std::uint64_t> dropped_ = 0;
  std::map<std::uint32_t, SnapshotMessage> parts_;
  Frame frame_ = 0;  // of the snapshot that these are of
  std::uint32_t part_count_ = 0;
  std::vector<ScheduledInputMessage> scheduled_;
  std::vector<DeltaMessage> deltas_kept_;
};

TEST(Streams, OneServerServesTwoToWhomeverPlaysThem) {
  const DdsOptions options = test::loopback();
  const auto log = std::filesystem::temp_directory_path() / (options.session + ".csv");
  const auto second_log = std::filesystem::path(log.string() + ".1");
  const std::string domain = std::to_string(options.domain);
  const Child server({TANDEM_TEST_TANDEMD, "--scene", "cube", "--bodies", "200", "--scripted", "--session",
                      options.session, "--domain", domain, "--stream", "thin:ballistic", "--stream",
                      "rich:field", "--hash-log", log.string()});
  const Child first(
      {TANDEM_TEST_TANDEM, "join", "--session", options.session, "--domain", domain, "--prefer", "thin"});
  ASSERT_TRUE(eventually([&] { return hashes(log).size() > 30; }, 30s));
  EXPECT_TRUE(hashes(second_log).empty()) << "nobody plays it yet";

  StreamReader reader(options);
  ASSERT_TRUE(eventually(
      [&] {
        reader.poll();
        return !reader.failure.empty() || (reader.timeline && hashes(second_log).size() > 150);
      },
      30s))
      << reader.failure;
  EXPECT_EQ(reader.failure, "");
  EXPECT_FALSE(reader.strange);
  EXPECT_EQ(reader.session->streams[kRich].layout.predictor, "field");
  EXPECT_EQ(reader.session->streams[kRich].name, "rich");
  const auto said = hashes(second_log);
  const Frame applied = reader.timeline->applied();
  ASSERT_TRUE(said.contains(applied));
  EXPECT_EQ(said.at(applied), to_hex(reader.timeline->hash()));
  EXPECT_GT(applied, said.begin()->first + 100);
  EXPECT_TRUE(hashes(log).contains(applied)) << "and the other goes on for the one who plays it";
  std::filesystem::remove(log);
  std::filesystem::remove(second_log);
}

}  // namespace
}  // namespace tandem::transport
