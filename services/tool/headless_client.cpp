#include "services/tool/headless_client.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cinttypes>
#include <cmath>
#include <fstream>

#include "sdk/client/api/clock.hpp"
#include "sdk/client/api/ports.hpp"
#include "sdk/core/lattice/hash.hpp"
#include "sdk/statistics/duration_histogram.hpp"
#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/wire/client_id.hpp"
#include "sdk/wire/units.hpp"
#include "services/engines/scenes/script.hpp"
#include "services/program/json/figures.hpp"
#include "services/tool/print_error.hpp"

namespace tandem::tool {
namespace {

constexpr std::int64_t kTellWaitingNs = 2 * kSecond;
constexpr std::int64_t kTellMissingNs = 5 * kSecond;
constexpr std::int64_t kMissingNs = 3 * kSecond;  // without a frame, before it is said
constexpr std::int64_t kLostNs = 5 * kSecond;     // without a frame at the end, which is then a failure

}  // namespace

Result<std::unique_ptr<HeadlessClient>> HeadlessClient::create(const HeadlessOptions& options) {
  std::unique_ptr<HeadlessClient> made(new HeadlessClient(options));
  if (auto opened = made->open(); !opened) return tl::unexpected<Error>(opened.error());
  return made;
}

HeadlessClient::~HeadlessClient() = default;

Result<void> HeadlessClient::open() {
  if (!options_.input_script.empty()) {
    // Reads the script now, so that a mistake in it is reported at once; frames are known when the session's
    // rate is known.
    if (auto loaded = load_script(1.0 / 30); !loaded) return loaded;
  }
  if (!options_.capture.empty()) {
    auto recorder = recording::Recorder::create(
        options_.capture, options_.compression,
        options_.overwrite ? recording::Existing::kReplaced : recording::Existing::kStays);
    if (!recorder) return tl::unexpected<Error>(recorder.error());
    recorder_ = std::make_unique<recording::Recorder>(std::move(*recorder));
    if (recorder_->file().is_numbered())
      tell(LogLevel::kWarning, fmt::format("{} exists and stays; this recording becomes {}", options_.capture,
                                           recorder_->file().path()));
  }
  if (!options_.publish.empty()) {
    options_.publication.began_ms = static_cast<std::uint64_t>(transport::wall_ns() / kMillisecond);
    auto publication =
        audience::Publication::open(options_.publish, options_.publication, options_.overwrite);
    if (!publication) return tl::unexpected<Error>(publication.error());
    publication_ = std::move(*publication);
    if (!publication_->told().empty()) tell(LogLevel::kWarning, publication_->told());
  }
  // After the recording: if that is refused, another process may be writing this log, too, and it must stay.
  if (!options_.hash_log.empty()) {
    hash_log_.reset(std::fopen(options_.hash_log.c_str(), "ab"));  // an earlier run's lines stay
    if (!hash_log_) return fail(ErrorCode::kIo, "cannot write the hash log " + options_.hash_log);
    std::setvbuf(hash_log_.get(), nullptr, _IOLBF, BUFSIZ);  // whole lines, even if it is killed
  }
  client::CoreOptions core;
  core.session = options_.wanted_session();
  core.id = transport::random_client_id();
  core.role = options_.observe ? transport::Role::kObserver : transport::Role::kParticipant;
  core.lead = options_.lead;
  core.prefer = options_.prefer;
  if (options_.max_delay_s)
    core.max_delay_ms = static_cast<std::uint32_t>(std::lround(*options_.max_delay_s * 1e3));
  core.cap_kbit_s = options_.max_kbit_s;
  core.gateway_caps = !options_.url.empty();
  core.measure_ns = transport::steady_ns;
  core.log = [this](LogLevel level, std::string_view line) { tell(level, std::string(line)); };
  tandem_options where = TANDEM_OPTIONS_INIT;
  where.domain = options_.domain;
  where.profile = options_.profile.c_str();
  where.secure = options_.secure.c_str();
  where.role = options_.observe ? TANDEM_OBSERVER : TANDEM_PARTICIPANT;
  if (!options_.url.empty()) where.url = options_.url.c_str();
  std::string token;
  if (!options_.token_file.empty()) {
    std::ifstream file(options_.token_file);
    if (!(file >> token)) return fail(ErrorCode::kIo, "no token could be read from " + options_.token_file);
  }
  where.token = token.c_str();
  where.tls_ca = options_.tls_ca.c_str();
  auto port = api::open_port(where, core.session, core.id);
  if (!port) return tl::unexpected<Error>(port.error());
  port_ = std::move(*port);
  if (!options_.profile.empty() && options_.index == 0)
    tell(LogLevel::kInfo,
         transport::describe_dds_profile(options_.domain, options_.profile, transport::Side::kClient));
  constexpr recording::Clocks kClocks{transport::steady_ns, transport::wall_ns};
  if (recorder_) recording_port_ = std::make_unique<RecordingPort>(*port_, *recorder_, kClocks);
  transport::ClientPort& used =
      recording_port_ ? static_cast<transport::ClientPort&>(*recording_port_) : *port_;
  client_ = std::make_unique<following::SessionClient>(std::move(core), used);
  sinks_ = {this};
  if (recorder_) sinks_.push_back(&recording_sink_.emplace(*recorder_, *client_, kClocks));
  if (publication_) sinks_.push_back(&audience_sink_.emplace(*publication_, *client_));
  return {};
}

Result<void> HeadlessClient::load_script(double dt_s) {
  auto loaded = scenes::load_input_script(options_.input_script, dt_s);
  if (!loaded) return tl::unexpected<Error>(loaded.error());
  script_.clear();
  for (auto& event : *loaded) {
    script_.push_back({event.frame, static_cast<transport::InputKind>(event.input.kind),
                       std::move(event.input.values), std::move(event.input.bytes)});
  }
  return {};
}

void HeadlessClient::run(const std::atomic<bool>& stop, TurnListener* listener) {
  started_ns_ = transport::steady_ns();
  told_ns_ = live_ns_ = started_ns_;
  while (!stop) {
    const client::Now now = client::now();
    const std::int64_t due_ns = client_->poll(sinks_, now);
    const client::Statistics& figures = core().statistics();
    send_script(now);
    const Kept written = kept();
    if (listener != nullptr) listener->turned(core(), written, now.steady_ns);
    if (!written.good) break;
    tell_waiting(now);
    tell_missing(now);
    tell_live(now);
    const auto over = [&](std::int64_t since_ns, const std::optional<double>& limit_s) {
      return limit_s && static_cast<double>(now.steady_ns - since_ns) / 1e9 >= *limit_s;
    };
    if (figures.frames_applied == 0) {
      if (over(started_ns_, options_.timeout_s)) break;
    } else if (over(figures.first_applied_ns, options_.seconds)) {
      break;
    }
    const std::int64_t wait_ns = due_ns - transport::steady_ns();
    if (wait_ns > 0) port_->wait(std::chrono::nanoseconds(wait_ns));
  }
  finish();
}

std::string HeadlessClient::place() const {
  if (!options_.url.empty()) {
    return options_.session.empty() ? "the gateway's session"
                                    : fmt::format("session '{}' of the gateway", options_.session);
  }
  return fmt::format("session '{}' on domain {}", options_.wanted_session(), options_.domain);
}

void HeadlessClient::finish() {
  // What failed before is the cause.
  if (failure_.empty() && core().statistics().frames_applied == 0) {
    const std::string reason = core().status().reason;
    failure_ = fmt::format("never played in {}: {}", place(),
                           reason.empty() ? "no server found or no frame came" : reason);
  }
  if (const auto missing = missing_frames(transport::steady_ns(), kLostNs); missing && failure_.empty())
    failure_ = *missing + " before the end";
  if (hash_log_) {
    const bool written = std::ferror(hash_log_.get()) == 0 && std::fflush(hash_log_.get()) == 0;
    if (!written) failure_ = "could not write all of the hash log " + options_.hash_log;
  }
  if (recorder_) {
    if (auto finished = recorder_->finish(); !finished) failure_ = finished.error().message;
  }
  if (publication_) {
    if (auto finished = publication_->finish(client::now()); !finished) failure_ = finished.error().message;
  }
  if (!failure_.empty()) tell(LogLevel::kError, failure_);
}

void HeadlessClient::on_session(const transport::SessionMessage& session) {
  epoch_ = session.epoch;
  learn(session);
}

void HeadlessClient::learn(const transport::SessionMessage& session) {
  if (session_ns_ != 0) return;
  session_ns_ = transport::steady_ns();
  if (!options_.input_script.empty() && session.frame_rate_hz > 0) {
    if (auto loaded = load_script(1 / session.frame_rate_hz); !loaded) failure_ = loaded.error().message;
  }
}

void HeadlessClient::on_applied(const client::CompleteDelta& delta, std::int64_t /*now_ns*/) {
  last_frame_ = delta.frame;
  last_hash_ = delta.hash;
  if (!first_join_ms_) first_join_ms_ = static_cast<double>(core().statistics().join_ns) / 1e6;
  if (hash_log_) {
    std::fprintf(hash_log_.get(), "%" PRIu64 ",%" PRIu64 ",%s\n", epoch_, delta.frame,
                 to_hex(delta.hash).c_str());
  }
}

Kept HeadlessClient::kept() const {
  if (recorder_) return {recorder_->progress(), recorder_->good()};
  if (!publication_) return {};
  const audience::Writer::Totals& totals = publication_->writer().totals();
  return {{.frames = totals.frames,
           .snapshots_cut = totals.snapshots,
           .written_bytes = totals.segment_bytes + totals.snapshot_bytes + totals.manifest_bytes},
          publication_->writer().good()};
}

void HeadlessClient::send_script(client::Now now) {
  // An event of frame n is due when the n-th frame has been applied; while joining again, it waits.
  while (script_at_ < script_.size() && core().phase() == ClientPhase::kPlaying &&
         core().statistics().frames_applied >= script_[script_at_].after) {
    ScriptEntry& entry = script_[script_at_++];
    const auto sent =
        client_->send(entry.kind, std::move(entry.values), std::move(entry.bytes), now.steady_ns);
    if (!sent) tell(LogLevel::kWarning, "input not sent: " + sent.error().message);
  }
}

void HeadlessClient::tell_waiting(client::Now now) {
  const ClientPhase phase = core().phase();
  if (phase == ClientPhase::kPlaying || now.steady_ns - told_ns_ < kTellWaitingNs) return;
  told_ns_ = now.steady_ns;
  const double waited_s = static_cast<double>(now.steady_ns - started_ns_) / 1e9;
  if (phase == ClientPhase::kSearching) {
    tell(LogLevel::kInfo, fmt::format("waiting for a server of {} ({:.0f} s)", place(), waited_s));
  } else {
    tell(LogLevel::kInfo, fmt::format("waiting to join {} ({:.0f} s)", place(), waited_s));
  }
}

// A server that ended, or that makes no frames, owes none.
std::optional<std::string> HeadlessClient::missing_frames(std::int64_t now_ns, std::int64_t least_ns) const {
  const client::Statistics& figures = core().statistics();
  const std::int64_t missing_ns = now_ns - figures.last_applied_ns;
  if (figures.frames_applied == 0 || missing_ns < least_ns) return std::nullopt;
  if (port_->server_ended() && port_->trouble().empty()) return std::nullopt;
  const std::optional<bool> makes = core().server_makes_frames(now_ns);
  if (makes && !*makes) return std::nullopt;
  const std::string reason = core().status().reason;
  return fmt::format("no frame came for {:.0f} s{}", static_cast<double>(missing_ns) / 1e9,
                     !reason.empty() ? ", as " + reason
                     : makes         ? ", though the server makes them"
                                     : ", and nothing is heard of the server");
}

void HeadlessClient::tell_missing(client::Now now) {
  if (now.steady_ns - missing_told_ns_ < kTellMissingNs) return;
  const auto missing = missing_frames(now.steady_ns, kMissingNs);
  if (!missing) return;
  missing_told_ns_ = now.steady_ns;
  tell(LogLevel::kWarning, *missing);
}

void HeadlessClient::tell_live(client::Now now) {
  if (!options_.live || now.steady_ns - live_ns_ < kSecond) return;
  const double span_s = static_cast<double>(now.steady_ns - live_ns_) / 1e9;
  const client::Statistics& figures = core().statistics();
  const auto bytes = static_cast<double>(figures.payload_bytes - live_bytes_);
  static constexpr const char* kPhases[] = {"searching", "refused", "joining", "playing"};
  Json line;
  line["client"] = options_.index;
  line["seconds"] = static_cast<double>(now.steady_ns - started_ns_) / 1e9;
  line["phase"] = kPhases[static_cast<std::size_t>(core().phase())];
  line["frame"] = last_frame_;
  line["frames_per_s"] = static_cast<double>(figures.frames_applied - live_frames_) / span_s;
  line["mbit_per_s"] = bytes * 8 / kBitsPerMbit / span_s;
  line["wire_mbit_per_s"] =
      static_cast<double>(figures.wire_bytes - live_wire_bytes_) * 8 / kBitsPerMbit / span_s;
  line["lag_ms"] = figures.smoothed_latency_ns / 1e6;
  line["resyncs"] = figures.resyncs;
  line["stream"] = core().status().stream;
  print_error(line.dump() + '\n');
  live_ns_ = now.steady_ns;
  live_wire_bytes_ = figures.wire_bytes;
  live_bytes_ = figures.payload_bytes;
  live_frames_ = figures.frames_applied;
}

void HeadlessClient::tell(LogLevel level, const std::string& line) const {
  if (options_.log) return options_.log(level, line);
  print_error(fmt::format("tandem join: {}{}\n", options_.name, line));
}

bool HeadlessClient::succeeded() const {
  return failure_.empty() && core().statistics().frames_applied > 0 &&
         core().statistics().hash_mismatches == 0;
}

Json HeadlessClient::report() const {
  const client::Statistics& figures = core().statistics();
  const ClientStatus status = core().status();
  Json out;
  each_client_figure([&out](const char* name, auto value) { put_figure(out, name, value); }, status);
  const double frames = std::max<double>(1, static_cast<double>(figures.frames_applied));
  const auto mean_ms = [frames](std::int64_t total_ns) {
    return static_cast<double>(total_ns) / 1e6 / frames;
  };
  out["cost_ms"] = {{"receive", mean_ms(figures.costs.receive_ns)},
                    {"predict", mean_ms(figures.costs.predict_ns)},
                    {"decode", mean_ms(figures.costs.decode_ns)},
                    {"hash", mean_ms(figures.costs.hash_ns)},
                    {"acknowledge", mean_ms(figures.costs.acknowledge_ns)}};
  out["played_s"] = static_cast<double>(figures.last_applied_ns - figures.first_applied_ns) / 1e9;
  out["join_ms"] = first_join_ms_ ? Json(*first_join_ms_) : Json(nullptr);
  out["last_frame"] = last_frame_;
  out["state_hash"] = to_hex(last_hash_);
  out["client"] = to_hex(status.client_id);
  out["role"] = status.role == ClientRole::kParticipant ? "participant" : "observer";
  out["lead"] = status.lead;
  out["epochs"] = figures.epochs;
  out["stream"] = status.stream;
  out["stream_reason"] = status.stream_reason;
  out["discovery_ms"] = session_ns_ != 0 ? static_cast<double>(session_ns_ - started_ns_) / 1e6 : 0.0;
  return out;
}

std::string HeadlessClient::summary() const {
  const client::Statistics& figures = core().statistics();
  return fmt::format(
      "{}{} frames, last {} with hash {}, {:.3f} Mbit/s; latency {:.2f} / {:.2f} ms, client {:.3f} / {:.3f} "
      "ms (p50 / p99); joined in {:.0f} ms; {} resyncs, {} mismatches; inputs: {} sent, {} refused\n",
      options_.name, figures.frames_applied, last_frame_, to_hex(last_hash_), figures.mean_mbit_per_s(),
      figures.latency.quantile_ms(0.5), figures.latency.quantile_ms(0.99),
      figures.frame_cost.quantile_ms(0.5), figures.frame_cost.quantile_ms(0.99), first_join_ms_.value_or(0),
      figures.resyncs, figures.hash_mismatches, figures.inputs_sent, figures.inputs_refused);
}

}  // namespace tandem::tool
