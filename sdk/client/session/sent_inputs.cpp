#include "sdk/client/session/sent_inputs.hpp"

#include <algorithm>

namespace tandem::client {

void SentInputs::on_sent(std::int64_t now_ns, std::vector<InputOutcome>& outcomes) {
  pending_.push_back({++last_number_, now_ns, 0});
  if (pending_.size() <= kMaxPending) return;
  outcomes.push_back({InputOutcome::Kind::kUnknown, pending_.front().number, 0, 0, 0});
  pending_.pop_front();
}

void SentInputs::on_reply(const transport::ReplyMessage& reply, std::vector<InputOutcome>& outcomes) {
  std::erase_if(pending_, [&](Pending& input) {
    if (input.frame != 0 || input.number > reply.highest_input) return false;
    const auto entry = std::find_if(reply.entries.begin(), reply.entries.end(),
                                    [&](const transport::ReplyEntry& e) { return e.number == input.number; });
    if (entry == reply.entries.end()) {
      outcomes.push_back({InputOutcome::Kind::kUnknown, input.number, 0, 0, 0});
      return true;
    }
    if (entry->code != static_cast<std::uint32_t>(transport::Reason::kNone)) {
      const auto of = std::find_if(reply.texts.begin(), reply.texts.end(),
                                   [&](const transport::ReplyText& t) { return t.number == input.number; });
      outcomes.push_back({InputOutcome::Kind::kRefused, input.number, 0, entry->code, 0,
                          of != reply.texts.end() ? of->text : std::string()});
      return true;
    }
    input.frame = std::max<Frame>(1, entry->frame);
    return false;
  });
  settle(outcomes);
}

void SentInputs::on_applied(Frame frame, std::int64_t now_ns, std::vector<InputOutcome>& outcomes) {
  last_applied_ = {frame, now_ns};
  applied_at_[static_cast<std::size_t>(frame % applied_at_.size())] = last_applied_;
  if (!pending_.empty()) settle(outcomes);
}

void SentInputs::settle(std::vector<InputOutcome>& outcomes) {
  std::erase_if(pending_, [&](const Pending& input) {
    if (input.frame == 0 || input.frame > last_applied_.frame) return false;
    // A rejoin may have skipped the frame. Then the newest state is the one that shows the input.
    const Applied& exact = applied_at_[static_cast<std::size_t>(input.frame % applied_at_.size())];
    const std::int64_t at_ns = exact.frame == input.frame ? exact.at_ns : last_applied_.at_ns;
    outcomes.push_back({InputOutcome::Kind::kActed, input.number, input.frame, 0,
                        std::max<std::int64_t>(0, at_ns - input.sent_ns)});
    return true;
  });
}

void SentInputs::clear(std::vector<InputOutcome>& outcomes) {
  for (const Pending& input : pending_) {
    outcomes.push_back({InputOutcome::Kind::kUnknown, input.number, 0, 0, 0});
  }
  const std::uint64_t last_number = last_number_;
  *this = SentInputs();
  last_number_ = last_number;
}

}  // namespace tandem::client
