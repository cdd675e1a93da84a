// Engines for tests of the door, good and bad ones. It speaks through tandem/engine.h alone.
//
// door_engine particles SCENE BODIES SEED [LINE ...]: engine/particles; LINE: more lines of HELLO, '=' for
// blanks.
// door_engine small MODE [FRAME]: 17 bodies; from FRAME on it misbehaves as MODE says.
#include "tandem/engine.h"

#include <signal.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "services/engines/scenes/scene.hpp"

namespace {

using tandem::engine::Bodies;

tandem_engine engine;

int complain() {
  std::fprintf(stderr, "%s\n", engine.error);
  return tandem_engine_close(&engine);
}

template <class T>
void put(const char* name, std::uint32_t axis, std::span<const T> values) {
  void* const to = tandem_engine_column(&engine, name, axis);
  if (engine.column[0].kind[1] != '6' || sizeof(T) < 4) {
    std::memcpy(to, values.data(), values.size_bytes());
    return;
  }
  for (std::size_t i = 0; i < values.size(); ++i)
    static_cast<double*>(to)[i] = static_cast<double>(values[i]);
}

/// The particles' bodies as columns. What was spawned in a step gets another value of `alive`.
class Writer {
 public:
  explicit Writer(std::uint32_t capacity) : births_(capacity) {}
  void write(const tandem::engine::Simulation& simulation) {
    const Bodies bodies = simulation.bodies();
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      put("position", axis, bodies.position[axis]);
      put("velocity", axis, bodies.velocity[axis]);
    }
    put("type", 0, bodies.type);
    for (const tandem::engine::Event& event : simulation.events()) {
      if (event.kind != tandem::engine::Event::Kind::kSpawned) continue;
      births_[event.slot] = static_cast<std::uint8_t>((births_[event.slot] + 1) % 255);
    }
    std::vector<std::uint8_t> alive(bodies.alive.begin(), bodies.alive.end());
    for (std::size_t s = 0; s < alive.size(); ++s)
      if (alive[s] != 0) alive[s] = static_cast<std::uint8_t>(1 + births_[s]);
    put("alive", 0, std::span<const std::uint8_t>(alive));
  }

 private:
  std::vector<std::uint8_t> births_;
};

tandem::engine::Input input_now() {
  tandem::engine::Input input{.kind = engine.kind};
  if (engine.kind < TANDEM_ENGINE_APPLICATION) {
    input.values.assign(engine.values, engine.values + engine.count);
  } else {
    input.bytes.resize(engine.count);
    std::memcpy(input.bytes.data(), engine.bytes, engine.count);
  }
  return input;
}

int particles(const std::vector<std::string>& words) {
  const auto scene = tandem::scenes::load_scene(words.at(0));
  if (!scene) return 2;
  const auto bodies = static_cast<std::uint32_t>(std::stoul(words.at(1)));
  auto made = tandem::scenes::make_simulation(*scene, bodies, std::stoull(words.at(2)), 1);
  if (!made) return 2;
  tandem::engine::Simulation& simulation = **made;
  const tandem::engine::Vec3 g = simulation.gravity();
  char numbers[300];
  std::snprintf(numbers, sizeof numbers, "capacity %u\ndt %.17g\ngravity %.17g %.17g %.17g\ndamping %.17g\n",
                bodies, simulation.dt_s(), g[0], g[1], g[2], simulation.damping_per_s());
  std::string hello = std::string("name particles\nsave 1\ninput gravity 1000\ninput push 1000\n") + numbers;
  for (std::size_t i = 3; i < words.size(); ++i) {
    hello += words[i] + '\n';
    std::replace(hello.begin(), hello.end(), '=', ' ');
  }
  if (tandem_engine_open(&engine, hello.c_str()) != 0) return complain();
  Writer writer(bodies);
  writer.write(simulation);
  tandem_engine_start(&engine);
  for (;;) switch (tandem_engine_next(&engine)) {
      case TANDEM_ENGINE_INPUT:
        simulation.apply(input_now());
        break;
      case TANDEM_ENGINE_STEP:
        simulation.step();
        writer.write(simulation);
        tandem_engine_done(&engine, simulation.colliding());
        break;
      case TANDEM_ENGINE_SAVE: {
        std::vector<std::byte> state;
        simulation.save(state);
        std::ofstream(engine.path, std::ios::binary)
            .write(reinterpret_cast<const char*>(state.data()), static_cast<std::streamsize>(state.size()));
        tandem_engine_saved(&engine, state.size());
        break;
      }
      case TANDEM_ENGINE_LOAD: {
        std::ifstream file(engine.path, std::ios::binary);
        const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
        const bool loaded = simulation.load(std::as_bytes(std::span(text)));
        writer.write(simulation);
        tandem_engine_loaded(&engine, loaded ? 1 : 0);
        break;
      }
      default:
        return complain();
    }
}

