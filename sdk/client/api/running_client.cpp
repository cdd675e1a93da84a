#include "sdk/client/api/running_client.hpp"

#include <algorithm>
#include <chrono>
#include <new>
#include <utility>

namespace tandem::api {
namespace {

constexpr double kLongestWaitS = 1e6;
constexpr std::int64_t kThreadWaitNs = 500'000'000;

std::int64_t wait_ns(double seconds) {
  return static_cast<std::int64_t>(std::clamp(seconds, 0.0, kLongestWaitS) * 1e9);
}

tl::unexpected<Error> closed() { return fail(ErrorCode::kInvalidHandle, "the client was closed meanwhile"); }

}  // namespace

RunningClient::RunningClient(client::CoreOptions options, std::unique_ptr<transport::ClientPort> port,
                             Clock clock, bool background)
    : clock_(clock),
      participant_(options.role == transport::Role::kParticipant),
      port_(std::move(port)),
      core_(std::move(options), *port_, &events_) {
  if (background) thread_ = std::thread([this] { work(); });
}

RunningClient::~RunningClient() {
  end();
  if (thread_.joinable()) thread_.join();
}

void RunningClient::end() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  phase_changed_.notify_all();
  port_->wake();
}

void RunningClient::work() {
  while (!ending_ && round(kThreadWaitNs)) {
  }
}

Result<void> RunningClient::usable() const {
  if (!fault_) return {};
  if (*fault_ == ErrorCode::kOutOfMemory) {
    return fail(*fault_, "the client stopped because no memory was left; join again");
  }
  return fail(*fault_, "the client stopped because of an internal error; join again");
}

Result<void> RunningClient::poll(std::int64_t& due_ns) {
  const std::lock_guard lock(mutex_);
  if (auto can = usable(); !can) return can;
  const client::Now now = clock_();
  try {
    events_.begin(now.steady_ns);
    due_ns = core_.poll(now);
    events_.end(core_);
  } catch (const std::bad_alloc&) {
    fault_ = ErrorCode::kOutOfMemory;
  } catch (...) {
    fault_ = ErrorCode::kInternal;
  }
  if (phase_.exchange(core_.phase()) != core_.phase() || fault_) phase_changed_.notify_all();
  return usable();
}

Result<void> RunningClient::round(std::int64_t longest_ns) {
  std::int64_t due_ns = 0;
  if (auto polled = poll(due_ns); !polled) return polled;
  const std::int64_t wait_ns = std::min(longest_ns, due_ns - clock_().steady_ns);
  if (wait_ns > 0 && !ending_) port_->wait(std::chrono::nanoseconds(wait_ns));
  return {};
}

Result<void> RunningClient::update(double wait_s) {
  if (has_thread()) {
    return fail(ErrorCode::kWrongThread, "this client has a thread of its own: join with background = 0");
  }
  if (updating_.exchange(true))
    return fail(ErrorCode::kWrongThread, "another thread is updating this client");
  struct Done {
    std::atomic<bool>& updating;
    ~Done() { updating = false; }
  } const done{updating_};
  if (auto went = round(wait_ns(wait_s)); !went) return went;
  if (ending_) return closed();
  return {};
}

Result<void> RunningClient::wait_until_playing(double timeout_s) {
  const auto playing = [this] { return phase_ == ClientPhase::kPlaying; };
  const auto late = [] {
    return fail(ErrorCode::kTimeout, "found no session to play within the given time");
  };
  if (has_thread()) {
    std::unique_lock lock(mutex_);
    const bool over = phase_changed_.wait_for(lock, std::chrono::nanoseconds(wait_ns(timeout_s)),
                                              [&] { return playing() || ending_ || fault_; });
    if (ending_) return closed();
    if (auto can = usable(); !can) return can;
    if (!over) return late();
    return {};
  }
  {
    const std::lock_guard lock(mutex_);
    if (auto can = usable(); !can) return can;
  }
  const std::int64_t end_ns = clock_().steady_ns + wait_ns(timeout_s);
  while (!playing()) {
    const std::int64_t left_ns = end_ns - clock_().steady_ns;
    if (left_ns <= 0) return late();
    if (auto updated = update(static_cast<double>(left_ns) / 1e9); !updated) return updated;
  }
  return {};
}

