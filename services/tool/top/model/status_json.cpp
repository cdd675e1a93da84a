#include "services/tool/top/model/status_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

#include "sdk/wire/plain_text.hpp"
#include "services/program/json/figures.hpp"
#include "services/program/json/json.hpp"
#include "services/tool/top/model/diagnosis.hpp"

namespace tandem::top {
namespace {

const char* role_word(std::uint32_t role) {
  return role == static_cast<std::uint32_t>(transport::Role::kParticipant) ? "participant" : "observer";
}

const char* phase_word(std::uint32_t phase) {
  return phase == static_cast<std::uint32_t>(transport::Phase::kPlaying) ? "playing" : "joining";
}

/// Texts come from the network.
std::string plain(std::string_view text) { return transport::plain_text(text, 64); }

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

Json json_of(const Overview& overview, const Client& client, Moment now) {
  const transport::ClientStatusMessage& c = client.status;
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
           {"stream_reason", plain(c.stream_reason)},
           {"why", diagnose(overview, client, now).why}};
  if (client.peer && !client.peer->host.empty()) out["host"] = plain(client.peer->host);
  if (client.gateway) out["gateway"] = fmt::format("{:016x}", *client.gateway);
  each_reported_figure([&out](const char* name, auto value) { out[name] = value; }, c);
  return out;
}

bool played(const transport::ServerStatusMessage& s) { return s.participants + s.observers > 0; }

/// A session's status: what its streams share, sums over the streams, and all streams. The rates of a stream
/// without clients are old and do not count.
template <class Streams>
Json json_of_session(Streams first, Streams last) {
  transport::ServerStatusMessage sum = (*first)->second.status;
  Json streams = Json::array();
  for (auto stream = first; stream != last; ++stream) {
    const transport::ServerStatusMessage& s = (*stream)->second.status;
    Json of_stream = json_of(s);
    of_stream["offered"] = (*stream)->second.offered;
    of_stream["delay_ms"] = (*stream)->second.delay_ms;
    streams.push_back(std::move(of_stream));
    if (stream == first) continue;
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

}  // namespace

std::string to_json(const Overview& overview, Moment now) {
  std::vector<const std::pair<const StreamKey, Stream>*> live;
  for (const auto& entry : overview.streams())
    if (!entry.second.gone) live.push_back(&entry);
  Json sessions = Json::array();
  for (auto first = live.begin(); first != live.end();) {
    const StreamKey& key = (*first)->first;
    const auto last = std::find_if(first, live.end(), [&](const auto* entry) {
      return entry->first.session != key.session || entry->first.standby != key.standby;
    });
    sessions.push_back(json_of_session(first, last));
    first = last;
  }
  Json clients = Json::array();
  for (const auto& [id, client] : overview.clients())
    if (!client.gone) clients.push_back(json_of(overview, client, now));
  return Json{{"sessions", sessions}, {"clients", clients}}.dump();
}

}  // namespace tandem::top
