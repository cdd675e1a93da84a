#include "services/tandemd/metrics.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "sdk/transport/dds/dds_ports.hpp"
#include "services/program/metrics/figure_series.hpp"
#include "services/program/metrics/reasons.hpp"

namespace tandem::daemon {
namespace {

using host::Host;
using metrics::Labels;
using metrics::Page;

// The server keeps its rate if it misses no more than this share of it, over three seconds.
constexpr double kHeldShare = 0.9;
constexpr const char* kNoNetwork = "the network address that DDS is bound to is gone";

double seconds(std::int64_t ns) { return static_cast<double>(ns) / 1e9; }

void describe_server(Page& page, const SessionFacts& facts, const FiguresNow& figures) {
  page.gauge("tandem_session_info", "The session that this server publishes, as labels", 1,
             {{"session", facts.session}, {"scene", facts.scene}});
  constexpr std::size_t kStandingBy = 6;  // after those of Host::State
  page.state("tandem_server_state",
             "1 for the state of the server: it claims the session's name, waits for participants before "
             "frame 1, runs, was refused by another server of this session, has handed the session over, has "
             "ended, or stands by",
             {"claiming", "waiting", "running", "refused", "handed_over", "ended", "standing_by"},
             figures.standby ? kStandingBy : static_cast<std::size_t>(figures.state));
  if (figures.checkpoint_age_s) {
    page.gauge(
        "tandem_checkpoint_age_seconds",
        "Age of the newest checkpoint that was written, or else of the server; while the server stands "
        "by, of the one it holds",
        *figures.checkpoint_age_s);
  }
  if (figures.checkpoint_interval_s > 0) {
    page.gauge("tandem_checkpoint_interval_seconds", "Time between two checkpoints that are written",
               figures.checkpoint_interval_s);
  }
}

void describe_standby(Page& page, const StandbyNow& standby) {
  page.gauge("tandem_standby_checkpoint_frame",
             "Frame of the checkpoint that a server which stands by holds; 0: none",
             static_cast<double>(standby.holds));
  page.gauge("tandem_standby_behind_frames",
             "Frames that the live server made since the checkpoint that this server holds",
             static_cast<double>(standby.behind));
  page.count("tandem_standby_received_bytes_total", "Checkpoints and inputs received from the live server",
             static_cast<double>(standby.received_bytes));
}

void describe_session(Page& page, const SessionFacts& facts, const FiguresNow& figures) {
  page.gauge("tandem_epoch_timestamp_seconds", "Start of this epoch, since 1970",
             static_cast<double>(figures.epoch_ms) / 1e3);
  page.gauge("tandem_frame_rate_target_hertz", "Frames per second that are due; 0: as many as possible",
             facts.frame_rate_hz);
  page.gauge("tandem_frame_rate_hertz", "Frames per second, over the last three seconds",
             figures.frame_rate_hz);
  page.gauge("tandem_frame", "Number of the last frame", static_cast<double>(figures.frame));
  page.count("tandem_frames_total", "Frames made", static_cast<double>(figures.totals.frames));
  page.durations("tandem_frame_duration_seconds", "Time of a frame: step, predict, encode, apply",
                 figures.frame_took);
  page.durations("tandem_step_duration_seconds", "Time of the full simulation's step", figures.step_took);
  page.durations("tandem_publish_duration_seconds",
                 "Time in which DDS took the deltas of a frame, all streams together", figures.publish_took);
  page.gauge("tandem_bodies", "Bodies alive", figures.moment.bodies);
  page.gauge("tandem_hidden_bodies",
             "Bodies of the simulation that clients do not see: not finite, or beyond the extent",
             figures.totals.hidden);
}

void describe_stream(Page& page, const SessionFacts& facts, const FiguresNow& figures, std::size_t id) {
  const std::string& name = facts.streams[id];
  const host::StreamTotals& totals = figures.totals.streams[id];
  const host::StreamMoment& moment = figures.moment.streams[id];
  const std::string& delay = facts.delays[id];
  const Labels stream{{"delay", delay}, {"stream", name}};
  page.gauge(
      "tandem_stream_info",
      "A stream in one of the delays in which it is offered, its codec and its predictor, as labels", 1,
      {{"delay", delay}, {"stream", name}, {"codec", facts.codecs[id]}, {"predictor", facts.predictors[id]}});
  page.gauge("tandem_stream_made", "1 while the stream is computed, as somebody plays it",
             totals.made ? 1 : 0, stream);
  page.count("tandem_stream_frames_total", "Deltas of the stream", static_cast<double>(totals.frames),
             stream);
  page.count("tandem_payload_bytes_total", "Payload of the stream's deltas, counted once for all clients",
             static_cast<double>(totals.payload_bytes), stream);
  page.count("tandem_corrected_bodies_total", "Corrections of bodies in the stream's deltas",
             static_cast<double>(totals.corrected), stream);
  page.count("tandem_snapshots_total", "Snapshots made for joining clients",
             static_cast<double>(totals.snapshots), stream);
  page.count("tandem_snapshot_bytes_total", "Bytes of snapshots, with repetitions",
             static_cast<double>(totals.snapshot_bytes), stream);
  page.gauge("tandem_threshold_meters", "Error above which a body is corrected, in force", moment.threshold_m,
             stream);
  page.gauge("tandem_error_rms_meters", "Root of the mean square error of positions, of part of the bodies",
             moment.error_rms_m, stream);
  page.gauge("tandem_error_max_meters", "Largest error of a position, of part of the bodies",
             moment.error_largest_m, stream);
  page.gauge("tandem_bodies_at_rest", "Bodies at rest in the stream", moment.at_rest, stream);
  page.gauge("tandem_bodies_crowded", "Bodies that the predicted step lets through others", moment.crowded,
             stream);
  const auto clients = [&](const char* role, double count) {
    page.gauge("tandem_clients", "Clients by stream and role; those that join have none yet", count,
               {{"delay", delay}, {"stream", name}, {"role", role}});
  };
  clients("participant", totals.participants);
  clients("observer", totals.observers);
  clients("joining", moment.joining);
  page.gauge("tandem_client_lag_frames", "Frames that the slowest client of the stream is behind",
             moment.longest_lag, stream);
  page.durations("tandem_predict_duration_seconds", "Time of the predicted step", figures.predict_took[id],
                 stream);
  page.durations("tandem_encode_duration_seconds", "Time to encode and apply", figures.encode_took[id],
                 stream);
}

void describe_refusals(Page& page, const char* name, const char* help, const host::Refusals& refusals) {
  for (std::size_t i = 1; i < transport::kReasons; ++i) {
    const std::string_view reason = metrics::reason_label(static_cast<transport::Reason>(i));
    page.count(name, help, static_cast<double>(refusals.by_reason[i]), {{"reason", std::string(reason)}});
  }
}

void describe_clients(Page& page, const FiguresNow& figures) {
  const host::HostTotals& totals = figures.totals;
  page.count("tandem_clients_seen_total", "Clients that came", static_cast<double>(totals.clients_seen));
  page.gauge("tandem_dds_participants", "DDS participants that have clients here",
             figures.moment.dds_participants);
  page.gauge("tandem_window_frames", "Frames that the server may be ahead of its slowest participant",
             figures.moment.window);
  page.gauge("tandem_round_trip_seconds",
             "Longest time from a frame to its acknowledgement, of the participants",
             seconds(figures.moment.longest_round_trip_ns));
  page.count("tandem_demotions_total", "Participants that became observers because they delayed the others",
             static_cast<double>(totals.demotions));
  page.count("tandem_repeated_demotions_total",
             "Demotions of clients that had been demoted in the five minutes before",
             static_cast<double>(totals.repeated_demotions));
  page.count("tandem_rejoins_total", "Snapshots for clients that had got one before and had lost the session",
             static_cast<double>(totals.rejoins));
  metrics::describe(page, static_cast<const ServerCounts&>(totals));
  describe_refusals(page, "tandem_refused_inputs_total", "Inputs of clients that were refused",
                    totals.inputs_refused);
  describe_refusals(page, "tandem_refused_messages_total", "Messages that broke a rule of the protocol",
                    totals.messages_refused);
  page.count("tandem_refused_messages_total", "Messages that broke a rule of the protocol",
             static_cast<double>(totals.refused_messages - totals.messages_refused.total()),
             {{"reason", "unreadable"}});
}

void describe_queue(Page& page, const FiguresNow& figures) {
  page.gauge("tandem_queue_messages", "Messages that wait to be sent",
             static_cast<double>(figures.moment.queued));
  page.gauge("tandem_queue_messages_high_water", "Maximum number of messages that waited at once",
             static_cast<double>(figures.moment.queued_most));
  page.gauge("tandem_queue_frames", "Frames that wait to be sent", figures.moment.queued_frames);
  page.count("tandem_write_failures_total", "Writes that DDS refused, most of them repeated",
             static_cast<double>(figures.write_failures));
  page.count("tandem_repeated_bytes_total", "Bytes of deltas that DDS sent again, as a client lacked them",
             static_cast<double>(figures.repeated_bytes));
}

}  // namespace

SessionFacts facts_of(const host::HostConfig& config, const std::string& session, const std::string& scene,
                      bool free_rate) {
  SessionFacts facts{
      .session = session, .scene = scene, .streams = {}, .delays = {}, .codecs = {}, .predictors = {}};
  facts.frame_rate_hz = free_rate ? 0 : config.frame_rate_hz;
  for (const host::StreamConfig& stream : config.streams) {
    facts.streams.push_back(stream.name.empty() ? "0" : stream.name);
    facts.delays.push_back(fmt::format("{:g}", 1e-3 * stream.delay_ms));
    facts.codecs.push_back(stream.layout.codec);
    facts.predictors.push_back(stream.layout.predictor);
  }
  return facts;
}

void describe(Page& page, const SessionFacts& facts, const FiguresNow& figures) {
  describe_server(page, facts, figures);
  if (figures.engine) describe(page, *figures.engine);
  if (figures.standby) return describe_standby(page, *figures.standby);
  if (figures.totals.streams.size() != facts.streams.size()) return;  // it starts
  describe_session(page, facts, figures);
  for (std::size_t id = 0; id < facts.streams.size(); ++id) describe_stream(page, facts, figures, id);
  describe_clients(page, figures);
  describe_queue(page, figures);
}

Result<void> Metrics::serve(const metrics::Address& address, SessionFacts facts) {
  facts_ = std::move(facts);
  figures_.predict_took.resize(facts_.streams.size());
  figures_.encode_took.resize(facts_.streams.size());
  auto endpoint = metrics::Endpoint::create(address, health_,
                                            [this](Page& page) { describe(page, facts_, latest_.get()); });
  if (!endpoint) return tl::unexpected(endpoint.error());
  endpoint_ = std::move(*endpoint);
  spdlog::info(endpoint_->notice());
  return {};
}

void Metrics::count_frame(const host::FrameReport& report) {
  const auto ns = [](double ms) { return static_cast<std::int64_t>(ms * 1e6); };
  figures_.frame_took.add(ns(report.frame_ms));
  figures_.step_took.add(ns(report.step_ms));
  engine_.count_step();
  for (const host::DeltaReport& delta : report.deltas) {
    if (delta.encode_ns == 0) continue;  // it was encoded for another offer
    figures_.predict_took[delta.stream].add(delta.predict_ns);
    figures_.encode_took[delta.stream].add(delta.encode_ns);
  }
}

const char* Metrics::obstacle(const Host& host, const host::Publisher& publisher) const {
  if (publisher.gave_up()) return "DDS takes no frames";
  if (!network_there_) return kNoNetwork;
  switch (host.state()) {
    case Host::State::kClaiming:
      return metrics::Health::kStarting;
    case Host::State::kWaiting:
      return "it waits for participants before frame 1 (--wait-for)";
    case Host::State::kRunning:
      break;
    case Host::State::kRefused:
      return "another server has the session";
    case Host::State::kEnded:
      return "there are no more frames";
    case Host::State::kHandedOver:
      return "another server continues the session";
  }
  const double due_hz = facts_.frame_rate_hz;
  if (rate_.per_second() > 0 && rate_.per_second() >= kHeldShare * due_hz) return nullptr;
  return "it publishes fewer frames than are due";
}

// A server that waits for its participants says so, and a step may last for as long as an engine may take.
bool Metrics::frames_are_due(const Host& host, std::int64_t now_ns) {
  if (host.frame() != figures_.frame || frame_ns_ == 0) frame_ns_ = now_ns;
  const std::uint64_t suspended_ms = host.totals().suspended_ms;
  const bool suspended = std::exchange(suspended_ms_, suspended_ms) != suspended_ms;
  const bool may_step = host.frame_under_way() && now_ns - frame_ns_ < step_limit_ns_;
  return host.state() == Host::State::kRunning && !suspended && !may_step;
}

void Metrics::note_checkpoints(const host::Keeping& keeping, std::int64_t now_ns) {
  if (!began_ns_) began_ns_ = now_ns;
  const auto checkpoints = keeping.figures();
  figures_.checkpoint_age_s.reset();
  figures_.checkpoint_interval_s = checkpoints ? checkpoints->interval_s : 0;
  if (checkpoints) figures_.checkpoint_age_s = checkpoints->age_s.value_or(seconds(now_ns - *began_ns_));
}

void Metrics::begin_engine(const engine::door::Door& door) {
  engine_.begin(door);
  step_limit_ns_ = static_cast<std::int64_t>(door.hello().step_limit_s * 1e9);
  figures_.engine = engine_.now();
}

void Metrics::miss_engine(std::int64_t now_ns) {
  engine_.lost();
  if (!endpoint_) return;
  figures_.engine = engine_.now();
  figures_.state = Host::State::kEnded;
  latest_.offer(figures_);
  health_.saw_frames(0, false, now_ns);
  health_.beat(now_ns, "its engine ended, and another one is awaited");
}

void Metrics::miss_network(std::int64_t now_ns) {
  health_.saw_frames(0, false, now_ns);
  health_.beat(now_ns, kNoNetwork);
}

void Metrics::watch(const standby::Standby& standby, std::int64_t now_ns) {
  if (!endpoint_) return;
  began_ns_.reset();
  const Frame holds = standby.holds();
  if (now_ns >= next_ns_) {
    next_ns_ = now_ns + kPeriodNs;
    figures_.standby = {.holds = holds,
                        .behind = holds == 0 ? 0 : standby.live_frame() - holds,
                        .received_bytes = standby.received_bytes()};
    figures_.checkpoint_interval_s = 0;
    figures_.checkpoint_age_s.reset();
    if (const auto age_ns = standby.checkpoint_age_ns(now_ns)) figures_.checkpoint_age_s = seconds(*age_ns);
    if (figures_.engine) figures_.engine = engine_.now();
    latest_.offer(figures_);
  }
  const char* const missing = standby.follows() == 0 ? "it has found no live server to stand by for"
                                                     : "it has no checkpoint of the live server yet";
  health_.saw_frames(0, false, now_ns);
  health_.beat(now_ns, holds == 0 ? missing : nullptr);
}

void Metrics::watch(const Host& host, const host::Publisher& publisher, const host::Keeping& keeping,
                    bool produced, std::int64_t now_ns) {
  if (!endpoint_) return;
  if (produced) count_frame(host.report());
  if (now_ns >= next_ns_) {
    next_ns_ = now_ns + kPeriodNs;
    figures_.standby.reset();
    note_checkpoints(keeping, now_ns);
    network_there_ = transport::dds_server_network() == transport::NetworkState::kThere;
    health_.saw_frames(host.frame(), frames_are_due(host, now_ns), now_ns);
    figures_.state = host.state();
    figures_.epoch_ms = host.session().epoch;
    figures_.frame = host.frame();
    figures_.totals = host.totals();
    if (now_ns >= next_moment_ns_) {
      next_moment_ns_ = now_ns + kMomentNs;
      figures_.moment = host.present();
    }
    figures_.write_failures = publisher.failures();
    figures_.repeated_bytes = repeated_bytes_.load(std::memory_order_relaxed);
    figures_.publish_took = publisher.durations();
    rate_.saw(figures_.totals.frames, now_ns);
    figures_.frame_rate_hz = rate_.per_second();
    if (figures_.engine) figures_.engine = engine_.now();
    latest_.offer(figures_);
  }
  health_.beat(now_ns, obstacle(host, publisher));
}

}  // namespace tandem::daemon
