// The command line tool: join, record, replay, checkpoint, handover, engine-check, bench, export, top,
// doctor, pki. Exit 0 done, 1 failed, 2 wrong usage.

#include <cstdio>
#include <exception>
#include <string>
#include <string_view>

#include "sdk/transport/dds/dds_ports.hpp"
#include "services/tool/commands.hpp"

int main(int argc, char** argv) {
  // Otherwise everybody who sends packets could fill stderr.
  tandem::transport::set_dds_log([](std::string_view line, bool /*error*/) {
    std::fprintf(stderr, "tandem: Cyclone DDS: %.*s\n", static_cast<int>(line.size()), line.data());
  });
  tandem::commandline::Program app{
      "Clients, recordings, measurements and diagnosis for Tandem, which streams large simulations over DDS.",
      "tandem"};
  app.version("tandem " TANDEM_VERSION);
  app.require_subcommand();
  app.footer("Exit codes: 0 done, 1 failed, 2 wrong usage. With --json, stdout holds one JSON object.");
  tandem::tool::Run run;
  const tandem::commandline::Command& command = app;
  tandem::tool::add_join(command, run);
  tandem::tool::add_record(command, run);
  tandem::tool::add_replay(command, run);
  tandem::tool::add_checkpoint(command, run);
  tandem::tool::add_handover(command, run);
  tandem::tool::add_engine_check(command, run);
#ifdef TANDEM_LAB
  tandem::tool::add_bench(command, run);
  tandem::tool::add_export(command, run);
#endif
  tandem::tool::add_top(command, run);
  tandem::tool::add_doctor(command, run);
  tandem::tool::add_pki(command, run);
#ifndef TANDEM_LAB
  if (argc > 1 && (argv[1] == std::string("bench") || argv[1] == std::string("export"))) {
    std::fprintf(stderr,
                 "tandem: %s is not in this build; build from source: cmake --preset release "
                 "-DTANDEM_BUILD_LAB=ON && cmake --build build/release\n",
                 argv[1]);
    return 2;
  }
#endif
  // The parser would only say that a command is needed, not that this one is unknown.
  if (argc > 1 && argv[1][0] != '-' && !app.has_subcommand(argv[1])) {
    std::fprintf(stderr, "tandem: unknown command '%s'; see tandem --help\n", argv[1]);
    return 2;
  }
  if (const auto code = app.parse(argc, argv)) return *code;
  try {
    const int code = run();
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
    std::fputs("tandem: the output could not be written to stdout\n", stderr);
    return 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tandem: %s\n", error.what());
    return 1;
  }
}
