// Sessions of 2,800 frames in all that need nothing but the core: prints the final state hash of server and
// client and compares them with those that every compiler, flag and machine must give. Exit 1 where it
// differs.

#include <cstdio>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sdk/core/predict/contact/constants.hpp"
#include "sdk/core/predict/rigid/constants.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

constexpr std::uint64_t kGolden = 0x3B18685600880165, kGoldenOfHard = 0x242FC5419827E2A1;
constexpr std::uint32_t kCapacity = 500;
constexpr std::string_view kBallistic = "ballistic", kContact = "contact", kField = "field", kHard = "hard",
                           kRigid = "rigid";
struct Session {
  std::string_view codec, predictor;
  bool turns;
};
constexpr Session kSessions[] = {
    {"none", kBallistic, false},    {"selective", kBallistic, false}, {"quantized", kBallistic, false},
    {"entropy", kBallistic, false}, {"limited", kBallistic, false},   {"tracker", kBallistic, false},
    {"tracker", kContact, false},   {"tracker", kField, false},       {"none", kBallistic, true},
    {"entropy", kBallistic, true},  {"tracker", kBallistic, true},    {"tracker", kField, true}};

// A golden of their own, because that of the others stays.
constexpr Session kHardSessions[] = {{"tracker", kHard, false}, {"tracker", kRigid, true}};

std::vector<std::int32_t> contact_constants(std::string_view predictor) {
  ContactConstants constants;
  constants.substeps = 2;
  constants.pair = constants.wall = {1820, 205, 205};
  constants.types = {{20000, 65536}, {10000, 131072}};
  constants.planes = {{{0, ContactConstants::kOne, 0}, -100000}};
  constants.balls = {{{-200000, 0, 0}, 60000}};
  if (predictor == kRigid) {
    return write_rigid_constants(
        {constants, {{Solid::Kind::kBox, {20000, 9000, 15000}}, {Solid::Kind::kRound, {9000, 12000, 0}}}});
  }
  return write_contact_constants(predictor == kField ? in_one_step(constants) : constants);
}

// Runs one session; mixes the hash of every frame into `digest`. False if the client ever disagrees.
bool run(std::string_view codec, std::string_view predictor, const Groups& groups, synthetic::Random& random,
         std::uint64_t& digest) {
  Layout layout;
  layout.capacity = kCapacity;
  layout.type_count = synthetic::kTypes;
  layout.codec = codec;
  layout.codec_tables = synthetic::tables_for(codec, groups);
  if (groups.orientation) {
    layout.groups.push_back(kOrientationGroup);
    layout.radii = {synthetic::kRadii.begin(), synthetic::kRadii.end()};
  }
  layout.parameters = {{200, 16, 64}, {100}};
  if (groups.orientation && codec_traits(codec)->reads_steps) {
    layout.parameters.codec.turn_step = 1 << 16;
    layout.parameters.codec.spin_step = 1 << 12;
  }
  layout.predictor = predictor;
  if (predictor != kBallistic) layout.predictor_constants = contact_constants(predictor);
  if (predictor == kHard || predictor == kRigid) layout.parameters.step.contacts = {true, 500, -200, 900};
  auto server = ServerTimeline::create(layout, 1);
  auto client = ClientTimeline::create(layout);
  if (!server || !client) return false;
  server->start(0, synthetic::random_state(random, kCapacity, 4, groups), Drive{{0, -640, 0}, 300});
  std::vector<std::byte> snapshot;
  server->snapshot(snapshot);
  if (!client->load(snapshot, 1)) return false;
  for (Frame frame = 1; frame <= 200; ++frame) {
    if (random.one_in(10)) {
      const Drive drive{{random.value(2000), random.value(2000), random.value(2000)}, 300};
      const ScheduledDrive input{server->last_input() + 1, frame + 1, drive};
      if (!server->schedule(input) || !client->schedule(input)) return false;
    }
    if (random.one_in(30)) {
      const auto share = [&random] { return static_cast<std::uint16_t>(random.below(65536)); };
      StreamParameters parameters = layout.parameters;
      parameters.step.decay = share();
      parameters.codec.velocity_gain = share();
      parameters.codec.acceleration_gain = share();
      server->set_parameters(parameters);
    }
    State target = synthetic::random_target(random, server->state(), 8);
    const auto lifecycle = synthetic::random_lifecycle(random, server->state(), target, 100);
    const auto delta = server->advance(target, lifecycle, codec == "limited" ? 600 : kNoBudget);
    client->step(1);
    if (auto a = client->apply(delta.frame, delta.last_input, delta.hash, delta.payload); !a) {
      std::puts(a.error().message.c_str());
      return false;
    }
    digest = digest * 0x9E3779B97F4A7C15U + delta.hash;
    for (const std::byte byte : delta.payload) digest = digest * 31 + std::to_integer<std::uint64_t>(byte);
  }
  return true;
}

// Runs sessions one after the other; prints the digest. False if it is not `golden`, or a client disagrees.
bool is_golden(std::span<const Session> sessions, std::uint64_t golden) {
  synthetic::Random random(1000);
  std::uint64_t digest = 0;
  for (const Session& session : sessions) {
    if (!run(session.codec, session.predictor, {session.turns}, random, digest)) {
      std::fprintf(stderr, "client and server disagree (%s, %s%s)\n", std::string(session.codec).c_str(),
                   std::string(session.predictor).c_str(), session.turns ? ", turning" : "");
      return false;
    }
  }
  std::printf("%s ", to_hex(digest).c_str());
  if (digest != golden) std::fprintf(stderr, "expected %s\n", to_hex(golden).c_str());
  return digest == golden;
}

int compare() {
  const bool usual = is_golden(kSessions, kGolden);
  const bool hard = is_golden(kHardSessions, kGoldenOfHard);
  std::puts("");
  return usual && hard ? 0 : 1;
}

}  // namespace
}  // namespace tandem

int main() { return tandem::compare(); }
