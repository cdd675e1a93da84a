// Floods a session, as a stranger in its network can. Prints its counts as one JSON object.
//   flood KIND SESSION RATE SECONDS
// KIND is one of kFloods below. RATE: samples a second; 0: as fast as the middleware takes them.

#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <thread>

#include "sdk/transport/dds/node.hpp"
#include "sdk/wire/messages.hpp"

namespace {

using namespace tandem;
using namespace tandem::transport;
using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kSeed = 1;

/// The knowledge of an eavesdropper: the announcement and a client that plays.
struct Heard {
  SessionMessage session;
  AckMessage victim;
};

class Flooder {
 public:
  Flooder(dds::Node node, std::string session, double rate, double seconds)
      : node_(std::move(node)), session_(std::move(session)), rate_(rate), seconds_(seconds) {}

  [[nodiscard]] bool listen() {
    auto sessions = node_.reader<SessionMessage>("sessions");
    auto acks = node_.reader<AckMessage>("acknowledgements");
    if (!sessions || !acks) return false;
    std::atomic<std::uint64_t> dropped = 0;
    std::vector<Received<SessionMessage>> announced;
    std::vector<Received<AckMessage>> heard;
    const auto deadline = Clock::now() + std::chrono::seconds(10);
    while (Clock::now() < deadline) {
      sessions->take(dropped, announced);
      acks->take(dropped, heard);
      const bool plays = !heard.empty() && heard.back().message.phase == Phase::kPlaying;
      if (!announced.empty() && plays) {
        heard_ = {announced.back().message, heard.back().message};
        return true;
      }
      node_.wait(std::chrono::milliseconds(100));
    }
    return false;
  }

  /// An input that any engine takes. Numbers go up, as those of a client do.
  [[nodiscard]] InputMessage input(ClientId client, std::uint64_t number) const {
    InputMessage out;
    out.client = client;
    out.epoch = heard_.session.epoch;
    out.number = number;
    out.client_frame = heard_.victim.simulated;
    out.kind = static_cast<std::uint32_t>(InputKind::kGravity);
    out.values = {0, 9, 0};
    return out;
  }

  int victim_inputs() {
    return flood<InputMessage>([this](std::uint64_t n) { return input(heard_.victim.client, n); });
  }
  int random_inputs() {
    return flood<InputMessage>([this](std::uint64_t n) { return input(random_(), n); });
  }
  int victim_acks() {
    return flood<AckMessage>([this](std::uint64_t n) {
      AckMessage out = heard_.victim;
      out.phase = n % 2 == 0 ? Phase::kPlaying : Phase::kJoining;
      out.applied = n % 2 == 0 ? n % (heard_.victim.applied + 1) : 0;
      out.join_attempt = static_cast<std::uint32_t>(n);
      return out;
    });
  }
  int server_statuses() {
    return flood<ServerStatusMessage>([this](std::uint64_t n) {
      ServerStatusMessage out;
      out.session = session_;
      out.epoch = heard_.session.epoch + n;
      out.frame = n;
      return out;
    });
  }
  /// Newer and older epochs in turn, each a server that could be played.
  int sessions() {
    return flood<SessionMessage>([this](std::uint64_t n) {
      SessionMessage out = heard_.session;
      out.epoch = n % 2 == 0 ? out.epoch + n : out.epoch - n;
      return out;
    });
  }

 private:
  template <class M, class Make>
  int flood(Make&& make) {
    auto writer = node_.writer<M>("flood");
    if (!writer) return fail_with(writer.error());
    const auto began = Clock::now();
    std::uint64_t sent = 0, failed = 0;
    double passed = 0;
    while ((passed = std::chrono::duration<double>(Clock::now() - began).count()) < seconds_) {
      const auto due = rate_ == 0 ? sent + 100 : static_cast<std::uint64_t>(passed * rate_);
      while (sent < due) failed += writer->write(make(++sent)) ? 0U : 1U;
      if (rate_ != 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    std::printf("{\"sent\": %llu, \"failed\": %llu, \"seconds\": %.2f}\n",
                static_cast<unsigned long long>(sent), static_cast<unsigned long long>(failed), passed);
    return 0;
  }
  static int fail_with(const Error& error) {
    std::fprintf(stderr, "flood: %s\n", error.message.c_str());
    return 1;
  }

  dds::Node node_;
  std::string session_;
  double rate_, seconds_;
  Heard heard_;
  std::mt19937_64 random_{kSeed};
};

struct Flood {
  std::string_view name;
  int (Flooder::*run)();
};
constexpr std::array kFloods{
    Flood{"victim_inputs", &Flooder::victim_inputs}, Flood{"victim_acks", &Flooder::victim_acks},
    Flood{"server_statuses", &Flooder::server_statuses}, Flood{"random_inputs", &Flooder::random_inputs},
    Flood{"sessions", &Flooder::sessions}};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: flood KIND SESSION RATE SECONDS\n");
    return 2;
  }
  DdsOptions options;
  options.session = argv[2];
  auto node = dds::Node::create(options, "flood", options.session, dds::Purpose::kAct);
  if (!node) {
    std::fprintf(stderr, "flood: %s\n", node.error().message.c_str());
    return 1;
  }
  Flooder flooder(std::move(*node), options.session, std::atof(argv[3]), std::atof(argv[4]));
  if (!flooder.listen()) {
    std::fprintf(stderr, "flood: no session with a client that plays\n");
    return 1;
  }
  for (const Flood& flood : kFloods) {
    if (flood.name == argv[1]) return (flooder.*flood.run)();
  }
  std::fprintf(stderr, "flood: no such kind: %s\n", argv[1]);
  return 2;
}
