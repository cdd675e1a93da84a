#include "services/tool/top/model/overview.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "sdk/wire/limits.hpp"
#include "sdk/wire/plain_text.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::top {
namespace {

constexpr std::size_t kMaxEvents = 500;
constexpr std::size_t kMaxPoints = 90;  // of a minute, if somebody writes more often than the rules say
// The lease of a client's status writer if the server waits for it is half a second, otherwise ten.
constexpr std::chrono::seconds kShortLease(5);

// Strangers write these times; differences must not overflow.
std::int64_t transit_ns(std::int64_t written_ns, std::int64_t wall_ns) {
  constexpr std::int64_t kMaxNs = std::int64_t{1} << 61;
  return wall_ns - std::clamp(written_ns, std::int64_t{0}, kMaxNs);
}

template <class Points>
void keep_a_minute(Points& points, std::int64_t now_ns) {
  while (points.size() > kMaxPoints || (!points.empty() && now_ns - points.front().at_ns > kMinuteNs))
    points.pop_front();
}

bool is_participant(const transport::ClientStatusMessage& status) {
  return status.role == static_cast<std::uint32_t>(transport::Role::kParticipant);
}

bool plays(const transport::ClientStatusMessage& status) {
  return status.phase == static_cast<std::uint32_t>(transport::Phase::kPlaying);
}

/// Makes room by forgetting one that is gone. False if all are alive.
template <class Map>
bool make_room(Map& known) {
  if (known.size() < kMaxShown) return true;
  const auto gone = std::ranges::find_if(known, [](const auto& entry) { return entry.second.gone; });
  if (gone == known.end()) return false;
  known.erase(gone);
  return true;
}

}  // namespace

std::string short_id(transport::ClientId client) { return fmt::format("{:016x}", client).substr(0, 8); }

void Overview::note(Moment now, Trouble trouble, const std::string& session, std::string text) {
  events_.push_back({now.wall_ns, trouble, session, std::move(text)});
  if (events_.size() > kMaxEvents) events_.pop_front();
}

void Overview::update(const transport::Stamped<transport::ServerStatusMessage>& heard, Moment now) {
  const transport::ServerStatusMessage& status = heard.message;
  const bool live = status.server_role == transport::ServerRole::kLive;
  const StreamKey key{status.session, live ? 0 : status.epoch, status.stream};
  if (!shown(status.session)) return;
  auto found = streams_.find(key);
  if (found == streams_.end()) {
    if (!make_room(streams_)) return;
    found = streams_.try_emplace(key).first;
    found->second.carries = key.stream;
    if (status.stream == 0)
      note(now, Trouble::kNone, status.session, live ? "a server is heard" : "a server stands by");
  } else if (found->second.gone) {
    if (status.stream == 0) note(now, Trouble::kNote, status.session, "the server is back");
  } else if (found->second.status.epoch != status.epoch && status.stream == 0) {
    note(now, Trouble::kWarning, status.session, "another server is live, or the same was started again");
  }
  Stream& stream = found->second;
  if (stream.status.epoch != status.epoch) stream.minute.clear();
  // The same process stood by before.
  if (live)
    std::erase_if(streams_, [&](const auto& entry) {
      return entry.first.standby != 0 && entry.second.from == heard.from;
    });
  stream.status = status;
  stream.from = heard.from;
  stream.heard = now;
  stream.gone = false;
  stream.minute.push_back({.at_ns = now.steady_ns,
                           .transit_ns = transit_ns(heard.written_ns, now.wall_ns),
                           .rate_hz = status.frame_rate_hz,
                           .frame_ms = status.frame_ms_p50,
                           .mbit_per_s = status.mbit_per_s,
                           .suspended_ms = status.suspended_ms});
  keep_a_minute(stream.minute, now.steady_ns);
}

