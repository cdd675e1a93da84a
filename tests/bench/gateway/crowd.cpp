#include "tests/bench/gateway/crowd.hpp"

#include <arpa/inet.h>
#include <linux/errqueue.h>
#include <linux/net_tstamp.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "sdk/wire/clock.hpp"
#include "sdk/wire/envelope.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::bench {
namespace {

using Arrival = Crowd::Arrival;

constexpr std::int64_t kAckNs = 200 * kMillisecond, kPartAckNs = 20 * kMillisecond;
// Kind, encapsulation, epoch, stream and generation lie before a delta's frame number.
constexpr std::size_t kFrameAt = 1 + transport::kCdrHeaderBytes + 8 + 4 + 4;
constexpr unsigned kPing = 9, kPong = 10, kBinary = 2;

struct Viewer {
  int socket = -1;
  bool sleeper = false, upgraded = false;
  transport::AckMessage ack;
  std::uint32_t parts_held = 0;
  bool joined = false;
  std::optional<Frame> last;
  std::int64_t acked_ns = 0;
  bool ack_due = false;
  transport::Bytes in;  // what was received and is no whole message yet
};

/// A frame of WebSocket, with a mask of zeros. The kernel has room for it, or it is left out.
void send_frame(const Viewer& viewer, unsigned kind, std::span<const std::byte> body) {
  transport::Bytes frame;
  const auto put = [&frame](std::size_t value) { frame.push_back(static_cast<std::byte>(value & 0xFFU)); };
  put(0x80U | kind);
  if (body.size() < 126) {
    put(0x80U | body.size());
  } else {
    put(0x80U | 126U);
    put(body.size() >> 8U);
    put(body.size());
  }
  for (int i = 0; i < 4; ++i) put(0);
  frame.insert(frame.end(), body.begin(), body.end());
  [[maybe_unused]] const ssize_t sent =
      send(viewer.socket, frame.data(), frame.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

/// When the newest received byte came, by the wall clock; 0: the kernel does not say.
std::int64_t stamp_of(msghdr& message) {
  for (cmsghdr* one = CMSG_FIRSTHDR(&message); one != nullptr; one = CMSG_NXTHDR(&message, one)) {
    if (one->cmsg_level != SOL_SOCKET || one->cmsg_type != SCM_TIMESTAMPING) continue;
    scm_timestamping stamps{};
    std::memcpy(&stamps, CMSG_DATA(one), sizeof stamps);
    return stamps.ts[0].tv_sec * kSecond + stamps.ts[0].tv_nsec;
  }
  return 0;
}

}  // namespace

// It speaks WebSocket itself, because libwebsockets takes as long for a message as the gateway, and does not
// tell when it came.
struct Crowd::Impl {
  void connect_one(Viewer& viewer, int port);
  void receive(Viewer& viewer);
  void take_frames(Viewer& viewer, const Arrival& arrival);
  void take(Viewer& viewer, std::span<const std::byte> message, const Arrival& arrival);
  void joins(Viewer& viewer, const transport::SnapshotMessage& part, std::int64_t now_ns);
  void end(Viewer& viewer);
  static void acknowledge(Viewer& viewer);

  int poll = epoll_create1(EPOLL_CLOEXEC);
  std::vector<Viewer> viewers;
  std::uint64_t gaps = 0, lost = 0;
  std::map<Frame, std::vector<Arrival>> arrivals;
};

void Crowd::Impl::connect_one(Viewer& viewer, int port) {
  viewer.socket = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  constexpr int kOn = 1, kStamps = SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE;
  setsockopt(viewer.socket, SOL_SOCKET, SO_TIMESTAMPING, &kStamps, sizeof kStamps);
  setsockopt(viewer.socket, IPPROTO_TCP, TCP_NODELAY, &kOn, sizeof kOn);
  if (connect(viewer.socket, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) return end(viewer);
  constexpr std::string_view kRequest =
      "GET /tandem HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
      "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
      "Sec-WebSocket-Protocol: tandem.4\r\n\r\n";
  if (send(viewer.socket, kRequest.data(), kRequest.size(), MSG_NOSIGNAL) < 0) return end(viewer);
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.ptr = &viewer;
  epoll_ctl(poll, EPOLL_CTL_ADD, viewer.socket, &event);
}

void Crowd::Impl::end(Viewer& viewer) {
  ++lost;
  close(std::exchange(viewer.socket, -1));
}

void Crowd::Impl::receive(Viewer& viewer) {
  std::array<std::byte, 65'536> buffer{};
  std::array<char, 128> control{};
  iovec piece{buffer.data(), buffer.size()};
  msghdr message{};
  message.msg_iov = &piece;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t size = recvmsg(viewer.socket, &message, MSG_DONTWAIT);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (size <= 0) return end(viewer);
  Arrival arrival;
  arrival.read_ns = transport::steady_ns();
  const std::int64_t stamp_ns = stamp_of(message);
  arrival.in_kernel_ns = stamp_ns == 0 ? arrival.read_ns : stamp_ns + arrival.read_ns - transport::wall_ns();
  viewer.in.insert(viewer.in.end(), buffer.begin(), buffer.begin() + size);
  take_frames(viewer, arrival);
}

void Crowd::Impl::take_frames(Viewer& viewer, const Arrival& arrival) {
  std::size_t at = 0;
  if (!viewer.upgraded) {
    const std::string_view text(reinterpret_cast<const char*>(viewer.in.data()), viewer.in.size());
    const std::size_t end = text.find("\r\n\r\n");
    if (end == std::string_view::npos) return;
    viewer.upgraded = true;
    at = end + 4;
  }
  const auto byte = [&viewer](std::size_t place) { return std::to_integer<std::size_t>(viewer.in[place]); };
  while (viewer.socket >= 0 && viewer.in.size() >= at + 2) {
    std::size_t head = 2, size = byte(at + 1) & 127U;
    const std::size_t more = size == 126 ? 2 : size == 127 ? 8 : 0;
    if (viewer.in.size() < at + head + more) break;
    if (more > 0) size = 0;
    for (std::size_t i = 0; i < more; ++i) size = size << 8U | byte(at + head + i);
    head += more;
    if (viewer.in.size() < at + head + size) break;
    const auto body = std::span(viewer.in).subspan(at + head, size);
    const std::size_t kind = byte(at) & 15U;
    if (kind == kPing) send_frame(viewer, kPong, body);
    if (kind == kBinary && !body.empty()) take(viewer, body, arrival);
    at += head + size;
  }
  viewer.in.erase(viewer.in.begin(), viewer.in.begin() + static_cast<std::ptrdiff_t>(at));
  if (viewer.sleeper && viewer.last && viewer.socket >= 0)
    epoll_ctl(poll, EPOLL_CTL_DEL, viewer.socket, nullptr);
}

void Crowd::Impl::take(Viewer& viewer, std::span<const std::byte> message, const Arrival& arrival) {
  const std::int64_t now_ns = arrival.read_ns;
  const auto kind = static_cast<transport::MessageKind>(message[0]);
  if (kind == transport::MessageKind::kDelta) {
    Frame frame = 0;
    std::memcpy(&frame, message.data() + kFrameAt, sizeof frame);
    if (viewer.last && frame != *viewer.last + 1) ++gaps;
    viewer.last = frame;
    if (!viewer.sleeper) arrivals[frame].push_back(arrival);
    viewer.ack.applied = viewer.ack.simulated = frame;
    if (viewer.joined && now_ns - viewer.acked_ns >= kAckNs) viewer.ack_due = true;
  } else if (kind == transport::MessageKind::kSession || kind == transport::MessageKind::kSnapshot) {
    const auto read = transport::read_gateway_envelope(message);
    if (!read) return;
    if (const auto* session = std::get_if<transport::SessionMessage>(&*read)) {
      viewer.ack.epoch = session->epoch;
      viewer.ack.stream = session->streams.at(0).id;
      viewer.ack_due = true;
    } else if (const auto* part = std::get_if<transport::SnapshotMessage>(&*read)) {
      joins(viewer, *part, now_ns);
    }
  }
  if (viewer.ack_due) acknowledge(viewer);
}

void Crowd::Impl::joins(Viewer& viewer, const transport::SnapshotMessage& part, std::int64_t now_ns) {
  ++viewer.parts_held;
  viewer.ack.snapshot_frame = part.frame;
  viewer.ack.snapshot_parts = part.parts;
  viewer.ack.missing = {viewer.parts_held, part.parts - viewer.parts_held};
  viewer.joined = viewer.parts_held == part.parts;
  if (viewer.joined) {
    viewer.ack.phase = transport::Phase::kPlaying;
    viewer.ack.missing.clear();
    viewer.ack.applied = viewer.ack.simulated = viewer.last.value_or(part.frame);
  }
  if (viewer.joined || now_ns - viewer.acked_ns >= kPartAckNs || viewer.parts_held < 100)
    viewer.ack_due = true;
}

void Crowd::Impl::acknowledge(Viewer& viewer) {
  if (!viewer.ack_due || viewer.ack.epoch == 0) return;
  viewer.ack_due = false;
  viewer.acked_ns = viewer.ack.clock_ns = transport::steady_ns();
  transport::Bytes envelope;
  transport::write_envelope(viewer.ack, envelope);
  send_frame(viewer, kBinary, envelope);
}

Crowd::Crowd(int port, std::size_t viewers, std::size_t sleepers) : impl_(std::make_unique<Impl>()) {
  impl_->viewers.resize(viewers);
  for (std::size_t i = 0; i < viewers; ++i) {
    Viewer& viewer = impl_->viewers[i];
    viewer.sleeper = i < sleepers;
    viewer.ack.client = i + 1;
    viewer.ack.role_wanted = transport::Role::kParticipant;
    viewer.ack.join_attempt = 1;
    impl_->connect_one(viewer, port);
    // A few at a time, as the queue of a listening socket is short.
    if (i % 20 == 19) run_for(20 * kMillisecond);
  }
}

Crowd::~Crowd() {
  for (const Viewer& viewer : impl_->viewers) {
    if (viewer.socket >= 0) close(viewer.socket);
  }
  close(impl_->poll);
}

void Crowd::run_for(std::int64_t ns) {
  const std::int64_t end_ns = transport::steady_ns() + ns;
  std::array<epoll_event, 64> events{};
  for (std::int64_t left_ns = ns; left_ns > 0; left_ns = end_ns - transport::steady_ns()) {
    const int count = epoll_wait(impl_->poll, events.data(), static_cast<int>(events.size()),
                                 static_cast<int>(left_ns / kMillisecond + 1));
    for (int i = 0; i < count; ++i)
      impl_->receive(*static_cast<Viewer*>(events[static_cast<std::size_t>(i)].data.ptr));
  }
}

std::size_t Crowd::playing() const {
  return static_cast<std::size_t>(std::ranges::count_if(
      impl_->viewers, [](const Viewer& viewer) { return viewer.joined && viewer.last; }));
}
std::uint64_t Crowd::gaps() const { return impl_->gaps; }
std::uint64_t Crowd::lost() const { return impl_->lost; }
const std::map<Frame, std::vector<Crowd::Arrival>>& Crowd::arrivals() const { return impl_->arrivals; }
void Crowd::forget_arrivals() { impl_->arrivals.clear(); }

}  // namespace tandem::bench
