#include "sdk/web/module/web_client.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "sdk/client/session/reply_reason.hpp"
#include "sdk/core/lattice/hash.hpp"
#include "sdk/web/module/json.hpp"

namespace tandem::web {
namespace {

client::CoreOptions core_options(WebClient::Options options) {
  client::CoreOptions core;
  core.id = options.id;
  core.role =
      options.role == ClientRole::kObserver ? transport::Role::kObserver : transport::Role::kParticipant;
  core.lead = options.lead;
  core.max_delay_ms = options.max_delay_ms;
  core.cap_kbit_s = options.cap_kbit_s;
  core.gateway_caps = true;
  core.log = std::move(options.log);
  core.measure_ns = options.measure_ns;
  return core;
}

const char* name_of(ClientPhase phase) {
  switch (phase) {
    case ClientPhase::kSearching:
      return "searching";
    case ClientPhase::kRefused:
      return "refused";
    case ClientPhase::kJoining:
      return "joining";
    case ClientPhase::kPlaying:
      return "playing";
  }
  return "";
}

const char* name_of(client::InputOutcome::Kind kind) {
  switch (kind) {
    case client::InputOutcome::Kind::kActed:
      return "acted";
    case client::InputOutcome::Kind::kRefused:
      return "refused";
    case client::InputOutcome::Kind::kUnknown:
      return "unknown";
    case client::InputOutcome::Kind::kLost:
      return "lost";
  }
  return "";
}

const char* name_of(transport::Shape shape) {
  constexpr std::array<const char*, 6> kNames{"none", "sphere", "box", "capsule", "cylinder", "hull"};
  const auto index = static_cast<std::size_t>(shape);
  return index < kNames.size() ? kNames[index] : kNames[0];
}

std::string hex_of(std::span<const std::byte> bytes) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  text.reserve(2 * bytes.size());
  for (const std::byte byte : bytes) {
    text += kDigits[std::to_integer<unsigned>(byte) >> 4U];
    text += kDigits[std::to_integer<unsigned>(byte) & 15U];
  }
  return text;
}

std::string colour(std::uint32_t rgba) { return "#" + to_hex(rgba).substr(8); }

/// The gravity in force, scene units / s^2; zero before a snapshot.
std::array<double, 3> gravity(const client::ClientCore& core) {
  std::array<double, 3> result{};
  if (core.timeline() == nullptr || core.session() == nullptr) return result;
  const double dt_s = core.session()->dt_s;
  const double scale = core.session()->lattice_unit / 64 / (dt_s * dt_s);
  for (std::size_t axis = 0; axis < 3; ++axis) result[axis] = core.timeline()->drive().gravity[axis] * scale;
  return result;
}

/// Makes a member for each figure of a list.
struct WriteFigure {
  JsonWriter& json;
  template <class T>
  void operator()(const char* name, T number) const {
    json.member(name, number);
  }
};

void write(JsonWriter& json, const transport::ServerStatusMessage& server) {
  json.begin_object()
      .member("session", server.session)
      .member("epoch", server.epoch)
      .member("frame", server.frame);
  each_server_figure(WriteFigure{json}, server);
  json.member("codec", server.codec).member("predictor", server.predictor).end_object();
}

}  // namespace

WebClient::WebClient(Options options) : core_(core_options(std::move(options)), port_, this) {}

std::int64_t WebClient::poll(client::Now now) {
  polled_ns_ = now.steady_ns;
  return core_.poll(now);
}

Result<std::uint64_t> WebClient::send(transport::InputKind kind, std::vector<double> values,
                                      transport::Bytes bytes, client::Now now) {
  return core_.send(kind, std::move(values), std::move(bytes), now);
}

template <class Fill>
void WebClient::add_event(const char* type, Fill&& fill, std::size_t most) {
  if (events_.size() > most) return;
  events_ += events_.empty() ? "" : ",";
  JsonWriter json(events_);
  json.begin_object().member("type", type);
  fill(json);
  json.end_object();
}

void WebClient::on_session(const transport::SessionMessage& session) {
  corrected_.assign(session.capacity, 0);
  corrected_in_.assign(session.capacity, 0);
  lag_ns_.reset();
  add_event("session", [&](JsonWriter& json) { json.member("epoch", session.epoch); });
}

void WebClient::on_applied(Epoch epoch, const client::CompleteDelta& delta) {
  const std::span<const Slot> corrected = core_.timeline()->corrected();
  std::fill(corrected_.begin(), corrected_.end(), std::uint8_t{0});
  for (const Slot slot : corrected) {
    corrected_[slot] = 1;
    corrected_in_[slot] = static_cast<std::uint32_t>(delta.frame);
  }
  corrected_count_ = static_cast<std::uint32_t>(corrected.size());
  if (const auto server_ns = core_.server_wall_ns(polled_ns_)) {
    const auto lag_ns = static_cast<double>(*server_ns) - static_cast<double>(delta.server_time_ns);
    lag_ns_ = lag_ns_ ? *lag_ns_ + (lag_ns - *lag_ns_) / 16 : lag_ns;
  }
  add_event("applied", [&](JsonWriter& json) {
    json.member("epoch", epoch)
        .member("frame", delta.frame)
        .member("hash", to_hex(delta.hash))
        .member("bytes", std::uint64_t{delta.payload.size()})
        .member("corrected", corrected_count_);
  });
}

void WebClient::on_outcome(const client::InputOutcome& outcome) {
  add_event("outcome", [&](JsonWriter& json) {
    json.member("number", outcome.number)
        .member("kind", name_of(outcome.kind))
        .member("frame", outcome.frame)
        .member("reason", outcome.text.empty() ? client::describe(outcome.reason) : outcome.text)
        .member("latencyMs", static_cast<double>(outcome.latency_ns) / 1e6);
  });
}