void Overview::note_changes(const Client& before, const transport::ClientStatusMessage& now_is, Moment now) {
  const auto say = [&](Trouble trouble, const std::string& what) {
    note(now, trouble, now_is.session, short_id(now_is.client) + " " + what);
  };
  if (before.gone) say(Trouble::kNote, "is back");
  if (now_is.epoch != before.status.epoch) return;
  if (now_is.resyncs > before.status.resyncs) say(Trouble::kWarning, "lost frames and joined again");
  if (now_is.hash_mismatches > before.status.hash_mismatches)
    say(Trouble::kBad, "had a state that differed from the server's");
  if (!(now_is.stream == before.status.stream))
    say(Trouble::kNote, fmt::format("plays stream {} now: {}", now_is.stream.id,
                                    transport::plain_text(now_is.stream_reason, transport::kMaxReasonBytes)));
}

void Overview::update(const transport::Stamped<transport::ClientStatusMessage>& heard,
                      const std::optional<transport::Peer>& peer, Moment now) {
  const transport::ClientStatusMessage& status = heard.message;
  if (!shown(status.session)) return;
  auto found = clients_.find(status.client);
  if (found == clients_.end()) {
    if (!make_room(clients_)) return;
    found = clients_.try_emplace(status.client).first;
    found->second.from = heard.from;
    note(now, Trouble::kNone, status.session, short_id(status.client) + " is heard");
  } else {
    // Nobody takes another's id while that one is alive: viewers choose their own.
    if (found->second.from != heard.from && !found->second.gone) return;
    note_changes(found->second, status, now);
  }
  Client& client = found->second;
  const bool same_run =
      client.from == heard.from && client.status.epoch == status.epoch && !client.minute.empty();
  if (!same_run) client.minute.clear();
  if (client.from != heard.from) client.peer.reset();
  if (peer) client.peer = peer;
  client.gateway.reset();
  if (client.peer) {
    constexpr std::string_view kName = "tandem client ";
    const std::string& name = client.peer->name;
    const std::string own = fmt::format("{}{:016x}", kName, status.client);
    if (name.size() == own.size() && name.starts_with(kName) && name != own)
      client.gateway = std::strtoull(name.c_str() + kName.size(), nullptr, 16);
  }

  ClientPoint point{.at_ns = now.steady_ns,
                    .transit_ns = transit_ns(heard.written_ns, now.wall_ns),
                    .written_ns = std::max(heard.written_ns, std::int64_t{0}),
                    .lag_ms = status.lag_ms,
                    .work_ms = status.client_ms_p50,
                    .mbit_per_s = status.mbit_per_s,
                    .frames_applied = status.frames_applied,
                    .resyncs = status.resyncs};
  if (!client.minute.empty()) {
    const ClientPoint& last = client.minute.back();
    const double seconds = static_cast<double>(point.at_ns - last.at_ns) * 1e-9;
    const auto frames = static_cast<double>(point.frames_applied) - static_cast<double>(last.frames_applied);
    // Reports that came together tell no rate.
    point.rate_hz = seconds > 0.2 ? std::max(frames, 0.0) / seconds : last.rate_hz;
  }
  client.minute.push_back(point);
  keep_a_minute(client.minute, now.steady_ns);

  // A client that wants to be waited for and plays as an observer was demoted: the server waits no longer.
  const bool observes = plays(status) && !is_participant(status) && !client.gateway;
  client.seen_as_observer = observes ? client.seen_as_observer + 1 : 0;
  const bool was_participant = same_run && is_participant(client.status);
  const bool wants_to_be = client.peer && client.peer->lease.count() > 0 && client.peer->lease < kShortLease;
  const bool demoted =
      observes && (was_participant || client.demoted || (wants_to_be && client.seen_as_observer > 1));
  if (demoted && !client.demoted) {
    client.demoted = now;
    note(now, Trouble::kWarning, status.session,
         short_id(status.client) + " is an observer: the server had to wait for it for too long");
  } else if (!demoted && client.demoted) {
    client.demoted.reset();
    if (is_participant(status))
      note(now, Trouble::kNone, status.session, short_id(status.client) + " is a participant again");
  }
  if (plays(status)) {
    client.joining.reset();
  } else if (!client.joining) {
    client.joining = now;
  }
  client.status = status;
  client.from = heard.from;
  client.heard = now;
  client.gone = false;
}

