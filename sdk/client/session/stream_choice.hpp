#pragma once
// Which of a session's streams suits this client, at first and as it plays: idl/STATES.md, "The choice of a
// stream".

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/statistics/duration_histogram.hpp"
#include "sdk/transport/messages.hpp"
#include "sdk/transport/units.hpp"

namespace tandem::client {

/// What an application wants of a stream before all else.
struct StreamPreference {
  enum class Kind : std::uint8_t {
    kAutomatic,  ///< fewest bits, where the step takes a small part of a frame
    kBandwidth,  ///< fewest bits that the processor keeps up with
    kComputing,  ///< cheapest step
    kError,      ///< smallest threshold that the processor keeps up with
    kNamed,      ///< this one, and no other while it is there
  };
  Kind kind = Kind::kAutomatic;
  std::string name = {};  ///< of kNamed
};
/// "", "auto", "bandwidth", "computing", "error", or else a stream's name or number.
[[nodiscard]] StreamPreference read_preference(std::string_view text);

/// One of a session's streams that this build can play.
struct StreamOffer {
  std::size_t index = 0;  ///< in SessionMessage::streams
  StreamId id;
  std::string name;
  bool is_ballistic = false;
  double threshold = 0;     ///< scene units
  double per_body_ns = 0;   ///< of a client's predicted step and hash, on the server's machine
  double announced_ns = 0;  ///< the same of all slots
};
/// Those listed in `playable`, indices into the session's streams, with the names of the scene's text, or
/// their numbers.
[[nodiscard]] std::vector<StreamOffer> list_offers(const transport::SessionMessage& session,
                                                   const std::vector<std::size_t>& playable);

/// Time of this machine for a `ballistic` step and hash of one body, ns, over about 20 ms. Nothing where the
/// clock stands still, or there is none.
[[nodiscard]] std::optional<double> measure_own_step(std::int64_t (*clock_ns)());

/// Decides by what streams cost, in bits and in time: as announced at first, then as seen. Sans-I/O, not
/// thread-safe.
class StreamChooser {
 public:
  /// A frame may take this part of its period before a stream is left for a cheaper one...
  static constexpr double kMostShare = 0.5;
  /// ...and a step this part for a stream to be taken where nobody states a preference.
  static constexpr double kEasyShare = 0.1;
  static constexpr std::int64_t kLookNs = kSecond;  ///< between decisions
  /// Seconds in a row in which something has to be so.
  static constexpr int kSlowSeconds = 3, kStarvedSeconds = 5, kBetterSeconds = 5;
  /// A better stream is worth a change from this part of the other's cost on.
  static constexpr double kWorthwhile = 0.7;
  /// No change for a better one so soon after a change; doubled with each, up to kMostDwellNs.
  static constexpr std::int64_t kDwellNs = 20 * kSecond, kMostDwellNs = 600 * kSecond;
  /// A stream that was left for trouble is not taken again for so long; doubled each time, up to
  /// kMostBarredNs.
  static constexpr std::int64_t kBarredNs = 60 * kSecond, kMostBarredNs = 960 * kSecond;
  /// What a stream costs the link is forgotten so long after somebody played it.
  static constexpr std::int64_t kKnownNs = 60 * kSecond;
  /// A join that takes longer makes a stream of fewer bits worth a try.
  static constexpr std::int64_t kLongJoinNs = 10 * kSecond;

  /// `offers`: at least one. `own_step_ns`: see measure_own_step().
  StreamChooser(std::vector<StreamOffer> offers, StreamPreference preference, double period_ns,
                std::optional<double> own_step_ns);

  /// The stream to play or join.
  [[nodiscard]] const StreamOffer& chosen() const { return offers_[chosen_].offer; }
  /// Why, for a human; in few words.
  [[nodiscard]] const std::string& reason() const { return reason_; }

