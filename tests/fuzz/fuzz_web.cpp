// Whatever a gateway may send a viewer, over connections that come and go: it plays again when the gateway
// behaves.

#include "sdk/web/module/web_client.hpp"
#include "tests/fuzz/program.hpp"
#include "tests/support/client/fake_server.hpp"

namespace tandem::web {
namespace {

using client::FakeServer;
using client::kFrameNs;
using client::kMs;
using fuzz::Program;
using fuzz::require;

constexpr std::uint32_t kCapacity = 8;

template <class M>
transport::Bytes envelope(const M& message) {
  transport::Bytes bytes;
  transport::write_envelope(message, bytes);
  return bytes;
}

/// The messages of an honest gateway, made once, so that a run costs only the viewer's work.
struct Honest {
  Honest() {
    messages.push_back(envelope(server.session));
    for (int i = 0; i < 6; ++i) {
      if (i == 3) messages.push_back(envelope(server.schedule(-40)));
      messages.push_back(envelope(server.advance(i * kFrameNs)));
      if (i == 1) messages.push_back(envelope(server.snapshot()));
    }
    messages.push_back(envelope(transport::AbsentMessage{}));
    for (int i = 0; i < 3; ++i) {
      deltas.push_back(envelope(successor.advance(i * kFrameNs)));
      snapshots.push_back(envelope(successor.snapshot()));
    }
  }
  FakeServer server{1000, kCapacity, 1};
  std::vector<transport::Bytes> messages;
  FakeServer successor{~std::uint64_t{0} >> 1U, kCapacity, 1};
  std::vector<transport::Bytes> deltas, snapshots;
};

class Run {
 public:
  Run(const Honest& honest, Program& program) : honest_(honest), program_(program) {}

  void play() {
    viewer_.port().connected();
    for (int step = 0; step < 64 && !program_.over(); ++step) event();
    make_peace();
  }

 private:
  void event() {
    switch (program_.u8() % 8) {
      case 0:
        return viewer_.port().connected();
      case 1:
        return viewer_.port().disconnected();
      case 2:
        return give(program_.bytes(600));
      case 3:
      case 4: {
        transport::Bytes message = honest_.messages[program_.u8() % honest_.messages.size()];
        program_.damage(message);
        return give(message);
      }
      case 5:
        return poll(std::int64_t{program_.u8()} * 4 * kMs);
      default:
        return give(honest_.messages[next_++ % honest_.messages.size()]);
    }
  }
  void give(const transport::Bytes& message) { static_cast<void>(viewer_.port().receive(message)); }
  void poll(std::int64_t later_ns) {
    now_.steady_ns += later_ns;
    now_.wall_ns += later_ns;
    viewer_.poll(now_);
    if (program_.u8() % 4 == 1)
      static_cast<void>(viewer_.send(transport::InputKind::kGravity, {program_.real(), 0, 0}, {}, now_));
    std::size_t sent = 0;
    while (viewer_.port().next_message()) ++sent;
    require(sent <= 8);
    static_cast<void>(viewer_.take_events());
    static_cast<void>(viewer_.status());
    static_cast<void>(viewer_.types());
    if (const Sample* sample = viewer_.sample(SampleMode::kExtrapolate, now_))
      require(viewer_.corrected().size() == sample->capacity);
  }

  void make_peace() {
    viewer_.port().connected();
    give(envelope(honest_.successor.session));
    poll(5000 * kMs);
    for (std::size_t i = 0; i < honest_.deltas.size(); ++i) {
      give(honest_.deltas[i]);
      give(honest_.snapshots[i]);
      poll(100 * kMs);
    }
    require(viewer_.core().phase() == ClientPhase::kPlaying);
    require(viewer_.core().timeline()->hash() ==
            honest_.successor.hashes.at(viewer_.core().timeline()->applied()));
  }

  const Honest& honest_;
  Program& program_;
  WebClient viewer_{{.id = client::kClient, .log = {}}};
  client::Now now_{1'000'000'000'000, 1'000'000'000'000};
  std::size_t next_ = 0;
};

}  // namespace
}  // namespace tandem::web

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tandem::web::Honest honest;
  tandem::fuzz::Program program(std::as_bytes(std::span(data, size)));
  tandem::web::Run(honest, program).play();
  return 0;
}
