// Implements tandem::HandedColumns.
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "tandem/host.hpp"

namespace tandem {
namespace {

using engine::Classification;
using engine::InputKind;

enum class Turn : std::uint8_t { kServer, kWanted, kHandedOver };

double length_of(std::span<const double> values) {
  double squared = 0;
  for (const double v : values) squared += v * v;
  return std::sqrt(squared);
}

Classification refuse(const char* why) { return {.reason = why}; }

}  // namespace

struct HandedColumns::Impl {
  explicit Impl(HandedColumnsOptions the_options)
      : options(std::move(the_options)),
        alive(options.capacity),
        before(options.capacity),
        type(options.capacity),
        data(std::size_t{options.capacity} * options.data_bytes) {
    for (std::size_t i = 0; i < kAxes && (i < 6 || options.turns); ++i) axes[i].resize(options.capacity);
    if (options.turns) std::ranges::fill(axes[9], 1.0F);
    bell = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  }
  ~Impl() {
    if (bell >= 0) ::close(bell);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  // The server waits for this: whoever polls is to look at wanted(), or the server at the columns.
  void ring() const {
    const std::uint64_t one = 1;
    static_cast<void>(!::write(bell, &one, sizeof one));
  }
  void hush() const {
    std::uint64_t count = 0;
    static_cast<void>(!::read(bell, &count, sizeof count));
  }

  void note_events() {
    events.clear();
    for (std::uint32_t s = 0; s < alive.size(); ++s) {
      if (alive[s] == before[s]) continue;
      if (before[s] != 0) events.push_back({engine::Event::Kind::kDespawned, s});
      if (alive[s] != 0) events.push_back({engine::Event::Kind::kSpawned, s});
    }
    before = alive;
  }

  static constexpr std::size_t kAxes = 13;
  HandedColumnsOptions options;
  std::array<std::vector<float>, kAxes> axes;  // position, velocity, orientation, angular velocity
  std::vector<std::uint8_t> alive, before;
  std::vector<std::uint16_t> type;
  std::vector<std::byte> data;
  std::vector<engine::Event> events;
  std::vector<engine::Input> inputs;  // of the side whose turn it is
  std::atomic<Turn> turn{Turn::kServer};
  bool begun = false;  // the first frame was asked for
  int bell = -1;
};

HandedColumns::HandedColumns(HandedColumnsOptions options)
    : impl_(std::make_unique<Impl>(std::move(options))) {}
HandedColumns::~HandedColumns() = default;

std::span<float> HandedColumns::position(std::size_t axis) { return impl_->axes.at(axis % 3); }
std::span<float> HandedColumns::velocity(std::size_t axis) { return impl_->axes.at(3 + axis % 3); }
std::span<float> HandedColumns::orientation(std::size_t axis) { return impl_->axes.at(6 + axis % 4); }
std::span<float> HandedColumns::angular_velocity(std::size_t axis) { return impl_->axes.at(10 + axis % 3); }
std::span<std::uint8_t> HandedColumns::alive() { return impl_->alive; }
std::span<std::uint16_t> HandedColumns::type() { return impl_->type; }
std::span<std::byte> HandedColumns::data() { return impl_->data; }

bool HandedColumns::wanted() {
  if (impl_->turn.load(std::memory_order_acquire) != Turn::kWanted) return false;
  impl_->hush();
  return true;
}

std::vector<engine::Input> HandedColumns::take_inputs() {
  if (impl_->turn.load(std::memory_order_acquire) != Turn::kWanted) return {};
  return std::exchange(impl_->inputs, {});
}

void HandedColumns::hand_over() {
  Turn wanted = Turn::kWanted;
  if (!impl_->turn.compare_exchange_strong(wanted, Turn::kHandedOver, std::memory_order_acq_rel)) return;
  impl_->ring();
}

std::uint32_t HandedColumns::capacity() const { return impl_->options.capacity; }
double HandedColumns::dt_s() const { return impl_->options.dt_s; }
engine::Vec3 HandedColumns::gravity() const { return impl_->options.gravity; }
double HandedColumns::damping_per_s() const { return impl_->options.damping_per_s; }

Classification HandedColumns::classify(const engine::Input& input) const {
  const HandedColumnsOptions& options = impl_->options;
  if (!std::ranges::all_of(input.values, [](double v) { return std::isfinite(v); }))
    return refuse("a value is not finite");
  const std::span<const double> values = input.values;
  switch (static_cast<InputKind>(input.kind)) {
    case InputKind::kGravity: {
      if (!options.most_gravity) return refuse("this simulation takes no gravity");
      if (values.size() != 3 || !input.bytes.empty()) return refuse("gravity takes 3 values");
      if (!(length_of(values) <= *options.most_gravity)) return refuse("this gravity is too large");
      Classification effect{.effect = Classification::Effect::kScheduled,
                            .damping_per_s = options.damping_per_s};
      std::copy_n(values.begin(), 3, effect.gravity.begin());
      return effect;
    }
    case InputKind::kPush:
      if (!options.most_push) return refuse("this simulation takes no pushes");
      if (values.size() != 7 || !input.bytes.empty()) return refuse("a push takes 7 values");
      if (!(values[3] > 0)) return refuse("a push's radius must be above 0");
      if (!(length_of(values.subspan(4)) <= *options.most_push)) return refuse("this push is too large");
      return {.effect = Classification::Effect::kImmediate};
    case InputKind::kApplication:
      if (!options.most_bytes) return refuse("this simulation takes no application's inputs");
      if (!values.empty()) return refuse("an application's input has bytes only");
      if (input.bytes.size() > *options.most_bytes) return refuse("this input has too many bytes");
      return {.effect = Classification::Effect::kImmediate};
    default:
      return refuse("this simulation takes no input of this kind");
  }
}

void HandedColumns::apply(const engine::Input& input) {
  if (input.kind == static_cast<std::uint32_t>(InputKind::kGravity)) {
    TANDEM_ASSERT(input.values.size() == 3);  // classify() took it
    std::copy_n(input.values.begin(), 3, impl_->options.gravity.begin());
  }
  impl_->inputs.push_back(input);
}

// Only a server that stands by asks so; it has no loop that could hand anything over.
void HandedColumns::step() { impl_->events.clear(); }

void HandedColumns::begin_step() {
  if (!std::exchange(impl_->begun, true)) impl_->before = impl_->alive;
  impl_->turn.store(Turn::kWanted, std::memory_order_release);
  impl_->ring();
}

bool HandedColumns::step_ready() {
  Turn handed_over = Turn::kHandedOver;
  if (!impl_->turn.compare_exchange_strong(handed_over, Turn::kServer, std::memory_order_acq_rel))
    return false;
  impl_->hush();
  impl_->note_events();
  return true;
}

int HandedColumns::step_descriptor() const { return impl_->bell; }

engine::Bodies HandedColumns::bodies() const {
  engine::Bodies bodies;
  for (std::size_t i = 0; i < 3; ++i) {
    bodies.position[i] = impl_->axes[i];
    bodies.velocity[i] = impl_->axes[3 + i];
    bodies.angular_velocity[i] = impl_->axes[10 + i];
  }
  for (std::size_t i = 0; i < 4; ++i) bodies.orientation[i] = impl_->axes[6 + i];
  bodies.alive = impl_->alive;
  bodies.type = impl_->type;
  bodies.data = impl_->data;
  return bodies;
}

std::span<const engine::Event> HandedColumns::events() const { return impl_->events; }

void HandedColumns::save(std::vector<std::byte>& out) const {
  out.clear();
  if (!impl_->options.save || !impl_->options.load) return;
  const engine::Vec3& gravity = impl_->options.gravity;  // in force: it may be one that a user sent
  const auto head = std::as_bytes(std::span(gravity));
  out.assign(head.begin(), head.end());
  const std::vector<std::byte> rest = impl_->options.save();
  out.insert(out.end(), rest.begin(), rest.end());
}

bool HandedColumns::load(std::span<const std::byte> bytes) {
  engine::Vec3& gravity = impl_->options.gravity;
  if (!impl_->options.load || bytes.size() < sizeof gravity) return false;
  if (!impl_->options.load(bytes.subspan(sizeof gravity))) return false;
  std::memcpy(gravity.data(), bytes.data(), sizeof gravity);
  impl_->inputs.clear();
  return true;
}

}  // namespace tandem