void Overview::update(const transport::SessionMessage& session) {
  const bool live = session.server_role == transport::ServerRole::kLive;
  for (auto& [key, stream] : streams_) {
    if (key.session != session.session || key.standby != 0 || !live || stream.status.epoch != session.epoch)
      continue;
    stream.offered = std::ranges::any_of(
        session.streams, [&id = key.stream](const auto& announced) { return announced.id.id == id; });
  }
  for (const transport::StreamMessage& announced : session.streams) {
    const auto found = streams_.find({session.session, live ? 0 : session.epoch, announced.id.id});
    if (found == streams_.end() || found->second.status.epoch != session.epoch) continue;
    found->second.nominal_hz = session.frame_rate_hz;
    found->second.name = announced.name;
    found->second.carries = announced.carries;
    found->second.delay_ms = announced.delay_ms;
  }
}

void Overview::count_clients() {
  std::map<StreamKey, std::vector<double>> lags;
  std::map<transport::ClientId, std::uint32_t> viewers;
  for (auto& [key, stream] : streams_) stream.viewers = 0;
  for (auto& [id, client] : clients_) {
    if (client.gone) continue;
    const StreamKey key{client.status.session, 0, client.status.stream.id};
    if (client.gateway) {
      ++viewers[*client.gateway];
      if (const auto stream = streams_.find(key); stream != streams_.end()) ++stream->second.viewers;
    } else if (plays(client.status) && std::isfinite(client.status.lag_ms)) {
      lags[key].push_back(client.status.lag_ms);
    }
  }
  for (auto& [id, client] : clients_) {
    const auto found = viewers.find(id);
    client.viewers = found == viewers.end() ? 0 : found->second;
  }
  for (auto& [key, values] : lags) {
    const auto stream = streams_.find(key);
    if (stream == streams_.end()) continue;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
    std::nth_element(values.begin(), middle, values.end());
    stream->second.usual_lag_ms = *middle;
  }
}

void Overview::age(Moment now) {
  for (auto& [key, stream] : streams_) {
    if (stream.gone || now.steady_ns - stream.heard.steady_ns <= kServerSilenceNs) continue;
    stream.gone = true;
    if (key.stream == 0)
      note(now, Trouble::kBad, key.session,
           key.standby == 0 ? "the server is gone" : "a server that stood by is gone");
  }
  for (auto& [id, client] : clients_) {
    if (client.gone || now.steady_ns - client.heard.steady_ns <= kClientSilenceNs) continue;
    client.gone = true;
    note(now, Trouble::kNote, client.status.session, short_id(id) + " is gone");
  }
  const auto silent = [now](std::int64_t most_ns) {
    return [now, most_ns](const auto& entry) {
      return entry.second.gone && now.steady_ns - entry.second.heard.steady_ns > most_ns;
    };
  };
  std::erase_if(streams_, silent(kGoneServerNs));
  std::erase_if(clients_, silent(kGoneClientNs));
  count_clients();
}

bool Overview::empty() const {
  const auto gone = [](const auto& entry) { return entry.second.gone; };
  return std::ranges::all_of(streams_, gone) && std::ranges::all_of(clients_, gone);
}

const Stream* Overview::stream_of(const Client& client) const {
  const auto found = streams_.find({client.status.session, 0, client.status.stream.id});
  return found == streams_.end() ? nullptr : &found->second;
}

bool Overview::described(transport::ClientId client) const {
  const auto found = clients_.find(client);
  return found != clients_.end() && found->second.peer && !found->second.gone;
}

}  // namespace tandem::top
