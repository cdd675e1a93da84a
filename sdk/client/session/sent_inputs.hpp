#pragma once
// The inputs sent in this epoch, and their outcomes.

#include <array>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "sdk/wire/messages.hpp"

namespace tandem::client {

/// The outcome of one input. No input is sent twice, because an input that is late is worth less than the
/// next one.
struct InputOutcome {
  enum class Kind : std::uint8_t {
    kActed,    ///< acted on `frame`, which this client has applied
    kRefused,  ///< the server refused it for `reason`
    kUnknown,  ///< it was lost, or 32 later answers overwrote its answer
    kLost,     ///< it did not act: the server went back to a frame before it. May follow kActed
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
  /// Maximum number of inputs that acted and that a server which goes back can still take back.
  static constexpr std::size_t kMaxActed = 1024;

  std::uint64_t next_number() const { return last_number_ + 1; }
  void on_sent(std::int64_t now_ns, std::vector<InputOutcome>& outcomes);
  void on_reply(const transport::ReplyMessage& reply, std::vector<InputOutcome>& outcomes);
  void on_applied(Frame frame, std::int64_t now_ns, std::vector<InputOutcome>& outcomes);
  /// An epoch begins whose world is that of the one before up to `frame`. What acted later, or was not
  /// answered, is in doubt until the first reply that comes from an account: it says what the server had
  /// decided by then. But what was sent to `entered` when the client was there before may still reach it.
  /// `returns`: it is the epoch that the one before continued.
  void carry_over(Epoch entered, Frame frame, bool returns = false);
  /// Another server, or another connection, goes on with the epoch. It has an account of its own for this
  /// client: unanswered inputs count as unknown.
  void on_another_server(std::vector<InputOutcome>& outcomes);
  /// A new epoch begins, or none: unanswered inputs count as unknown. The numbers continue, because an
  /// earlier server that comes back remembers the outcomes of the numbers it knows.
  void clear(Epoch entered, std::vector<InputOutcome>& outcomes);
  [[nodiscard]] std::size_t pending() const { return pending_.size(); }
  /// True if the outcome of every input of earlier epochs is known.
  [[nodiscard]] bool settled() const;

 private:
  struct Pending {
    std::uint64_t number = 0;
    std::int64_t sent_ns = 0;
    Frame frame = 0;  ///< 0 until the reply names it
    Epoch of = 0;     ///< that it was sent to
  };
  struct Applied {
    Frame frame = 0;
    std::int64_t at_ns = 0;
  };
  struct Doubt {
    std::uint64_t number = 0;
    std::int64_t sent_ns = 0;
    Frame acted = 0;  // the frame with which it was told as kActed; 0: it was not
    Epoch of = 0;     // that it was sent to, or acted in
  };
  struct Acted {
    std::uint64_t number = 0;
    Frame frame = 0;
    Epoch of = 0;  // in which it acted
  };
  void settle(std::vector<InputOutcome>& outcomes);
  void remember(const Acted& acted);
  void resolve(const transport::ReplyMessage& reply, std::vector<InputOutcome>& outcomes);
  void resolve(const Doubt& doubt, const transport::ReplyMessage& reply, std::vector<InputOutcome>& outcomes);

  Epoch epoch_ = 0;
  std::uint64_t last_number_ = 0;
  std::uint64_t first_number_ = 1;  // of this epoch
  std::deque<Pending> pending_;
  std::deque<Acted> acted_;  // the latest
  std::vector<Doubt> doubts_;
  // When the last frames were applied, indexed by frame modulo the array's size: a reply may come after the
  // frame that it names.
  std::array<Applied, 256> applied_at_{};
  Applied last_applied_;
};

}  // namespace tandem::client
