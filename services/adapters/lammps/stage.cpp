// SPDX-License-Identifier: MIT
#include "tandem/engine.h"  // first: it asks the system for more

#include "services/adapters/lammps/stage.hpp"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <utility>

#include "services/adapters/lammps/lammps.hpp"

namespace tandem_lammps {
namespace {

// "TANDLMP2": head of a saved file.
constexpr std::uint64_t kMagic = 0x32504D4C444E4154ULL;

struct SavedHead {
  std::uint64_t magic = kMagic, fingerprint = 0, capacity = 0, script_bytes = 0, slot_bytes = 0,
                restart_bytes = 0;
};

// Of LAMMPS's types; all of them differ in light, for those who see no colours.
constexpr const char* kColours[] = {"D9A441FF", "4E8FC7FF", "B5533CFF", "7FB069FF", "8E6BB8FF", "C7C7C7FF"};

std::vector<std::uint8_t> read_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  if (!in) return {};
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(in.tellg()));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return in ? bytes : std::vector<std::uint8_t>();
}

void write_some(std::ofstream& out, const void* bytes, std::size_t count) {
  out.write(static_cast<const char*>(bytes), static_cast<std::streamsize>(count));
}

constexpr std::size_t kMaxTimes = 1 << 16;
constexpr std::size_t kMaxHelloBytes = 65'000;  // besides the lines of tandem/engine.h

/// Milliseconds since the last call.
class Stopwatch {
 public:
  float lap_ms() {
    const auto now = std::chrono::steady_clock::now();
    return std::chrono::duration<float, std::milli>(now - std::exchange(last_, now)).count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

double median(std::vector<float>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return static_cast<double>(*middle);
}

std::string text(const char* format, auto... values) {
  char line[400];
  std::snprintf(line, sizeof line, format, values...);  // NOLINT: the formats are here
  return line;
}

}  // namespace

/// What all ranks do next.
struct Stage::Order {
  int what = TANDEM_ENGINE_BYE;  // a number of tandem/engine.h; INPUT: `kind` says which
  int kind = 0;
  double values[7] = {};
};

Stage::Stage(void* lammps, const Ranks& ranks, const LammpsOptions& options)
    : lammps_(lammps), ranks_(ranks), options_(options), script_(lammps, ranks, options.script) {
  if (options.endless) script_.make_endless();
  if (!script_.reach_run() && !script_.ran()) throw Refusal{options.script + ": has no run"};
  world_ = std::make_unique<LammpsWorld>(lammps, ranks, script_, options);
  slots_ = std::make_unique<Slots>(world_->capacity());
}

Stage::~Stage() = default;

std::string Stage::hello() const {
  const Pace& pace = world_->pace();
  const double speed2 = pace.speed * pace.speed;
  std::string lines = "name lammps\nstep_limit 600\n";
  if (script_.facts().no_checkpoints().empty()) lines += "save 1\n";
  std::string name = options_.script.substr(options_.script.rfind('/') + 1);
  for (char& c : name)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '.' && c != '-' && c != '_') c = '_';
  lines += "scene " + name + "\n";
  if (!options_.session.empty()) lines += "session " + options_.session + "\n";
  lines += text("capacity %u\ndt %.17g\n", world_->capacity(), pace.frame_s);
  const bool is_2d = lammps_extract_setting(lammps_, "dimension") == 2;
  std::size_t up = is_2d ? 1 : 2;
  const Vec3 g = script_.gravity() ? script_.gravity_now() : Vec3{};
  for (std::size_t i = 0; i < 3; ++i)
    if (-g[i] > 1.01 * std::abs(g[up])) up = i;
  lines += text("up %c\ngravity %.17g %.17g %.17g\n", "xyz"[up], g[0] * speed2, g[1] * speed2, g[2] * speed2);
  const double strength = std::hypot(g[0], g[1], g[2]) * speed2;
  const double most_gravity = script_.gravity() ? options_.gravity.value_or(4 * strength) : 0;
  const double most_push = options_.push.value_or(world_->useful_push());
  if (most_gravity > 0) lines += text("input gravity %.17g\n", most_gravity);
  if (most_push > 0) lines += text("input push %.17g\n", most_push);
  double reach = 0;
  const Box& box = world_->box();
  for (std::size_t i = 0; i < 3; ++i) reach = std::max({reach, std::abs(box.low[i]), std::abs(box.high[i])});
  lines += text("extent %.9g\n", 2 * reach);
  if (options_.threshold > 0) lines += text("threshold %.9g\n", options_.threshold);
  double lightest = std::numeric_limits<double>::infinity();
  for (const Kind& kind : world_->kinds()) {
    lines += text("type type%d %.9g %s %.9g sphere\n", kind.type, kind.radius,
                  kColours[static_cast<std::size_t>(kind.type - 1) % std::size(kColours)], kind.mass);
    lightest = std::min(lightest, kind.mass);
  }
  for (const Plane& plane : script_.facts().planes(box))
    lines += text("plane %.17g %.17g %.17g %.17g\n", plane.normal[0], plane.normal[1], plane.normal[2],
                  plane.offset.value_or(0));
  for (const auto& ball : script_.facts().balls())
    lines += text("ball %.9g %.9g %.9g %.9g\n", ball[0], ball[1], ball[2], ball[3]);
  const auto law = script_.facts().law();
  const auto substeps = static_cast<int>(std::min<std::int64_t>(pace.every, 16));
  const double part = pace.frame_s / substeps;
  // Clients compute with it if their larger steps can follow it.
  if (law && law->spring * speed2 * part * part < 0.5 * lightest) {
    const double between = lightest / 2 * pace.speed, still = lightest * pace.speed;
    lines +=
        text("law %.9g %.9g %.9g %.9g %.9g %.9g %d\n", law->spring * speed2, law->damping * between,
             law->shear * between, law->spring * speed2, law->damping * still, law->shear * still, substeps);
  }
  return lines;
}

