// Plays a recording of tests/web natively: replay_session TRACE. Prints the client's status, "frameMs" in it.

#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <vector>

#include "sdk/web/module/web_client.hpp"
#include "sdk/wire/clock.hpp"

int main(int argc, char** argv) {
  using namespace tandem;
  if (argc != 2) return 2;
  std::ifstream in(argv[1], std::ios::binary);
  const std::vector<char> trace{std::istreambuf_iterator<char>(in), {}};
  web::WebClient::Options options;
  options.id = 77;
  options.measure_ns = transport::steady_ns;
  web::WebClient viewer(options);
  viewer.port().connected();
  std::int64_t now_ns = 0;
  const auto poll = [&] {
    viewer.poll({now_ns, now_ns});
    bool asked = false;
    while (viewer.port().next_message()) asked = true;
    return asked;
  };
  constexpr std::byte kSnapshot{4};
  double at_ms = 0;
  std::uint32_t size = 0;
  for (std::size_t at = 0; at + sizeof at_ms + sizeof size <= trace.size();) {
    std::memcpy(&at_ms, trace.data() + at, sizeof at_ms);
    std::memcpy(&size, trace.data() + at + sizeof at_ms, sizeof size);
    at += sizeof at_ms + sizeof size;
    const auto message = std::as_bytes(std::span(trace).subspan(at, size));
    at += size;
    now_ns = std::max(now_ns, static_cast<std::int64_t>(at_ms * double{kMillisecond}));
    if (message[0] == kSnapshot) {
      do now_ns += kMillisecond;
      while (!poll());
    }
    if (!viewer.port().receive(message)) return 1;
    poll();
  }
  std::puts(viewer.status().c_str());
  return 0;
}
