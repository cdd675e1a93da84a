#pragma once
// Chooses the stream of a session that suits this client, at first and while it plays: idl/STATES.md, "The
// choice of a stream".

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/statistics/duration_histogram.hpp"
#include "sdk/wire/messages.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::client {

/// The preference of an application when a stream is chosen.
struct StreamPreference {
  enum class Kind : std::uint8_t {
    kAutomatic,  ///< the fewest bits, if the step takes a small part of a frame
    kBandwidth,  ///< the fewest bits among the streams that the processor keeps up with
    kComputing,  ///< the step that takes the least time
    kError,      ///< the minimum threshold among the streams that the processor keeps up with
    kNamed,      ///< the named stream, and no other while it exists
  };
  Kind kind = Kind::kAutomatic;
  std::string name = {};  ///< for kNamed
};
/// Reads "", "auto", "bandwidth", "computing" or "error"; any other text is a stream's name or number.
[[nodiscard]] StreamPreference read_preference(std::string_view text);

/// One of a session's streams that this build can play.
struct StreamOffer {
  std::size_t index = 0;  ///< index in SessionMessage::streams
  StreamId id;
  std::string name;
  bool is_ballistic = false;
  double threshold = 0;          ///< scene units
  double per_body_ns = 0;        ///< cost of a client's predicted step and hash, on the server's machine
  double announced_ns = 0;       ///< the same cost for all slots
  std::uint32_t cap_kbit_s = 0;  ///< that the server keeps; 0: none
  double first_threshold = 0;    ///< as announced; `threshold` is the one in force
  std::uint32_t misfit = 0;      ///< how far the delay is from what the client wants; only to be compared
  bool suits_others = false;  ///< another one differs by its delay alone and suits the client better: it is
                              ///< played by name or number only
};
/// The offers for `playable`, which holds indices into the session's streams. A stream without a name is
/// called by the number of the offer that encodes. Of those that differ in their delay alone, the greatest
/// delay that is not above `max_delay_ms` suits best, or the shortest if all are above.
[[nodiscard]] std::vector<StreamOffer> list_offers(const transport::SessionMessage& session,
                                                   const std::vector<std::size_t>& playable,
                                                   std::uint32_t max_delay_ms);

/// Measures this machine's time for a `ballistic` step and hash of one body, ns, over about 20 ms. Empty if
/// the clock stands still or there is none.
[[nodiscard]] std::optional<double> measure_own_step(std::int64_t (*clock_ns)());

/// Decides by the costs of streams, in bits and in time: first as announced, then as observed. Sans-I/O. Not
/// thread-safe.
class StreamChooser {
 public:
  /// Maximum part of its period that a frame may take before the client leaves the stream for a cheaper
  /// one...
  static constexpr double kMaxShare = 0.5;
  /// ...and maximum part that a step may take for the automatic choice to take a stream.
  static constexpr double kEasyShare = 0.1;
  /// A frame that takes so many periods cannot be afforded for a second: any other stream is better, whatever
  /// the server announces.
  static constexpr double kHopelessShare = 4;
  static constexpr std::int64_t kLookNs = kSecond;  ///< time between decisions
  /// Minimum time after a change before one that the application does not ask for.
  static constexpr std::int64_t kLeastStayNs = 2 * kSecond;
  /// How many consecutive seconds a condition must hold.
  static constexpr int kSlowSeconds = 3, kStarvedSeconds = 5, kBetterSeconds = 5;
  /// A change is worthwhile if the better stream costs less than this part of the present one.
  static constexpr double kWorthwhile = 0.7;
  /// Minimum time after a change before a change to a better stream; doubled with each change, up to
  /// kMaxDwellNs.
  static constexpr std::int64_t kDwellNs = 20 * kSecond, kMaxDwellNs = 600 * kSecond;
  /// A stream that was left because of trouble is not taken again for this time; doubled each time, up to
  /// kMaxBarredNs.
  static constexpr std::int64_t kBarredNs = 60 * kSecond, kMaxBarredNs = 960 * kSecond;
  /// A stream's bit rate is forgotten this long after it was last played.
  static constexpr std::int64_t kKnownNs = 60 * kSecond;
  /// A stream that takes more than the client's cap, and kTolerance more, for so many seconds is left.
  static constexpr int kOverSeconds = 5;
  static constexpr double kTolerance = 1.05;
  /// If a join takes longer than this, a stream with fewer bits is worth a try.
  static constexpr std::int64_t kLongJoinNs = 10 * kSecond;

  /// `offers`: at least one. `own_step_ns`: see measure_own_step(). `cap_kbit_s`: what the client may take on
  /// the network; 0: no cap.
  StreamChooser(std::vector<StreamOffer> offers, StreamPreference preference, double period_ns,
                std::optional<double> own_step_ns, std::uint32_t cap_kbit_s = 0);

  /// The stream to play or join.
  [[nodiscard]] const StreamOffer& chosen() const {
    TANDEM_ASSERT(chosen_ < offers_.size());  // so there is at least one
    return offers_[chosen_].offer;
  }
  /// Why it was chosen: a short text for a human.
  [[nodiscard]] const std::string& reason() const { return reason_; }
  /// True while a status that was not heard yet may change the first choice.
  [[nodiscard]] bool wants_status() const;
  /// If no stream that may be played was within the client's cap, as far as is known, when one was chosen or
  /// the one that is played went above it: the smallest cap with which one would be; 0: not known.
  [[nodiscard]] std::optional<std::uint32_t> needed_kbit_s() const;
  /// Chooses as at first, by what statuses have told until now.
  void choose_anew();