bool Stage::open() {
  const std::string lines = hello();
  if (lines.size() > kMaxHelloBytes) {
    std::fprintf(stderr,
                 "tandem-lammps: types and walls take %zu bytes, and a HELLO has room for %zu: use fewer\n",
                 lines.size(), kMaxHelloBytes);
    return false;
  }
  engine_ = std::make_unique<tandem_engine>();
  if (!options_.socket.empty()) ::setenv("TANDEM_DOOR", options_.socket.c_str(), 1);
  return tandem_engine_open(engine_.get(), lines.c_str()) == 0;
}

void Stage::say_pace() const {
  const Pace& pace = world_->pace();
  std::printf("%d ranks; a frame is %lld steps and lasts %.4g s: %.4g of the script's time a second\n",
              ranks_.count(), static_cast<long long>(pace.every), pace.frame_s, pace.speed);
  if (const std::string& why = script_.facts().no_checkpoints(); !why.empty())
    std::printf("no checkpoints are kept: a restart file does not bring back %s\n", why.c_str());
  std::fflush(stdout);
}

void Stage::say_times() {
  if (steps_ == 0) return;
  std::printf(
      "%llu frames, medians: %.3g ms of LAMMPS, %.2g ms to bring the atoms together, %.2g ms to hand them over\n",
      static_cast<unsigned long long>(steps_), median(steps_ms_), median(gather_ms_), median(hand_over_ms_));
  std::fflush(stdout);
}

int Stage::play() {
  int opened = 1;
  if (ranks_.first()) opened = open() ? 1 : 0;
  MPI_Bcast(&opened, 1, MPI_INT, 0, ranks_.comm());
  if (opened != 0) {
    if (ranks_.first()) say_pace();
    write_columns();
    if (ranks_.first()) tandem_engine_start(engine_.get());
  }
  while (opened != 0) {
    Order order;
    if (ranks_.first()) order = next_order();
    ranks_.share_patiently(&order, sizeof order);
    if (order.what == TANDEM_ENGINE_BYE) break;
    obey(order);
  }
  if (!ranks_.first()) return 0;
  if (!engine_) return 1;
  say_times();
  if (engine_->error[0] != 0) std::fprintf(stderr, "tandem-lammps: %s\n", engine_->error);
  return tandem_engine_close(engine_.get());
}