Result<std::uint64_t> RunningClient::send(transport::InputKind kind, std::vector<double> values,
                                          transport::Bytes bytes) {
  const std::lock_guard lock(mutex_);
  if (auto can = usable(); !can) return tl::unexpected<Error>(can.error());
  auto sent = core_.send(kind, std::move(values), std::move(bytes), clock_());
  if (!sent && sent.error().code == ErrorCode::kOutOfOrder && participant_) {
    sent.error().code = ErrorCode::kNotReady;  // not playing
  }
  return sent;
}

Result<void> RunningClient::prefer(std::string_view preference) {
  const std::lock_guard lock(mutex_);
  if (auto can = usable(); !can) return can;
  core_.prefer(preference);
  return {};
}

std::optional<Event> RunningClient::next_event() {
  const std::lock_guard lock(mutex_);
  return events_.take();
}

std::optional<QueuedNews> RunningClient::next_news() {
  const std::lock_guard lock(mutex_);
  return events_.news().take();
}

Result<ClientStatus> RunningClient::status() const {
  const std::lock_guard lock(mutex_);
  if (auto can = usable(); !can) return tl::unexpected<Error>(can.error());
  return core_.status();
}

std::uint64_t RunningClient::events_dropped() const {
  const std::lock_guard lock(mutex_);
  return events_.dropped();
}

std::shared_ptr<const KnownScene> RunningClient::scene() const {
  const std::lock_guard lock(mutex_);
  return scene_;
}

void RunningClient::hold_scene(std::shared_ptr<const KnownScene> scene) {
  const std::lock_guard lock(mutex_);
  scene_ = std::move(scene);
}

namespace {

template <class T>
client::Column<T> column(T* first, std::uint32_t stride, std::size_t numbers) {
  return {first, stride != 0 ? stride : numbers * sizeof(T)};
}

client::SampleColumns to_columns(const tandem_columns& c) {
  return {.capacity = c.capacity,
          .positions = column(c.positions, c.position_stride, 3),
          .velocities = column(c.velocities, c.velocity_stride, 3),
          .orientations = column(c.orientations, c.orientation_stride, 4),
          .angular_velocities = column(c.angular_velocities, c.angular_velocity_stride, 3),
          .types = column(c.types, c.type_stride, 1),
          .alive = column(c.alive, c.alive_stride, 1),
          .reuse = column(c.reuse, c.reuse_stride, 1),
          .changes = column(c.changes, c.change_stride, 1)};
}

}  // namespace

Result<void> RunningClient::sample(const tandem_sample_options& options, const tandem_columns& columns,
                                   tandem_frame& frame) {
  if (!sampling_) {
    const std::lock_guard lock(mutex_);
    if (auto can = usable(); !can) return can;
    core_.start_sampling();
    sampling_ = true;
    port_->wake();  // from now on it wakes for each frame that is due
  }
  const auto sampled = core_.sample({.mode = static_cast<SampleMode>(options.mode),
                                     .at_ns = options.at_ns,
                                     .smoothing_s = options.smoothing_s},
                                    to_columns(columns), clock_());
  if (!sampled) {
    Error error = sampled.error();
    if (error.code == ErrorCode::kOutOfOrder) error.code = ErrorCode::kNotReady;
    const auto drawable = core_.drawable();
    if (drawable) {
      frame.capacity = drawable->capacity;
      frame.has_orientations = drawable->has_orientations ? 1 : 0;
    }
    return tl::unexpected<Error>(std::move(error));
  }
  frame.capacity = sampled->capacity;
  frame.epoch = sampled->epoch;
  frame.frame = sampled->frame;
  frame.seconds_since_delta = sampled->since_delta_s;
  frame.alive = sampled->alive;
  frame.has_orientations = sampled->has_orientations ? 1 : 0;
  frame.mode = options.mode;
  frame.phase = static_cast<tandem_phase>(phase());
  return {};
}

}  // namespace tandem::api
