#pragma once
// What a host consists of. host.cpp creates it and shows it to the outside; poll.cpp is what it does.

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/statistics/duration_histogram.hpp"
#include "services/host/clients/audience.hpp"
#include "services/host/clients/claim.hpp"
#include "services/host/clients/inputs.hpp"
#include "services/host/clients/joins.hpp"
#include "services/host/clients/pacing.hpp"
#include "services/host/clients/replies.hpp"
#include "services/host/clients/roster.hpp"
#include "services/host/clients/snapshot_transfer.hpp"
#include "services/host/host.hpp"
#include "services/host/outgoing/publication.hpp"
#include "services/host/outgoing/status.hpp"
#include "services/host/succession/succession.hpp"

namespace tandem::host {

struct Host::Impl {
  Impl(ServiceConfig configuration, std::unique_ptr<FrameSource> frames, transport::ServerPort& endpoints);

  static Result<std::unique_ptr<Host>> create(ServiceConfig config, std::unique_ptr<FrameSource> source,
                                              transport::ServerPort& port);

  // --- What the rules see ---
  // `made`: the last frame of which a delta is out, or will be when the next step begins.
  [[nodiscard]] Roster::Now moment(Frame made) const {
    const Frame written = source->frame() - std::min<Frame>(source->frame(), outbox.unwritten_frames());
    return {.ns = now_ns,
            .frame = made,
            .written = written,
            .period_ns = pacing.period_ns(),
            .sent = publication.sent(),
            .unsent = static_cast<std::uint32_t>(made - source->frame())};
  }
  [[nodiscard]] Roster::Now moment() const { return moment(source->frame()); }
  // A snapshot waits for a frame, which is rounded for it, but not while the session is suspended.
  [[nodiscard]] std::int64_t frame_awaited_until_ns() const {
    return state == State::kRunning ? pacing.suspended_from_ns() + pacing.period_ns() : INT64_MIN;
  }
  [[nodiscard]] double threshold_m(std::uint32_t stream) const {
    return source->parameters(stream).codec.threshold * source->session().lattice_unit;
  }
  // What an offer that is not made takes, as it was measured, or as another offer of its stream takes now.
  [[nodiscard]] double estimated_mbit_per_s(std::uint32_t id) const {
    const auto& offers = source->session().streams;
    for (std::uint32_t other = 0; other < lanes.size(); ++other)
      if (source->active()[other] && offers[other].carries == offers[id].carries)
        return lanes[other].status.mbit_per_s();
    return source->estimated_mbit_per_s(id);
  }
  [[nodiscard]] std::uint32_t first_made() const {
    std::uint32_t stream = 0;
    TANDEM_ASSERT(source->active().any());
    while (!source->active()[stream]) ++stream;
    return stream;
  }
  [[nodiscard]] std::int64_t clock() const { return config.clock_ns == nullptr ? 0 : config.clock_ns(); }

  // --- One poll, in this order ---
  bool poll();
  void claim_name();
  void charge_waiting();
  void receive();
  void look_around();
  void settle_inputs();
  [[nodiscard]] StreamSet snapshots_due();
  bool advance_if_due(StreamSet snapshots_due);
  void begin_frame(const Roster::Now& then);
  void begin_early();
  void tell_collected_frames(bool all);
  void choose_streams(StreamSet joined);
  void make_snapshots(StreamSet due);
  void announce_names();
  void announce();
  void publish_status();
  void plan_wake();

  void digest(const transport::Received<transport::AckMessage>& ack);
  void digest(const transport::Received<transport::InputMessage>& input);
  bool produce_frame(StreamSet snapshots_due);
  [[nodiscard]] HostTotals totals_now() const;
  void note(std::string notice);
  void note_foreigner(transport::ClientId client);
  void refuse_stream(const transport::Received<transport::AckMessage>& ack, transport::Reason why);
  [[nodiscard]] std::uint32_t needed_kbit_s() const;

  // The data of each stream.
  struct Lane {
    Lane(std::uint32_t stream, const ServiceConfig& config, Outbox& outbox, const transport::ServerPort& port)
        : joins(stream), transfer(outbox), status(config.session, stream, config.epoch, outbox, port) {}
    JoinDesk joins;
    SnapshotTransfer transfer;
    StatusDesk status;
    StreamTotals totals;
  };

  enum class Waiting : std::uint8_t { kNothing, kParticipants, kQueue };
  enum class Delay : std::uint8_t {
    kNone,
    kHeld,     // it had to wait
    kStalled,  // the same, and its wait was counted as a stall
  };

  ServiceConfig config;
  transport::ServerPort* port;
  std::unique_ptr<FrameSource> source;
  Outbox outbox;
  Roster roster;
  Succession succession;
  InputDesk inputs;
  Audience audience;
  std::deque<Lane> lanes;
  std::size_t first_to_send = 0;
  ReplyDesk replies;
  Claim claim;
  Pacing pacing;
  Overrun overrun;
  Publication publication;

  State state = State::kClaiming;
  std::optional<Error> error;
  std::int64_t now_ns = 0, wall_ns = 0, last_poll_ns = 0, wake_ns = 0;
  std::optional<std::int64_t> wall_ahead_ns;  // of the steady clock, at the first poll
  /// What clients compare: a wall clock that is set within the epoch moves it not.
  [[nodiscard]] std::int64_t stamp_ns() const { return now_ns + wall_ahead_ns.value_or(0); }
  std::optional<std::int64_t> first_poll_ns;
  std::int64_t names_announced_ns = INT64_MIN / 2;
  std::int64_t last_look_ns = 0, last_foreign_note_ns = INT64_MIN;
  Waiting waiting = Waiting::kNothing;  // what the due frame has waited for since the last poll
  Frame written_then = 0;               // last frame written, as of the last poll
  Delay delay = Delay::kNone;           // of the due frame
  std::int64_t suspended_ns = 0;
  std::int64_t frame_began_ns = 0;  // of the last frame that was begun, by clock()
  std::int64_t encoding_ns = 0;     // of the last frame that was made: all but its step
  std::int64_t last_rest_ns = 0;

  std::uint64_t seen_before = 0;  // of roster.seen(), as of the last poll
  StreamSet active_before;        // of source->active()

  FrameReport report;
  HostTotals totals;
  DurationHistogram frame_durations;
  StreamSet unprepared;             // streams that a snapshot is due of and not ready for
  std::vector<InputVerdict> later;  // kept to reuse its memory
  std::vector<std::byte> snapshot;
  std::vector<transport::Received<transport::AckMessage>> acks;
  std::vector<transport::Received<transport::InputMessage>> input_samples;
};

}  // namespace tandem::host
