#include "services/tool/top/model/diagnosis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sdk/wire/units.hpp"

namespace tandem::top {
namespace {

// A client lags if what it shows is older than this and than three frames.
constexpr double kLagMs = 100;
constexpr double kLagPeriods = 3;
// A report that is written this much later than due tells that the process did not run.
constexpr double kLateMs = 60;
constexpr int kLateReports = 2;
constexpr std::int64_t kLookNs = 20'000'000'000;
// Missing reports tell of a link that loses packets: as many, and this part of all.
constexpr int kMissing = 3;
constexpr double kMissingShare = 0.03;
// A client's own work for a frame may take this part of the frame's time (idl/STATES.md, "Status").
constexpr double kWorkShare = 0.5;
// Hosts keep their clocks within a second of one another; a lag that is due to the clocks is larger, or
// negative.
constexpr double kClockS = 1;
constexpr double kMaxOnTheWayS = 5;
constexpr double kRateShare = 0.95;

/// The least time on the way is the difference of the clocks, nearly.
template <class Points>
double least_transit_s(const Points& points) {
  std::int64_t least = INT64_MAX;
  for (const auto& point : points) least = std::min(least, point.transit_ns);
  return points.empty() ? 0 : static_cast<double>(least) * 1e-9;
}

void count_reports(const Client& client, ClientFacts& facts) {
  const auto& points = client.minute;
  facts.reports = static_cast<int>(points.size());
  if (points.size() < 2) return;
  // By the writer's clock, as reports may be late on their way; but if somebody has set that, by ours.
  const auto gap_s = [&points](std::size_t i) {
    const auto written_s = static_cast<double>(points[i].written_ns - points[i - 1].written_ns) * 1e-9;
    const auto heard_s = static_cast<double>(points[i].at_ns - points[i - 1].at_ns) * 1e-9;
    return std::abs(written_s - heard_s) > kMaxOnTheWayS ? heard_s : written_s;
  };
  // One is due a second after the one before, an observer's after two.
  double shortest_s = 60;
  for (std::size_t i = 1; i < points.size(); ++i)
    if (gap_s(i) > 0.5) shortest_s = std::min(shortest_s, gap_s(i));
  const double due_s = shortest_s < 1.9 ? 1 : 2;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double gap = gap_s(i);
    if (gap < 0.5 || gap > 60) continue;
    const double times = std::max(1.0, std::floor(gap / due_s + 0.05));
    const double late_ms = (gap - times * due_s) * 1e3;
    facts.missing += static_cast<int>(times) - 1;
    if (points.back().at_ns - points[i].at_ns > kLookNs || late_ms < kLateMs) continue;
    ++facts.late_reports;
    facts.late_ms = std::max(facts.late_ms, late_ms);
  }
}

bool lags(const ClientFacts& facts) {
  return facts.worst_lag_ms > std::max(kLagMs, kLagPeriods * facts.period_ms);
}

// Milliseconds that the server waited for participants in the last 10 s.
std::uint64_t suspended_ms(const Stream& stream, std::int64_t now_ns) {
  const std::uint64_t total = stream.status.suspended_ms;
  for (const StreamPoint& point : stream.minute)
    if (now_ns - point.at_ns <= 10 * kSecond) return total - std::min(point.suspended_ms, total);
  return 0;
}
constexpr std::uint64_t kMuchSuspendedMs = 500;

/// True if the server made fewer frames than are due in the last 20 s, and not because it waited for clients.
bool stood_still(const Stream& stream, std::int64_t now_ns) {
  if (suspended_ms(stream, now_ns) > kMuchSuspendedMs) return false;
  return std::ranges::any_of(stream.minute, [&](const StreamPoint& point) {
    return now_ns - point.at_ns <= kLookNs && sane(point.rate_hz) < kRateShare * stream.nominal_hz;
  });
}

struct Causes {
  const Overview& overview;
  const Client& client;
  const ClientFacts& facts;
  const Stream* stream;
  Diagnosis& found;

  void add(std::string why, std::string fact) {
    if (found.why.empty()) found.why = std::move(why);
    found.facts.push_back(std::move(fact));
  }

  void own_work() {
    if (facts.period_ms <= 0 || facts.work_ms <= kWorkShare * facts.period_ms) return;
    add(fmt::format("own step takes {:.0f} of {:.0f} ms", facts.work_ms, facts.period_ms),
        fmt::format("Its own work for a frame (decode, apply, simulate) takes {:.1f} of the {:.1f} ms that a "
                    "frame has. It needs a faster processor, or a stream with a cheaper step: --prefer "
                    "computing.",
                    facts.work_ms, facts.period_ms));
  }

  void not_run() {
    if (facts.late_reports < kLateReports || client.gateway) return;
    add(fmt::format("process held up, by {:.0f} ms", facts.late_ms),
        fmt::format(
            "Its process does not run when it should: {} of its last reports were written up to {:.0f} ms late, "
            "by its own clock. It is stopped in turns, or others take its processor.",
            facts.late_reports, facts.late_ms));
  }

