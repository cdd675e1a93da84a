// tandem::Client: a ClientCore with a clock, a DDS port and, if wanted, a thread.
#include "tandem/client.hpp"
#include "sdk/core/timeline/timeline.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>
#include <utility>

#include "sdk/client/api/client_id.hpp"
#include "sdk/client/api/clock.hpp"
#include "sdk/client/client_core.hpp"
#include "sdk/transport/dds/dds_ports.hpp"

namespace tandem {
namespace {

constexpr double kLongestWaitS = 1e6;

client::CoreOptions core_options(const ClientOptions& options) {
  client::CoreOptions core;
  core.session = options.session;
  core.id = client::random_client_id();
  core.role =
      options.role == ClientRole::kObserver ? transport::Role::kObserver : transport::Role::kParticipant;
  core.lead = options.lead;
  core.log = options.log;
  core.measure_ns = transport::steady_ns;
  return core;
}

}  // namespace

// The port waits without the lock, so that nobody waits for the network; sample() does without it but once.
struct Client::Impl {
  Impl(client::CoreOptions core_opts, std::unique_ptr<transport::ClientPort> client_port)
      : port(std::move(client_port)), core(std::move(core_opts), *port) {}

  ~Impl() {
    ending = true;
    port->wake();
    if (thread.joinable()) thread.join();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  Impl(Impl&&) = delete;
  Impl& operator=(Impl&&) = delete;

  /// One round; waits at most `longest_ns` for the next thing to do.
  void round(std::int64_t longest_ns) {
    std::int64_t due_ns = 0;
    {
      const std::lock_guard lock(mutex);
      due_ns = core.poll(client::now());
    }
    const std::int64_t wait_ns = std::min(longest_ns, due_ns - transport::steady_ns());
    if (wait_ns > 0 && !ending) port->wait(std::chrono::nanoseconds(wait_ns));
  }

  Result<std::uint64_t> send(transport::InputKind kind, std::vector<double> values, transport::Bytes bytes) {
    const std::lock_guard lock(mutex);
    return core.send(kind, std::move(values), std::move(bytes), client::now());
  }

  std::unique_ptr<transport::ClientPort> port;
  mutable std::mutex mutex;  // guards core but for its sample(); port->wait() and wake() need no guard
  client::ClientCore core;
  std::atomic<bool> sampling = false;
  std::atomic<bool> ending = false;
  std::thread thread;
};

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;
Client::~Client() = default;

Result<Client> Client::connect(const ClientOptions& options) {
  if (auto ok = transport::check_session_name(options.session); !ok) return tl::unexpected<Error>(ok.error());
  if (options.domain > transport::kMaxDomain) {
    return fail(ErrorCode::kInvalidArgument, "a DDS domain is 0 to " + std::to_string(transport::kMaxDomain));
  }
  if (options.lead > kMaxLead) return fail(ErrorCode::kInvalidArgument, "a lead is 0 or 1");
  auto core = core_options(options);
  transport::DdsOptions dds;
  dds.domain = options.domain;
  dds.session = options.session;
  dds.client = core.id;
  if (options.role == ClientRole::kObserver) dds.lease = transport::DdsOptions::kObserverLease;
  auto port = transport::make_dds_client_port(dds);
  if (!port) return tl::unexpected<Error>(port.error());
  auto impl = std::make_unique<Impl>(std::move(core), std::move(*port));
  if (options.background) {
    impl->thread = std::thread([self = impl.get()] {
      constexpr std::int64_t kLongestNs = 100'000'000;
      while (!self->ending) self->round(kLongestNs);
    });
  }
  return Client(std::move(impl));
}

void Client::poll(double wait_s) {
  if (impl_->thread.joinable()) return;
  impl_->round(static_cast<std::int64_t>(std::clamp(wait_s, 0.0, kLongestWaitS) * 1e9));
}

ClientStatus Client::status() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->core.status();
}

void Client::run_for(double seconds) {
  using Clock = std::chrono::steady_clock;
  const std::chrono::duration<double> span(std::clamp(seconds, 0.0, kLongestWaitS));
  if (impl_->thread.joinable()) return std::this_thread::sleep_for(span);
  for (const auto end = Clock::now() + span; Clock::now() < end;) {
    poll(std::chrono::duration<double>(end - Clock::now()).count());
  }
}

bool Client::wait_until_playing(double timeout_s) {
  constexpr double kStepS = 0.01;
  const auto playing = [this] {
    const std::lock_guard lock(impl_->mutex);
    return impl_->core.phase() == ClientPhase::kPlaying;
  };
  for (double waited_s = 0; !playing() && waited_s < timeout_s; waited_s += kStepS) run_for(kStepS);
  return playing();
}

Result<std::uint64_t> Client::send_gravity(std::array<double, 3> metres_per_s2) {
  return impl_->send(transport::InputKind::kGravity, {metres_per_s2.begin(), metres_per_s2.end()}, {});
}

Result<std::uint64_t> Client::send_push(std::array<double, 3> centre, double radius,
                                        std::array<double, 3> velocity) {
  return impl_->send(transport::InputKind::kPush,
                     {centre[0], centre[1], centre[2], radius, velocity[0], velocity[1], velocity[2]}, {});
}

Result<std::uint64_t> Client::send_bytes(std::span<const std::byte> bytes) {
  return impl_->send(transport::InputKind::kApplication, {}, {bytes.begin(), bytes.end()});
}

std::vector<BodyTypeInfo> Client::types() const {
  const std::lock_guard lock(impl_->mutex);
  std::vector<BodyTypeInfo> out;
  if (const auto* session = impl_->core.session()) {
    for (const auto& type : session->types) {
      out.push_back({type.name, type.radius, type.colour_rgba, type.shape, type.shape_values});
    }
  }
  return out;
}

std::string Client::scene_description() const {
  const std::lock_guard lock(impl_->mutex);
  const auto* session = impl_->core.session();
  return session != nullptr ? session->scene_description : std::string();
}

bool Client::sample(Sample& out, SampleMode mode) {
  if (!impl_->sampling) {
    const std::lock_guard lock(impl_->mutex);
    impl_->core.start_sampling();
    impl_->sampling = true;
  }
  return impl_->core.sample(out, mode, client::now());
}

}  // namespace tandem
