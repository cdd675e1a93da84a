// A client that does what no client does: it tries to write and to read every topic of a session, and to
// speak for a client that plays. It also asks for a participant's place under an id of its own, keeps up for
// half of its time, and then makes all wait. Prints what it could as one JSON object.
//   intruder SESSION IDENTITY SECONDS      IDENTITY: a folder for DDS Security; -: none

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sdk/transport/dds/node.hpp"

namespace {

using namespace tandem;
using namespace tandem::transport;

/// One topic: a reader and a writer, as far as they are allowed.
template <class M>
class Door {
 public:
  Door(dds::Node& node, M forged) : forged_(std::move(forged)) {
    if (auto reader = node.reader<M>("intruder", {.ignore_own = true})) reader_.emplace(std::move(*reader));
    if (auto writer = node.writer<M>("intruder")) writer_.emplace(std::move(*writer));
  }
  void listen() {
    if (reader_) reader_->take(dropped_, heard_);
  }
  [[nodiscard]] const std::vector<Received<M>>& heard() const { return heard_; }
  M& forged() { return forged_; }
  void write() {
    if (writer_) static_cast<void>(writer_->write(forged_));
  }
  /// "name": [may write, readers that match, may read, samples]
  void print(const char* separator) const {
    const int readers = writer_ ? dds_get_matched_subscriptions(writer_->get(), nullptr, 0) : 0;
    std::printf("%s\"%s\": [%s, %d, %s, %zu]", separator, M::kTopic, writer_ ? "true" : "false", readers,
                reader_ ? "true" : "false", heard_.size());
  }

 private:
  M forged_;
  std::optional<dds::Reader<M>> reader_;
  std::optional<dds::Writer<M>> writer_;
  std::vector<Received<M>> heard_;
  std::atomic<std::uint64_t> dropped_ = 0;
};

InputMessage gravity() {
  InputMessage out;
  out.number = 1'000'000;  // no honest client comes so far in this test
  out.kind = static_cast<std::uint32_t>(InputKind::kGravity);
  out.values = {0, 9, 0};
  return out;
}

AckMessage own_place() {
  AckMessage out;
  out.client = 0xBAD;
  out.protocol_version = kProtocolVersion;
  out.phase = Phase::kPlaying;
  out.role_wanted = Role::kParticipant;
  out.join_attempt = 1;
  return out;
}

SessionMessage session(const std::string& name) {
  SessionMessage out;
  out.session = name;
  out.epoch = UINT64_MAX / 2;
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: intruder SESSION IDENTITY SECONDS\n");
    return 2;
  }
  DdsOptions options;
  options.session = argv[1];
  if (argv[2] != std::string("-")) options.secure = argv[2];
  auto made = dds::Node::create(options, "intruder", options.session, dds::Purpose::kWatch);
  if (!made) {
    std::fprintf(stderr, "intruder: %s\n", made.error().message.c_str());
    return 1;
  }
  dds::Node node = std::move(*made);
  Door<SessionMessage> sessions(node, session(options.session));
  Door<DeltaMessage> deltas(node, {});
  Door<ScheduledInputMessage> scheduled(node, {});
  Door<SnapshotMessage> snapshots(node, {});
  Door<ReplyMessage> replies(node, {});
  Door<ServerStatusMessage> server_status(node, {});
  Door<InputMessage> inputs(node, gravity());
  Door<AckMessage> acks(node, {});
  Door<ClientStatusMessage> client_status(node, {});
  Door<JournalMessage> journal(node, {});
  Door<CheckpointMessage> checkpoints(node, {});
  Door<StandbyMessage> standby(node, {});
  Door<CommandMessage> commands(node, {});
  const auto each = [&](const auto& act) {
    act(sessions), act(deltas), act(scheduled), act(snapshots), act(replies), act(server_status), act(inputs),
        act(acks);
    act(client_status), act(journal), act(checkpoints), act(standby), act(commands);
  };
  Door<AckMessage> place(node, own_place());
  const auto begin = std::chrono::steady_clock::now();
  const std::chrono::duration<double> time(std::atof(argv[3]));
  const auto end = begin + time;
  while (std::chrono::steady_clock::now() < end) {
    node.wait(std::chrono::milliseconds(50));
    each([](auto& door) { door.listen(); });
    if (!client_status.heard().empty()) {  // the victim says who it is
      const ClientStatusMessage& victim = client_status.heard().back().message;
      inputs.forged().client = acks.forged().client = victim.client;
      inputs.forged().epoch = acks.forged().epoch = victim.epoch;
      acks.forged().phase = Phase::kJoining;
      acks.forged().protocol_version = kProtocolVersion;
    }
    place.forged().epoch = inputs.forged().epoch;
    if (!server_status.heard().empty() && std::chrono::steady_clock::now() < begin + time / 2)
      place.forged().applied = server_status.heard().back().message.frame;
    if (place.forged().applied > 0) place.write();
    inputs.forged().number += 1;
    each([](auto& door) { door.write(); });
  }
  const char* separator = "{";
  each([&](const auto& door) { door.print(std::exchange(separator, ", ")); });
  const bool knew = !client_status.heard().empty();
  std::printf(", \"victim\": %s}\n", knew ? "true" : "false");
  return 0;
}