  void link_loses() {
    const int all = facts.reports + facts.missing;
    if (client.gateway || facts.missing < kMissing || facts.missing < kMissingShare * all) return;
    add(fmt::format("link loses packets: {:.0f} % of reports", 100.0 * facts.missing / all),
        fmt::format("Its link loses packets: {} of the last {} reports that it wrote did not come here.",
                    facts.missing, all));
  }

  void link_thin() {
    if (stream == nullptr || stream->gone) return;
    const double all = sane(stream->status.mbit_per_s), taken = sane(client.status.mbit_per_s);
    if (all <= 0.01 || taken >= 0.8 * all || facts.rate_hz >= 0.9 * sane(stream->status.frame_rate_hz))
      return;
    add(fmt::format("link too thin: {:.2f} of {:.2f} Mbit/s", taken, all),
        fmt::format("It takes in {:.2f} of the {:.2f} Mbit/s of its stream. Give it a thinner stream "
                    "(--prefer bandwidth), or the server a --target-bandwidth.",
                    taken, all));
  }

  void link_slow() {
    if (!found.why.empty()) return;
    const double usual = stream != nullptr ? sane(stream->usual_lag_ms) : 0;
    add(client.gateway ? std::string("its link to the gateway, or its computer")
                       : fmt::format("link slow or lossy; others lag {:.0f} ms", usual),
        fmt::format(
            "Its own work and its process are in time, so its frames are late or lost on the way: up to "
            "{:.0f} ms in the last 20 s, where others of its stream have {:.0f} ms.",
            facts.worst_lag_ms, usual));
  }
};

std::string after(std::string_view before, const std::string& why) {
  return why.empty() ? std::string(before) : fmt::format("{}: {}", before, why);
}

}  // namespace

double sane(double number) { return std::isfinite(number) ? std::clamp(number, -1e9, 1e9) : 0; }

std::string duration_text(std::int64_t duration_ns) {
  const std::int64_t seconds = std::max<std::int64_t>(duration_ns, 0) / kSecond;
  return seconds < 120 ? fmt::format("{} s", seconds) : fmt::format("{} min", seconds / 60);
}

ClientFacts facts_of(const Overview& overview, const Client& client) {
  ClientFacts facts;
  const Stream* const stream = overview.stream_of(client);
  facts.lag_ms = sane(client.status.lag_ms);
  facts.work_ms = sane(client.status.client_ms_p50);
  if (stream != nullptr && stream->nominal_hz > 0) facts.period_ms = 1e3 / stream->nominal_hz;
  if (client.minute.empty()) return facts;
  facts.rate_hz = client.minute.back().rate_hz;
  count_reports(client, facts);
  // A count that starts again belongs to another process under the same id.
  const std::uint64_t before = client.minute.front().resyncs;
  facts.rejoins = client.status.resyncs > before ? client.status.resyncs - before : 0;
  if (stream != nullptr && !client.gateway) {
    const double ahead_s = least_transit_s(stream->minute) - least_transit_s(client.minute);
    if (std::abs(ahead_s) > kClockS || facts.lag_ms < -1) facts.clock_ahead_s = sane(ahead_s);
  }
  // Only older clients measure their lag by clocks that do not agree.
  const auto corrected = [&facts](double lag_ms) {
    const double shift_ms = 1e3 * facts.clock_ahead_s, lag = sane(lag_ms);
    if (shift_ms == 0 || std::abs(lag) < std::abs(shift_ms) / 2) return lag;
    return std::max(lag - shift_ms, 0.0);
  };
  facts.worst_lag_ms = facts.lag_ms = corrected(facts.lag_ms);
  for (const ClientPoint& point : client.minute) {
    if (client.minute.back().at_ns - point.at_ns > kLookNs) continue;
    facts.worst_lag_ms = std::max(facts.worst_lag_ms, corrected(point.lag_ms));
  }
  return facts;
}

