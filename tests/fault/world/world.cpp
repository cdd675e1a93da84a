#include "tests/fault/world/world.hpp"

#include <algorithm>
#include <exception>
#include <stdexcept>
#include <utility>

#include "tests/fault/world/actors/camera.hpp"
#include "tests/fault/world/actors/client.hpp"
#include "tests/fault/world/actors/gateway.hpp"
#include "tests/fault/world/actors/recorder.hpp"
#include "tests/fault/world/faults/engine_faults.hpp"
#include "tests/support/dice/dice.hpp"

namespace tandem::world {
namespace {

constexpr std::int64_t kTickNs = kMs;
constexpr std::int64_t kChecksNs = 100 * kMs;

std::int64_t time_ns = 0;

std::int64_t heal_ns(double run_s) { return static_cast<std::int64_t>((run_s - Settings::kHealingS) * 1e9); }

class World {
 public:
  World(const RunOptions& options, const Plan& plan)
      : stage_(draw_settings(options.seed, options.seconds)),
        end_ns_(static_cast<std::int64_t>(options.seconds * 1e9)),
        camera_(stage_, options.record),
        newcomers_from_(fill()),
        chaos_(stage_, cast_, newcomers_from_, plan, heal_ns(options.seconds)) {}

  Outcome live() {
    stage_.journal.add(0, "world", text_of(stage_.settings));
    for (std::size_t i = 0; i < newcomers_from_; ++i) cast_[i]->start();
    camera_.start();
    std::uint64_t turns = 0;
    try {
      while (stage_.now_ns < end_ns_ && !stage_.finding) {
        advance();
        ++turns;
      }
      if (!stage_.finding && service_.serves_for_ns() < Rules::kPlaysNs)
        stage_.blame("getting in", "world", "there has not been one live server for 10 s");
      if (!stage_.finding)
        for (const auto& actor : cast_) actor->check_end();
    } catch (const std::exception& thrown) {
      stage_.blame("nothing throws", "world", thrown.what());
    }
    if (const auto written = camera_.finish(); !written) throw std::runtime_error(written.error().message);
    Outcome outcome;
    outcome.counts.turns = turns;
    outcome.counts.acts = stage_.truth.acts();
    outcome.counts.epochs = stage_.truth.epochs();
    outcome.counts.network = stage_.network.counts();
    const Lineage* last = stage_.truth.lineage(stage_.live_epoch);
    outcome.counts.frames = last == nullptr ? 0 : last->last;
    stage_.journal.fold(stage_.network.counts().delivered);
    stage_.journal.fold(outcome.counts.acts);
    outcome.digest = stage_.journal.digest();
    outcome.finding = stage_.finding;
    outcome.journal = std::move(stage_.journal);
    return outcome;
  }

 private:
  std::size_t fill() {
    const Service& of = service_;
    // Each start of an actor counts on from its first id.
    Dice dice(stage_.settings.seed * 0xA24BAED4963EE407ULL + 5);
    const auto first_id = [&] { return dice.next() | 1U; };
    const auto add_server = [&](const std::string& name, std::uint32_t rank) {
      auto server = std::make_unique<Server>(stage_, name, first_id(), rank);
      stage_.servers.push_back(server.get());
      cast_.push_back(std::move(server));
    };
    add_server("server", 0);
    for (const std::uint32_t rank : stage_.settings.ranks)
      add_server("standby " + std::to_string(rank), rank);
    const auto add = [&](const ClientSettings& settings, const std::string& name) {
      cast_.push_back(std::make_unique<Client>(stage_, name, settings, of, first_id()));
    };
    int number = 0;
    for (const ClientSettings& settings : stage_.settings.clients) {
      const bool participates = settings.role == transport::Role::kParticipant;
      add(settings, std::string(settings.draws ? "application "
                                : participates ? "participant "
                                               : "observer ") +
                        std::to_string(++number));
    }
    if (stage_.settings.records) {
      cast_.push_back(std::make_unique<RecorderActor>(stage_, "recorder", of, first_id()));
    }
    if (stage_.settings.has_gateway) {
      auto gateway = std::make_unique<GatewayActor>(stage_, "gateway", of, first_id());
      GatewayActor& entrance = *gateway;
      cast_.push_back(std::move(gateway));
      number = 0;
      for (const ClientSettings& settings : stage_.settings.viewers)
        cast_.push_back(std::make_unique<Browser>(stage_, "browser " + std::to_string(++number), settings,
                                                  entrance, first_id()));
    }
    const std::size_t newcomers_from = cast_.size();
    number = 0;
    for (const ClientSettings& settings : stage_.settings.newcomers)
      add(settings, "newcomer " + std::to_string(++number));
    return newcomers_from;
  }

  void advance() {
    std::int64_t next_ns = std::min({end_ns_, chaos_.wake_ns(), next_check_ns_});
    if (const auto event_ns = stage_.network.next_event_ns()) next_ns = std::min(next_ns, *event_ns);
    for (const auto& actor : cast_) next_ns = std::min(next_ns, actor->wake_ns());
    next_ns = std::min(next_ns, camera_.wake_ns());
    next_ns = (next_ns + kTickNs - 1) / kTickNs * kTickNs;
    time_ns = stage_.now_ns = std::max(next_ns, stage_.now_ns + kTickNs);
    stage_.network.advance_to(stage_.now_ns);
    chaos_.turn();
    for (const auto& actor : cast_) actor->turn();
    camera_.turn();
    service_.look();
    if (stage_.now_ns < next_check_ns_) return;
    next_check_ns_ = stage_.now_ns + kChecksNs;
    for (const auto& actor : cast_)
      if (actor->up() && !actor->paused()) actor->check();
  }

  Stage stage_;
  std::int64_t end_ns_;
  Cast cast_;
  Service service_{stage_};
  Camera camera_;
  std::size_t newcomers_from_;
  Chaos chaos_;
  std::int64_t next_check_ns_ = 0;
};

}  // namespace

Plan plan_of(const RunOptions& options, const std::vector<FaultKind>& kinds) {
  const PlanWishes wishes{.from_ms = 500, .until_ms = heal_ns(options.seconds) / kMs, .kinds = kinds};
  Plan plan = draw_plan(options.seed, wishes);
  add_engine_faults(options.seed, wishes, plan);
  return plan;
}

Outcome run_world(const RunOptions& options, const Plan& plan) {
  time_ns = 0;
  return World(options, plan).live();
}

std::int64_t living_ns() { return time_ns; }

}  // namespace tandem::world
