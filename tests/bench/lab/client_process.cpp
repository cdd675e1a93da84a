#include "tests/bench/lab/client_process.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <thread>
#include <vector>

#include "services/lab/measures/client_cost.hpp"
#include "services/lab/measures/scene_source.hpp"
#include "services/program/json/json.hpp"
#include "tests/bench/lab/child.hpp"
#include "tests/bench/lab/process_counters.hpp"

namespace tandem::lab {
namespace {

constexpr double kIdleSettleS = 1;  // messages on their way arrive
constexpr double kIdleS = 4;

constexpr const char* kLoopback =
    "<CycloneDDS><Domain id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\" multicast=\"true\"/>"
    "</Interfaces></General></Domain></CycloneDDS>";

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Result<void> sleep(double seconds, const std::atomic<bool>& stop) {
  constexpr double kStepS = 0.1;
  for (; seconds > 0; seconds -= kStepS) {
    if (stop) return fail(ErrorCode::kIo, "stopped");
    std::this_thread::sleep_for(std::chrono::duration<double>(std::min(seconds, kStepS)));
  }
  return {};
}

std::vector<std::string> server_command(const ClientProcessSetup& setup, const std::string& session) {
  std::vector<std::string> command{setup.tandemd,
                                   "--scene",
                                   setup.scene,
                                   "--bodies",
                                   std::to_string(setup.choice.bodies),
                                   "--codec",
                                   setup.choice.codec,
                                   "--predictor",
                                   setup.choice.predictor,
                                   "--seed",
                                   std::to_string(setup.seed),
                                   "--domain",
                                   std::to_string(setup.domain),
                                   "--session",
                                   session,
                                   "--lead",
                                   "1",
                                   "--scripted"};
  if (setup.choice.threshold_m) {
    command.insert(command.end(), {"--threshold", fmt::format("{}", *setup.choice.threshold_m)});
  } else if (setup.choice.threshold_scale != 1) {
    command.insert(command.end(), {"--threshold-scale", fmt::format("{}", setup.choice.threshold_scale)});
  }
  return command;
}

Result<ClientProcessRow> run_once(const ClientProcessSetup& setup) {
  const std::string session = fmt::format("bench-client-{}", getpid());
  const ChildPlace place{.cgroup_procs = {}, .dds_config = kLoopback};
  auto server = Child::start(server_command(setup, session), place);
  if (!server) return tl::unexpected(server.error());
  auto client = Child::start({setup.tandem, "join", "--domain", std::to_string(setup.domain), "--session",
                              session, "--lead", "1", "--json"},
                             place);
  if (!client) return tl::unexpected(client.error());

  const auto read_after = [&](double seconds) -> Result<ProcessReading> {
    if (auto slept = sleep(seconds, *setup.stop); !slept) return tl::unexpected(slept.error());
    return read_process(client->pid());
  };
  const auto first = read_after(setup.settle_s);
  if (!first) return tl::unexpected(first.error());
  const auto counter = SyscallCounter::start(*first);
  const auto second = read_after(setup.seconds);
  if (!second) return tl::unexpected(second.error());
  const std::uint64_t calls = counter ? counter->calls() : 0;
  kill(server->pid(), SIGSTOP);
  const auto third = read_after(kIdleSettleS);
  if (!third) return tl::unexpected(third.error());
  const auto fourth = read_after(kIdleS);
  if (!fourth) return tl::unexpected(fourth.error());
  kill(client->pid(), SIGINT);
  // It exits with 1, because no frame came before its end; what it printed tells of errors.
  const auto said = client->finish(kChildEnd, *setup.stop, 1);
  if (!said) return fail(said.error().code, "the client: " + said.error().message);
  const auto printed = Json::parse(*said);
  if (!printed) return fail(ErrorCode::kIo, "the client printed no JSON");
  const Json& json = *printed;
  if (json["hash_mismatches"].number() != 0) return fail(ErrorCode::kIo, "the client had hash mismatches");
  const double played_s = json["played_s"].number();
  if (played_s < setup.seconds) return fail(ErrorCode::kIo, "the client joined too late: increase --settle");

  ClientProcessRow row;
  row.frames_per_s = (json["frames_applied"].number() - 1) / played_s;
  const ProcessSpan playing = between(*first, *second);
  const double frames = row.frames_per_s * playing.seconds;
  row.cpu_ms = playing.cpu_ms / frames;
  for (const auto& [name, cpu_ms] : playing.cpu_ms_by_thread) row.by_thread[name] = cpu_ms / frames;
  double told_ms = 0;
  for (const auto& [kind, ms] : json["cost_ms"].members()) told_ms += row.by_kind[kind] = ms.number();
  row.by_kind["dds"] = row.cpu_ms - told_ms;
  if (counter) row.syscalls = static_cast<double>(calls) / frames;
  row.wakeups_per_s = playing.wakeups / playing.seconds;
  const ProcessSpan idle = between(*third, *fourth);
  row.idle_wakeups_per_s = idle.wakeups / idle.seconds;
  row.resident_mb = second->resident_mb;
  return row;
}

/// The median of `of(row)` over the rows.
template <class Of>
double median_of(const std::vector<ClientProcessRow>& rows, Of&& of) {
  std::vector<double> values;
  for (const ClientProcessRow& row : rows) values.push_back(of(row));
  return median(std::move(values));
}

void take_medians(const std::vector<ClientProcessRow>& rows,
                  std::map<std::string, double> ClientProcessRow::*parts, ClientProcessRow& out) {
  for (const auto& [name, unused] : rows.front().*parts) {
    (out.*parts)[name] = median_of(rows, [&, &key = name](const ClientProcessRow& row) {
      const auto found = (row.*parts).find(key);
      return found == (row.*parts).end() ? 0.0 : found->second;
    });
  }
}

}  // namespace

Result<ClientProcessRow> measure_client_process(const ClientProcessSetup& setup) {
  std::vector<ClientProcessRow> rows;
  for (unsigned i = 0; i < setup.runs; ++i) {
    auto row = run_once(setup);
    if (!row) return tl::unexpected(row.error());
    rows.push_back(std::move(*row));
  }
  using Row = ClientProcessRow;
  Row out;
  out.frames_per_s = median_of(rows, [](const Row& row) { return row.frames_per_s; });
  out.cpu_ms = median_of(rows, [](const Row& row) { return row.cpu_ms; });
  const auto [least, most] = std::minmax_element(
      rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.cpu_ms < b.cpu_ms; });
  out.cpu_ms_least = least->cpu_ms;
  out.cpu_ms_most = most->cpu_ms;
  take_medians(rows, &Row::by_thread, out);
  take_medians(rows, &Row::by_kind, out);
  if (rows.front().syscalls)
    out.syscalls = median_of(rows, [](const Row& row) { return row.syscalls.value_or(0); });
  out.wakeups_per_s = median_of(rows, [](const Row& row) { return row.wakeups_per_s; });
  out.idle_wakeups_per_s = median_of(rows, [](const Row& row) { return row.idle_wakeups_per_s; });
  out.resident_mb = median_of(rows, [](const Row& row) { return row.resident_mb; });
  return out;
}

Result<double> measure_engine_step(const scenes::Scene& scene, const ClientProcessSetup& setup) {
  constexpr double kFramesPerS = 30;
  const auto settled = static_cast<std::uint64_t>(setup.settle_s * kFramesPerS);
  const auto frames = settled + static_cast<std::uint64_t>(setup.seconds * kFramesPerS);
  auto source = make_source(scene, {.bodies = setup.choice.bodies, .seed = setup.seed, .frames = frames});
  if (!source) return tl::unexpected(source.error());
  std::vector<double> ms;
  std::size_t next = 0;
  for (std::uint64_t frame = 1; frame <= frames; ++frame) {
    if (*setup.stop) return fail(ErrorCode::kIo, "stopped");
    for (; next < source->script.size() && source->script[next].frame <= frame; ++next)
      source->simulation->apply(source->script[next].input);
    const std::int64_t began_ns = thread_cpu_ns();
    source->simulation->step();
    if (frame > settled) ms.push_back(static_cast<double>(thread_cpu_ns() - began_ns) / 1e6);
  }
  return median(std::move(ms));
}

}  // namespace tandem::lab
