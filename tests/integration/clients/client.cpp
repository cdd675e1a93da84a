// The C++ client of clients_test.py.
#include "tandem/client.hpp"
#include <cstdint>
#include <cstdio>
#include <cstdlib>

namespace {

int failed(const char* what, const tandem::Error& error) {
  std::fprintf(stderr, "%s: %s\n", what, error.message.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  const std::uint64_t frames = std::strtoull(argv[3], nullptr, 10),
                      inputs = std::strtoull(argv[4], nullptr, 10);
  auto client =
      tandem::Client::connect({.session = argv[1],
                               .domain = static_cast<std::uint32_t>(std::strtoul(argv[2], nullptr, 10)),
                               .background = false});
  if (!client) return failed("connect", client.error());
  if (auto playing = client->wait_until_playing(60); !playing)
    return failed("wait until playing", playing.error());
  std::uint64_t sent = 0, last = 0;
  for (;;) {
    if (auto updated = client->update(0.1); !updated) return failed("update", updated.error());
    const auto status = client->status();
    if (!status) return failed("status", status.error());
    if (status->frame != last) {
      std::printf("%llu,%llu,%016llx\n", static_cast<unsigned long long>(status->epoch),
                  static_cast<unsigned long long>(status->frame),
                  static_cast<unsigned long long>(status->state_hash));
    }
    last = status->frame;
    const bool done = status->frames_applied >= frames && status->inputs_acted == sent && sent == inputs;
    if (done ||
        status->inputs_refused + status->inputs_unknown + status->hash_mismatches + status->resyncs != 0) {
      std::fprintf(stderr, "%llu frames, %llu of %llu inputs acted, %llu mismatches, %llu resyncs\n",
                   static_cast<unsigned long long>(status->frames_applied),
                   static_cast<unsigned long long>(status->inputs_acted),
                   static_cast<unsigned long long>(sent),
                   static_cast<unsigned long long>(status->hash_mismatches),
                   static_cast<unsigned long long>(status->resyncs));
      return done && status->hash_mismatches == 0 ? 0 : 1;
    }
    if (sent < inputs && status->frames_applied > sent * frames / inputs) {
      const auto number = client->send_gravity({static_cast<double>(sent % 5) - 2, -9, -1});
      if (number) ++sent;
    }
  }
}
