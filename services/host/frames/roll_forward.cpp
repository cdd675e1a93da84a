#include "services/host/frames/roll_forward.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "sdk/core/lattice/hash.hpp"
#include "services/host/news/news_desk.hpp"
#include "services/host/news/simulation_news.hpp"
#include "services/host/streams/mirror.hpp"

namespace tandem::host {
namespace {

using checkpoint::Checkpoint;
using checkpoint::ClientState;

// What a client was told, as the roster keeps it.
void remember(Checkpoint& world, const transport::InputDecision& decision) {
  transport::ParticipantId from;
  std::memcpy(from.bytes.data(), decision.participant.data(), from.bytes.size());
  auto known = std::ranges::find_if(world.clients, [&](const ClientState& client) {
    return client.id == decision.client && client.from == from;
  });
  if (known == world.clients.end()) {
    world.clients.push_back({.id = decision.client, .from = from, .highest = 0, .outcomes = {}});
    known = world.clients.end() - 1;
  }
  known->highest = std::max(known->highest, decision.number);
  if (known->outcomes.size() >= transport::kReplyRing) known->outcomes.erase(known->outcomes.begin());
  known->outcomes.push_back({decision.number, decision.frame, decision.code});
}

// `later`: immediate inputs that were accepted while a step was under way, and so act on the one after it.
// The journal is another machine's, and the simulation acts on its inputs without a further look.
Result<void> decide(Checkpoint& world, const engine::Simulation& simulation,
                    const transport::InputDecision& decision, std::vector<engine::Input>& later) {
  using Effect = engine::Classification::Effect;
  if (decision.client != 0) remember(world, decision);
  if (decision.code != static_cast<std::uint32_t>(transport::Reason::kNone)) return {};
  engine::Input input{.kind = decision.kind, .values = decision.values, .bytes = decision.bytes};
  const bool immediate = decision.scheduled == 0;
  if (simulation.classify(input).effect != (immediate ? Effect::kImmediate : Effect::kScheduled))
    return fail(ErrorCode::kMalformed, "the engine refuses an input that the live server accepted");
  if (immediate) {
    (decision.frame > world.frame + 1 ? later : world.immediate).push_back(std::move(input));
    return {};
  }
  const Frame least = world.scheduled.empty() ? world.frame + 1 : world.scheduled.back().frame;
  if (decision.scheduled != world.last_input + 1 || decision.frame < least)
    return fail(ErrorCode::kMalformed, "the journal's scheduled inputs are not in order");
  world.scheduled.push_back({decision.scheduled, decision.frame, std::move(input)});
  world.last_input = decision.scheduled;
  return {};
}

// In the order of LiveSource.
void apply(Checkpoint& world, engine::Simulation& simulation) {
  const auto later = std::ranges::find_if(
      world.scheduled, [&](const checkpoint::Scheduled& waiting) { return waiting.frame > world.frame + 1; });
  for (auto it = world.scheduled.begin(); it != later; ++it) simulation.apply(it->input);
  world.scheduled.erase(world.scheduled.begin(), later);
  for (const engine::Input& input : world.immediate) simulation.apply(input);
  world.immediate.clear();
}

}  // namespace

Result<Checkpoint> roll_forward(const HostConfig& config, engine::Simulation& simulation, Checkpoint from,
                                std::span<const transport::JournalMessage> journal) {
  Checkpoint world = std::move(from);
  auto mirror = make_mirror(config.streams, simulation.bodies(), config.extent);
  if (!mirror) return tl::unexpected(mirror.error());
  mirror->restore(world.next_reuse, world.withheld);
  const Layout& layout = config.streams.front().layout;
  NewsDesk news(layout.world, layout.capacity);
  SimulationNews of_simulation;
  if (!world.world.empty()) {
    if (auto good = news.restore(world.world, world.waiting_news); !good) return tl::unexpected(good.error());
  }
  StateHasher hasher;
  std::vector<engine::Input> later = std::move(world.later);
  for (const transport::JournalMessage& entry : journal) {
    for (const transport::InputDecision& decision : entry.decisions)
      if (auto good = decide(world, simulation, decision, later); !good) return tl::unexpected(good.error());
    if (entry.state == transport::JournalState::kNotMade) continue;
    if (entry.frame != world.frame + 1) return fail(ErrorCode::kMalformed, "the journal leaves out a frame");
    apply(world, simulation);
    world.immediate.swap(later);
    simulation.step();
    if (std::string why = simulation.failure(); !why.empty()) return fail(ErrorCode::kIo, std::move(why));
    const engine::Bodies bodies = simulation.bodies();
    if (auto good = mirror->check(bodies); !good) return tl::unexpected(good.error());
    mirror->update(bodies, simulation.events());
    // What the simulation tells beyond what a frame holds waits here as it did at the live server.
    if (layout.world.any()) of_simulation.ask(simulation, news, world.frame + 1);
    if (auto good = news.follow(entry.news); !good) return tl::unexpected(good.error());
    ++world.frame;
    if (hasher.hash(mirror->target()) != entry.hash)
      return fail(ErrorCode::kMismatch,
                  fmt::format("this machine makes another frame {} than the live server did", world.frame));
  }
  if (layout.world.any()) news.save(world.world, world.waiting_news);
  world.later = std::move(later);  // their senders were told so
  world.gravity = simulation.gravity();
  world.damping_per_s = simulation.damping_per_s();
  world.bodies = mirror->target().alive_count();
  mirror->save(world.next_reuse, world.withheld);
  return world;
}

Result<Continued> continue_world(const HostConfig& config, engine::Simulation& simulation,
                                 const Checkpoint& from, std::span<const transport::JournalMessage> journal) {
  constexpr const char* kRefused = "the engine refuses its part of the checkpoint";
  if (!simulation.load(from.engine_state)) return fail(ErrorCode::kMismatch, kRefused);
  auto world = roll_forward(config, simulation, from, journal);
  if (world) return Continued{std::move(*world), {}};
  if (!simulation.load(from.engine_state)) return fail(ErrorCode::kMismatch, kRefused);
  return Continued{from, std::move(world.error().message)};
}

}  // namespace tandem::host
