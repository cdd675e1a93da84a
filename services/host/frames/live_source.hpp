#pragma once
// A running simulation as a source of frames: inputs, step, streams.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/hash.hpp"
#include "sdk/workers/workers.hpp"
#include "services/host/frames/configuration.hpp"
#include "services/host/frames/frame_cycle.hpp"
#include "services/host/frames/frame_source.hpp"
#include "services/host/frames/gravity_hint.hpp"
#include "services/host/frames/recent_senders.hpp"
#include "services/host/frames/trials.hpp"
#include "services/host/news/simulation_news.hpp"
#include "services/host/streams/stream.hpp"
#include "tandem/result.hpp"

namespace tandem::host {

inline constexpr std::size_t kMaxImmediate = 1024;  ///< maximum number of inputs of all clients that wait
                                                    ///< for one step
/// Maximum number of scheduled inputs per frame of all clients together; those of lead + 1 frames fit
/// kMaxPendingInputs.
inline constexpr std::uint32_t kMaxScheduledPerFrame = 100;

/// Gives inputs their frame, hands them to the simulation in time, and streams the simulation's bodies. All
/// streams follow one mirror and run in parallel, each on its own thread if there are enough cores. Not
/// thread-safe.
class LiveSource final : public FrameSource {
 public:
  /// Creates a source. `simulation` must outlive it; its bodies are those of config.start_frame. The first
  /// stream is made from the start. Errors: as Host::create(), naming the stream if there are several.
  static Result<std::unique_ptr<LiveSource>> create(const HostConfig& config, engine::Simulation& simulation);

  [[nodiscard]] const transport::SessionMessage& session() const override { return session_; }
  [[nodiscard]] bool offers(std::uint32_t id) const override { return !withheld_[lanes_[id].carries]; }
  [[nodiscard]] Frame frame() const override { return cycle_.frame(); }
  [[nodiscard]] StreamSet active() const override;
  void set_active(StreamSet streams) override;
  [[nodiscard]] const State& agreed(std::uint32_t id) const override { return made(id).agreed(); }
  [[nodiscard]] std::uint64_t hash(std::uint32_t id) const override { return made(id).hash(); }
  [[nodiscard]] const StreamParameters& parameters(std::uint32_t id) const override;
  [[nodiscard]] PositionError error_of(std::uint32_t id) const override;
  /// Hands over the inputs that act on the next frame, and begins its step. Until next() has returned, all
  /// that this class tells is of the frame before.
  void begin_next() override;
  [[nodiscard]] bool next_ready() override { return step_is_ready_ = simulation_->step_ready(); }
  [[nodiscard]] int next_descriptor() const override { return simulation_->step_descriptor(); }
  bool take_step() override;
  [[nodiscard]] bool stepping() const override { return cycle_.stepping(); }
  [[nodiscard]] bool may_begin_early() const override { return cycle_.may_begin_early(); }
  void rest_after_frame() override { cycle_.rest(); }
  [[nodiscard]] bool needs_rest() const override { return names_are_old_; }
  [[nodiscard]] bool failed() override;
  /// If begin_next() was called: once next_ready() was true. That is asserted.
  void set_budgets(std::span<const FrameBudget> budgets) override;
  std::optional<MadeFrame> next(StreamSet snapshots_follow, Outbox& outbox) override;
  void snapshot(std::uint32_t id, std::vector<std::byte>& out) override {
    made(id).snapshot(out, StreamId{.id = id, .generation = 0});
  }
  InputVerdict accept(const transport::InputMessage& message, const InputTerms& terms,
                      Outbox& outbox) override;
  [[nodiscard]] transport::SessionMessage announced() const override;
  bool refresh_names() override;
  void use_spare_time() override;
  [[nodiscard]] double estimated_mbit_per_s(std::uint32_t id) const override;
  [[nodiscard]] BodyCounts bodies(std::uint32_t id) const override;

  [[nodiscard]] NewsDesk* news() override { return news_ ? &*news_ : nullptr; }
  [[nodiscard]] std::string name(std::uint32_t id) const override { return lanes_[id].config.name; }
  Result<void> set_parameters(std::uint32_t id, const StreamParameters& parameters) override;
  void capture(checkpoint::Checkpoint& out) const override;
  [[nodiscard]] std::uint64_t bodies_hash() override { return bodies_hasher_.hash(mirror_.target()); }
  [[nodiscard]] std::vector<std::string> take_notices(std::int64_t now_ns) override;
  [[nodiscard]] std::vector<std::string> take_warnings(std::int64_t now_ns) override;
  [[nodiscard]] std::uint32_t hidden() const override { return mirror_.hidden(); }
  [[nodiscard]] std::optional<Error> error() const override { return error_; }

 private:
  /// An offer. What was told and learned of its stream stands in the lane that encodes.
  struct Lane {
    StreamConfig config;
    std::uint32_t carries = 0;                     // the lane that encodes: by default itself
    std::shared_ptr<Stream> stream = {};           // null: nobody plays it. Lanes of one encoding share it
    bool told_out_of_reach = false;                // it was told that target or cap is out of reach
    bool told_crowded = false;                     // likewise that its predicted step passes over many bodies
    FrameBudget budget = {};                       // of the next frame
    std::optional<StreamParameters> learned = {};  // in an earlier epoch; not taken over yet
  };
  struct Waiting {
    ScheduledDrive drive;
    engine::Input input;
  };
  LiveSource(const HostConfig& config, engine::Simulation& simulation, Mirror mirror, const Drive& drive);

