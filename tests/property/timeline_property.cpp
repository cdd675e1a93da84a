#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <deque>
#include <map>

#include "sdk/core/predict/ballistic/ballistic.hpp"
#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "tests/property/synthetic.hpp"

// Any interleaving of simulated frames, scheduled inputs and deltas ends with the server's state, bit by bit.

namespace tandem {
namespace {

using synthetic::Random;

/// Ballistic, and each body is drawn to the next slot's: a correction of one spreads to its neighbours.
class Chained final : public Predictor {
 public:
  explicit Chained(std::uint32_t capacity) : before_(capacity) {}
  void step(const State& from, State& to, const StepInput& input) override {
    before_ = from;
    ballistic_.step(from, to, input);
    for (Slot slot = 0; slot + 1 < to.capacity(); ++slot) {
      if (to.alive()[slot] == 0 || to.alive()[slot + 1] == 0) continue;
      for (std::size_t i = 0; i < kPositionChannels; ++i) {
        const std::int64_t pull = (std::int64_t{before_.p(i)[slot + 1]} - before_.p(i)[slot]) >> 8U;
        const std::int64_t limit = kVelocityLimit;
        to.v(i)[slot] = static_cast<std::int32_t>(std::clamp(to.v(i)[slot] + pull, -limit, limit));
      }
    }
  }
  void step_slots(const State&, State&, const StepInput&, std::span<const Slot>) override {
    FAIL() << "bodies interact: all of them have to be simulated again";
  }
  [[nodiscard]] bool interacts() const override { return true; }

 private:
  State before_;
  Ballistic ballistic_;
};

enum class Kind { kBallistic, kChained, kContact };

// Bodies so large that those of a random state meet.
std::vector<std::int32_t> contact_constants() {
  ContactConstants constants;
  constants.substeps = 2;
  constants.pair = constants.wall = {7000, 300, 200};
  constants.types = {{ContactConstants::kMaxRadius, 65536}, {ContactConstants::kMaxRadius / 2, 131072}};
  constants.planes = {{{0, ContactConstants::kOne, 0}, -(1 << 26)}};
  return write_contact_constants(constants);
}

std::unique_ptr<Predictor> make(Kind kind, std::uint32_t capacity) {
  switch (kind) {
    case Kind::kChained:
      return std::make_unique<Chained>(capacity);
    case Kind::kContact:
      return *make_predictor("contact", capacity, contact_constants());
    default:
      return std::make_unique<Ballistic>();
  }
}

struct Delta {
  Frame frame;
  std::uint64_t last_input;
  std::uint64_t hash;
  std::vector<std::byte> payload;
};

/// A server, what it has published, and one client.
class Scenario {
 public:
  Scenario(Random& random, Kind kind, std::uint32_t lead) : random_(random) {
    layout_.capacity = static_cast<std::uint32_t>(1 + random.below(60));
    layout_.type_count = synthetic::kTypes;
    layout_.codec = codec_names()[random.below(codec_names().size())];
    layout_.codec_tables = synthetic::tables_for(layout_.codec);
    layout_.parameters = {{200, 16, 64}, {300}};
    layout_.lead = lead;
    server_.emplace(*ServerTimeline::create(layout_, 1, make(kind, layout_.capacity)));
    client_.emplace(*ClientTimeline::create(layout_, make(kind, layout_.capacity)));
    reference_ = make(kind, layout_.capacity);
    server_->start(random.below(1000), synthetic::random_state(random, layout_.capacity), random_drive());
  }

  void join() {
    std::vector<std::byte> snapshot;
    server_->snapshot(snapshot);
    const auto loaded = client_->load(snapshot, 1);
    RC_ASSERT(loaded.has_value());
    RC_ASSERT(client_->state(client_->applied()) == server_->state());
    deltas_.clear();
    // Late inputs that the snapshot counts may still be on their way, as may be later ones.
    while (!inputs_.empty() && inputs_.front().number + 3 < server_->last_input()) inputs_.pop_front();
  }

  void server_frame() {
    while (random_.one_in(3)) {
      const ScheduledDrive input{server_->last_input() + 1,
                                 server_->frame() + 1 + layout_.lead + random_.below(3), random_drive()};
      RC_ASSERT(server_->schedule(input).has_value());
      inputs_.push_back(input);
      all_inputs_[input.number] = input;
    }
    State target = synthetic::random_target(random_, server_->state(), 1 + random_.below(8));
    const auto lifecycle =
        synthetic::random_lifecycle(random_, server_->state(), target, 1 + random_.below(30));
    if (random_.one_in(10)) {
      StreamParameters parameters{{static_cast<std::int32_t>(50 + random_.below(500)), 8, 32}};
      parameters.step.decay = share();
      parameters.codec.velocity_gain = share();
      parameters.codec.acceleration_gain = share();
      server_->set_parameters(parameters);
    }
    if (random_.one_in(6)) server_->round_next();
    const auto frame =
        server_->advance(target, lifecycle, random_.one_in(2) ? kNoBudget : random_.below(400));
    deltas_.push_back(
        {frame.frame, frame.last_input, frame.hash, {frame.payload.begin(), frame.payload.end()}});
  }

