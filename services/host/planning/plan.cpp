#include "services/host/planning/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/core/codec/paper/code_tables.hpp"
#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/workers/block_threads.hpp"
#include "services/host/planning/contact_plan.hpp"
#include "services/host/planning/scenery_json.hpp"
#include "services/host/streams/groups.hpp"

namespace tandem::planning {
namespace {

std::vector<std::byte> codec_tables(const TrainedTable& table, const Groups& groups) {
  std::vector<std::byte> bytes;
  const auto append = [&bytes](const std::vector<std::uint8_t>& lengths) {
    for (const std::uint8_t length : lengths) bytes.push_back(std::byte{length});
  };
  std::vector<std::byte> usual = default_code_tables(groups);
  append(table.position_code_lengths);
  append(table.velocity_code_lengths);
  if (bytes.empty()) return usual;
  if (!groups.orientation) return bytes;
  append(table.turn_code_lengths);
  append(table.spin_code_lengths);
  // The table was trained before bodies turned.
  if (table.turn_code_lengths.empty()) bytes.insert(bytes.end(), usual.begin() + 2 * kSymbols, usual.end());
  return bytes;
}

Result<void> choose_groups(const PlannedWorld& world, const CodecTraits& traits, host::StreamConfig& stream) {
  std::vector<host::BodySize> sizes;
  for (const BodyType& type : world.types) sizes.push_back({type.name, type.bounding_radius});
  return host::choose_groups(world.turns, sizes, stream.lattice, traits, stream.layout);
}

// Sets the steps of turns if the codec reads them and bodies turn.
Result<void> choose_turn_steps(const PlannedWorld& world, const TrainedTable& table,
                               const CodecTraits& traits, host::StreamConfig& stream) {
  if (!traits.reads_steps || !groups_of(stream.layout).orientation) return {};
  const double smallest = std::ranges::min(world.types, {}, &BodyType::bounding_radius).bounding_radius;
  return host::set_turn_steps(stream.lattice, table.turn_range_rad, table.spin_range_rad_per_s, smallest,
                              stream.layout.parameters.codec);
}

// Cells are as large as the largest bodies and hold only a limited number of smaller ones.
bool are_alike(const std::vector<BodyType>& types) {
  if (types.empty()) return false;
  const auto [smallest, largest] = std::ranges::minmax(types, {}, &BodyType::contact_radius);
  return smallest.contact_radius >= 0.5 * largest.contact_radius;
}

bool are_spheres(const std::vector<BodyType>& types) {
  return std::ranges::all_of(types, [](const BodyType& type) { return type.shape == BodyShape::kSphere; });
}

bool suits(const PredictorTraits& predictor, const PlannedWorld& world, const CodecTraits& traits) {
  if (traits.is_baseline) return predictor.name == basic_predictor().name;
  return world.capacity <= predictor.most_bodies && (!predictor.reads_world || world.scenery) &&
         (!predictor.only_spheres || (are_spheres(world.types) && are_alike(world.types)));
}

// With more bodies a trial of a stream whose step is dear would take a large part of a frame.
constexpr std::uint32_t kMaxForTrialOfRich = 20'000;

// True for a predictor that may pay beside the one that is chosen, which only a trial can tell.
bool is_worth_a_trial(const PredictorTraits& predictor, const PlannedWorld& world, const Wishes& wishes) {
  if (world.capacity > predictor.most_on_trial) return false;
  const auto traits = codec_traits(wishes.codec);
  if (!traits || traits->is_baseline) return false;
  if (predictor.only_spheres != (are_spheres(world.types) && are_alike(world.types))) return false;
  Wishes tried = wishes;
  tried.predictor = predictor.name;
  return plan_stream(world, tried).has_value();
}

Result<void> set_predictor(const PlannedWorld& world, const PredictorTraits& predictor,
                           host::StreamConfig& stream) {
  if (predictor.reads_world) return set_contact(world, predictor, stream);
  stream.layout.predictor = predictor.name;
  return {};
}

// Sets the predictor and its constants.
Result<void> choose_predictor(const PlannedWorld& world, const Wishes& wishes, const CodecTraits& traits,
                              host::StreamConfig& stream) {
  if (wishes.predictor != kAutomaticPredictor) {
    if (auto known = check_known_predictor(wishes.predictor); !known) return known;
    return set_predictor(world, **find_predictor(wishes.predictor), stream);
  }
  for (const PredictorTraits& predictor : predictors()) {
    if (!suits(predictor, world, traits)) continue;
    // Skips a predictor for which the lattice is too fine, but reports a world that is described wrongly.
    auto set = set_predictor(world, predictor, stream);
    if (set || set.error().code != ErrorCode::kCapacity) return set;
  }
  return set_predictor(world, basic_predictor(), stream);
}

/// The thresholds of a stream, in metres.
struct Thresholds {
  double first = 0, finest = 0;
};

Thresholds thresholds_of(const PlannedWorld& world, const Wishes& wishes) {
  const double stated_m = wishes.threshold_m.value_or(world.threshold * wishes.threshold_scale);
  if (!wishes.automatic && !wishes.cap_kbit_s) return {stated_m, stated_m};
  const double first_m = std::min(stated_m, wishes.max_error_m.value_or(stated_m));
  if (!wishes.automatic) return {first_m, first_m};
  return {first_m, first_m * host::kFinestShare};
}

std::uint32_t milliseconds(double seconds) { return static_cast<std::uint32_t>(std::lround(seconds * 1e3)); }

// Plans a stream on the lattice that the session's streams share.
Result<host::StreamConfig> plan_on(const host::Lattice& lattice, const PlannedWorld& world,
                                   const Wishes& wishes) {
  const auto traits = codec_traits(wishes.codec);
  if (!traits) return tl::unexpected(traits.error());
  const auto [threshold_m, finest_m] = thresholds_of(world, wishes);
  const TrainedTable* const trained = nearest_table(world.trained, world.capacity, threshold_m);
  const TrainedTable table = trained == nullptr ? TrainedTable{} : *trained;
  const auto parameters =
      host::codec_parameters(lattice, threshold_m, table.position_range_m, table.velocity_range_m_per_s);
  if (!parameters) return tl::unexpected(parameters.error());

  host::StreamConfig stream;
  const double coarsest = wishes.cap_kbit_s ? host::kCoarsestShareOfCap : host::kCoarsestShare;
  if (wishes.automatic || (wishes.cap_kbit_s && traits->reads_threshold)) {
    stream.quality = host::quality_goal(lattice, wishes.target_mbit_per_s, finest_m,
                                        wishes.max_error_m.value_or(threshold_m * coarsest));
  }
  stream.cap_kbit_s = static_cast<std::uint32_t>(wishes.cap_kbit_s.value_or(0));
  stream.lattice = lattice;
  stream.layout.capacity = world.capacity;
  stream.layout.type_count = static_cast<TypeId>(world.types.size());
  if (auto chosen = choose_groups(world, *traits, stream); !chosen) return tl::unexpected(chosen.error());
  stream.layout.parameters.codec = *parameters;
  if (auto chosen = choose_turn_steps(world, table, *traits, stream); !chosen)
    return tl::unexpected(chosen.error());
  stream.layout.codec = wishes.codec;
  if (traits->takes_tables) stream.layout.codec_tables = codec_tables(table, groups_of(stream.layout));
  if (!wishes.delays_s.empty()) stream.delay_ms = milliseconds(std::ranges::min(wishes.delays_s));
  stream.has_data = wishes.data != "no";
  stream.data_kbit_s = wishes.data_kbit_s;
  if (traits->takes_budget) stream.budget = wishes.budget_bytes.value_or(traits->usual_budget);
  if (auto chosen = choose_predictor(world, wishes, *traits, stream); !chosen)
    return tl::unexpected(chosen.error());
  if (traits->reads_gains) {
    if (auto gained = host::choose_gains(stream); !gained) return tl::unexpected(gained.error());
  }
  stream.local.run_blocks = blocks_on_threads(wishes.threads, Callers::kOne);
  return stream;
}

tl::unexpected<Error> of_stream(const std::string& name, const Error& error) {
  if (name.empty()) return tl::unexpected(error);
  return fail(error.code, fmt::format("stream {}: {}", name, error.message));
}

/// A stream's name and all its wishes.
struct Wished {
  std::string name;
  Wishes wishes;
  host::Offered offered = host::Offered::kAlways;
};

Result<std::vector<Wished>> all_streams(const Wishes& wishes) {
  std::vector<Wished> all;
  if (wishes.streams.empty()) all.push_back({{}, wishes});
  for (const StreamWishes& stream : wishes.streams) {
    if (stream.name.empty()) return fail(ErrorCode::kInvalidArgument, "every stream needs a name");
    auto of = wishes_of(wishes, stream);
    if (!of) return of_stream(stream.name, of.error());
    all.push_back({stream.name, std::move(*of), stream.offered});
  }
  return all;
}

// Offers the planned streams in a second delay where that is wished: behind all streams, whose ids stay.
Result<void> add_second_offers(const std::vector<Wished>& streams, host::HostConfig& config) {
  TANDEM_ASSERT(streams.size() == config.streams.size());
  for (std::size_t i = 0; i < streams.size(); ++i) {
    const std::vector<double>& delays_s = streams[i].wishes.delays_s;
    if (delays_s.size() < host::kMaxDelays) continue;
    host::StreamConfig offer = config.streams[i];
    offer.delay_ms = milliseconds(std::ranges::max(delays_s));
    config.streams.push_back(std::move(offer));
  }
  if (config.streams.size() <= transport::kMaxStreams) return {};
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("delivery-delay: {} streams in so many delays are {} offers, and a session has {}",
                          streams.size(), config.streams.size(), transport::kMaxStreams));
}

// Streams of which nobody says in which delays they are offered.
std::vector<double> usual_delays(const std::vector<Wished>& streams) {
  std::size_t offers = 0;
  for (const Wished& stream : streams)
    offers += stream.wishes.delays_s.empty() ? kUsualDelaysS.size() : stream.wishes.delays_s.size();
  if (offers > transport::kMaxStreams) return {kUsualDelaysS.front()};
  return {kUsualDelaysS.begin(), kUsualDelaysS.end()};
}

}  // namespace

