#include "tests/bench/gateway/crowd.hpp"

#include <libwebsockets.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <variant>

#include "sdk/transport/clock.hpp"
#include "sdk/transport/envelope.hpp"
#include "sdk/transport/units.hpp"

namespace tandem::bench {
namespace {

constexpr std::int64_t kAckNs = 200 * kMillisecond, kPartAckNs = 20 * kMillisecond;
// Kind, encapsulation, epoch, stream and generation lie before a delta's frame number.
constexpr std::size_t kFrameAt = 1 + transport::kCdrHeaderBytes + 8 + 4 + 4;

struct Viewer {
  lws* wsi = nullptr;
  bool sleeper = false;
  transport::AckMessage ack;
  std::uint32_t parts_held = 0;
  bool joined = false;
  std::optional<Frame> last;
  std::int64_t acked_ns = 0;
  bool ack_due = false;
  transport::Bytes message;
};

}  // namespace

struct Crowd::Impl {
  static int on_event(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t len);
  int receive(Viewer& viewer, const void* in, std::size_t len);
  void take(Viewer& viewer, std::int64_t now_ns);
  void joins(Viewer& viewer, const transport::SnapshotMessage& part, std::int64_t now_ns);
  int write(Viewer& viewer);

  std::array<lws_protocols, 2> protocols{};
  lws_context* context = nullptr;
  lws_sorted_usec_list_t wake{};
  std::vector<Viewer> viewers;
  std::uint64_t gaps = 0, lost = 0;
  std::map<Frame, std::vector<std::int64_t>> arrivals;
};

int Crowd::Impl::receive(Viewer& viewer, const void* in, std::size_t len) {
  const std::int64_t now_ns = transport::steady_ns();
  const auto* const bytes = static_cast<const std::byte*>(in);
  viewer.message.insert(viewer.message.end(), bytes, bytes + len);
  if (lws_remaining_packet_payload(viewer.wsi) != 0 || lws_is_final_fragment(viewer.wsi) == 0) return 0;
  take(viewer, now_ns);
  viewer.message.clear();
  if (viewer.sleeper && viewer.last) lws_rx_flow_control(viewer.wsi, 0);
  return 0;
}

void Crowd::Impl::take(Viewer& viewer, std::int64_t now_ns) {
  const auto kind = static_cast<transport::MessageKind>(viewer.message.at(0));
  if (kind == transport::MessageKind::kDelta) {
    Frame frame = 0;
    std::memcpy(&frame, viewer.message.data() + kFrameAt, sizeof frame);
    if (viewer.last && frame != *viewer.last + 1) ++gaps;
    viewer.last = frame;
    if (!viewer.sleeper) arrivals[frame].push_back(now_ns);
    viewer.ack.applied = viewer.ack.simulated = frame;
    if (viewer.joined && now_ns - viewer.acked_ns >= kAckNs) viewer.ack_due = true;
  } else if (kind == transport::MessageKind::kSession || kind == transport::MessageKind::kSnapshot) {
    const auto read = transport::read_gateway_envelope(viewer.message);
    if (!read) return;
    if (const auto* session = std::get_if<transport::SessionMessage>(&*read)) {
      viewer.ack.epoch = session->epoch;
      viewer.ack.stream = session->streams.at(0).id;
      viewer.ack_due = true;
    } else if (const auto* part = std::get_if<transport::SnapshotMessage>(&*read)) {
      joins(viewer, *part, now_ns);
    }
  }
  if (viewer.ack_due) lws_callback_on_writable(viewer.wsi);
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

int Crowd::Impl::write(Viewer& viewer) {
  if (!viewer.ack_due || viewer.ack.epoch == 0) return 0;
  viewer.ack_due = false;
  viewer.acked_ns = viewer.ack.clock_ns = transport::steady_ns();
  transport::Bytes framed(LWS_PRE);
  transport::write_envelope(viewer.ack, framed);
  const std::size_t size = framed.size() - LWS_PRE;
  auto* const bytes = reinterpret_cast<unsigned char*>(framed.data()) + LWS_PRE;
  return lws_write(viewer.wsi, bytes, size, LWS_WRITE_BINARY) < static_cast<int>(size) ? -1 : 0;
}

int Crowd::Impl::on_event(lws* wsi, lws_callback_reasons reason, void* /*user*/, void* in, std::size_t len) {
  auto* const viewer = static_cast<Viewer*>(lws_get_opaque_user_data(wsi));
  if (viewer == nullptr) return 0;
  auto& self = *static_cast<Impl*>(lws_context_user(lws_get_context(wsi)));
  switch (reason) {
    case LWS_CALLBACK_CLIENT_ESTABLISHED:
      viewer->wsi = wsi;
      return 0;
    case LWS_CALLBACK_CLIENT_RECEIVE:
      return self.receive(*viewer, in, len);
    case LWS_CALLBACK_CLIENT_WRITEABLE:
      return self.write(*viewer);
    case LWS_CALLBACK_CLIENT_CONNECTION_ERROR:
    case LWS_CALLBACK_CLIENT_CLOSED:
      ++self.lost;
      return 0;
    default:
      return 0;
  }
}

Crowd::Crowd(int port, std::size_t viewers, std::size_t sleepers) : impl_(std::make_unique<Impl>()) {
  impl_->viewers.resize(viewers);
  impl_->protocols[0] = {"tandem.2", Impl::on_event, 0, 65'536, 0, nullptr, 0};
  lws_set_log_level(0, nullptr);
  lws_context_creation_info info{};
  info.port = CONTEXT_PORT_NO_LISTEN;
  info.protocols = impl_->protocols.data();
  info.user = impl_.get();
  impl_->context = lws_create_context(&info);
  for (std::size_t i = 0; i < viewers; ++i) {
    Viewer& viewer = impl_->viewers[i];
    viewer.sleeper = i < sleepers;
    viewer.ack.client = i + 1;
    viewer.ack.role_wanted = transport::Role::kParticipant;
    viewer.ack.join_attempt = 1;
    lws_client_connect_info connect{};
    connect.context = impl_->context;
    connect.address = connect.host = "127.0.0.1";
    connect.port = port;
    connect.path = "/tandem";
    connect.protocol = connect.local_protocol_name = "tandem.2";
    connect.opaque_user_data = &viewer;
    lws_client_connect_via_info(&connect);
    // A few at a time, as the queue of a listening socket is short.
    if (i % 20 == 19) run_for(20 * kMillisecond);
  }
}

Crowd::~Crowd() { lws_context_destroy(impl_->context); }

void Crowd::run_for(std::int64_t ns) {
  const std::int64_t end_ns = transport::steady_ns() + ns;
  for (std::int64_t left_ns = ns; left_ns > 0; left_ns = end_ns - transport::steady_ns()) {
    lws_sul_schedule(
        impl_->context, 0, &impl_->wake, [](lws_sorted_usec_list_t*) {}, left_ns / 1000 + 1);
    lws_service(impl_->context, 0);
  }
}

std::size_t Crowd::playing() const {
  return static_cast<std::size_t>(std::ranges::count_if(
      impl_->viewers, [](const Viewer& viewer) { return viewer.joined && viewer.last; }));
}
std::uint64_t Crowd::gaps() const { return impl_->gaps; }
std::uint64_t Crowd::lost() const { return impl_->lost; }
const std::map<Frame, std::vector<std::int64_t>>& Crowd::arrivals() const { return impl_->arrivals; }
void Crowd::forget_arrivals() { impl_->arrivals.clear(); }

}  // namespace tandem::bench
