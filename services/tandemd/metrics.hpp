#pragma once
// The metrics and the health of tandemd: --metrics.

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/statistics/duration_buckets.hpp"
#include "services/host/host.hpp"
#include "services/host/keeping/keeping.hpp"
#include "services/host/outgoing/publisher.hpp"
#include "services/host/standby/standby.hpp"
#include "services/program/metrics/endpoint.hpp"
#include "services/program/metrics/health.hpp"
#include "services/program/metrics/latest.hpp"
#include "services/program/metrics/rate_watch.hpp"
#include "services/tandemd/engine_metrics.hpp"
#include "tandem/result.hpp"

namespace tandem::daemon {

/// What a session is from its start to its end.
struct SessionFacts {
  std::string session, scene;
  double frame_rate_hz = 0;  ///< 0: as fast as possible
  /// Of each offer: the name of its stream, or the number where it has none; and its delay in seconds. Both
  /// together are of one offer alone.
  std::vector<std::string> streams, delays, codecs, predictors;
};
[[nodiscard]] SessionFacts facts_of(const host::HostConfig& config, const std::string& session,
                                    const std::string& scene, bool free_rate);

/// A server that stands by.
struct StandbyNow {
  Frame holds = 0;   ///< frame of its checkpoint; 0: it has none
  Frame behind = 0;  ///< frames that the live server made since, as far as is known
  std::uint64_t received_bytes = 0;
};

/// Figures of a moment, as one thread hands them to the other.
struct FiguresNow {
  std::optional<StandbyNow>
      standby;  ///< set: it stands by, and only the age of its checkpoint counts besides
  /// Of the newest checkpoint that was written, or else since the server began; while it stands by, of the
  /// one that it holds. Empty: it writes none, or holds none.
  std::optional<double> checkpoint_age_s;
  double checkpoint_interval_s = 0;  ///< 0: it writes none
  host::Host::State state = host::Host::State::kClaiming;
  std::uint64_t epoch_ms = 0;
  Frame frame = 0;
  double frame_rate_hz = 0;  ///< as achieved over the last three seconds
  host::HostTotals totals;
  host::HostMoment moment;
  std::uint64_t write_failures = 0, repeated_bytes = 0;
  DurationBuckets::Counts frame_took, step_took, publish_took;
  std::vector<DurationBuckets::Counts> predict_took, encode_took;  ///< by stream
  std::optional<EngineNow> engine;                                 ///< in another process
};
/// The page of such figures, apart from what metrics/ adds for every program.
void describe(metrics::Page& page, const SessionFacts& facts, const FiguresNow& figures);

/// Does nothing without an address. The thread that polls the host calls watch(); it never waits here.
class Metrics {
 public:
  /// Starts to answer, if there is an address. Errors: those of Endpoint::create().
  [[nodiscard]] Result<void> serve(const metrics::Address& address, SessionFacts facts);
  /// Call after every poll.
  void watch(const host::Host& host, const host::Publisher& publisher, const host::Keeping& keeping,
             bool produced, std::int64_t now_ns);
  void watch(const standby::Standby& standby, std::int64_t now_ns);
  /// For DdsOptions.
  [[nodiscard]] std::atomic<std::uint64_t>& repeated_bytes() { return repeated_bytes_; }
  /// Follow an engine in another process: it serves.
  void begin_engine(const engine::door::Door& door);
  /// It serves no longer. Call also while another one is awaited, instead of watch().
  void miss_engine(std::int64_t now_ns);
  /// Call while there is no network to serve on, instead of watch().
  void miss_network(std::int64_t now_ns);

 private:
  void count_frame(const host::FrameReport& report);
  [[nodiscard]] bool frames_are_due(const host::Host& host, std::int64_t now_ns);
  void note_checkpoints(const host::Keeping& keeping, std::int64_t now_ns);
  [[nodiscard]] const char* obstacle(const host::Host& host, const host::Publisher& publisher) const;

  static constexpr std::int64_t kPeriodNs = kSecond / 4;
  static constexpr std::int64_t kMomentNs = kSecond;  // it looks at all bodies

  SessionFacts facts_;
  FiguresNow figures_;  // of the polling thread
  std::atomic<std::uint64_t> repeated_bytes_{0};
  EngineWatch engine_;
  metrics::RateWatch rate_;
  std::int64_t next_ns_ = 0, next_moment_ns_ = 0;
  std::int64_t step_limit_ns_ = 30 * kSecond;  // of an engine in another process, or as long as its default
  std::int64_t frame_ns_ = 0;                  // when the last frame was seen to be another
  std::uint64_t suspended_ms_ = 0;
  bool network_there_ = true;
  std::optional<std::int64_t> began_ns_;  // to serve the session
  metrics::Latest<FiguresNow> latest_;
  metrics::Health health_;
  std::unique_ptr<metrics::Endpoint> endpoint_;  // last: ends before what it reads
};

}  // namespace tandem::daemon