constexpr std::uint32_t kSmall = 17;

void fill(std::uint64_t frame) {
  std::vector<float> zero(kSmall), x(kSmall), one(kSmall, 1.0F);
  for (std::uint32_t s = 0; s < kSmall; ++s)
    x[s] = static_cast<float>(s) + 0.125F * static_cast<float>(frame % 8);
  const std::vector<std::uint8_t> alive(kSmall, 1);
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    put("position", axis, std::span<const float>(axis == 0 ? x : zero));
    put("velocity", axis, std::span<const float>(zero));
    put("angular_velocity", axis, std::span<const float>(zero));
  }
  for (std::uint32_t axis = 0; axis < 4; ++axis)
    put("orientation", axis, std::span<const float>(axis == 3 ? one : zero));
  put("alive", 0, std::span<const std::uint8_t>(alive));
}

float& value(const char* column, std::uint32_t axis, std::uint32_t slot) {
  return static_cast<float*>(tandem_engine_column(&engine, column, axis))[slot];
}

/// Tells news in front of DONE: good ones, more than a session takes, or what breaks the rules.
void tell_news(std::string_view mode) {
  const std::vector<char> much(60'000);
  if (mode == "news" || mode == "news-unasked") {
    const auto score = static_cast<char>(engine.frame);
    tandem_engine_set_key(&engine, "score", &score, 1);
    tandem_engine_remove_key(&engine, "old");
    tandem_engine_broadcast(&engine, 7, "goal", 4, 3);
    tandem_engine_broadcast(&engine, 8, nullptr, 0, TANDEM_ENGINE_NO_SLOT);
  }
  if (mode == "news-large") {
    tandem_engine_broadcast(&engine, 0x80000000U, nullptr, 0, TANDEM_ENGINE_NO_SLOT);
    tandem_engine_broadcast(&engine, 9, much.data(), 1025, TANDEM_ENGINE_NO_SLOT);
    tandem_engine_set_key(&engine, "two\nlines", "x", 1);
  }
  for (int i = 0; i < 40 && mode == "news-flood"; ++i)
    tandem_engine_set_key(&engine, "k", much.data(), 60'000);
  const auto raw = [](std::uint64_t frame, std::uint32_t kind, std::uint32_t first, std::uint32_t bytes) {
    std::uint32_t body[6] = {0, 0, kind, first, 0, bytes};
    std::memcpy(body, &frame, 8);
    tandem_engine_send(&engine, TANDEM_ENGINE_NEWS, body, sizeof body, nullptr, 0);
  };
  if (mode == "news-untold") raw(engine.frame, TANDEM_ENGINE_EVENT, 1, 0);
  if (mode == "news-frame") raw(engine.frame + 1, TANDEM_ENGINE_EVENT, 1, 0);
  if (mode == "news-long") raw(engine.frame, TANDEM_ENGINE_EVENT, 1, 5);
  if (mode == "news-key") raw(engine.frame, TANDEM_ENGINE_KEY, 1, 0);
  if (mode == "news-later") raw(engine.frame, 77, 1, 0);
  if (mode == "news-short") tandem_engine_send(&engine, TANDEM_ENGINE_NEWS, "x", 1, nullptr, 0);
}

/// Answers a STEP in a wrong way. False: as usual.
bool misbehave(std::string_view mode) {
  const auto done = [](std::uint64_t frame, std::uint32_t slot, std::size_t bytes) {
    unsigned char body[32] = {};
    std::memcpy(body, &frame, 8);
    std::memcpy(body + 8, &slot, 4);
    tandem_engine_send(&engine, TANDEM_ENGINE_DONE, body, bytes, nullptr, 0);
    return true;
  };
  fill(engine.frame);
  if (mode == "exit") std::exit(3);
  if (mode == "crash") {
    std::fprintf(stderr, "the last word\n");
    std::abort();
  }
  if (mode == "orphan" && ::fork() != 0) std::_Exit(7);  // what is left behind holds the socket
  if (mode == "orphan") return ::sleep(20) == 0;
  if (mode == "hang") return ::pause() != 0;
  if (mode == "slow") return ::usleep(300'000) != 0;
  if (mode == "stop") return ::raise(SIGSTOP) != 0;
  if (mode == "wrong-frame") return done(engine.frame + 7, 0, 24);
  if (mode == "wrong-slot") return done(engine.frame, 9, 24);
  if (mode == "wrong-size") return done(engine.frame, 0, 23);
  if (mode == "stale") return done(engine.frame, 0, 24);  // without the slot's head
  if (mode == "inline-stale" || mode == "inline-long") {
    std::vector<unsigned char> slot(engine.slot_bytes + (mode == "inline-long" ? 8 : 0));
    std::memcpy(slot.data(), engine.memory, engine.slot_bytes);
    unsigned char body[24] = {};
    std::memcpy(body, &engine.frame, 8);
    return tandem_engine_send(&engine, TANDEM_ENGINE_DONE, body, sizeof body, slot.data(), slot.size()) == 0;
  }
  if (mode == "inline-half")
    return tandem_engine_send(&engine, TANDEM_ENGINE_DONE, engine.memory, 24, engine.memory, 100) == 0;
  if (mode == "twice") return tandem_engine_done(&engine, 0) + tandem_engine_done(&engine, 0) == 0;
  if (mode == "unknown") return tandem_engine_send(&engine, 77, "x", 1, nullptr, 0) == 0;
  if (mode == "huge") {
    const std::uint32_t head[2] = {TANDEM_ENGINE_DONE, 0x7FFFFFFF};
    return ::send(engine.fd, head, sizeof head, MSG_NOSIGNAL) > 0 && ::pause() != 0;
  }
  if (mode == "half") return ::send(engine.fd, "\6\0\0", 3, MSG_NOSIGNAL) > 0 && ::pause() != 0;
  if (mode == "error") {
    tandem_engine_complain(&engine, "the springs\x1b[31m broke");
    std::exit(1);
  }
  if (mode == "scribble") {
    static const bool started = [] {
      // Columns only: the head of a slot has tests of its own.
      std::thread([] {
        std::mt19937 random(7);
        for (;;)
          engine.memory[engine.first + 64 + random() % (engine.slot_bytes - 64)] =
              static_cast<unsigned char>(random());
      }).detach();
      return true;
    }();
    return !started;
  }
  if (mode == "scribble-all") {
    static const bool started = [] {
      std::thread([] {
        // Over all of it, also what says where things are: bytes, numbers that are none, and long runs.
        std::mt19937 random(11);
        const std::uint64_t bytes = engine.memory_bytes;
        for (;;) {
          unsigned char* const at = engine.memory + random() % (bytes - 64);
          const std::uint32_t what = random() % 8;
          if (what == 0) {
            std::memset(at, static_cast<int>(random() % 256), random() % 64);
          } else if (what < 4) {
            constexpr std::uint32_t kOdd[] = {0x7F800000, 0xFF800000, 0x7FC00000, 0x7F7FFFFF, 1, 0x80000000};
            std::memcpy(at, &kOdd[random() % 6], 4);
          } else {
            *at = static_cast<unsigned char>(random());
          }
          // Else hardly a frame were whole.
          if (random() % 64 == 0) std::this_thread::sleep_for(std::chrono::microseconds{50});
        }
      }).detach();
      return true;
    }();
    return !started;
  }
  if (mode == "flap") {
    auto* const alive = static_cast<std::uint8_t*>(tandem_engine_column(&engine, "alive", 0));
    for (std::uint32_t s = 0; s < kSmall; ++s) alive[s] = static_cast<std::uint8_t>(1 + engine.frame % 2);
  }
  if (mode.starts_with("news")) tell_news(mode);
  if (mode == "nan") value("position", 1, 3) = std::numeric_limits<float>::quiet_NaN();
  if (mode == "far") value("position", 2, 4) = 1e30F;
  if (mode == "turn") value("angular_velocity", 0, 2) = std::numeric_limits<float>::quiet_NaN();
  if (mode == "norm") value("orientation", 0, 5) = 5;
  if (mode == "type") static_cast<std::uint16_t*>(tandem_engine_column(&engine, "type", 0))[6] = 60000;
  if (mode == "dead") static_cast<std::uint8_t*>(tandem_engine_column(&engine, "alive", 0))[7] = 0;
  if (mode == "punch") ::madvise(engine.memory, engine.memory_bytes, MADV_REMOVE);
  return false;
}

/// Answers a SAVE in a wrong way.
void save_badly(std::string_view mode) {
  constexpr std::uint64_t kMuch = 1ULL << 40U;
  std::ofstream(engine.path) << "12345678";
  if (mode == "save-much" && ::truncate(engine.path, static_cast<off_t>(kMuch)) == 0) {
    tandem_engine_saved(&engine, kMuch);
  } else if (mode == "save-pipe" && ::unlink(engine.path) == 0 && ::mkfifo(engine.path, 0600) == 0) {
    tandem_engine_saved(&engine, 8);
  } else {
    tandem_engine_saved(&engine, mode == "save-none" ? 0 : 9);
  }
}

int small(const std::string& mode, std::uint64_t from) {
  if (mode == "silent") return ::pause();
  if (mode == "exit-early") return 4;
  std::string hello = "name small\ncapacity 17\ndt 0.03125\nturns 1\nstep_limit 1\ninput application 8\n";
  if (mode == "capacity") hello = "name small\ncapacity 99999999\ndt 0.03125\n";
  if (mode == "shared") hello += "memory shared\n";
  if (mode.starts_with("save")) hello += "save 1\n";
  if (mode.starts_with("news") && mode != "news-unasked" && mode != "news-untold")
    hello += "news keys events\n";
  if (mode == "no-dt") hello = "name small\ncapacity 17\n";
  if (tandem_engine_open(&engine, hello.c_str()) != 0) return complain();
  if (mode == "no-start") return ::pause();
  fill(0);
  tandem_engine_start(&engine);
  for (;;) switch (tandem_engine_next(&engine)) {
      case TANDEM_ENGINE_INPUT:
        break;
      case TANDEM_ENGINE_STEP:
        if (engine.frame >= from && misbehave(mode)) break;
        if (engine.frame < from) fill(engine.frame);
        tandem_engine_done(&engine, 0);
        break;
      case TANDEM_ENGINE_SAVE:
        save_badly(mode);
        break;
      default:
        return complain();
    }
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() >= 4 && words[0] == "particles") return particles({words.begin() + 1, words.end()});
  if (words.size() >= 2 && words[0] == "small")
    return small(words[1],
                 words.size() > 2 ? std::stoull(words[2]) : std::numeric_limits<std::uint64_t>::max());
  return 2;
}
