#include "tests/bench/lab/framerate/enclave.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <poll.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <deque>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

#include "services/lab/measures/replay.hpp"

namespace tandem::lab {
namespace {

using system::Descriptor;

constexpr const char* kDevice = "tandem0";
constexpr std::size_t kMaxPacketBytes = 65536;

tl::unexpected<Error> failure(const char* what) {
  return fail(ErrorCode::kIo, fmt::format("{}: {}", what, std::strerror(errno)));
}

ifreq request_for(const char* device) {
  ifreq request{};
  std::strncpy(request.ifr_name, device, sizeof request.ifr_name - 1);
  return request;
}

Result<void> bring_up(int control, const char* device) {
  ifreq request = request_for(device);
  if (ioctl(control, SIOCGIFFLAGS, &request) != 0) return failure(device);
  request.ifr_flags = static_cast<short>(request.ifr_flags | IFF_UP | IFF_RUNNING);
  if (ioctl(control, SIOCSIFFLAGS, &request) != 0) return failure(device);
  return {};
}

Result<void> set_address(int control, unsigned long what, const std::string& address) {
  ifreq request = request_for(kDevice);
  sockaddr_in internet{};
  internet.sin_family = AF_INET;
  if (inet_pton(AF_INET, address.c_str(), &internet.sin_addr) != 1)
    return fail(ErrorCode::kInvalidArgument, address + " is no IPv4 address");
  std::memcpy(&request.ifr_addr, &internet, sizeof internet);
  if (ioctl(control, what, &request) != 0) return failure(address.c_str());
  return {};
}

/// Runs in a separate thread, because the namespace stays with the calling thread.
Result<Enclave> make_here(const std::string& address) {
  if (unshare(CLONE_NEWNET) != 0) return failure("a network namespace of its own");
  Enclave enclave;
  enclave.name_space = Descriptor(open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC));
  if (enclave.name_space.get() < 0) return failure("/proc/thread-self/ns/net");
  enclave.device = Descriptor(open("/dev/net/tun", O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (enclave.device.get() < 0) return failure("/dev/net/tun");
  ifreq request = request_for(kDevice);
  request.ifr_flags = IFF_TUN | IFF_NO_PI;
  if (ioctl(enclave.device.get(), TUNSETIFF, &request) != 0) return failure("a TUN device");
  const Descriptor control(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (control.get() < 0) return failure("socket");
  auto done = set_address(control.get(), SIOCSIFADDR, address);
  if (done) done = set_address(control.get(), SIOCSIFNETMASK, "255.255.255.0");
  if (done) done = bring_up(control.get(), "lo");
  if (done) done = bring_up(control.get(), kDevice);
  if (!done) return tl::unexpected(done.error());
  return enclave;
}

struct Packet {
  std::int64_t due_ns = 0;
  std::vector<char> bytes;
};

/// The traffic that was carried up to a moment.
struct Mark {
  std::int64_t at_ns = 0;
  std::uint64_t bytes_there = 0;
};
constexpr std::int64_t kMarkEveryNs = 100'000'000;

/// The way from one device to the other.
struct Way {
  Way(int from_fd, int to_fd, const transport::simulated::BottleneckOptions& options)
      : from(from_fd), to(to_fd), link(options) {}

  void take_in(std::span<char> buffer) {
    for (;;) {
      const ssize_t size = read(from, buffer.data(), buffer.size());
      if (size <= 0) return;
      // Carries IPv4 only, because the IPv6 traffic is the kernel's own.
      if ((static_cast<unsigned char>(buffer[0]) >> 4U) != 4) continue;
      const auto bytes = static_cast<std::size_t>(size);
      if (const auto due = link.offer(steady_ns(), bytes))
        waiting.push_back({*due, {buffer.data(), buffer.data() + bytes}});
    }
  }
  void give_out() {
    for (; !waiting.empty() && waiting.front().due_ns <= steady_ns(); waiting.pop_front()) {
      const Packet& packet = waiting.front();
      // A device that is full drops packets, as a network card does.
      [[maybe_unused]] const ssize_t taken = write(to, packet.bytes.data(), packet.bytes.size());
    }
  }

  int from, to;
  transport::simulated::Bottleneck link;
  std::deque<Packet> waiting;
};

}  // namespace

Result<Enclave> make_enclave(const std::string& address) {
  Result<Enclave> made{Enclave{}};
  std::jthread([&] { made = make_here(address); }).join();
  return made;
}

struct Link::State {
  State(const Enclave& server, const Enclave& clients, const transport::simulated::BottleneckOptions& options)
      : there(server.device.get(), clients.device.get(), options),
        back(clients.device.get(), server.device.get(), options) {}

  void run(const std::stop_token& stop) {
    std::vector<char> buffer(kMaxPacketBytes);
    while (!stop.stop_requested()) {
      std::int64_t wait_ns = 20'000'000;  // maximum delay until a stop is noticed
      if (const std::int64_t now_ns = steady_ns();
          marks.empty() || now_ns - marks.back().at_ns > kMarkEveryNs)
        marks.push_back({now_ns, there.link.bytes()});
      for (Way* way : {&there, &back}) {
        way->take_in(buffer);
        way->give_out();
        if (!way->waiting.empty()) {
          wait_ns = std::min(wait_ns, std::max<std::int64_t>(way->waiting.front().due_ns - steady_ns(), 0));
        }
      }
      pollfd ready[2] = {{there.from, POLLIN, 0}, {back.from, POLLIN, 0}};
      const timespec timeout{0, static_cast<long>(wait_ns)};
      ppoll(ready, 2, &timeout, nullptr);
    }
  }

  /// The last mark not after `at_ns`, or an empty one before the first.
  [[nodiscard]] Mark at(std::int64_t at_ns) const {
    const auto after =
        std::find_if(marks.begin(), marks.end(), [&](const Mark& mark) { return mark.at_ns > at_ns; });
    return after == marks.begin() ? Mark{} : *std::prev(after);
  }

  Way there, back;
  std::vector<Mark> marks;  // of a few minutes
};

Link::Link(const Enclave& server, const Enclave& clients,
           const transport::simulated::BottleneckOptions& options)
    : state_(std::make_unique<State>(server, clients, options)),
      thread_([state = state_.get()](const std::stop_token& stop) { state->run(stop); }) {}
Link::~Link() = default;
LinkCounts Link::finish(double seconds) {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
  const State& state = *state_;
  const Mark before = state.at(steady_ns() - static_cast<std::int64_t>(seconds * 1e9));
  return {state.there.link.bytes() - before.bytes_there,
          state.there.link.dropped() + state.back.link.dropped()};
}

}  // namespace tandem::lab
