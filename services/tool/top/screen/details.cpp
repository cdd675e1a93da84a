#include "services/tool/top/screen/details.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tandem::top {
namespace {

constexpr std::size_t kLabel = 10;

class Composer {
 public:
  Composer(Size size, Moment now, Alphabet alphabet) : size_(size), now_(now), alphabet_(alphabet) {}

  void heading(std::string_view text) {
    page_.emplace_back();
    page_.emplace_back(" " + shown(text, alphabet_), Style::kStrong);
  }
  void say(std::string_view text, Style style = Style::kNormal) {
    const std::size_t columns = size_.columns - std::min<std::size_t>(size_.columns, 4);
    for (const std::string& line : wrap(text, columns, alphabet_)) page_.emplace_back("   " + line, style);
  }
  void explain(const Diagnosis& diagnosis) {
    if (diagnosis.facts.empty()) return say("nothing is wrong with it");
    for (const std::string& fact : diagnosis.facts) say(fact, style_of(diagnosis.trouble));
  }
  template <class Points, class Value>
  void minute(std::string_view label, const Points& points, double least, std::string_view unit, int decimals,
              Value value) {
    const std::size_t room = size_.columns - std::min<std::size_t>(size_.columns, kLabel + 32);
    const std::size_t columns = std::clamp<std::size_t>(room, 10, 60);
    const auto values = spread(points, now_, columns, value);
    const double most = largest(values), now_is = points.empty() ? 0 : sane(value(points.back()));
    Line line(" " + cell(label, kLabel, Align::kLeft, alphabet_), Style::kDim);
    line.add(sparkline(values, std::max(least, most), alphabet_));
    line.add(
        fmt::format(" {} {} now, at most {}", number(now_is, decimals, 7), unit, number(most, decimals, 7)));
    page_.push_back(std::move(line));
  }
  void fact(std::string_view label, std::string_view text) {
    Line line(" " + cell(label, kLabel, Align::kLeft, alphabet_), Style::kDim);
    line.add(shown(text, alphabet_));
    page_.push_back(std::move(line));
  }
  void gauge(std::string_view label, double value, double most, double mark) {
    Line line(" " + cell(label, kLabel, Align::kLeft, alphabet_), Style::kDim);
    if (most > 0) line.add(bar(value / most, mark / most, 30, alphabet_) + " ");
    line.add(most > 0 ? fmt::format("{} of {} ms", number(value, 2, 8), number(most, 2, 8))
                      : fmt::format("{} ms", number(value, 2, 8)));
    page_.push_back(std::move(line));
  }
  [[nodiscard]] Page take() { return std::move(page_); }

