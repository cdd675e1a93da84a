#pragma once
// The inputs sent in this epoch, and their outcomes.

#include <array>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <vector>

#include "sdk/transport/messages.hpp"

namespace tandem::client {

/// The outcome of one input. No input is sent twice, because an input that is late is worth less than the
/// next one.
struct InputOutcome {
  enum class Kind : std::uint8_t {
    kActed,    ///< acted on `frame`, which this client has applied
    kRefused,  ///< the server refused it for `reason`
    kUnknown,  ///< it was lost, or 32 later answers overwrote its answer
  };
  Kind kind = Kind::kActed;
  std::uint64_t number = 0;
  Frame frame = 0;
  std::uint32_t reason = 0;     ///< transport::Reason
  std::int64_t latency_ns = 0;  ///< kActed: from sending to applying the frame it acted on
  std::string text = {};        ///< kRefused: the simulation's own words; empty if it gave none
};

/// Numbers inputs 1, 2, ... and matches the replies with them. Bounded. Not thread-safe.
class SentInputs {
 public:
  /// Maximum number of unanswered inputs held; beyond it the oldest counts as unknown.
  static constexpr std::size_t kMaxPending = 256;

  std::uint64_t next_number() const { return last_number_ + 1; }
  void on_sent(std::int64_t now_ns, std::vector<InputOutcome>& outcomes);
  void on_reply(const transport::ReplyMessage& reply, std::vector<InputOutcome>& outcomes);
  void on_applied(Frame frame, std::int64_t now_ns, std::vector<InputOutcome>& outcomes);
  /// A new epoch begins: unanswered inputs count as unknown. The numbers continue, because an earlier server
  /// that comes back remembers the outcomes of the numbers it knows.
  void clear(std::vector<InputOutcome>& outcomes);
  [[nodiscard]] std::size_t pending() const { return pending_.size(); }

 private:
  struct Pending {
    std::uint64_t number = 0;
    std::int64_t sent_ns = 0;
    Frame frame = 0;  ///< 0 until the reply names it
  };
  struct Applied {
    Frame frame = 0;
    std::int64_t at_ns = 0;
  };
  void settle(std::vector<InputOutcome>& outcomes);

  std::uint64_t last_number_ = 0;
  std::deque<Pending> pending_;
  // When the last frames were applied, indexed by frame modulo the array's size: a reply may come after the
  // frame that it names.
  std::array<Applied, 256> applied_at_{};
  Applied last_applied_;
};

}  // namespace tandem::client
