// tandem-relay --to http DIR: follows a session and writes it into a folder for an audience.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <memory>

#include "sdk/client/api/clock.hpp"
#include "sdk/wire/client_id.hpp"
#include "sdk/wire/clock.hpp"
#include "services/follow/audience/audience_sink.hpp"
#include "services/follow/following/session_client.hpp"
#include "services/program/logging/log.hpp"
#include "services/program/metrics/client_series.hpp"
#include "services/relay/service.hpp"
#include "services/relay/sides.hpp"
#include "services/relay/watched.hpp"

namespace tandem::relay {
namespace {

using transport::steady_ns;

/// It only watches, and draws nothing.
client::CoreOptions observer(const RelayOptions& options) {
  client::CoreOptions core;
  core.session = options.session;
  core.prefer = options.prefer;
  core.id = transport::random_client_id();
  core.role = transport::Role::kObserver;
  core.lead = 0;
  core.log = logging::write;
  core.measure_ns = steady_ns;
  return core;
}

class AudienceService {
 public:
  AudienceService(const RelayOptions& options, SignalWatch& signals)
      : options_(options), signals_(signals), sides_(options, signals.stop()) {}

  int run() {
    if (const auto ran = follow(); !ran) {
      spdlog::error(ran.error().message);
      return ran.error().code == ErrorCode::kInvalidArgument ? 2 : 1;
    }
    return 0;
  }

 private:
  Result<void> follow() {
    if (auto good = sides_.check(); !good) return good;
    if (auto served = watched_.serve(options_); !served) return served;
    audience::Writer::Options kept = options_.kept;
    kept.began_ms = static_cast<std::uint64_t>(transport::wall_ns() / kMillisecond);
    auto opened = audience::Publication::open(options_.folder, kept, false);
    if (!opened) return tl::unexpected(opened.error());
    audience::Publication& publication = **opened;
    if (!publication.told().empty()) spdlog::info(publication.told());
    client::CoreOptions core_options = observer(options_);
    auto port = sides_.follow(core_options.id);
    if (!port) return tl::unexpected(port.error());
    sides_.tell();
    following::SessionClient client(std::move(core_options), **port);
    audience::AudienceSink sink(publication, client);
    constexpr std::int64_t kLongestNs = kSecond / 4;
    while (!signals_.stop() && publication.writer().good()) {
      const client::Now now = client::now();
      const std::int64_t due_ns = std::min(client.poll(sink, now), now.steady_ns + kLongestNs);
      watch(client.core(), **port, publication.writer(), now.steady_ns);
      const std::int64_t wait_ns = due_ns - steady_ns();
      if (wait_ns > 0) (*port)->wait(std::chrono::nanoseconds(wait_ns));
    }
    return publication.finish(client::now());
  }

  void watch(const client::ClientCore& core, transport::ClientPort& port, const audience::Writer& writer,
             std::int64_t now_ns) {
    if (const auto* const session = core.session(); session != nullptr && session->epoch != epoch_) {
      epoch_ = session->epoch;
      logging::set_context(options_.session, epoch_);
      if (epoch_ != 0) ++epochs_;
    }
    const ClientStatus status = core.status();
    client_watch_.saw(status, now_ns);
    watched_.saw_frames(status.frames_applied, core.frames_are_due(now_ns), now_ns);
    const audience::Writer::Totals& totals = writer.totals();
    watched_.turned(now_ns, client_watch_.obstacle(), [&] {
      return fmt::format("{} frames in {} segments, {} objects of {} bytes", totals.frames, totals.segments,
                         totals.objects, totals.object_bytes);
    });
    if (!watched_.wants_figures(now_ns)) return;
    FiguresNow figures;
    figures.publishes = writer.manifest().number > 0;
    figures.opened = epochs_;
    figures.joins = epochs_ + core.statistics().resyncs;
    figures.frames = totals.frames;
    figures.snapshots = totals.snapshots;
    figures.audience = totals;
    figures.follows(port);
    figures.client = {.status = status, .lag_s = core.statistics().smoothed_latency_ns / 1e9};
    watched_.offer(figures);
  }

  const RelayOptions& options_;
  SignalWatch& signals_;
  Sides sides_;
  Watched watched_;
  metrics::ClientWatch client_watch_;
  Epoch epoch_ = 0;
  std::uint64_t epochs_ = 0;
};

}  // namespace

int run_audience(const RelayOptions& options, SignalWatch& signals) {
  return AudienceService(options, signals).run();
}

}  // namespace tandem::relay