  void on_status(const transport::ServerStatusMessage& status);
  /// A frame of the chosen stream was applied. `cost_ns`: of this thread; 0 where nothing is measured.
  void on_frame(std::int64_t cost_ns);
  /// The stream was lost, and has to be joined again.
  void on_loss(std::int64_t now_ns);

  struct Seen {
    std::int64_t now_ns = 0;
    /// While joining: since when nothing of a snapshot has come. Nothing while playing.
    std::optional<std::int64_t> idle_since_ns = {};
    std::int64_t round_trip_ns = 0;  ///< 0: unknown
  };
  /// The application wants something else: the next reconsider() chooses as at first.
  void prefer(StreamPreference preference);
  /// True when another stream is to be played from now on: chosen() and reason() then say which and why.
  [[nodiscard]] bool reconsider(const Seen& seen);
  /// What a client follows when a session is announced anew: `chosen` is played, or on its way while `before`
  /// is.
  void keep(const StreamId& chosen, const StreamId& before);
  /// The change did not come about: the stream of before is chosen again.
  void gave_up(std::int64_t now_ns);

 private:
  struct Candidate {
    StreamOffer offer;
    double bits_per_s = 0;   // payload, as the server or this client saw it last; 0: unknown
    double measured_ns = 0;  // a frame here, when it was played last; 0: unknown
    bool is_played = false;  // by anybody, since the last look
    std::int64_t played_ns = INT64_MIN;
    std::int64_t barred_until_ns = INT64_MIN;
    std::int64_t barred_ns = kBarredNs;  // the next time
    bool is_unreachable = false;  // could not be joined: barred even where trouble elsewhere would not count
  };
  struct Best {
    std::size_t index = 0;
    const char* why = "";
  };

  /// Returns why.
  std::string choose_first();
  [[nodiscard]] double cost_ns(const Candidate& candidate) const;
  /// What `a` costs, in parts of what `b` does.
  [[nodiscard]] static double relative_cost(const Candidate& a, const Candidate& b);
  [[nodiscard]] bool fits(const Candidate& candidate, double share) const;
  [[nodiscard]] bool fewer_bits(const Candidate& a, const Candidate& b) const;
  template <class Admits, class Less>
  [[nodiscard]] std::optional<std::size_t> best_of(std::int64_t now_ns, Admits&& admits, Less&& less) const;
  [[nodiscard]] std::size_t cheapest(std::int64_t now_ns) const;
  [[nodiscard]] Best best(std::int64_t now_ns) const;
  [[nodiscard]] bool worthwhile(const Candidate& other, const Candidate& present) const;
  void look_at_last_second(const Seen& seen);
  void forget_old_figures(std::int64_t now_ns);
  [[nodiscard]] std::optional<std::size_t> find(const StreamId& stream) const;
  [[nodiscard]] std::optional<std::size_t> find_named() const;
  [[nodiscard]] bool starved(const Seen& seen) const;
  bool leave_for(std::optional<std::size_t> other, std::string why, std::int64_t now_ns);
  bool leave_slow(std::int64_t now_ns);
  bool leave_link(const std::string& what, std::int64_t now_ns);
  void change(std::size_t to, std::string why, std::int64_t now_ns);

  std::vector<Candidate> offers_;
  StreamPreference preference_;
  bool is_new_preference_ = false;
  double period_ns_;
  double slowness_ = 1;  // of this machine against the server's
  std::size_t chosen_ = 0, before_ = 0;
  std::string reason_, reason_before_;

  std::int64_t looked_ns_ = INT64_MIN, changed_ns_ = INT64_MIN;
  std::int64_t dwell_ns_ = kDwellNs;
  // Since the last look.
  DurationHistogram costs_;
  std::uint64_t frames_ = 0;
  // Over several.
  int slow_seconds_ = 0, starved_seconds_ = 0, better_seconds_ = 0;
  std::size_t better_ = 0;
  std::vector<std::int64_t> losses_ns_;
  std::int64_t best_round_trip_ns_ = 0;
};

}  // namespace tandem::client
