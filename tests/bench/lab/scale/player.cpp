#include <fmt/format.h>

#include <chrono>

#include "sdk/client/api/clock.hpp"
#include "sdk/client/client_core.hpp"
#include "sdk/statistics/duration_histogram.hpp"
#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/wire/client_id.hpp"
#include "services/lab/measures/replay.hpp"
#include "services/program/json/json.hpp"
#include "tests/bench/lab/scale/machine.hpp"
#include "tests/bench/lab/scale/scale.hpp"

namespace tandem::lab {
namespace {

constexpr std::int64_t kSilenceNs = 60'000'000'000;  // without a frame the server is taken for dead

/// Counts what each applied delta took.
class Watch final : public client::CoreListener {
 public:
  void on_applied(Epoch /*epoch*/, const client::CompleteDelta& /*delta*/) override {
    const ClientTimeline::Timings timings = core->timeline()->timings();
    predict.add(timings.predict_ns);
    decode.add(timings.decode_ns);
    apply.add(timings.hash_ns);
    ++frames;
  }
  const client::ClientCore* core = nullptr;
  DurationHistogram predict, decode, apply;
  std::uint64_t frames = 0;
};

Json to_json(const DurationHistogram& histogram) {
  return {{"p50", histogram.quantile_ms(0.5)}, {"p99", histogram.quantile_ms(0.99)}};
}

}  // namespace

int play_scale(const std::string& session, std::uint32_t domain, std::uint64_t frames) {
  transport::DdsOptions dds;
  dds.domain = domain;
  dds.session = session;
  dds.profile = "loopback";
  client::CoreOptions options;
  options.session = session;
  options.id = dds.client = transport::random_client_id();
  options.lead = 1;
  options.measure_ns = &steady_ns;
  const std::int64_t heap_at_start = heap_bytes();
  auto port = transport::make_dds_client_port(dds);
  if (!port) return 1;
  Watch watch;
  client::ClientCore core(options, **port, &watch);
  watch.core = &core;
  std::int64_t heard_ns = steady_ns();
  // The last frames may still be on their way when the server ends.
  const std::uint64_t enough = frames > 10 ? frames - 10 : 1;
  while (watch.frames < enough) {
    const std::uint64_t before = watch.frames;
    const std::int64_t due_ns = core.poll(client::now());
    const std::int64_t now_ns = steady_ns();
    if (watch.frames != before) heard_ns = now_ns;
    if (now_ns - heard_ns > kSilenceNs) return 1;
    if (due_ns > now_ns) (*port)->wait(std::chrono::nanoseconds(due_ns - now_ns));
  }
  fmt::print("{}\n", Json{{"predict_ms", to_json(watch.predict)},
                          {"decode_ms", to_json(watch.decode)},
                          {"apply_ms", to_json(watch.apply)},
                          {"frames", watch.frames},
                          {"heap_bytes", heap_bytes() - heap_at_start}}
                         .dump());
  return core.statistics().hash_mismatches == 0 ? 0 : 1;
}

}  // namespace tandem::lab