 private:
  Size size_;
  Moment now_;
  Alphabet alphabet_;
  Page page_;
};

void add_events(Composer& out, const Overview& overview, std::string_view of) {
  std::vector<const Event*> found;
  for (const Event& event : overview.events())
    if (event.text.starts_with(of)) found.push_back(&event);
  if (found.empty()) return;
  out.heading("WHAT HAPPENED TO IT");
  for (std::size_t i = found.size() - std::min<std::size_t>(found.size(), 5); i < found.size(); ++i)
    out.say(found[i]->text, style_of(found[i]->trouble));
}

void describe(Composer& out, const Overview& overview, const ClientRow& row) {
  const Client& client = *row.client;
  const transport::ClientStatusMessage& status = client.status;
  out.heading(fmt::format("client {:016x}: {}, session {}", status.client, state_word(row), status.session));
  if (client.gateway) {
    out.fact("viewer of", fmt::format("the gateway {:016x}", *client.gateway));
  } else if (client.peer) {
    out.fact("process",
             fmt::format("{} {} on {}", client.peer->process, client.peer->pid, client.peer->host));
  }
  if (client.viewers > 0) out.fact("serves", fmt::format("{} viewers", client.viewers));
  out.heading("WHY");
  out.explain(row.diagnosis);
  out.heading("THE LAST MINUTE");
  out.minute("lag", client.minute, 100, "ms", 1, [](const ClientPoint& p) { return p.lag_ms; });
  out.minute("rate", client.minute, 0, "Hz", 1, [](const ClientPoint& p) { return p.rate_hz; });
  out.minute("bandwidth", client.minute, 0, "Mbit/s", 2, [](const ClientPoint& p) { return p.mbit_per_s; });
  if (sane(client.status.wire_mbit_per_s) > 0)
    out.fact("on the wire",
             fmt::format("{} Mbit/s, with headers and answers", number(client.status.wire_mbit_per_s, 3, 8)));
  out.gauge("work", row.facts.work_ms, row.facts.period_ms, 0.5 * row.facts.period_ms);
  out.heading("ITS STREAM");
  if (row.stream != nullptr) {
    const transport::ServerStatusMessage& stream = row.stream->status;
    out.fact("stream", fmt::format("{} {}: {}, {}, threshold {}", status.stream.id, row.stream->name,
                                   stream.predictor, stream.codec, number(stream.threshold, 4, 8)));
  } else {
    out.fact("stream", fmt::format("{}, of which no server is heard", status.stream.id));
  }
  out.fact("why this", status.stream_reason);
  out.heading("COUNTS");
  out.fact("frames", fmt::format("{} applied, up to frame {}", status.frames_applied, status.applied));
  out.fact("faults", fmt::format("{} rejoins, {} mismatches; at most {} frames waited at once",
                                 status.resyncs, status.hash_mismatches, status.queue_high_water));
  out.fact("inputs", fmt::format("{} sent, {} refused", status.inputs_sent, status.inputs_refused));
  add_events(out, overview, short_id(status.client));
}

void describe(Composer& out, const StreamRow& row) {
  const transport::ServerStatusMessage& s = row.stream->status;
  out.heading(
      fmt::format("session {}, stream {} {}, epoch {}", s.session, s.stream, row.stream->name, s.epoch));
  out.heading("STATE");
  out.explain(row.diagnosis);
  out.heading("THE LAST MINUTE");
  out.minute("rate", row.stream->minute, row.stream->nominal_hz, "Hz", 1,
             [](const StreamPoint& p) { return p.rate_hz; });
  out.minute("frame", row.stream->minute, 0, "ms", 1, [](const StreamPoint& p) { return p.frame_ms; });
  out.minute("bandwidth", row.stream->minute, 0, "Mbit/s", 2,
             [](const StreamPoint& p) { return p.mbit_per_s; });
  out.gauge("frame", sane(s.frame_ms_p50), row.stream->nominal_hz > 0 ? 1e3 / row.stream->nominal_hz : 0,
            sane(s.frame_ms_p99));
  out.heading("STREAM");
  out.fact("codec",
           fmt::format("{}, {}, threshold {} in force", s.codec, s.predictor, number(s.threshold, 4, 8)));
  out.fact("bodies", fmt::format("{}, {} at rest, {} corrected a frame", s.bodies, s.at_rest,
                                 number(s.corrected_per_frame, 0, 8)));
  out.fact("of raw", fmt::format("{} of {} Mbit/s, {} %", number(s.mbit_per_s, 2, 8),
                                 number(s.raw_mbit_per_s, 2, 8), number(share_of_raw(s), 1, 6)));
  if (sane(s.wire_mbit_per_s) > 0)
    out.fact("on the wire",
             fmt::format("{} Mbit/s an observer, with headers and answers", number(s.wire_mbit_per_s, 3, 8)));
  out.fact("clients", fmt::format("{} participants, {} observers, {} viewers behind gateways", s.participants,
                                  s.observers, row.stream->viewers));
  out.heading("COUNTS");
  out.fact("frame", fmt::format("{}, up for {}", s.frame,
                                duration_text(static_cast<std::int64_t>(std::max(sane(s.uptime_s), 0.0)) *
                                              1'000'000'000)));
  out.fact("waiting", fmt::format("{} stalls, suspended for {} s in all; window {}", s.stalls,
                                  s.suspended_ms / 1000, s.window));
  const auto size = [](std::uint64_t bytes) { return short_bytes(static_cast<double>(bytes)); };
  out.fact("bytes",
           fmt::format("deltas {}, replies {}, inputs {}, snapshots {} ({})", size(s.delta_bytes),
                       size(s.reply_bytes), size(s.input_bytes), size(s.snapshot_bytes), s.snapshots));
  out.fact("refused", fmt::format("{} inputs, {} messages; at most {} messages waited at once",
                                  s.refused_inputs, s.refused_messages, s.queue_high_water));
}

}  // namespace

Page details(const Overview& overview, const View& view, const Rows& rows, Size size, Moment now,
             Alphabet alphabet) {
  Composer out(size, now, alphabet);
  if (view.focus() == Focus::kStreams) {
    if (const auto at = view.chosen_stream(rows)) describe(out, rows.streams[*at]);
  } else if (const auto at = view.chosen_client(rows)) {
    describe(out, overview, rows.clients[*at]);
  }
  return out.take();
}

}  // namespace tandem::top