Stage::Order Stage::next_order() {
  Order order;
  order.what = std::max(tandem_engine_next(engine_.get()), 0);
  if (order.what == 0) order.what = TANDEM_ENGINE_BYE;
  if (order.what == TANDEM_ENGINE_INPUT && engine_->kind < TANDEM_ENGINE_APPLICATION) {
    order.kind = static_cast<int>(engine_->kind);
    std::copy_n(engine_->values, std::min<std::uint32_t>(engine_->count, 7), order.values);
  }
  return order;
}

void Stage::obey(const Order& order) {
  const double* const v = order.values;
  const double speed2 = world_->pace().speed * world_->pace().speed;
  if (order.what == TANDEM_ENGINE_INPUT && order.kind == TANDEM_ENGINE_GRAVITY && script_.gravity())
    script_.turn_gravity({v[0] / speed2, v[1] / speed2, v[2] / speed2});
  if (order.what == TANDEM_ENGINE_INPUT && order.kind == TANDEM_ENGINE_PUSH)
    world_->push({v[0], v[1], v[2]}, v[3], {v[4], v[5], v[6]});
  if (order.what == TANDEM_ENGINE_STEP) step();
  if (order.what != TANDEM_ENGINE_SAVE && order.what != TANDEM_ENGINE_LOAD) return;
  std::string path = ranks_.first() ? engine_->path : "";
  ranks_.share(path);
  order.what == TANDEM_ENGINE_SAVE ? save(path) : load(path);
}

void Stage::step() {
  Stopwatch watch;
  const std::int64_t made = over_ ? 0 : script_.advance(world_->pace().every);
  if (made < world_->pace().every && !over_) {
    over_ = true;
    if (ranks_.first()) std::printf("the script is over: its atoms hold still\n");
  }
  ++steps_;
  if (steps_ms_.size() < kMaxTimes) steps_ms_.push_back(watch.lap_ms());
  write_columns();
  if (ranks_.first()) tandem_engine_done(engine_.get(), 0);
}

// On the other side of a periodic box it is another body, which did not fly across.
void Stage::renew_what_crossed(const std::vector<Row>& rows, std::span<const std::uint32_t> slots) {
  const Box& box = world_->box();
  if (!box.periodic[0] && !box.periodic[1] && !box.periodic[2]) return;
  const std::size_t capacity = slots_->capacity();
  if (before_.empty()) before_.assign(3 * capacity, std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::uint32_t s = slots[i];
    if (s == Slots::kNone) continue;
    bool crossed = false;
    for (std::size_t d = 0; d < 3; ++d) {
      float& before = before_[d * capacity + s];
      crossed = crossed || (box.periodic[d] && std::abs(rows[i].position[d] - before) > box.length(d) / 2);
      before = rows[i].position[d];
    }
    if (crossed) slots_->renew(s);
  }
}

std::span<const std::uint32_t> Stage::assign(const std::vector<Row>& rows) {
  ids_.resize(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) ids_[i] = rows[i].id;
  const std::span<const std::uint32_t> slots = slots_->assign(ids_);
  renew_what_crossed(rows, slots);
  return slots;
}

