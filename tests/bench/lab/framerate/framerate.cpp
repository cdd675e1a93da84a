#include "tests/bench/lab/framerate/framerate.hpp"

#include <fmt/format.h>

#include <cmath>

#include "sdk/wire/units.hpp"
#include "services/program/json/json.hpp"
#include "tests/bench/lab/child.hpp"
#include "tests/bench/lab/framerate/enclave.hpp"
#include "tests/bench/lab/framerate/paper_numbers.hpp"
#include "tests/bench/lab/process_counters.hpp"

namespace tandem::lab {
namespace {

constexpr const char* kServerAddress = "10.77.0.1";
constexpr const char* kUsersAddress = "10.77.0.2";
// A thin device takes long to start a program and to read its first snapshot.
constexpr std::chrono::seconds kStart{60};
constexpr std::uint32_t kCalibratedBodies = 10000;

/// Unicast only, and datagrams without fragments, because a link that loses a fragment loses the datagram.
std::string dds_config(const char* peer) {
  return fmt::format(
      "<CycloneDDS><Domain id=\"any\"><General><Interfaces><NetworkInterface name=\"tandem0\" "
      "multicast=\"false\"/>"
      "</Interfaces><AllowMulticast>false</AllowMulticast><MaxMessageSize>1400B</MaxMessageSize></General>"
      "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>16</"
      "MaxAutoParticipantIndex>"
      "<Peers><Peer address=\"{}\"/></Peers></Discovery></Domain></CycloneDDS>",
      peer);
}

/// Runs a program to its end, as the measured user. Returns the JSON object that it printed, with its
/// processor time added.
Result<Json> run(const FramerateSetup& setup, const std::vector<std::string>& arguments, ChildPlace place,
                 ThinDevice* device) {
  const auto at_most = kStart + std::chrono::seconds(std::llround(2 * setup.seconds));
  if (device != nullptr) place.cgroup_procs = device->procs();
  auto child = Child::start(arguments, place);
  if (!child) return tl::unexpected(child.error());
  if (device != nullptr) device->hold(child->pid());
  auto said = child->finish(at_most, *setup.stop);
  if (device != nullptr) device->release();
  if (!said) return fail(said.error().code, fmt::format("{}: {}", arguments[1], said.error().message));
  auto parsed = Json::parse(*said);
  if (!parsed) return fail(ErrorCode::kIo, arguments[1] + " printed no JSON");
  (*parsed)["cpu_ms"] = child->cpu_ms();
  return std::move(*parsed);
}

Result<double> client_only(const FramerateSetup& setup, ThinDevice* device, const std::string& scene,
                           std::uint32_t bodies, double seconds) {
  return run(setup,
             {own_path(), "engine", "--scene", scene, "--bodies", std::to_string(bodies), "--seed",
              std::to_string(setup.seed), "--seconds", fmt::format("{}", seconds), "--json"},
             {}, device)
      .map([](const Json& json) { return json["updates_per_s"].number(); });
}

std::vector<std::string> server_command(const FramerateSetup& setup, const FramerateRow& row) {
  std::vector<std::string> command{setup.tandemd,
                                   "--scene",
                                   row.scene,
                                   "--bodies",
                                   std::to_string(row.bodies),
                                   "--rate",
                                   "max",
                                   "--stall-timeout",
                                   "off",
                                   "--window",
                                   "2",
                                   "--lead",
                                   "1",
                                   "--scripted",
                                   "--users",
                                   std::to_string(row.users),
                                   "--wait-for",
                                   std::to_string(row.users),
                                   "--seed",
                                   std::to_string(setup.seed)};
  if (row.method == kBallistic || row.method == kField) {
    command.insert(command.end(), {"--codec", "tracker", "--predictor", row.method});
  } else if (row.method != kAsItComes) {
    command.insert(command.end(), {"--codec", row.method});
  }
  return command;
}

std::vector<std::string> user_command(const FramerateSetup& setup, double seconds) {
  return {setup.tandem, "join", "--lead", "1", "--seconds", fmt::format("{}", seconds), "--json"};
}

Result<void> stream(const FramerateSetup& setup, ThinDevice* device,
                    const std::optional<Calibration>& calibration, FramerateRow& row) {
  auto server_side = make_enclave(kServerAddress);
  if (!server_side) return tl::unexpected(server_side.error());
  auto users_side = make_enclave(kUsersAddress);
  if (!users_side) return tl::unexpected(users_side.error());
  Link link(*server_side, *users_side, setup.link);
  const ChildPlace at_server{server_side->name_space.get(), {}, dds_config(kUsersAddress)};
  const ChildPlace at_users{users_side->name_space.get(), {}, dds_config(kServerAddress)};
  auto server = Child::start(server_command(setup, row), at_server);
  if (!server) return tl::unexpected(server.error());
  // The others play longer than the measured one.
  std::vector<Child> others;
  for (std::uint32_t i = 1; i < row.users; ++i) {
    auto other = Child::start(user_command(setup, 3600), at_users);
    if (!other) return tl::unexpected(other.error());
    others.push_back(std::move(*other));
  }
  const auto before = read_process(server->pid());
  const auto json = run(setup, user_command(setup, setup.seconds), at_users, device);
  const LinkCounts carried = link.finish(setup.seconds);
  const auto after = read_process(server->pid());
  const double server_busy = before && after ? between(*before, *after).cpu_ms / (1e3 * setup.seconds)
                                             : 0;  // the server waits while the user joins
  if (!json) return tl::unexpected(json.error());
  row.updates_per_s = (*json)["frames_applied"].number() / setup.seconds;
  row.client_ms_p50 = (*json)["client_ms"]["p50"].number();
  row.latency_ms_p50 = (*json)["latency_ms"]["p50"].number();
  row.client_cpu_ms = (*json)["cpu_ms"].number() / (*json)["frames_applied"].number();
  row.resyncs = static_cast<std::uint64_t>((*json)["resyncs"].number());
  row.link_mbit_per_s = static_cast<double>(carried.bytes_there) * 8 / kBitsPerMbit / setup.seconds;
  row.dropped = carried.dropped;
  row.stream = (*json)["stream"].text();
  row.bound = find_bound(row, setup.link.bits_per_s, calibration ? calibration->share : 1, server_busy);
  return {};
}

/// "-" for a missing value.
std::string rounded(const std::optional<double>& value, int digits) {
  return value ? fmt::format("{:.{}f}", *value, digits) : "-";
}

std::optional<double> in_paper(const FramerateRow& row) {
  return row.number ? paper_updates_per_s(*row.number, row.bodies, row.method) : std::nullopt;
}

}  // namespace

std::string find_bound(const FramerateRow& row, double link_bits_per_s, double share, double server_busy) {
  if (row.link_mbit_per_s.value_or(0) * kBitsPerMbit >= 0.9 * link_bits_per_s) return "link";
  if (row.client_cpu_ms.value_or(0) * row.updates_per_s / 1e3 >= 0.8 * share) return "processor";
  // Only then, because a packet lost in a burst does not slow down a user whose processor is the limit.
  if (row.dropped.value_or(0) > 0) return "link";
  return server_busy >= 0.9 ? "server" : "round trip";
}

void measure_row(const FramerateSetup& setup, ThinDevice* device,
                 const std::optional<Calibration>& calibration, FramerateRow& row) {
  row.device = calibration ? calibration->device : "native";
  row.seconds = setup.seconds;
  if (row.method == kClientOnly) {
    row.bound = "processor";
    if (row.users > 1) {
      row.missing = "without a server there is one user";
      return;
    }
    if (calibration && calibration->step_us > 0) {
      row.updates_per_s = 1e6 * calibration->share / (calibration->step_us * row.bodies);
      return;
    }
    const auto rate = client_only(setup, device, row.scene, row.bodies, setup.seconds);
    if (rate) row.updates_per_s = *rate;
    if (!rate) row.missing = rate.error().message;
    return;
  }
  const auto streamed =
      setup.kind == LinkKind::kMemory ? play_in_memory(setup, row) : stream(setup, device, calibration, row);
  if (!streamed) row.missing = streamed.error().message;
}

Result<Calibration> calibrate(const FramerateSetup& setup, ThinDevice& device, double updates_per_s,
                              const std::function<void(const std::string&)>& progress) {
  constexpr const char* kScene = "half_pipe";
  constexpr int kMaxTries = 6;
  progress("thin device: client-only at full speed");
  const auto native = client_only(setup, nullptr, kScene, kCalibratedBodies, 3);
  if (!native) return tl::unexpected(native.error());
  Calibration found{.device = "thin", .share = updates_per_s / *native};
  for (int i = 0; i < kMaxTries; ++i) {
    if (auto set = device.set_share(found.share); !set) return tl::unexpected(set.error());
    progress(fmt::format("thin device: client-only with {:.1f} % of a processor", 100 * found.share));
    // Runs as long as a row is measured, because falling bodies cost less than resting ones.
    const auto rate = client_only(setup, &device, kScene, kCalibratedBodies, setup.seconds);
    if (!rate) return tl::unexpected(rate.error());
    found.updates_per_s = *rate;
    found.slowdown = *native / *rate;
    const double off = *rate / updates_per_s;
    if (std::abs(off - 1) < 0.05) break;
    if (i + 1 < kMaxTries) found.share = std::min(found.share / off, 1.0);
  }
  return found;
}

Result<Calibration> calibrate_by_step(ThinDevice& device, double updates_per_s, double step_us) {
  Calibration found{.device = "thesis",
                    .share = updates_per_s * step_us * 1e-6 * kCalibratedBodies,
                    .updates_per_s = updates_per_s,
                    .step_us = step_us};
  found.slowdown = 1 / found.share;
  return device.set_share(found.share).map([&] { return found; });
}

std::string to_json(std::span<const FramerateRow> rows, const std::string& limited_by,
                    std::span<const Calibration> calibrations) {
  Json list = Json::array();
  for (const FramerateRow& row : rows) {
    list.push_back({{"scene", row.scene},
                    {"number", row.number},
                    {"users", row.users},
                    {"bodies", row.bodies},
                    {"method", row.method},
                    {"device", row.device},
                    {"updates_per_s", row.missing.empty() ? Json(row.updates_per_s) : Json(nullptr)},
                    {"paper_updates_per_s", in_paper(row)},
                    {"seconds", row.seconds},
                    {"client_cpu_ms", row.client_cpu_ms},
                    {"client_ms_p50", row.client_ms_p50},
                    {"latency_ms_p50", row.latency_ms_p50},
                    {"link_mbit_per_s", row.link_mbit_per_s},
                    {"dropped", row.dropped},
                    {"resyncs", row.resyncs},
                    {"stream", row.stream.empty() ? Json(nullptr) : Json(row.stream)},
                    {"bound", row.bound.empty() ? Json(nullptr) : Json(row.bound)},
                    {"missing", row.missing.empty() ? Json(nullptr) : Json(row.missing)}});
  }
  Json devices = Json::array();
  for (const Calibration& calibration : calibrations) {
    devices.push_back({{"device", calibration.device},
                       {"by", limited_by},
                       {"processor_share", calibration.share},
                       {"client_only_updates_per_s", calibration.updates_per_s},
                       {"step_us", calibration.step_us > 0 ? Json(calibration.step_us) : Json(nullptr)}});
  }
  return Json{{"devices", devices}, {"rows", list}}.dump();
}

std::string to_table(std::span<const FramerateRow> rows) {
  std::string text =
      fmt::format("{:<12} {:>5} {:>7} {:<12} {:<7} {:>9} {:>7} {:>10} {:>10} {:>11} {:>8} {:>7} {:<6} {}\n",
                  "scene", "users", "bodies", "method", "device", "updates/s", "paper", "client ms",
                  "latency ms", "link Mbit/s", "dropped", "rejoins", "stream", "bound by");
  for (const FramerateRow& row : rows) {
    text += fmt::format("{:<12} {:>5} {:>7} {:<12} {:<7} ", row.scene, row.users, row.bodies, row.method,
                        row.device);
    if (!row.missing.empty()) {
      text += fmt::format("not measured: {}\n", row.missing);
      continue;
    }
    text +=
        fmt::format("{:>9.1f} {:>7} {:>10} {:>10} {:>11} {:>8} {:>7} {:<6} {}\n", row.updates_per_s,
                    rounded(in_paper(row), 1), rounded(row.client_ms_p50, 2), rounded(row.latency_ms_p50, 1),
                    rounded(row.link_mbit_per_s, 2), row.dropped ? fmt::format("{}", *row.dropped) : "-",
                    row.resyncs ? fmt::format("{}", *row.resyncs) : "-", row.stream, row.bound);
  }
  return text;
}

}  // namespace tandem::lab
