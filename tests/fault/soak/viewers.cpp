// Many viewers of a gateway in one program, which check that they miss no frame, until a signal comes.

#include <cstdio>

#include "sdk/wire/units.hpp"
#include "services/program/commandline/commandline.hpp"
#include "services/program/process/signal_watch.hpp"
#include "tests/bench/gateway/crowd.hpp"

namespace {

struct Options {
  int port = 0;
  std::size_t viewers = 50;
};

int run(const Options& options) {
  tandem::SignalWatch signals("viewers");
  tandem::bench::Crowd crowd(options.port, options.viewers, 0);
  bool told = false;
  while (!signals.stop().load()) {
    crowd.run_for(100 * tandem::kMillisecond);
    crowd.forget_arrivals();
    if (!told && crowd.playing() == options.viewers) {
      std::fprintf(stderr, "%zu viewers play\n", options.viewers);
      told = true;
    }
  }
  std::printf(R"({"playing": %zu, "gaps": %llu, "lost": %llu})"
              "\n",
              crowd.playing(), static_cast<unsigned long long>(crowd.gaps()),
              static_cast<unsigned long long>(crowd.lost()));
  return signals.finish(0);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  tandem::commandline::Program app{"Viewers of a gateway that check that they miss no frame."};
  app.add_option("--port", options.port).required();
  app.add_option("--viewers", options.viewers).show_default();
  if (const auto code = app.parse(argc, argv)) return *code;
  return run(options);
}