void Stage::write_columns() {
  Stopwatch watch;
  const std::vector<Row>& rows = world_->gather();
  if (!ranks_.first()) return;
  if (gather_ms_.size() < kMaxTimes) gather_ms_.push_back(watch.lap_ms());
  const std::span<const std::uint32_t> slots = assign(rows);
  const std::size_t capacity = slots_->capacity();
  float *x[3], *v[3];
  for (std::uint32_t d = 0; d < 3; ++d) {
    x[d] = static_cast<float*>(tandem_engine_column(engine_.get(), "position", d));
    v[d] = static_cast<float*>(tandem_engine_column(engine_.get(), "velocity", d));
  }
  auto* const type = static_cast<std::uint16_t*>(tandem_engine_column(engine_.get(), "type", 0));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::uint32_t s = slots[i];
    if (s == Slots::kNone) continue;
    for (std::size_t d = 0; d < 3; ++d) {
      x[d][s] = rows[i].position[d];
      v[d][s] = over_ ? 0 : rows[i].velocity[d];
    }
    type[s] = static_cast<std::uint16_t>(rows[i].kind);
  }
  void* const alive = tandem_engine_column(engine_.get(), "alive", 0);
  std::memcpy(alive, slots_->alive().data(), capacity);
  if (hand_over_ms_.size() < kMaxTimes) hand_over_ms_.push_back(watch.lap_ms());
  if (slots_->gone() > 0) {
    if (lost_ == 0)
      std::printf("frame %llu: %zu atoms are gone\n", static_cast<unsigned long long>(steps_),
                  slots_->gone());
    lost_ += slots_->gone();
  }
  if (slots_->left_out() > 0 && steps_ % 100 == 0)
    std::printf("%zu atoms are not shown: there is no room for them (--capacity)\n", slots_->left_out());
  std::fflush(stdout);
}

// A file: head, script, slots, restart file.

void Stage::save(const std::string& path) {
  const std::string restart_path = path + ".restart";
  script_.write_restart(restart_path);
  // It puts atoms back into the periodic box: who loads it sees them there.
  const std::vector<Row>& rows = world_->gather();
  if (!ranks_.first()) return;
  assign(rows);
  const std::vector<std::uint8_t> restart = read_file(restart_path);
  std::remove(restart_path.c_str());
  const std::string script = script_.save();
  const std::vector<std::uint8_t> slots = slots_->save();
  const SavedHead head{.fingerprint = script_.fingerprint(),
                       .capacity = slots_->capacity(),
                       .script_bytes = script.size(),
                       .slot_bytes = slots.size(),
                       .restart_bytes = restart.size()};
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  write_some(out, &head, sizeof head);
  write_some(out, script.data(), script.size());
  write_some(out, slots.data(), slots.size());
  write_some(out, restart.data(), restart.size());
  out.close();
  const std::uint64_t bytes = sizeof head + script.size() + slots.size() + restart.size();
  tandem_engine_saved(engine_.get(), out && !restart.empty() ? bytes : 0);
}

void Stage::load(const std::string& path) {
  const std::string restart_path = path + ".restart";
  std::string script;
  std::uint8_t good = 0;
  if (ranks_.first()) {
    const std::vector<std::uint8_t> bytes = read_file(path);
    SavedHead head{.magic = 0};
    if (bytes.size() >= sizeof head) std::memcpy(&head, bytes.data(), sizeof head);
    const bool ours = head.magic == kMagic && head.fingerprint == script_.fingerprint() &&
                      head.capacity == slots_->capacity() && head.slot_bytes == head.capacity * 9;
    const bool fits = ours && head.script_bytes <= bytes.size() && head.restart_bytes <= bytes.size() &&
                      sizeof head + head.script_bytes + head.slot_bytes + head.restart_bytes == bytes.size();
    const std::span<const std::uint8_t> all(bytes);
    if (fits && slots_->load(all.subspan(sizeof head + head.script_bytes, head.slot_bytes))) {
      script.assign(all.begin() + sizeof head,
                    all.begin() + static_cast<std::ptrdiff_t>(sizeof head + head.script_bytes));
      std::ofstream out(restart_path, std::ios::binary | std::ios::trunc);
      write_some(out, all.last(head.restart_bytes).data(), head.restart_bytes);
      out.close();
      good = out ? 1 : 0;
    }
  }
  MPI_Bcast(&good, 1, MPI_BYTE, 0, ranks_.comm());
  if (good != 0) {
    ranks_.share(script);
    script_.load(script, restart_path);
    over_ = false;
    before_.clear();
  }
  write_columns();
  if (!ranks_.first()) return;
  if (good != 0) std::remove(restart_path.c_str());
  tandem_engine_loaded(engine_.get(), good);
}

}  // namespace tandem_lammps