void WebClient::on_happened(const client::Happened& it) {
  add_event(
      "happened",
      [&](JsonWriter& json) {
        json.member("epoch", it.epoch).member("frame", it.frame).member("number", it.number);
        json.member("kind", it.event.kind).name("body");
        if (it.event.body) {
          json.begin_object().member("slot", it.event.body->slot);
          json.member("reuse", std::uint32_t{it.event.body->reuse}).end_object();
        } else {
          json.null();
        }
        json.member("data", hex_of(it.event.bytes));
      },
      kMaxNewsBytes);
}

void WebClient::on_events_lost(Epoch epoch, Frame frame, std::uint64_t count) {
  add_event(
      "lost",
      [&](JsonWriter& json) { json.member("epoch", epoch).member("frame", frame).member("count", count); },
      kMaxNewsBytes);
}

void WebClient::on_events_taken_back(Epoch epoch, Frame frame, std::uint64_t count) {
  add_event(
      "takenBack",
      [&](JsonWriter& json) { json.member("epoch", epoch).member("frame", frame).member("count", count); },
      kMaxNewsBytes);
}

void WebClient::on_key(Epoch epoch, Frame frame, const KeyChange& change) {
  add_event(
      "key",
      [&](JsonWriter& json) {
        json.member("epoch", epoch).member("frame", frame).member("key", change.key).name("value");
        change.value ? json.value(hex_of(*change.value)) : json.null();
      },
      kMaxNewsBytes);
}

std::string WebClient::take_events() {
  if (events_.empty()) return {};
  return "[" + std::exchange(events_, {}) + "]";
}

std::string WebClient::status() const {
  const ClientStatus status = core_.status();
  const ClientTimeline* const timeline = core_.timeline();
  const State* const state = timeline != nullptr ? &timeline->state(timeline->applied()) : nullptr;
  const transport::StreamMessage* const stream = core_.stream();
  const auto& server = port_.server_status();
  std::string out;
  JsonWriter json(out);
  json.begin_object()
      .member("phase", name_of(status.phase))
      .member("serverAlive", status.server_alive)
      .member("reason", status.reason)
      .member("role", status.role == ClientRole::kParticipant ? "participant" : "observer")
      .member("clientId", to_hex(status.client_id))
      .member("scene", status.scene)
      .member("epoch", status.epoch)
      .member("frame", status.frame)
      .member("stateHash", state != nullptr ? to_hex(status.state_hash) : "")
      .member("frameRateHz", status.frame_rate_hz)
      .member("lead", status.lead)
      .member("predictor", stream != nullptr ? stream->layout.predictor : "")
      .member("codec", stream != nullptr ? stream->layout.codec : "")
      .member("capacity", stream != nullptr ? stream->layout.capacity : 0U)
      .member("bodies", state != nullptr ? state->alive_count() : 0U)
      .member("atRest", state != nullptr ? state->rest_count() : 0U)
      .member("corrected", state != nullptr ? corrected_count_ : 0U)
      .member("lagMs", lag_ns_.value_or(0) / 1e6)
      .name("frameMs")
      .begin_object()
      .member("p50", status.client_ms_p50)
      .member("p99", status.client_ms_p99)
      .end_object();
  each_client_figure(WriteFigure{json}, status);
  if (const transport::SessionMessage* session = core_.session()) {
    json.member("dtS", session->dt_s)
        .member("upAxis", static_cast<std::uint32_t>(session->up_axis))
        .member("continuesEpoch", session->continues_epoch)
        .member("continuesFrame", session->continues_frame);
  }
  json.name("gravity").begin_list();
  for (const double axis : gravity(core_)) json.value(axis);
  json.end_list().name("uncorrected");
  if (const auto drift = core_.drift()) {
    const double unit = core_.session()->lattice_unit;
    json.begin_object()
        .member("frames", drift->frames)
        .member("bodies", drift->bodies)
        .member("meanDrift", drift->mean * unit)
        .member("mostDrift", drift->most * unit)
        .end_object();
  } else {
    json.null();
  }
  json.name("server");
  server ? write(json, *server) : static_cast<void>(json.null());
  json.end_object();
  return out;
}

std::string WebClient::data_fields() const {
  std::string out;
  JsonWriter json(out);
  json.begin_list();
  if (const transport::SessionMessage* session = core_.session()) {
    for (const DataField& field : session->data) {
      json.begin_object().member("name", field.name).member("kind", kDataKinds.at(field.kind)).end_object();
    }
  }
  json.end_list();
  return out;
}

std::span<const std::byte> WebClient::data() const {
  const BodyData* const data = core_.holds_state() ? core_.timeline()->data() : nullptr;
  return data != nullptr ? data->records() : std::span<const std::byte>();
}

std::string WebClient::types() const {
  std::string out;
  JsonWriter json(out);
  json.begin_list();
  if (const transport::SessionMessage* session = core_.session()) {
    for (const transport::BodyType& type : session->types) {
      json.begin_object()
          .member("name", type.name)
          .member("radius", double{type.radius})
          .member("colour", colour(type.colour_rgba))
          .member("shape", name_of(type.shape))
          .name("shapeValues")
          .begin_list();
      for (const float value : type.shape_values) json.value(double{value});
      json.end_list().end_object();
    }
  }
  json.end_list();
  return out;
}

std::string_view WebClient::scene_json() const {
  const transport::SessionMessage* const session = core_.session();
  return session != nullptr ? std::string_view(session->scene_json) : std::string_view();
}

const Sample* WebClient::sample(SampleMode mode, client::Now now) {
  core_.start_sampling();
  return core_.sample(sample_, mode, now) ? &sample_ : nullptr;
}

}  // namespace tandem::web
