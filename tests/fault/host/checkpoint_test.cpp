// A server that is killed and goes on from a checkpoint, with its clients on a simulated network.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>

#include "services/host/checkpoint/format.hpp"
#include "services/host/frames/going_on.hpp"
#include "tests/fault/host/fountain.hpp"
#include "tests/fault/host/stage.hpp"

namespace tandem::host {
namespace {

struct Player {
  std::unique_ptr<transport::ClientPort> port;
  Watcher watcher;
  std::unique_ptr<client::ClientCore> core;
  std::map<std::uint64_t, double> sent;
};

/// One server after another, and clients that stay.
class World {
 public:
  explicit World(std::uint64_t seed)
      : network({.seed = seed, .link = {.delay_ns = 3'000'000, .jitter_ns = 4'000'000}}) {
    network.advance_to(now_ns);
  }

  void start(const std::vector<std::byte>* from, const std::string& codec = "tracker") {
    port = must(network.make_server("default"));
    simulation = std::make_unique<Logged>();
    HostConfig config;
    config.epoch = ++epoch_ * 10'000;
    config.engine = "particles";
    config.streams.resize(1);
    StreamConfig& stream = config.streams[0];
    stream.layout.capacity = kSlots;
    stream.layout.codec = codec;
    stream.lattice = must(choose_lattice(0.01, 20, simulation->dt_s()));
    stream.layout.parameters.codec = must(codec_parameters(stream.lattice, 0.01, 0, 0));
    if (codec == "tracker") must_do(choose_gains(stream));
    if (from != nullptr) {
      auto checkpoint = std::make_shared<checkpoint::Checkpoint>(must(checkpoint::decode(*from)));
      must_do(checkpoint::check_world(*checkpoint, checkpoint_world(config), kSlots));
      ASSERT_TRUE(simulation->load(checkpoint->engine_state));
      simulation->frame = checkpoint->frame;
      checkpoint::Start start;
      start.goes_on_from = std::move(checkpoint);
      begin_from(start, config);
    }
    host = must(Host::create(std::move(config), *simulation, *port));
  }
  /// The power goes, with all that was not published.
  void kill() {
    network.kill(port->self());
    host.reset();
    port.reset();
  }
  Player& add_player() {
    auto player = std::make_unique<Player>();
    player->port = must(network.make_client("default"));
    client::CoreOptions options;
    options.session = "default";
    options.id = 100 + players.size();
    player->core = std::make_unique<client::ClientCore>(std::move(options), *player->port, &player->watcher);
    players.push_back(std::move(player));
    return *players.back();
  }
  void run_ms(std::int64_t ms) {
    for (std::int64_t i = 0; i < ms; ++i) {
      now_ns += kMillisecond;
      network.advance_to(now_ns);
      if (host) {
        if (host->poll(now_ns, wall_ns())) {
          if (host->frame() % 30 == 0) capture();
        }
        must_do(drain(host->outbox(), *port));
      }
      for (auto& player : players) player->core->poll({now_ns, wall_ns()});
    }
  }
  void capture() {
    checkpoint::Checkpoint copy;
    host->capture(copy);
    must_do(checkpoint::encode(copy, file));
    file_frame = copy.frame;
    reuse.assign(host->agreed().reuse().begin(), host->agreed().reuse().end());
    alive.assign(host->agreed().alive().begin(), host->agreed().alive().end());
  }
  void send(Player& player) {
    const double unique = 0.001 * static_cast<double>(++sent_);
    const auto number =
        player.core->send(transport::InputKind::kGravity, {unique, -3, 0}, {}, {now_ns, wall_ns()});
    if (number) player.sent[*number] = unique;
  }
  [[nodiscard]] bool all_play() const {
    return std::ranges::all_of(players, [this](const auto& player) {
      return player->core->phase() == ClientPhase::kPlaying &&
             player->core->session()->epoch == host->session().epoch;
    });
  }
  [[nodiscard]] std::int64_t wall_ns() const { return now_ns + 1'700'000'000 * kSecond; }

  template <class R>
  static void must_do(const R& result) {
    if (!result) throw std::runtime_error(result.error().message);
  }

  transport::simulated::Network network;
  std::int64_t now_ns = kSecond;
  std::unique_ptr<transport::ServerPort> port;
  std::unique_ptr<Logged> simulation;
  std::unique_ptr<Host> host;
  std::vector<std::unique_ptr<Player>> players;
  std::vector<std::byte> file;  // the newest checkpoint
  Frame file_frame = 0;
  std::vector<std::uint8_t> reuse, alive;  // then, by slot

 private:
  Epoch epoch_ = 0;
  std::uint64_t sent_ = 0;
};

TEST(GoingOn, ClientsPlayOnWithin3SecondsAndBodiesKeepTheirSlotAndReuse) {
  for_seeds(10, [](std::uint64_t seed) {
    Dice dice(seed);
    World world(seed);
    world.start(nullptr);
    for (int i = 0; i < 3; ++i) world.add_player();
    world.run_ms(4000 + static_cast<std::int64_t>(dice.below(1500)));
    ASSERT_TRUE(world.all_play());
    const Epoch before = world.host->session().epoch;
    const Frame last = world.host->frame();
    const std::unique_ptr<Logged> old = std::move(world.simulation);
    world.kill();
    world.run_ms(static_cast<std::int64_t>(dice.below(600)));
    world.start(&world.file);
    EXPECT_EQ(world.host->session().continues_epoch, before);
    EXPECT_EQ(world.host->session().continues_frame, world.file_frame);
    EXPECT_EQ(world.host->frame(), world.file_frame);
    EXPECT_LE(last - world.file_frame, 30U) << "at most a second of the world is lost";
    EXPECT_GT(*std::ranges::max_element(world.reuse), 0) << "slots were used again";
    for (Slot slot = 0; slot < kSlots; ++slot) {
      ASSERT_EQ(world.host->agreed().alive()[slot], world.alive[slot]);
      if (world.alive[slot] != 0) {
        ASSERT_EQ(world.host->agreed().reuse()[slot], world.reuse[slot]) << slot;
      }
    }
    world.run_ms(3000);
    EXPECT_TRUE(world.all_play());
    // Without inputs the second that was lost happens again, to the bit.
    for (Frame frame = world.file_frame + 1; frame <= last; ++frame)
      ASSERT_EQ(world.simulation->positions.at(frame), old->positions.at(frame)) << "frame " << frame;
    for (const auto& player : world.players) EXPECT_EQ(player->core->statistics().hash_mismatches, 0U);
  });
}

// The next body of a slot is told apart from all that were there before, also in the epoch before.
TEST(GoingOn, ASlotThatIsUsedAgainCountsOn) {
  World world(1);
  world.start(nullptr);
  world.add_player();
  world.run_ms(5000);
  const auto before = world.reuse;
  world.kill();
  world.start(&world.file);
  world.run_ms(6000);
  int counted_on = 0;
  for (Slot slot = 0; slot < kSlots; ++slot) {
    if (world.host->agreed().alive()[slot] == 0 || world.alive[slot] == 0) continue;
    EXPECT_GE(world.host->agreed().reuse()[slot], before[slot]);
    counted_on += world.host->agreed().reuse()[slot] > before[slot] ? 1 : 0;
  }
  EXPECT_GT(counted_on, 0);
}

// Each input acted once in the history that goes on, or its sender is told that it did not.
TEST(GoingOn, EveryInputActsOnceOrIsToldAsLostOnce) {
  std::size_t taken_back = 0, waited = 0;
  for_seeds(40, [&](std::uint64_t seed) {
    Dice dice(seed);
    World world(seed);
    world.start(nullptr);
    for (int i = 0; i < 2; ++i) world.add_player();
    world.run_ms(2000);
    const auto play = [&](std::int64_t ms) {
      for (std::int64_t t = 0; t < ms; t += 20) {
        world.run_ms(20);
        if (dice.one_in(3)) world.send(*world.players[static_cast<std::size_t>(dice.below(2))]);
      }
    };
    std::vector<std::pair<Frame, double>> history;
    for (int life = 0; life < 3; ++life) {
      play(1200 + static_cast<std::int64_t>(dice.below(1500)));
      for (const auto& [frame, value] : world.simulation->acted)
        if (frame <= world.file_frame) history.emplace_back(frame, value);
      waited += must(checkpoint::decode(world.file)).scheduled.size();
      world.kill();
      world.run_ms(static_cast<std::int64_t>(dice.below(400)));
      world.start(&world.file);
      play(2500);
      ASSERT_TRUE(world.all_play());
    }
    world.run_ms(1000);
    history.insert(history.end(), world.simulation->acted.begin(), world.simulation->acted.end());
    for (const auto& player : world.players) {
      for (const auto& [number, value] : player->sent) {
        const auto of_value = [&](const auto& entry) { return entry.second == value; };
        const auto acted = std::ranges::count_if(history, of_value);
        ASSERT_LE(acted, 1) << "input " << number;
        const auto told = player->watcher.outcomes.find(number);
        ASSERT_NE(told, player->watcher.outcomes.end()) << "nothing is known of input " << number;
        if (told->second.kind == client::InputOutcome::Kind::kActed) {
          ASSERT_EQ(acted, 1) << "input " << number << " acted on " << told->second.frame << ", it says";
          ASSERT_EQ(std::ranges::find_if(history, of_value)->first, told->second.frame);
        } else {
          ASSERT_EQ(acted, 0) << "input " << number << " acted, but the client was told otherwise";
        }
      }
      for (const auto& [number, times] : player->watcher.lost) {
        EXPECT_EQ(times, 1);
        ++taken_back;
      }
    }
  });
  EXPECT_GT(taken_back, 40U);
  EXPECT_GT(waited, 5U) << "some inputs waited in a checkpoint, and acted";
}

// Everybody in the domain can read the ids of clients.
TEST(GoingOn, AStrangerCannotTakeTheAccountOfAClientBeforeItComesBack) {
  World world(1);
  world.start(nullptr);
  Player& player = world.add_player();
  world.run_ms(2500);
  world.send(player);
  world.run_ms(1500);
  ASSERT_EQ(player.watcher.outcomes.size(), 1U);
  const auto stranger = must(world.network.make_client("default"));
  world.kill();
  world.start(&world.file);
  const auto says = [&](Epoch epoch) {
    transport::AckMessage ack;
    ack.client = 100;
    ack.epoch = epoch;
    World::must_do(stranger->write(ack));
  };
  for (int i = 0; i < 100; ++i) {  // before the player sees the announcement
    says(i % 2 == 0 ? 0 : world.host->session().epoch);
    world.run_ms(20);
  }
  EXPECT_GT(world.host->totals().refused_messages, 10U);
  EXPECT_TRUE(world.all_play());
  EXPECT_EQ(player.watcher.outcomes.at(1).kind, client::InputOutcome::Kind::kActed);
}

TEST(GoingOn, AnEpochThatIsNotAboveTheOldOneIsRefused) {
  World world(1);
  world.start(nullptr);
  world.run_ms(3000);
  HostConfig config;
  config.epoch = world.host->session().epoch;
  config.goes_on_from = std::make_shared<checkpoint::Checkpoint>(must(checkpoint::decode(world.file)));
  const auto port = must(world.network.make_server("default"));
  const auto host = Host::create(std::move(config), *world.simulation, *port);
  ASSERT_FALSE(host);
  EXPECT_EQ(host.error().code, ErrorCode::kInvalidArgument);
}

TEST(GoingOn, WhatAStreamLearnedIsTakenOver) {
  World world(3);
  world.start(nullptr);
  world.add_player();
  world.run_ms(8000);
  const StreamParameters first = world.host->session().streams[0].layout.parameters;
  const StreamParameters learned = must(checkpoint::decode(world.file)).streams[0].parameters;
  ASSERT_NE(learned, first);
  world.kill();
  world.start(&world.file);
  EXPECT_EQ(world.host->parameters(), learned);
  EXPECT_EQ(world.host->session().streams[0].layout.parameters, first)
      << "the session is announced as before";
  world.kill();
  world.start(&world.file, "selective");
  EXPECT_EQ(world.host->parameters(), world.host->session().streams[0].layout.parameters) << "another codec";
}

}  // namespace
}  // namespace tandem::host