Result<host::StreamConfig> plan_stream(const PlannedWorld& world, const Wishes& wishes) {
  return host::choose_lattice(thresholds_of(world, wishes).finest, world.extent, world.dt_s)
      .and_then([&](const host::Lattice& lattice) { return plan_on(lattice, world, wishes); });
}

Result<std::vector<StreamWishes>> usual_streams(const PlannedWorld& world, const Wishes& wishes) {
  std::vector<StreamWishes> streams;
  if (wishes.predictor != kAutomaticPredictor) return streams;
  const auto one = plan_stream(world, wishes);
  if (!one) return tl::unexpected(one.error());
  const std::string basic(basic_predictor().name);
  using host::Offered;
  const auto with = [](std::string name, std::string_view predictor, Offered offered) {
    return StreamWishes{std::move(name), {{"predictor", std::string(predictor)}}, offered};
  };
  streams.push_back(with("thin", basic, Offered::kAlways));
  if (one->layout.predictor != basic)
    streams.push_back(with("rich", one->layout.predictor,
                           world.capacity <= kMaxForTrialOfRich ? Offered::kWhileItPays : Offered::kAlways));
  for (const PredictorTraits& predictor : predictors()) {
    if (!wishes.automatic && is_worth_a_trial(predictor, world, wishes))
      streams.push_back(with(std::string(predictor.name), predictor.name, Offered::kOnceItPays));
  }
  if (streams.size() == 1) streams.clear();
  return streams;
}

