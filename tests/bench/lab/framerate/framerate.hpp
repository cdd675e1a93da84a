#pragma once
// Measures for `bench_lab framerate` how often a user's picture of a scene is updated (thesis, table 5.6).

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdk/transport/simulated/bottleneck.hpp"
#include "tandem/result.hpp"
#include "tests/bench/lab/framerate/thin_device.hpp"

namespace tandem::lab {

/// The thesis's "client only": the full simulation on the client, no server and no network.
inline constexpr std::string_view kClientOnly = "client-only";

/// `tracker` with this predicted step.
inline constexpr std::string_view kBallistic = "ballistic", kField = "field";
/// The defaults of server and user: the server's streams, and the user's choice among them.
inline constexpr std::string_view kAsItComes = "auto";

/// One row of the result.
struct FramerateRow {
  std::string scene;
  std::optional<int> number;  ///< number of the thesis's scene, 1..5
  std::uint32_t users = 1, bodies = 0;
  std::string method;  ///< client-only, a codec, a predicted step, or auto
  std::string device;  ///< native, thin or thesis
  double seconds = 0;  ///< measured time
  double updates_per_s = 0;
  // With a server:
  std::optional<double> client_ms_p50, latency_ms_p50;
  std::optional<double> client_cpu_ms;    ///< per update, with DDS, start and snapshot
  std::optional<double> link_mbit_per_s;  ///< to all users together, 2^20 bits, with protocol overhead
  std::optional<std::uint64_t> dropped, resyncs;  ///< packets for which the link's queue had no room; rejoins
  std::string stream;                             ///< the stream that the user played at the end
  std::string bound;                              ///< what limited the rate; see find_bound()
  std::string missing;                            ///< not empty: why nothing was measured
};

/// A thin device as it was set.
struct Calibration {
  std::string device;  ///< thin or thesis
  double share = 1, updates_per_s = 0;
  double slowdown = 1;  ///< against this machine's whole processor
  double step_us =
      0;  ///< thesis: of a body in the step that it was calibrated by; 0: measured, today's engine
};

/// The kind of link between server and users.
enum class LinkKind : std::uint8_t {
  kNamespaces,  ///< DDS between processes in network namespaces: the real thing, for root only
  kMemory,      ///< all in one process and in simulated time: for everybody, without what DDS costs
};

/// How all rows are measured.
struct FramerateSetup {
  std::string tandem, tandemd;  ///< paths of the programs
  transport::simulated::BottleneckOptions link;
  LinkKind kind = LinkKind::kNamespaces;
  double slowdown = 1;  ///< kMemory: of the measured user's processor
  double seconds = 10;  ///< counted from the first update
  std::uint64_t seed = 1;
  const std::atomic<bool>* stop = nullptr;  ///< ends a row early; must outlive the measurement
};

/// Runs the programs and fills a row's measured fields. The first user runs on `device`, as calibrated, if
/// that is not null. `row` has scene, users, bodies and method. An error is stored in `missing`.
void measure_row(const FramerateSetup& setup, ThinDevice* device,
                 const std::optional<Calibration>& calibration, FramerateRow& row);

/// Returns what limits a row that was measured with a server: "link" if it carries 0.9 of its rate or drops
/// anything, "processor" if the user takes 0.8 of its share, "server" if that takes 0.9 of a processor,
/// otherwise "round trip", which stands for the window of frames on their way.
[[nodiscard]] std::string find_bound(const FramerateRow& row, double link_bits_per_s, double share,
                                     double server_busy);

/// Runs the server's and the users' programs in one thread, on a simulated network with the setup's link.
/// Time is simulated: computing takes as long as it takes here, times the slowdown for the first user. Fills
/// the row like measure_row(). Errors: kInvalidArgument for what the scene or the codec refuses.
[[nodiscard]] Result<void> play_in_memory(const FramerateSetup& setup, FramerateRow& row);

/// Sets the device's share of a processor so that client-only makes `updates_per_s` of the thesis's first
/// scene with 10,000 bodies. `progress` gets each attempt. Returns the rate that is reached at the end, and
/// the share. Errors: kIo.
[[nodiscard]] Result<Calibration> calibrate(const FramerateSetup& setup, ThinDevice& device,
                                            double updates_per_s,
                                            const std::function<void(const std::string&)>& progress);

/// Sets the share at which a step that takes `step_us` per body makes `updates_per_s` with 10,000 bodies.
/// That is the cost of a plain grid that computes one body after another, as the thesis's did. Errors: kIo.
[[nodiscard]] Result<Calibration> calibrate_by_step(ThinDevice& device, double updates_per_s, double step_us);

/// {"devices": [...], "rows": [...]}, one line. `limited_by`: what limits the processor.
[[nodiscard]] std::string to_json(std::span<const FramerateRow> rows, const std::string& limited_by,
                                  std::span<const Calibration> calibrations);
/// A table for people, with the thesis's numbers next to the measured ones.
[[nodiscard]] std::string to_table(std::span<const FramerateRow> rows);

}  // namespace tandem::lab