  [[nodiscard]] const Stream& made(std::uint32_t id) const {
    TANDEM_ASSERT(id < lanes_.size() && lanes_[id].stream != nullptr);
    return *lanes_[id].stream;
  }
  [[nodiscard]] Stream& made(std::uint32_t id) {
    TANDEM_ASSERT(id < lanes_.size() && lanes_[id].stream != nullptr);
    return *lanes_[id].stream;
  }
  [[nodiscard]] bool encodes(std::uint32_t id) const { return lanes_[id].carries == id; }
  /// The stream of an offer, if any offer of it is played; else null.
  [[nodiscard]] Stream* played(std::uint32_t id) const;
  [[nodiscard]] Result<Stream> begin(std::uint32_t id) const;
  /// begin(), for a stream that is made from now on.
  [[nodiscard]] Result<void> make(std::uint32_t id);
  /// Takes over the inputs that wait to act, and remembers what the streams had learned. Errors: kMalformed,
  /// if the simulation refuses such an input.
  [[nodiscard]] Result<void> go_on_from(const checkpoint::Checkpoint& checkpoint);
  void remember_parameters(const checkpoint::Checkpoint& checkpoint);
  [[nodiscard]] InputVerdict schedule(const engine::Input& input, const engine::Classification& effect,
                                      const transport::InputMessage& message, Outbox& outbox);
  /// refresh_names(), of the bodies alone.
  bool refresh_bodies();
  /// Notes whether a body appeared in the last step, so that names() has to be asked.
  void note_births();
  /// The step is finished: its inputs are no longer pending.
  void settle_inputs();
  void make_deltas();
  /// The deltas of the current frame, one for each encoding, by the lanes that encode.
  [[nodiscard]] std::span<const MadeDelta> encoded();
  [[nodiscard]] FrameBudget budget_of(const Stream* stream) const;
  /// True if the sender's budget is used up for an input of that cost.
  [[nodiscard]] bool too_dear(double cost, transport::ClientId client, const InputTerms& terms);
  void note_refusal(const transport::InputMessage& message, const std::string& reason);
  void note_mishaps(std::int64_t now_ns, std::vector<std::string>& lines);
  void note_hidden(std::int64_t now_ns, std::vector<std::string>& lines);
  /// More bodies are hidden than a warning said.
  [[nodiscard]] bool hides_many() const { return mirror_.hidden() > 2 * told_hidden_; }
  /// Whose inputs came before bodies were lost.
  [[nodiscard]] std::string blamed(std::int64_t now_ns);
  static void note_target(Lane& lane, const Stream& stream, std::vector<std::string>& lines);
  void note_crowded(Lane& lane, const Stream& stream, std::vector<std::string>& lines) const;
  /// A round of trials ended: says what streams would take, and offers those that pay, and no others.
  void judge_trials(std::vector<std::string>& lines);
  [[nodiscard]] std::string called(std::uint32_t id) const;
  [[nodiscard]] double mbit_per_s(double bytes_per_frame) const;
  [[nodiscard]] std::int64_t clock() const { return clock_ns_ == nullptr ? 0 : clock_ns_(); }

  engine::Simulation* simulation_;
  Mirror mirror_;
  std::optional<NewsDesk> news_;  // if the session has features
  SimulationNews simulation_news_;
  std::vector<Lane> lanes_;
  Workers workers_;
  transport::SessionMessage session_;
  double frame_rate_hz_;
  std::int64_t (*clock_ns_)();
  FrameCycle cycle_;
  bool step_is_ready_ = false;  // the step under way, by the last next_ready()
  std::string engine_;
  bool has_moved_;  // the simulation, since its first frame
  std::int64_t step_began_ns_ = 0;
  std::int64_t step_ns_ = 0;              // of the step that was taken over last
  Drive drive_;                           // in force at frame()
  std::uint64_t last_input_ = 0;          // number
  std::vector<MadeDelta> deltas_;         // of the current frame
  std::vector<MadeDelta> encoded_;        // kept to reuse its memory
  bool acts_next_ = false;                // an input acts on the step that was begun last
  bool acted_ = false;                    // an input acted on the step that was taken over last
  std::vector<Waiting> scheduled_;        // in the order of their numbers and so ascending by frame
  std::vector<engine::Input> immediate_;  // in the order of arrival
  std::vector<engine::Input> later_;      // Checkpoint::later
  Frame scheduling_frame_ = 0;
  std::uint32_t scheduled_now_ = 0;               // for scheduling_frame_
  static constexpr std::size_t kMaxRefusals = 4;  // told of a frame
  std::vector<std::string> refusals_;             // not told yet
  std::int64_t told_budget_ns_ = INT64_MIN / 2;
  RecentSenders senders_;
  StateHasher bodies_hasher_;
  std::int64_t noted_mishaps_ns_ = -kSecond;
  engine::Mishaps engine_mishaps_;  // after the step that was taken over last
  engine::Mishaps noted_mishaps_;
  static constexpr std::int64_t kTellHiddenNs = 10 * kSecond;
  std::int64_t told_hidden_ns_ = INT64_MIN / 2;
  std::uint32_t told_hidden_ = 0;
  std::uint64_t told_removed_ = 0;
  GravityHint gravity_hint_;
  std::string origin_hint_;       // empty: the bodies are not just far away
  std::optional<Trials> trials_;  // empty: there is nothing to choose, or no time to spare
  StreamSet withheld_;            // clients are not told of them
  bool streams_are_new_ = false;  // announced() has other streams than it had
  bool names_are_old_ = true;
  std::uint64_t names_version_ = 0;
  std::optional<Error> error_;
};

}  // namespace tandem::host