  void on_status(const transport::ServerStatusMessage& status);
  /// A frame of the chosen stream was applied. `cost_ns`: time of this thread; 0 if it is not measured.
  void on_frame(std::int64_t cost_ns);
  /// The stream was lost and has to be rejoined.
  void on_loss(std::int64_t now_ns);

  struct Seen {
    std::int64_t now_ns = 0;
    /// While joining: the time since which no part of a snapshot has come. Empty while playing.
    std::optional<std::int64_t> idle_since_ns = {};
    std::int64_t round_trip_ns = 0;  ///< 0: unknown
    std::uint64_t wire_bytes = 0;    ///< that this client took on the network since its start; 0: unknown
  };
  /// The application changed its preference: the next reconsider() chooses as at first.
  void prefer(StreamPreference preference);
  /// True if another stream is to be played from now on: chosen() and reason() say which and why.
  [[nodiscard]] bool reconsider(const Seen& seen);
  /// Keeps the choice when a session is announced again: `chosen` is played, or is joined while `before` is
  /// played.
  void keep(const StreamId& chosen, const StreamId& before);
  /// The change failed: the previous stream is chosen again.
  void gave_up(std::int64_t now_ns);

 private:
  struct Candidate {
    StreamOffer offer;
    double bits_per_s = 0;       // payload rate, as the server or this client measured it last; 0: unknown
    double measured_ns = 0;      // time of a frame on this machine when it was played last; 0: unknown
    double told_mbit_per_s = 0;  // by the last status
    bool is_told = false;        // a status spoke of it
    double wire_kbit_s = 0;      // on the network, by the last status; 0: unknown
    double over_kbit_s = 0;      // with which it was above the client's cap; 0: it was not
    bool is_played = false;  // some client has played it since the last look, or the server has measured it
    std::int64_t played_ns = INT64_MIN;
    std::int64_t barred_until_ns = INT64_MIN;
    std::int64_t barred_ns = kBarredNs;  // length of the next ban
    bool is_unreachable = false;  // could not be joined: barred even where trouble would not count for others
  };
  struct Best {
    std::size_t index = 0;
    const char* why = "";
  };

  /// Chooses as at first; returns the reason.
  std::string choose_first();
  [[nodiscard]] double cost_ns(const Candidate& candidate) const;
  /// The cost of `a` divided by the cost of `b`.
  [[nodiscard]] static double relative_cost(const Candidate& a, const Candidate& b);
  [[nodiscard]] bool fits(const Candidate& candidate, double share) const;
  [[nodiscard]] static bool fewer_bits(const Candidate& a, const Candidate& b);
  template <class Admits, class Less>
  [[nodiscard]] std::optional<std::size_t> best_of(std::int64_t now_ns, Admits&& admits, Less&& less) const;
  [[nodiscard]] std::size_t cheapest(std::int64_t now_ns) const;
  [[nodiscard]] Best best(std::int64_t now_ns) const;
  [[nodiscard]] bool worthwhile(const Candidate& other, const Candidate& present) const;
  // stream_cap.cpp
  /// What the stream takes on the network, as far as is known; else 0.
  [[nodiscard]] static double takes_kbit_s(const Candidate& candidate);
  [[nodiscard]] bool within_cap(const Candidate& candidate) const;
  /// Under a cap: the smaller error, as far as is known.
  [[nodiscard]] static bool finer(const Candidate& a, const Candidate& b);
  [[nodiscard]] bool worthwhile_under_cap(const Candidate& other, const Candidate& present) const;
  [[nodiscard]] std::optional<std::size_t> best_within_cap(std::int64_t now_ns) const;
  [[nodiscard]] bool awaits_wire() const;
  bool leave_for_cap(const Seen& seen);

  void look_at_last_second(const Seen& seen);
  void forget_old_figures(std::int64_t now_ns);
  template <class Is>
  [[nodiscard]] std::optional<std::size_t> find(Is&& is) const;
  [[nodiscard]] std::optional<std::size_t> find_named() const;
  [[nodiscard]] bool starved(const Seen& seen) const;
  static void bar(Candidate& candidate, std::int64_t now_ns);
  [[nodiscard]] bool changed_lately(std::int64_t now_ns) const {
    return left_ns_ && now_ns - *left_ns_ < kLeastStayNs;
  }
  bool leave_for(std::optional<std::size_t> other, std::string why, std::int64_t now_ns);
  bool leave_slow(bool hopeless, std::int64_t now_ns);
  bool leave_link(const std::string& what, std::int64_t now_ns);
  void change(std::size_t to, std::string why, std::int64_t now_ns);

  std::vector<Candidate> offers_;
  StreamPreference preference_;
  bool is_new_preference_ = false;
  double period_ns_;
  std::uint32_t cap_kbit_s_;  // 0: none
  bool is_over_ = false;      // nothing is within the cap
  double slowness_ = 1;       // time of this machine divided by the server's
  std::size_t chosen_ = 0, before_ = 0;
  std::string reason_, reason_before_;

  std::int64_t looked_ns_ = INT64_MIN, changed_ns_ = INT64_MIN;
  std::optional<std::int64_t> left_ns_;  // when it last changed
  std::int64_t dwell_ns_ = kDwellNs;
  // Since the last look.
  DurationHistogram costs_;
  std::uint64_t frames_ = 0;
  // Over several looks.
  int slow_seconds_ = 0, starved_seconds_ = 0, better_seconds_ = 0, over_seconds_ = 0;
  std::uint64_t wire_bytes_ = 0;  // at the last look
  std::size_t better_ = 0;
  std::vector<std::int64_t> losses_ns_;
  std::int64_t best_round_trip_ns_ = 0;
};

}  // namespace tandem::client
