// Many viewers at a gateway that runs already, as bench_gateway has them; prints one line of JSON. Exit 1 if
// a frame was missing.

#include <algorithm>
#include <cstdio>

#include "sdk/wire/clock.hpp"
#include "sdk/wire/units.hpp"
#include "services/program/commandline/commandline.hpp"
#include "tests/bench/gateway/crowd.hpp"

int main(int argc, char** argv) {
  unsigned port = 8080, viewers = 300, seconds = 20;
  tandem::commandline::Program app{"Many viewers at a gateway of this machine.", "viewer_crowd"};
  app.add_option("--port", port, "Of the gateway").show_default();
  app.add_option("--viewers", viewers, "How many").range(1U, 5000U).show_default();
  app.add_option("--seconds", seconds, "How long they play once all do").range(1U, 3600U).show_default();
  if (const auto code = app.parse(argc, argv)) return *code;
  using namespace tandem;
  bench::Crowd crowd(static_cast<int>(port), viewers, 0);
  const std::int64_t begun_ns = transport::steady_ns();
  while (crowd.playing() < viewers && transport::steady_ns() - begun_ns < 120 * kSecond)
    crowd.run_for(kSecond / 10);
  const double joined_s = static_cast<double>(transport::steady_ns() - begun_ns) * 1e-9;
  crowd.run_for(2 * kSecond);
  const std::uint64_t gaps = crowd.gaps(), lost = crowd.lost();
  std::uint64_t frames = 0;
  for (unsigned second = 0; second < seconds; ++second) {
    crowd.forget_arrivals();
    crowd.run_for(kSecond);
    frames += crowd.arrivals().size();
  }
  std::printf(
      "{\"viewers\": %u, \"playing\": %zu, \"all_played_after_s\": %.1f, \"frames\": %llu, \"gaps\": %llu, \"lost\": %llu}\n",
      viewers, crowd.playing(), joined_s, static_cast<unsigned long long>(frames),
      static_cast<unsigned long long>(crowd.gaps() - gaps),
      static_cast<unsigned long long>(crowd.lost() - lost));
  return crowd.playing() == viewers && crowd.gaps() == gaps && crowd.lost() == lost ? 0 : 1;
}
