#include "tests/fault/world/settings.hpp"

#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <utility>

#include "sdk/core/codec/paper/code_tables.hpp"
#include "sdk/wire/units.hpp"
#include "services/host/streams/gains.hpp"
#include "services/host/streams/lattice_choice.hpp"
#include "tests/support/dice/dice.hpp"

namespace tandem::world {
namespace {

constexpr double kExtent = 20;

template <class T>
T must(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

/// Bodies that appear, fall and are removed, so that slots are used again.
engine::EngineWorld fountain(Dice& dice) {
  engine::EngineWorld world;
  const bool large = dice.chance(0.12);  // snapshots have several parts
  world.capacity = static_cast<std::uint32_t>(large ? 400 + dice.below(600) : 40 + dice.below(60));
  world.seed = dice.next();
  world.types = {{0.3F, 1}};
  world.low = {-20, -20, -20};
  world.high = {20, 20, 20};
  world.planes = {{{0, 1, 0}, -2}};
  world.emitters = {{{-3, 3, -3}, {3, 4, 3}, {0, 2, 0}, dice.uniform(5, 25) * (large ? 20 : 1), 0}};
  world.regions = {{{-20, -3, -20}, {20, -1.2F, 20}, engine::Region::Action::kRemove, {}, 0}};
  return world;
}

ClientSettings draw_client(Dice& dice) {
  static constexpr const char* kPreferences[] = {"", "bandwidth", "computing", "error"};
  ClientSettings client;
  client.role = dice.chance(0.7) ? transport::Role::kParticipant : transport::Role::kObserver;
  client.lead = static_cast<std::uint32_t>(dice.below(3));  // 2 is more than any session allows
  client.prefer = kPreferences[dice.below(4)];
  client.inputs_per_s = dice.chance(0.3) ? 0 : dice.uniform(0.2, 4);
  client.draws = dice.chance(0.2);
  return client;
}

host::StreamConfig stream_config(const Settings& settings, std::size_t index, const host::Lattice& lattice) {
  const std::string& codec = settings.codecs[index];
  host::StreamConfig stream;
  if (settings.codecs.size() > 1) stream.name = "stream" + std::to_string(index);
  stream.layout.capacity = settings.scene.capacity;
  stream.layout.codec = codec;
  stream.layout.lead = settings.lead;
  if (codec == "limited") stream.budget = 600;
  if (codec == "entropy" || codec == "limited") stream.layout.codec_tables = default_code_tables();
  stream.lattice = lattice;
  const double threshold = index == 0 ? 0.01 : 0.02 * static_cast<double>(index);
  stream.layout.parameters.codec = must(host::codec_parameters(lattice, threshold, 0.1, 2));
  if (codec == "tracker" && !host::choose_gains(stream)) throw std::runtime_error("no gains");
  return stream;
}

}  // namespace

Settings draw_settings(std::uint64_t seed, double seconds) {
  static constexpr const char* kCodecs[] = {"none",    "selective", "quantized", "entropy",
                                            "limited", "tracker",   "tracker"};
  Dice dice(seed * 0xD1342543DE82EF95ULL + 1);
  Settings settings;
  settings.seed = seed;
  settings.engine_process = has_engine_process(seed);
  settings.seconds = seconds;
  settings.frame_rate_hz = dice.chance(0.8) ? 30 : dice.chance(0.5) ? 20 : 60;
  settings.scene = fountain(dice);
  settings.scene.dt_s = static_cast<float>(1 / settings.frame_rate_hz);
  const std::uint64_t streams = dice.chance(0.7) ? 1 : 2 + dice.below(2);
  for (std::uint64_t i = 0; i < streams; ++i) settings.codecs.emplace_back(kCodecs[dice.below(7)]);
  settings.lead = static_cast<std::uint32_t>(dice.below(2));
  settings.link.delay_ns = static_cast<std::int64_t>(dice.uniform(0.1e6, 20e6));
  settings.link.jitter_ns = static_cast<std::int64_t>(dice.uniform(0, 10e6));
  settings.link.loss = dice.chance(0.3) ? dice.uniform(0, 0.03) : 0;
  // A fixed window that is narrower than the round trip makes observers of participants, and that is right.
  const bool near = settings.link.delay_ns < 4 * kMillisecond && settings.link.loss == 0;
  settings.narrow_window = dice.chance(0.5) && near && settings.frame_rate_hz <= 30;
  if (settings.narrow_window) settings.link.jitter_ns = std::min(settings.link.jitter_ns, 4 * kMillisecond);
  for (std::uint64_t i = 1 + dice.below(3); i > 0; --i) settings.clients.push_back(draw_client(dice));
  settings.clients.front().role = transport::Role::kParticipant;
  for (int i = 0; i < 2; ++i) settings.newcomers.push_back(draw_client(dice));
  if (dice.chance(0.45)) {
    settings.ranks = {1};
    if (dice.chance(0.4)) settings.ranks = dice.chance(0.5) ? std::vector{1U, 2U} : std::vector{3U, 1U};
    settings.swaps = dice.chance(0.5);
  }
  settings.records = dice.chance(0.5);
  settings.has_gateway = dice.chance(0.5);
  for (std::uint64_t i = settings.has_gateway ? 1 + dice.below(2) : 0; i > 0; --i)
    settings.viewers.push_back(draw_client(dice));
  return settings;
}

std::string text_of(const Settings& settings) {
  std::string codecs;
  for (const std::string& codec : settings.codecs) codecs += (codecs.empty() ? "" : ", ") + codec;
  std::string standbys;
  for (const std::uint32_t rank : settings.ranks) standbys += ", a standby of rank " + std::to_string(rank);
  if (settings.engine_process) standbys += ", engines in processes of their own";
  if (settings.swaps) standbys += " (who is replaced stands by)";
  char text[320];
  std::snprintf(
      text, sizeof text,
      "%zu clients, %zu viewers%s%s and a server of %u bodies at %g Hz, %s, lead %u%s; links of %.1f ms, %.1f ms of jitter, %.1f %% lost",
      settings.clients.size(), settings.viewers.size(), settings.records ? ", a recorder" : "",
      standbys.c_str(), settings.scene.capacity, settings.frame_rate_hz, codecs.c_str(), settings.lead,
      settings.narrow_window ? ", a window of 2" : "", 1e-6 * static_cast<double>(settings.link.delay_ns),
      1e-6 * static_cast<double>(settings.link.jitter_ns), 100 * settings.link.loss);
  return text;
}

host::HostConfig host_config(const Settings& settings) {
  host::HostConfig config;
  config.frame_rate_hz = settings.frame_rate_hz;
  config.engine = "particles";
  config.scene = "fountain";
  config.pipeline = settings.engine_process;
  config.types = {{"ball", 0.3F, 0xFFFFFFFF}};
  if (settings.narrow_window) config.window = 2;
  const host::Lattice lattice =
      must(host::choose_lattice(0.01, kExtent, static_cast<double>(settings.scene.dt_s)));
  for (std::size_t i = 0; i < settings.codecs.size(); ++i)
    config.streams.push_back(stream_config(settings, i, lattice));
  return config;
}

}  // namespace tandem::world
