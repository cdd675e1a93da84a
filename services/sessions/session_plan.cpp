#include "services/sessions/session_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/core/codec/paper/code_tables.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "services/host/streams/block_threads.hpp"
#include "services/host/streams/groups.hpp"
#include "services/sessions/contact_plan.hpp"

namespace tandem::sessions {
namespace {

std::vector<std::byte> codec_tables(const scenes::TrainedTable& table, const Groups& groups) {
  std::vector<std::byte> bytes;
  const auto append = [&bytes](const std::vector<std::uint8_t>& lengths) {
    for (const std::uint8_t length : lengths) bytes.push_back(std::byte{length});
  };
  const std::vector<std::byte> usual = default_code_tables(groups);
  append(table.position_code_lengths);
  append(table.velocity_code_lengths);
  if (bytes.empty()) return usual;
  if (!groups.orientation) return bytes;
  append(table.turn_code_lengths);
  append(table.spin_code_lengths);
  // Of a table that was trained before bodies turned.
  if (table.turn_code_lengths.empty()) bytes.insert(bytes.end(), usual.begin() + 2 * kSymbols, usual.end());
  return bytes;
}

Result<void> choose_groups(const scenes::Scene& scene, const host::Lattice& lattice,
                           const CodecTraits& traits, Layout& layout) {
  std::vector<host::BodySize> sizes;
  for (const scenes::BodyType& type : scene.types) sizes.push_back({type.name, type.bounding_radius_m});
  return host::choose_groups(scene.turns, sizes, lattice, traits, layout);
}

// Where the codec reads them and bodies turn.
Result<void> choose_turn_steps(const scenes::Scene& scene, const scenes::TrainedTable& table,
                               const CodecTraits& traits, host::StreamConfig& stream) {
  if (!traits.reads_steps || !groups_of(stream.layout).orientation) return {};
  const double smallest =
      std::ranges::min(scene.types, {}, &scenes::BodyType::bounding_radius_m).bounding_radius_m;
  return host::set_turn_steps(stream.lattice, table.turn_range_rad, table.spin_range_rad_per_s, smallest,
                              stream.layout.parameters.codec);
}

// Cells are as large as the largest bodies, and hold so many smaller ones at most.
bool alike(const std::vector<engine::ParticleType>& types) {
  if (types.empty()) return false;
  const auto [smallest, largest] = std::ranges::minmax(types, {}, &engine::ParticleType::radius);
  return smallest.radius >= 0.5F * largest.radius;
}

bool are_spheres(const std::vector<scenes::BodyType>& types) {
  return std::ranges::all_of(
      types, [](const scenes::BodyType& type) { return type.shape.kind == engine::Shape::Kind::kSphere; });
}

bool suits(const PredictorTraits& predictor, const scenes::Scene& scene, const SessionChoice& choice,
           const CodecTraits& traits) {
  if (traits.is_baseline) return predictor.name == basic_predictor().name;
  return choice.bodies <= predictor.most_bodies &&
         (!predictor.only_spheres || (are_spheres(scene.types) && alike(scene.world.types)));
}

Result<void> set_predictor(const scenes::Scene& scene, const PredictorTraits& predictor,
                           host::StreamConfig& stream) {
  if (predictor.reads_world) {
    auto constants = contact_constants(scene, stream.lattice, predictor.name);
    if (!constants) return tl::unexpected(constants.error());
    stream.layout.predictor_constants = std::move(*constants);
  }
  stream.layout.predictor = predictor.name;
  return {};
}

// Sets the predictor and its constants.
Result<void> choose_predictor(const scenes::Scene& scene, const SessionChoice& choice,
                              const CodecTraits& traits, host::StreamConfig& stream) {
  if (choice.predictor != kAutomaticPredictor) {
    const auto predictor = find_predictor(choice.predictor);
    if (!predictor) return tl::unexpected(predictor.error());
    return set_predictor(scene, **predictor, stream);
  }
  for (const PredictorTraits& predictor : predictors())
    if (suits(predictor, scene, choice, traits) && set_predictor(scene, predictor, stream)) return {};
  return set_predictor(scene, basic_predictor(), stream);
}

/// Of a stream, in metres.
struct Thresholds {
  double first = 0, finest = 0;
};

Thresholds thresholds_of(const scenes::Scene& scene, const SessionChoice& choice) {
  const double stated_m = choice.threshold_m.value_or(scene.threshold_m * choice.threshold_scale);
  if (!choice.automatic) return {stated_m, stated_m};
  const double first_m = std::min(stated_m, choice.max_error_m.value_or(stated_m));
  return {first_m, first_m * host::kFinestShare};
}

// On a lattice that the session's streams share.
Result<host::StreamConfig> plan_on(const host::Lattice& session_lattice, const scenes::Scene& scene,
                                   const SessionChoice& choice) {
  const auto traits = codec_traits(choice.codec);
  if (!traits) return tl::unexpected(traits.error());
  const host::Lattice* const lattice = &session_lattice;
  const auto [threshold_m, finest_m] = thresholds_of(scene, choice);
  const scenes::TrainedTable* trained = scenes::nearest_table(scene.trained, choice.bodies, threshold_m);
  const scenes::TrainedTable table = trained == nullptr ? scenes::TrainedTable{} : *trained;
  const auto parameters =
      host::codec_parameters(*lattice, threshold_m, table.position_range_m, table.velocity_range_m_per_s);
  if (!parameters) return tl::unexpected(parameters.error());

  host::StreamConfig stream;
  if (choice.automatic) {
    stream.quality = host::quality_goal(*lattice, choice.target_mbit_per_s, finest_m,
                                        choice.max_error_m.value_or(threshold_m * host::kCoarsestShare));
  }
  stream.lattice = *lattice;
  stream.layout.capacity = choice.bodies;
  stream.layout.type_count = static_cast<TypeId>(scene.types.size());
  if (auto chosen = choose_groups(scene, *lattice, *traits, stream.layout); !chosen)
    return tl::unexpected(chosen.error());
  stream.layout.parameters.codec = *parameters;
  if (auto chosen = choose_turn_steps(scene, table, *traits, stream); !chosen)
    return tl::unexpected(chosen.error());
  stream.layout.codec = choice.codec;
  if (traits->takes_tables) stream.layout.codec_tables = codec_tables(table, groups_of(stream.layout));
  if (traits->takes_budget) stream.budget = choice.budget_bytes.value_or(traits->usual_budget);
  if (auto chosen = choose_predictor(scene, choice, *traits, stream); !chosen)
    return tl::unexpected(chosen.error());
  if (traits->reads_gains) {
    if (auto gained = host::choose_gains(stream); !gained) return tl::unexpected(gained.error());
  }
  stream.local.run_blocks = host::blocks_on_threads(choice.threads);
  return stream;
}

tl::unexpected<Error> of_stream(const std::string& name, const Error& error) {
  if (name.empty()) return tl::unexpected(error);
  return fail(error.code, fmt::format("stream {}: {}", name, error.message));
}

}  // namespace

SessionChoice choice_of(const SessionChoice& session, const StreamChoice& stream) {
  SessionChoice choice = session;
  choice.streams.clear();
  choice.codec = stream.codec.value_or(session.codec);
  choice.predictor = stream.predictor.value_or(session.predictor);
  if (stream.threshold_m) {
    choice.threshold_m = stream.threshold_m;
    choice.automatic = false;
  }
  if (stream.target_mbit_per_s) {
    choice.target_mbit_per_s = *stream.target_mbit_per_s;
    choice.automatic = true;
  }
  if (stream.max_error_m) choice.max_error_m = stream.max_error_m;
  if (stream.budget_bytes) choice.budget_bytes = stream.budget_bytes;
  const auto traits = codec_traits(choice.codec);
  if (traits && !traits->reads_threshold) choice.automatic = false;
  return choice;
}

Result<host::StreamConfig> plan_stream(const scenes::Scene& scene, const SessionChoice& choice) {
  return host::choose_lattice(thresholds_of(scene, choice).finest, scene.extent_m, scene.dt_s)
      .and_then([&](const host::Lattice& lattice) { return plan_on(lattice, scene, choice); });
}

Result<std::vector<StreamChoice>> usual_streams(const scenes::Scene& scene, const SessionChoice& choice) {
  std::vector<StreamChoice> streams;
  if (choice.predictor != kAutomaticPredictor) return streams;
  const auto one = plan_stream(scene, choice);
  if (!one) return tl::unexpected(one.error());
  const std::string basic(basic_predictor().name);
  if (one->layout.predictor == basic) return streams;
  streams.push_back({.name = "thin", .predictor = basic});
  streams.push_back({.name = "rich", .predictor = one->layout.predictor});
  return streams;
}

Result<host::HostConfig> plan_session(const scenes::Scene& scene, const SessionChoice& choice) {
  const std::vector<StreamChoice> streams =
      choice.streams.empty() ? std::vector<StreamChoice>(1) : choice.streams;
  const auto finest = std::ranges::min_element(streams, {}, [&](const StreamChoice& stream) {
    return thresholds_of(scene, choice_of(choice, stream)).finest;
  });
  const auto lattice = host::choose_lattice(thresholds_of(scene, choice_of(choice, *finest)).finest,
                                            scene.extent_m, scene.dt_s);
  if (!lattice) return of_stream(finest->name, lattice.error());
  host::HostConfig config;
  for (const StreamChoice& stream : streams) {
    auto planned = plan_on(*lattice, scene, choice_of(choice, stream));
    if (!planned) return of_stream(stream.name, planned.error());
    planned->name = stream.name;
    config.streams.push_back(std::move(*planned));
  }
  if (auto named = host::check_stream_names(config.streams); !named) return tl::unexpected(named.error());
  config.frame_rate_hz = 1 / scene.dt_s;
  config.scene = scene.name;
  config.scene_description = scene.text;
  config.types.clear();
  for (const scenes::BodyType& type : scene.types) {
    config.types.push_back({.name = type.name,
                            .radius = static_cast<float>(type.bounding_radius_m),
                            .colour_rgba = type.colour_rgba,
                            .shape = static_cast<transport::Shape>(type.shape.kind),
                            .shape_values = type.shape.values});
  }
  return config;
}

}  // namespace tandem::sessions
