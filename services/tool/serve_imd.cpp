// tandem serve-imd: offers a session to viewers of molecular dynamics, as a simulation that speaks IMD.

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>
#include <thread>
#include <vector>

#include "services/adapters/imd/wire.hpp"
#include "services/engines/door/descriptor.hpp"
#include "services/program/process/signal_watch.hpp"
#include "services/tool/commands.hpp"
#include "services/tool/endpoint_options.hpp"
#include "services/tool/print_error.hpp"
#include "tandem/client.hpp"

namespace tandem::tool {
namespace {

using Clock = std::chrono::steady_clock;
using engine::door::Descriptor;
constexpr auto kGoLimit = std::chrono::seconds{10};  // the protocol says 1; people type
constexpr std::size_t kMostViewers = 16;

struct Options {
  ClientOptions client;
  std::string listen = "127.0.0.1:8888";
  int version = 3;
  double scale = 1;
  std::optional<double> seconds;
};

Result<Descriptor> listen_at(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  std::string host = colon == std::string::npos ? "" : address.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* list = nullptr;
  const std::string port = address.substr(colon == std::string::npos ? 0 : colon + 1);
  if (const int wrong = ::getaddrinfo(host.empty() ? "127.0.0.1" : host.c_str(), port.c_str(), &hints, &list);
      wrong != 0)
    return fail(ErrorCode::kInvalidArgument, fmt::format("{}: {}", address, ::gai_strerror(wrong)));
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> addresses(list, &::freeaddrinfo);
  const int on = 1;
  Descriptor socket(::socket(list->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  ::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (socket.get() < 0 || ::bind(socket.get(), list->ai_addr, list->ai_addrlen) != 0 ||
      ::listen(socket.get(), 4) != 0)
    return fail(ErrorCode::kIo, fmt::format("{}: {}", address, std::strerror(errno)));
  return socket;
}

/// A viewer that is connected. It gets whole frames; those for which it is too slow are left out.
class Viewer {
 public:
  Viewer(Descriptor socket, const imd::Session& session)
      : socket_(std::move(socket)), version_(session.version) {
    const int on = 1;
    ::setsockopt(socket_.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    imd::append_session(out_, session);
  }

  [[nodiscard]] pollfd wait_for() const {
    return {.fd = socket_.get(),
            .events = static_cast<short>(sent_ < out_.size() ? POLLIN | POLLOUT : POLLIN),
            .revents = 0};
  }
  [[nodiscard]] bool gone() const { return gone_; }
  [[nodiscard]] bool wants(std::uint64_t frame) const {
    return going_ && !paused_ && sent_ == out_.size() && frame % static_cast<std::uint64_t>(rate_) == 0;
  }
  void give(const std::vector<std::byte>& frame) {
    out_ = frame;
    sent_ = 0;
    flush();
  }
  void turn(bool readable) {
    if (readable) take();
    flush();
    gone_ = gone_ || (!going_ && Clock::now() - came_ > kGoLimit);
  }

 private:
  void take() {
    std::array<std::byte, 65536> bytes{};
    const ssize_t got = ::recv(socket_.get(), bytes.data(), bytes.size(), 0);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (got <= 0) {
      gone_ = true;
      return;
    }
    const auto good = reader_.take(std::span(bytes).first(static_cast<std::size_t>(got)),
                                   [this](const imd::Wish& wish) { obey(wish); });
    if (good) return;
    print_error(fmt::format("tandem serve-imd: a viewer is sent away: {}\n", good.error().message));
    gone_ = true;
  }
  void obey(const imd::Wish& wish) {
    switch (wish.type) {
      case imd::Type::kGo:
        going_ = true;
        break;
      case imd::Type::kPause:
        paused_ = version_ == 2 ? !paused_ : true;
        break;
      case imd::Type::kResume:
        paused_ = false;
        break;
      case imd::Type::kRate:
        rate_ = std::max(wish.value, 1);
        break;
      case imd::Type::kForcesIn:
        if (!std::exchange(told_forces_, true))
          print_error("tandem serve-imd: a viewer's forces are not taken: it only watches\n");
        break;
      case imd::Type::kDisconnect:
      case imd::Type::kKill:  // others watch, too: only this one ends
        gone_ = true;
        break;
      default:
        break;
    }
  }
  void flush() {
    while (!gone_ && sent_ < out_.size()) {
      const ssize_t sent = ::send(socket_.get(), out_.data() + sent_, out_.size() - sent_, MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent < 0 && errno == EAGAIN) return;
      if (sent <= 0) {
        gone_ = true;
        return;
      }
      sent_ += static_cast<std::size_t>(sent);
    }
  }

  Descriptor socket_;
  int version_;
  imd::ViewerReader reader_;
  std::vector<std::byte> out_;
  std::size_t sent_ = 0;
  Clock::time_point came_ = Clock::now();
  std::int32_t rate_ = 1;
  bool going_ = false, paused_ = false, gone_ = false, told_forces_ = false;
};

/// The session's bodies as messages of IMD. Every slot is an atom, because the number of atoms cannot change.
class Frames {
 public:
  Frames(const Scene& scene, const Options& options)
      : options_(options), dt_s_(scene.dt_s), capacity_(scene.capacity) {
    float reach = 0;
    for (std::size_t i = 0; i < 3; ++i)
      reach = std::max({reach, std::abs(scene.low[i]), std::abs(scene.high[i])});
    // Where there is no body, viewers are to see none; NaN would upset some of them.
    away_ = static_cast<float>(10 * std::max(reach, 100.0F) * options.scale);
    for (std::size_t i = 0; i < 3; ++i)
      box_[4 * i] = static_cast<float>(static_cast<double>(scene.high[i] - scene.low[i]) * options.scale);
    positions_.resize(std::size_t{3} * capacity_);
    velocities_.resize(positions_.size());
    alive_.resize(capacity_);
  }
  [[nodiscard]] std::uint32_t capacity() const { return capacity_; }
  [[nodiscard]] imd::Session session() const {
    const bool all = options_.version >= 3;
    return {.version = options_.version, .time = all, .box = all, .coordinates = true, .velocities = all};
  }

  /// False: there is nothing newer than the last frame. Errors: the session has other slots now.
  Result<bool> next(Client& client) {
    const auto at = client.sample_frame({.mode = SampleMode::kInterpolate});
    if (!at) return false;
    const auto whole = static_cast<std::uint64_t>(at->frame);
    if (at->epoch == epoch_ && whole == number_) return false;
    Columns columns;
    columns.capacity = capacity_;
    columns.positions = Column<float>(positions_.data());
    columns.velocities = Column<float>(velocities_.data());
    columns.alive = Column<std::uint8_t>(alive_.data());
    const auto sampled = client.sample(columns, {.mode = SampleMode::kInterpolate});
    if (!sampled) return tl::unexpected(sampled.error());
    epoch_ = sampled->epoch;
    number_ = static_cast<std::uint64_t>(sampled->frame);
    time_s_ = sampled->frame * dt_s_;
    const auto scale = static_cast<float>(options_.scale);
    for (std::size_t s = 0; s < capacity_; ++s) {
      for (std::size_t i = 3 * s; i < 3 * s + 3; ++i) {
        positions_[i] = alive_[s] != 0 ? positions_[i] * scale : away_;
        velocities_[i] = alive_[s] != 0 ? velocities_[i] * scale : 0;
      }
    }
    bytes_.clear();
    if (options_.version >= 3) {
      imd::append_moment(bytes_, {.dt = dt_s_, .time = time_s_, .step = static_cast<std::int64_t>(number_)});
      imd::append_box(bytes_, box_);
    }
    imd::append_vectors(bytes_, imd::Type::kCoordinates, positions_);
    if (options_.version >= 3) imd::append_vectors(bytes_, imd::Type::kVelocities, velocities_);
    return true;
  }
  [[nodiscard]] std::uint64_t number() const { return number_; }
  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  const Options& options_;
  double dt_s_;
  std::uint32_t capacity_;
  float away_ = 0;
  std::array<float, 9> box_{};
  std::vector<float> positions_, velocities_;
  std::vector<std::uint8_t> alive_;
  std::vector<std::byte> bytes_;
  std::uint64_t epoch_ = 0, number_ = 0;
  double time_s_ = 0;
};

/// Serves until it is stopped. Errors: the session changed its form.
Result<void> serve(Client& client, Frames& frames, const Descriptor& listener, const Options& options,
                   const std::atomic<bool>& stop) {
  std::vector<std::unique_ptr<Viewer>> viewers;
  const auto end = Clock::now() + std::chrono::duration<double>(options.seconds.value_or(1e9));
  while (!stop.load(std::memory_order_relaxed) && Clock::now() < end) {
    std::vector<pollfd> list{{.fd = listener.get(), .events = POLLIN, .revents = 0}};
    for (const auto& viewer : viewers) list.push_back(viewer->wait_for());
    ::poll(list.data(), list.size(), 5);
    for (std::size_t i = 0; i < viewers.size(); ++i) viewers[i]->turn((list[i + 1].revents & ~POLLOUT) != 0);
    if ((list[0].revents & POLLIN) != 0) {
      Descriptor socket(::accept4(listener.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
      if (socket.get() >= 0 && viewers.size() < kMostViewers)
        viewers.push_back(std::make_unique<Viewer>(std::move(socket), frames.session()));
    }
    const std::size_t before = viewers.size();
    std::erase_if(viewers, [](const auto& viewer) { return viewer->gone(); });
    if (viewers.size() < before) fmt::print("{} viewers\n", viewers.size());
    const auto newer = frames.next(client);
    if (!newer) return tl::unexpected(newer.error());
    if (!*newer) continue;
    for (const auto& viewer : viewers)
      if (viewer->wants(frames.number())) viewer->give(frames.bytes());
  }
  return {};
}

int run_serve(Options& options) {
  const auto complain = [](const std::string& why) {
    print_error(fmt::format("tandem serve-imd: {}\n", why));
  };
  SignalWatch signals("tandem serve-imd", SignalWatch::Hangup::kStop,
                      {&transport::dds_fault, complain, false, &transport::dds_outdated});
  const auto refuse = [&signals, &complain](const std::string& why) {
    complain(why);
    return signals.finish(1);
  };
  const auto listener = listen_at(options.listen);
  if (!listener) return refuse(listener.error().message);
  options.client.role = ClientRole::kObserver;
  auto client = Client::connect(options.client);
  if (!client) return refuse(client.error().message);
  std::optional<Frames> frames;
  while (!frames && !signals.stop().load()) {
    if (!client->wait_until_playing(0.2)) continue;
    const auto scene = client->scene();
    if (!scene) return refuse(scene.error().message);
    frames.emplace(*scene, options);
    fmt::print("session {}: {} atoms, IMD version {} at {}\n", options.client.session, scene->capacity,
               options.version, options.listen);
    std::fflush(stdout);
  }
  if (!frames) return signals.finish(0);
  if (const auto served = serve(*client, *frames, *listener, options, signals.stop()); !served)
    return refuse(served.error().message);
  return signals.finish(0);
}

}  // namespace

void add_serve_imd(commandline::Command app, Run& run) {
  commandline::Command command = app.add_subcommand(
      "serve-imd",
      "Offers a session to VMD, OVITO and MDAnalysis, as a simulation that speaks IMD. It only watches.");
  const auto options = std::make_shared<Options>();
  add_endpoint_options(command, options->client.domain, options->client.profile, options->client.session);
  add_secure_option(command, options->client.secure);
  add_prefer_option(command, options->client.prefer);
  command
      .add_option(
          "--listen", options->listen,
          "ADDRESS:PORT or a port of 127.0.0.1. Who reaches it sees the session: IMD has no passwords")
      .show_default();
  command
      .add_option("--imd-version", options->version,
                  "Version of the protocol: 2 (VMD, OVITO) has positions alone")
      .range(2, 3)
      .show_default();
  command.add_option("--scale", options->scale, "Angstrom of a scene unit").positive().show_default();
  command.add_option("--seconds", options->seconds, "Seconds to serve (default: until stopped)").positive();
  command.footer(
      "Each slot is an atom; where no body is, the atom is far outside. Seconds are sent as picoseconds. Exits with 1 if it cannot serve.");
  command.on_chosen([options, &run] { run = [options] { return run_serve(*options); }; });
}

}  // namespace tandem::tool
