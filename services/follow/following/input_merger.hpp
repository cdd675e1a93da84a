#pragma once
// Merges the inputs of many senders into those of one client.

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sdk/client/session/sent_inputs.hpp"
#include "sdk/wire/messages.hpp"
#include "services/follow/following/world.hpp"
#include "services/host/accounts/input_verdict.hpp"
#include "services/program/token_bucket.hpp"

namespace tandem::following {

/// One of those whose inputs are merged: a viewer of a gateway, a client of a relay.
using SenderId = std::uint64_t;

/// Coalesces gravities: the last one is sent, and its outcome counts for those before it. Other inputs are
/// sent unchanged, at a rate that all senders share. The sum stays below a server's limit for one client. Not
/// thread-safe.
class InputMerger {
 public:
  using Claim = accounts::InputClaim;
  using Verdict = accounts::InputVerdict;

  static constexpr double kGravitiesPerSecond = 20;
  static constexpr double kOthersPerSecond = 30;  ///< also the maximum burst

  /// Maximum number of inputs that acted and that a server which goes back can still take back.
  static constexpr std::size_t kMaxActed = 16'384;

  /// A gravity can stand for earlier ones. So an input that the server would refuse is refused before it is
  /// merged, if that can be known: values that are not finite, another count than its kind has, no such kind.
  [[nodiscard]] static bool well_formed(const transport::InputMessage& input);
  /// Takes one well-formed input, whose claim has its number and kind. Verdicts that are known at once are
  /// appended to `out`, here as below.
  void add(SenderId sender, transport::InputMessage input, FollowedWorld& world, std::int64_t now_ns,
           std::vector<Verdict>& out);
  /// Sends what waits and is due.
  void flush(FollowedWorld& world, std::int64_t now_ns, std::vector<Verdict>& out);
  void on_outcome(const client::InputOutcome& outcome, std::vector<Verdict>& out);
  /// Begins a new epoch: outcomes of the old epoch's inputs are not reported.
  void clear();
  /// Begins a new epoch that shares a history with the one before: outcomes go on. What was not sent yet is
  /// lost.
  void carry_over(std::vector<Verdict>& out);

  [[nodiscard]] bool waiting() const { return !gravity_claims_.empty(); }
  [[nodiscard]] std::uint64_t sent() const { return sent_; }

 private:
  void send(const transport::InputMessage& input, std::vector<Claim> claims, FollowedWorld& world,
            std::int64_t now_ns, std::vector<Verdict>& out);

  transport::InputMessage gravity_;  // the last one
  std::vector<Claim> gravity_claims_;
  accounts::TokenBucket gravities_{kGravitiesPerSecond, 1};
  accounts::TokenBucket others_{kOthersPerSecond, kOthersPerSecond};
  std::map<std::uint64_t, std::vector<Claim>> unanswered_;  // by the number that it was sent under
  struct Acted {
    std::uint64_t number = 0;
    Claim claim;
  };
  std::deque<Acted> acted_;  // the latest
  std::uint64_t sent_ = 0;
};

}  // namespace tandem::following
