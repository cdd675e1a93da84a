// `tandem doctor`: checks what a session needs of this machine and its networks, and suggests changes.

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "services/program/json/json.hpp"
#include "services/tool/commands.hpp"
#include "services/tool/doctor/doctor.hpp"
#include "services/tool/doctor/nats_doctor.hpp"
#include "services/tool/endpoint_options.hpp"

namespace tandem::tool {
namespace {

using doctor::Check;
using doctor::Verdict;

const char* word(Verdict verdict) {
  switch (verdict) {
    case Verdict::kGood:
      return "ok";
    case Verdict::kWarning:
      return "warning";
    case Verdict::kFailure:
      return "failure";
  }
  return "";
}

int print(const std::vector<Check>& checks, bool json) {
  const bool failed = std::any_of(checks.begin(), checks.end(),
                                  [](const Check& c) { return c.verdict == Verdict::kFailure; });
  if (json) {
    Json rows = Json::array();
    for (const Check& check : checks) {
      rows.push_back({{"name", check.name},
                      {"verdict", word(check.verdict)},
                      {"detail", check.detail},
                      {"advice", check.advice}});
    }
    fmt::print("{}\n", Json{{"ok", !failed}, {"checks", rows}}.dump());
    return failed ? 1 : 0;
  }
  for (const Check& check : checks) {
    fmt::print("{:<8} {:<15} {}\n", word(check.verdict), check.name, check.detail);
    if (!check.advice.empty()) fmt::print("{:<8} {:<15} -> {}\n", "", "", check.advice);
  }
  return failed ? 1 : 0;
}

}  // namespace

void add_doctor(commandline::Command app, Run& run) {
  commandline::Command command = app.add_subcommand(
      "doctor",
      "Checks configuration, interfaces, multicast, buffers, MTU, clock, ports, who is on the domain and an identity, and "
      "suggests changes; with --nats the same for a NATS server between sites.");
  struct Options {
    bool json = false;
    std::uint32_t domain = 0;
    std::string profile;
    std::string secure;
    NatsFlags nats;
    std::string session;
  };
  const auto options = std::make_shared<Options>();
  // Whether it is a server's or a client's is seen from its parameters.
  add_domain_options(command, options->domain, options->profile, transport::Side::kServer);
  add_secure_option(command, options->secure);
  add_nats_options(command, options->nats, "to check");
  command.add_option("--session", options->session, "With --nats: a session that has to be there [any]")
      .check(refusal_of_session)
      .needs(command.option("--nats"));
  command.add_flag("--json", options->json,
                   "Print one JSON object: ok, checks[name, verdict, detail, advice]");
  command.footer(
      "A profile with a server's address is checked as a client uses it, one without as a server does. Exits with 1 if "
      "sessions cannot work at all, and with 0 if there are only warnings.");
  command.on_chosen([options, &run] {
    run = [options] {
      if (!options->nats.url.empty()) {
        const auto facts = doctor::nats_facts(options->nats.connection("tandem doctor"), options->nats.site,
                                              options->session);
        return print(judge(facts), options->json);
      }
      const auto facts = doctor::machine_facts(options->domain, options->profile, options->secure);
      return print(judge(facts), options->json);
    };
  });
}

}  // namespace tandem::tool