Result<host::HostConfig> plan_session(const PlannedWorld& world, const Wishes& wishes) {
  const auto streams = all_streams(wishes);
  if (!streams) return tl::unexpected(streams.error());
  TANDEM_ASSERT(!streams->empty());
  const auto finest = std::ranges::min_element(
      *streams, {}, [&](const Wished& stream) { return thresholds_of(world, stream.wishes).finest; });
  const auto lattice =
      host::choose_lattice(thresholds_of(world, finest->wishes).finest, world.extent, world.dt_s);
  if (!lattice) return of_stream(finest->name, lattice.error());
  host::HostConfig config;
  for (const Wished& stream : *streams) {
    auto planned = plan_on(*lattice, world, stream.wishes);
    if (!planned) return of_stream(stream.name, planned.error());
    planned->name = stream.name;
    planned->offered = stream.offered;
    config.streams.push_back(std::move(*planned));
  }
  if (auto named = host::check_stream_names(config.streams); !named) return tl::unexpected(named.error());
  if (auto added = add_second_offers(*streams, config); !added) return tl::unexpected(added.error());
  config.extent = world.extent;
  config.frame_rate_hz = 1 / world.dt_s;
  config.up_axis = world.up_axis;
  config.scene = world.name;
  config.scene_json =
      world.scene_json.empty() && world.scenery ? scenery_json(*world.scenery, world.dt_s) : world.scene_json;
  config.types.clear();
  for (const BodyType& type : world.types) {
    config.types.push_back({.name = type.name,
                            .radius = static_cast<float>(type.bounding_radius),
                            .colour_rgba = type.colour_rgba,
                            .shape = type.shape,
                            .shape_values = type.shape_values});
  }
  return config;
}

Result<host::HostConfig> plan_server(const PlannedWorld& world, Wishes wishes, const ServiceWishes& service) {
  if (auto good = check_wishes(wishes); !good) return tl::unexpected(good.error());
  if (auto good = check_service(service); !good) return tl::unexpected(good.error());
  if (auto known = check_known_predictor(wishes.predictor); !known) return tl::unexpected(known.error());
  if (wishes.streams.empty()) {
    auto usual = usual_streams(world, wishes);
    if (!usual) return tl::unexpected(usual.error());
    wishes.streams = std::move(*usual);
  }
  if (wishes.delays_s.empty()) {
    const auto streams = all_streams(wishes);
    if (!streams) return tl::unexpected(streams.error());
    wishes.delays_s = usual_delays(*streams);
  }
  return plan_session(world, wishes).map([&](host::HostConfig&& config) {
    config.session = service.session;
    config.epoch = static_cast<Epoch>(transport::wall_ns() / kMillisecond);
    config.clock_ns = &transport::steady_ns;
    if (service.rate_hz) config.frame_rate_hz = *service.rate_hz;
    config.free_rate = service.free_rate;
    for (host::StreamConfig& stream : config.streams) {
      stream.layout.lead = service.lead;
      stream.layout.world = world.tells;
    }
    config.window = service.window;
    config.stall_timeout_ns.reset();
    if (service.stall_timeout_s)
      config.stall_timeout_ns = static_cast<std::int64_t>(*service.stall_timeout_s * 1e9);
    config.wait_for = service.wait_for;
    config.client_limit = service.client_limit;
    return std::move(config);
  });
}

}  // namespace tandem::planning
