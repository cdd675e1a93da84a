#include "sdk/client/session/sent_inputs.hpp"

#include <algorithm>

namespace tandem::client {

void SentInputs::on_sent(std::int64_t now_ns, std::vector<InputOutcome>& outcomes) {
  pending_.push_back({++last_number_, now_ns, 0, epoch_});
  if (pending_.size() <= kMaxPending) return;
  outcomes.push_back({InputOutcome::Kind::kUnknown, pending_.front().number, 0, 0, 0});
  pending_.pop_front();
}

void SentInputs::carry_over(Epoch entered, Frame frame, bool returns) {
  SentInputs next;
  next.epoch_ = entered;
  next.last_number_ = last_number_;
  next.first_number_ = last_number_ + 1;
  for (const Doubt& doubt : doubts_) {
    if (doubt.of != entered) {
      next.doubts_.push_back(doubt);
    } else if (doubt.acted != 0) {
      next.remember({doubt.number, doubt.acted, doubt.of});
    } else {
      next.pending_.push_back({doubt.number, doubt.sent_ns, 0, doubt.of});
    }
  }
  for (const Acted& acted : acted_) {
    // The epoch that is left has what acted before it from the epoch that it continues.
    const bool acted_there = acted.of == entered || (returns && acted.number < first_number_);
    if (acted.frame > frame && !acted_there) {
      next.doubts_.push_back({acted.number, 0, acted.frame, acted.of});
    } else {
      next.acted_.push_back(acted);  // the epoch after this one may take it back
    }
  }
  for (const Pending& input : pending_) {
    if (input.of == entered || (input.frame != 0 && input.frame <= frame)) {
      next.pending_.push_back(input);  // this client has yet to see it
    } else {
      next.doubts_.push_back({input.number, input.sent_ns, 0, input.of});
    }
  }
  constexpr std::size_t kMaxDoubts = kMaxPending + kMaxActed;
  if (next.doubts_.size() > kMaxDoubts)
    next.doubts_.erase(next.doubts_.begin(), next.doubts_.end() - kMaxDoubts);
  *this = std::move(next);
}

// A reply without an account says nothing of inputs; its reason is another.
void SentInputs::resolve(const transport::ReplyMessage& reply, std::vector<InputOutcome>& outcomes) {
  if (doubts_.empty()) return;
  const auto reason = static_cast<transport::Reason>(reply.reason);
  if (reason != transport::Reason::kNone && reason != transport::Reason::kDemoted) return;
  for (const Doubt& doubt : doubts_) resolve(doubt, reply, outcomes);
  doubts_.clear();
}

void SentInputs::resolve(const Doubt& doubt, const transport::ReplyMessage& reply,
                         std::vector<InputOutcome>& outcomes) {
  const auto entry = std::find_if(reply.entries.begin(), reply.entries.end(),
                                  [&](const transport::ReplyEntry& e) { return e.number == doubt.number; });
  const bool listed = entry != reply.entries.end();
  // If the server has handled an input of this epoch already, only the list tells about earlier ones.
  const bool decided = listed || (doubt.number <= reply.highest_input && reply.highest_input < first_number_);
  if (!decided) {
    outcomes.push_back({InputOutcome::Kind::kLost, doubt.number, 0, 0, 0});
  } else if (doubt.acted != 0) {
    remember({doubt.number, doubt.acted, doubt.of});
  } else if (!listed) {
    outcomes.push_back({InputOutcome::Kind::kUnknown, doubt.number, 0, 0, 0});
  } else if (entry->code != static_cast<std::uint32_t>(transport::Reason::kNone)) {
    outcomes.push_back({InputOutcome::Kind::kRefused, doubt.number, 0, entry->code, 0});
  } else {
    pending_.push_back({doubt.number, doubt.sent_ns, std::max<Frame>(1, entry->frame), doubt.of});
  }
}

void SentInputs::on_reply(const transport::ReplyMessage& reply, std::vector<InputOutcome>& outcomes) {
  resolve(reply, outcomes);
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
    remember({input.number, input.frame, epoch_});
    return true;
  });
}

void SentInputs::remember(const Acted& acted) {
  acted_.push_back(acted);
  if (acted_.size() > kMaxActed) acted_.pop_front();
}

bool SentInputs::settled() const {
  const auto is_earlier = [this](const Pending& input) { return input.number < first_number_; };
  return doubts_.empty() && std::none_of(pending_.begin(), pending_.end(), is_earlier);
}

void SentInputs::on_another_server(std::vector<InputOutcome>& outcomes) {
  std::erase_if(pending_, [&outcomes](const Pending& input) {
    if (input.frame != 0) return false;  // it acts, and this client has yet to see it
    outcomes.push_back({InputOutcome::Kind::kUnknown, input.number, 0, 0, 0});
    return true;
  });
}

void SentInputs::clear(Epoch entered, std::vector<InputOutcome>& outcomes) {
  for (const Pending& input : pending_) {
    outcomes.push_back({InputOutcome::Kind::kUnknown, input.number, 0, 0, 0});
  }
  for (const Doubt& doubt : doubts_) {
    if (doubt.acted == 0) outcomes.push_back({InputOutcome::Kind::kUnknown, doubt.number, 0, 0, 0});
  }
  const std::uint64_t last_number = last_number_;
  *this = SentInputs();
  epoch_ = entered;
  last_number_ = last_number;
  first_number_ = last_number + 1;
}

}  // namespace tandem::client