Diagnosis diagnose(const Overview& overview, const Client& client, Moment now) {
  Diagnosis found;
  const auto since = [&now](const Moment& then) { return duration_text(now.steady_ns - then.steady_ns); };
  const Stream* const stream = overview.stream_of(client);
  if (client.gone) {
    found.trouble = Trouble::kNote;
    found.why = fmt::format("silent for {}: ended, or cut off", since(client.heard));
    found.facts.push_back("Nothing is heard of it: it ended, was killed or stopped, or its link is cut.");
    return found;
  }
  if (stream != nullptr && stream->gone) {
    found.trouble = Trouble::kBad;
    found.why = fmt::format("its server is gone for {}", since(stream->heard));
    found.facts.push_back("It shows the last frame that it got, and waits for the server.");
    return found;
  }
  const ClientFacts facts = facts_of(overview, client);
  Causes causes{overview, client, facts, stream, found};
  const bool lag = lags(facts);
  const bool late = client.demoted.has_value() || lag || facts.rejoins > 0;
  causes.own_work();
  if (late) causes.not_run();
  causes.link_loses();
  const bool waits_too = lag && stream != nullptr && stood_still(*stream, now.steady_ns);
  if (waits_too) {
    causes.add(
        "its server makes fewer frames than are due",
        "In the last 20 s its server did not make all frames, so what it shows was old for that reason.");
  } else if (late) {
    causes.link_thin();
    if (lag || facts.rejoins > 0) causes.link_slow();
  }
  if (!found.why.empty()) found.trouble = late ? Trouble::kBad : Trouble::kWarning;
  if (facts.rejoins > 0) {
    const char* const times = facts.rejoins == 1 ? "time" : "times";
    found.facts.push_back(
        fmt::format("It lost frames and joined again {} {} in the last minute.", facts.rejoins, times));
    found.why += fmt::format("; {} rejoin{}", facts.rejoins, facts.rejoins == 1 ? "" : "s");
  }
  if (client.demoted) {
    found.trouble = Trouble::kBad;
    if (found.why.empty()) found.why = fmt::format("held the server up {} ago", since(*client.demoted));
    found.facts.push_back(fmt::format(
        "The server had to wait for it for too long, and made it an observer {} ago. Its inputs are "
        "refused until it has kept up for 10 s.",
        since(*client.demoted)));
  }
  if (client.joining && now.steady_ns - client.joining->steady_ns > 3 * kSecond) {
    found.trouble = Trouble::kBad;
    found.why = fmt::format("joining for {}: waits for its snapshot", since(*client.joining));
    found.facts.push_back("It has no state yet: its snapshot passes at the pace of its link.");
  }
  if (facts.clock_ahead_s != 0) {
    found.trouble = std::max(found.trouble, Trouble::kNote);
    const double off_s = std::abs(facts.clock_ahead_s);
    const char* const way = facts.clock_ahead_s > 0 ? "ahead of" : "behind";
    found.facts.push_back(
        fmt::format("The clock of its host is {:.1f} s {} the server's; the lag shown is corrected for that.",
                    off_s, way));
    if (found.why.empty()) found.why = fmt::format("its clock is {:.1f} s {} the server's", off_s, way);
  }
  if (client.status.hash_mismatches > 0) {
    found.trouble = Trouble::kBad;
    found.facts.push_back(
        fmt::format("Its state differed from the server's {} times. This is a fault: please report it.",
                    client.status.hash_mismatches));
    found.why = after("state differed from the server's", found.why);
  }
  if (client.viewers > 0) {
    found.facts.push_back(fmt::format("It is a gateway with {} viewers.", client.viewers));
    if (found.why.empty())
      found.why = fmt::format("gateway of {} viewer{}", client.viewers, client.viewers == 1 ? "" : "s");
  }
  return found;
}

Diagnosis diagnose(const Overview& overview, const StreamKey& key, const Stream& stream, Moment now) {
  Diagnosis found;
  if (stream.gone) {
    found.trouble = Trouble::kBad;
    found.why = fmt::format("gone for {}", duration_text(now.steady_ns - stream.heard.steady_ns));
    found.facts.push_back("The server is silent: it ended, was killed or stopped, or its link is cut.");
    return found;
  }
  const transport::ServerStatusMessage& status = stream.status;
  if (key.standby != 0) {
    found.trouble = Trouble::kNone;
    found.why = fmt::format("stands by, {} frames behind", status.behind_frames);
    return found;
  }
  const double rate_hz = sane(status.frame_rate_hz), frame_ms = sane(status.frame_ms_p50);
  if (stream.nominal_hz <= 0 || rate_hz >= kRateShare * stream.nominal_hz) return found;
  const double budget_ms = 1e3 / stream.nominal_hz;
  found.trouble = Trouble::kBad;
  const std::string rate = fmt::format("{:.0f} of {:.0f} Hz", rate_hz, stream.nominal_hz);
  const std::uint64_t waited_ms = suspended_ms(stream, now.steady_ns);
  if (frame_ms > 0.8 * budget_ms) {
    found.why = fmt::format("{}: a frame takes {:.0f} of {:.0f} ms", rate, frame_ms, budget_ms);
    found.facts.push_back(
        "The server does not finish its frames in time: fewer bodies, a cheaper predictor, or more processor.");
  } else if (waited_ms > kMuchSuspendedMs) {
    found.why = fmt::format("{}: waits for participants", rate);
    found.facts.push_back(fmt::format(
        "In the last 10 s it waited {:.1f} s for participants that are behind, or for its own queue.",
        static_cast<double>(waited_ms) / 1e3));
    const Client* slowest = nullptr;
    for (const auto& [id, client] : overview.clients()) {
      if (client.gone || client.gateway || client.status.session != key.session) continue;
      if (slowest == nullptr || client.status.applied < slowest->status.applied) slowest = &client;
    }
    if (slowest != nullptr)
      found.facts.push_back(
          fmt::format("The client that is most behind is {}.", short_id(slowest->status.client)));
  } else if (rate_hz == 0 && status.frame > 0) {
    found.why = fmt::format("{}: its simulation takes long for a step, or hangs", rate);
    found.facts.push_back(
        "It answers and waits for nobody, but has no frame. Its log says more, also of an engine in another process.");
  } else {
    found.why = fmt::format("{}: its process is held up", rate);
    found.facts.push_back("Its frames are short and it waits for nobody, so others take its processor.");
  }
  return found;
}

}  // namespace tandem::top