  bool deliver_input() {
    if (inputs_.empty()) return false;
    // Mostly in order; sometimes the second overtakes the first.
    const std::size_t at = inputs_.size() > 1 && random_.one_in(4) ? 1 : 0;
    const ScheduledDrive input = inputs_[at];
    inputs_.erase(inputs_.begin() + static_cast<std::ptrdiff_t>(at));
    RC_ASSERT(client_->schedule(input).has_value());
    if (random_.one_in(4)) RC_ASSERT(client_->schedule(input).has_value());
    return true;
  }

  bool deliver_delta() {
    if (deltas_.empty()) return false;
    const Delta& delta = deltas_.front();
    if (client_->inputs_held() < delta.last_input) return false;
    const auto applied = client_->apply(delta.frame, delta.last_input, delta.hash, delta.payload);
    RC_ASSERT(applied.has_value());
    RC_ASSERT(client_->applied() == delta.frame);
    deltas_.pop_front();
    return true;
  }

  void client_frame() { client_->step(static_cast<std::uint32_t>(random_.below(6))); }

  /// Where every input issued has arrived: what the client holds beyond its last delta is what a fresh
  /// simulation of the agreed frame says.
  void check_ahead() {
    RC_ASSERT(client_->now() >= client_->applied());
    RC_ASSERT(client_->now() <= client_->applied() + layout_.lead);
    if (!inputs_.empty()) return;
    State state = client_->state(client_->applied());
    Drive drive = client_->drive();
    for (Frame frame = client_->applied() + 1; frame <= client_->now(); ++frame) {
      for (const auto& [number, input] : all_inputs_) {
        if (input.frame == frame) drive = input.drive;
      }
      reference_->step(state, state, {drive, client_->parameters().step});
      RC_ASSERT(client_->state(frame) == state);
    }
  }

  void drain() {
    while (deliver_input()) check_ahead();
    while (deliver_delta()) check_ahead();
    RC_ASSERT(deltas_.empty());
    RC_ASSERT(client_->state(client_->applied()) == server_->state());
    RC_ASSERT(client_->hash() == server_->hash());
  }

 private:
  std::uint16_t share() { return static_cast<std::uint16_t>(random_.below(65536)); }
  Drive random_drive() {
    return {{random_.value(1 << 16), random_.value(1 << 16), random_.value(1 << 16)},
            static_cast<std::uint16_t>(random_.below(3000))};
  }

  Random& random_;
  Layout layout_;
  std::optional<ServerTimeline> server_;
  std::optional<ClientTimeline> client_;
  std::unique_ptr<Predictor> reference_;
  std::deque<ScheduledDrive> inputs_;
  std::map<std::uint64_t, ScheduledDrive> all_inputs_;
  std::deque<Delta> deltas_;
};

void any_interleaving(Kind kind) {
  Random random(*rc::gen::arbitrary<std::uint64_t>());
  Scenario scenario(random, kind, static_cast<std::uint32_t>(random.below(5)));
  for (std::uint64_t before = random.below(5); before > 0; --before) scenario.server_frame();
  scenario.join();
  for (int turn = 0; turn < 120; ++turn) {
    switch (random.below(8)) {
      case 0:
      case 1:
        scenario.server_frame();
        break;
      case 2:
      case 3:
        scenario.deliver_input();
        break;
      case 4:
      case 5:
        scenario.client_frame();
        break;
      case 6:
        scenario.deliver_delta();
        break;
      default:
        if (random.one_in(20)) scenario.join();
        break;
    }
    scenario.check_ahead();
  }
  scenario.drain();
}

RC_GTEST_PROP(Timeline, EndsWithTheServersStateWhereBodiesDoNotInteract, ()) {
  any_interleaving(Kind::kBallistic);
}
RC_GTEST_PROP(Timeline, EndsWithTheServersStateWhereBodiesInteract, ()) { any_interleaving(Kind::kChained); }
RC_GTEST_PROP(Timeline, EndsWithTheServersStateWhereBodiesTouch, ()) { any_interleaving(Kind::kContact); }

}  // namespace
}  // namespace tandem
