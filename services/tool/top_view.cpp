#include "services/tool/top_view.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <iterator>
#include <string_view>
#include <utility>

#include "sdk/transport/plain_text.hpp"
#include "services/json/json.hpp"
#include "services/tool/figures.hpp"

namespace tandem::tool {
namespace {

constexpr std::int64_t kSilenceNs = 3'000'000'000;
// A machine that floods the status topics must not fill this one's memory.
constexpr std::size_t kMostShown = 4096;
constexpr std::size_t kMostTextBytes = 64;

const char* role_word(std::uint32_t role) {
  return role == static_cast<std::uint32_t>(transport::Role::kParticipant) ? "participant" : "observer";
}

const char* phase_word(std::uint32_t phase) {
  return phase == static_cast<std::uint32_t>(transport::Phase::kPlaying) ? "playing" : "joining";
}

double share_percent(const transport::ServerStatusMessage& s) {
  return s.raw_mbit_per_s > 0 ? 100 * s.mbit_per_s / s.raw_mbit_per_s : 0;
}

/// Texts come from the network: control characters must not reach the terminal.
std::string plain(std::string_view text) { return transport::plain_text(text, kMostTextBytes); }

/// The names of byte counts in JSON; they share one object.
constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kBytes{
    {{"delta_bytes", "deltas"},
     {"reply_bytes", "replies"},
     {"input_bytes", "inputs"},
     {"snapshot_bytes", "snapshots"}}};

Json json_of(const transport::ServerStatusMessage& s) {
  Json out{{"session", s.session},
           {"stream", s.stream},
           {"epoch", s.epoch},
           {"frame", s.frame},
           {"role", s.server_role == transport::ServerRole::kLive ? "live" : "standby"},
           {"behind_frames", s.behind_frames}};
  each_server_figure(
      [&out](std::string_view name, auto value) {
        const auto* const bytes = std::ranges::find(kBytes, name, &decltype(kBytes)::value_type::first);
        bytes != kBytes.end() ? put_figure(out["bytes"], bytes->second, value) : put_figure(out, name, value);
      },
      s);
  out["codec"] = s.codec;
  out["predictor"] = s.predictor;
  return out;
}

Json json_of(const transport::ClientStatusMessage& c) {
  Json out{{"client", fmt::format("{:016x}", c.client)},
           {"session", c.session},
           {"stream", c.stream.id},
           {"epoch", c.epoch},
           {"applied", c.applied},
           {"role", role_word(c.role)},
           {"phase", phase_word(c.phase)},
           {"lag_ms", c.lag_ms},
           {"too_slow", c.too_slow != 0},
           {"queue_high_water", c.queue_high_water},
           {"stream_reason", plain(c.stream_reason)}};
  each_reported_figure([&out](const char* name, auto value) { out[name] = value; }, c);
  return out;
}

bool played(const transport::ServerStatusMessage& s) { return s.participants + s.observers > 0; }

/// A session's status: what its streams share, sums over the streams, and all streams. The rates of a stream
/// without clients are old and do not count.
template <class Streams>
Json json_of_session(Streams first, Streams last) {
  transport::ServerStatusMessage sum = first->second.status;
  Json streams = Json::array({json_of(sum)});
  for (auto stream = std::next(first); stream != last; ++stream) {
    const transport::ServerStatusMessage& s = stream->second.status;
    streams.push_back(json_of(s));
    if (played(s)) {
      sum.mbit_per_s = s.mbit_per_s + (played(sum) ? sum.mbit_per_s : 0);
      sum.corrected_per_frame = s.corrected_per_frame + (played(sum) ? sum.corrected_per_frame : 0);
    }
    sum.participants += s.participants;
    sum.observers += s.observers;
    sum.delta_bytes += s.delta_bytes;
    sum.snapshot_bytes += s.snapshot_bytes;
    sum.snapshots += s.snapshots;
  }
  Json session = json_of(sum);
  session["streams"] = std::move(streams);
  return session;
}

/// The number of bytes in at most five characters.
std::string short_bytes(std::uint64_t bytes) {
  constexpr std::array<const char*, 5> kUnits{"", "k", "M", "G", "T"};
  auto value = static_cast<double>(bytes);
  std::size_t unit = 0;
  while (value >= 999.5 && unit + 1 < kUnits.size()) {
    value /= 1000;
    ++unit;
  }
  return fmt::format("{:.0f}{}", value, kUnits.at(unit));
}

}  // namespace

void TopView::update(const transport::ServerStatusMessage& status, std::int64_t now_ns) {
  const bool live = status.server_role == transport::ServerRole::kLive;
  const StreamKey key{status.session + (live ? "" : fmt::format(" (standby {})", status.epoch)),
                      status.stream};
  if (!shown(status.session) || (streams_.size() >= kMostShown && !streams_.contains(key))) return;
  streams_[key] = {status, now_ns};
}

void TopView::update(const transport::ClientStatusMessage& status, std::int64_t now_ns) {
  if (!shown(status.session) || (clients_.size() >= kMostShown && !clients_.contains(status.client))) return;
  clients_[status.client] = {status, now_ns};
}

void TopView::forget_silent(std::int64_t now_ns) {
  const auto silent = [now_ns](const auto& entry) { return now_ns - entry.second.at_ns > kSilenceNs; };
  std::erase_if(streams_, silent);
  std::erase_if(clients_, silent);
}

bool TopView::several(const std::string& session) const {
  const auto first = streams_.lower_bound({session, 0});
  return first != streams_.end() && std::next(first) != streams_.end() &&
         std::next(first)->first.first == session;
}

std::string TopView::stream_of(const transport::ClientStatusMessage& client) const {
  const auto heard = streams_.find({client.session, client.stream.id});
  if (heard == streams_.end()) return fmt::format("{}", client.stream.id);
  return fmt::format("{} {}", client.stream.id, plain(heard->second.status.predictor));
}

std::string TopView::to_json() const {
  Json sessions = Json::array();
  for (auto first = streams_.begin(); first != streams_.end();) {
    const auto last = std::find_if(
        first, streams_.end(), [&](const auto& entry) { return entry.first.first != first->first.first; });
    sessions.push_back(json_of_session(first, last));
    first = last;
  }
  Json clients = Json::array();
  for (const auto& [id, heard] : clients_) clients.push_back(json_of(heard.status));
  return Json{{"sessions", sessions}, {"clients", clients}}.dump();
}

std::string TopView::to_table() const {
  if (empty()) return "no session heard of on this domain\n";
  std::string text =
      fmt::format("{:<20} {:>9} {:>6} {:>8} {:>8} {:>17} {:>9} {:>8} {:>7} {:>6} {:>6}  {:<20} {}\n",
                  "SESSION", "FRAME", "HZ", "BODIES", "AT REST", "MBIT/S (OF RAW)", "CORRECTED", "FRAME MS",
                  "CLIENTS", "WINDOW", "STALLS", "DELTA REPLY IN SNAP", "CODEC, PREDICTOR, THRESHOLD");
  std::string standbys;
  for (const auto& [key, heard] : streams_) {
    const transport::ServerStatusMessage& s = heard.status;
    if (s.server_role != transport::ServerRole::kLive) {
      standbys += fmt::format("{:<20} {:>9} {:>8} {:>9.0f}\n", plain(s.session), s.frame, s.behind_frames,
                              s.uptime_s);
      continue;
    }
    text += fmt::format(
        "{:<20} {:>9} {:>6.1f} {:>8} {:>8} {:>17} {:>9.0f} {:>8.2f} {:>7} {:>6} {:>6}  {:<20} {}, {}, {:.3g}\n",
        several(key.first) ? fmt::format("{}/{}", plain(key.first), s.stream) : plain(key.first), s.frame,
        s.frame_rate_hz, s.bodies, s.at_rest,
        fmt::format("{:.2f} ({:.1f} %)", s.mbit_per_s, share_percent(s)), s.corrected_per_frame,
        s.frame_ms_p50, fmt::format("{}+{}", s.participants, s.observers), s.window, s.stalls,
        fmt::format("{} {} {} {}", short_bytes(s.delta_bytes), short_bytes(s.reply_bytes),
                    short_bytes(s.input_bytes), short_bytes(s.snapshot_bytes)),
        plain(s.codec), plain(s.predictor), s.threshold);
  }
  if (!standbys.empty())
    text += fmt::format("\n{:<20} {:>9} {:>8} {:>9}\n", "STANDS BY FOR", "HOLDS", "BEHIND", "UPTIME S") +
            standbys;
  text += fmt::format("\n{:<16} {:<20} {:<11} {:<11} {:<7} {:>9} {:>8} {:>8} {:>8} {:>7} {:>6}  {}\n",
                      "CLIENT", "SESSION", "STREAM", "ROLE", "PHASE", "APPLIED", "LAG MS", "WORK MS",
                      "MBIT/S", "REJOINS", "WRONG", "WHY THIS STREAM");
  for (const auto& [id, heard] : clients_) {
    const transport::ClientStatusMessage& c = heard.status;
    text +=
        fmt::format("{:016x} {:<20} {:<11} {:<11} {:<7} {:>9} {:>8.2f} {:>8.2f} {:>8.2f} {:>7} {:>6}  {}{}\n",
                    c.client, plain(c.session), stream_of(c), role_word(c.role), phase_word(c.phase),
                    c.applied, c.lag_ms, c.client_ms_p50, c.mbit_per_s, c.resyncs, c.hash_mismatches,
                    plain(c.stream_reason), c.too_slow != 0 ? "  too slow" : "");
  }
  return text;
}

}  // namespace tandem::tool
