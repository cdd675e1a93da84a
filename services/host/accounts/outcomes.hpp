#pragma once
// The outcomes of the inputs of one client.

#include <cstdint>
#include <string>
#include <vector>

#include "sdk/wire/messages.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::accounts {

/// The last kReplyRing outcomes, oldest first. Not thread-safe.
class Outcomes {
 public:
  /// An outcome is repeated for this time. Replies are reliable, so only the newest one may be lost with a
  /// link.
  static constexpr std::int64_t kToldNs = 5 * kSecond;

  /// `text`: the words of the simulation that refused the input; empty if there are none.
  void add(const transport::ReplyEntry& entry, std::int64_t now_ns, std::string text = {});
  [[nodiscard]] bool has(std::uint64_t number) const;
  /// Forgets what was said of that input.
  void take_back(std::uint64_t number);
  /// All that are kept are told again, as if they were known from now on.
  void renew(std::int64_t now_ns);
  /// All that are kept, oldest first.
  [[nodiscard]] std::vector<transport::ReplyEntry> entries() const;
  /// Fills in the entries and texts of a reply that is made now. Of more than kMaxReplyTexts texts the newest
  /// are told.
  void tell(transport::ReplyMessage& reply, std::int64_t now_ns) const;

 private:
  struct Outcome {
    transport::ReplyEntry entry;
    std::int64_t at_ns = 0;
    std::string text;
  };
  std::vector<Outcome> outcomes_;
};

}  // namespace tandem::accounts
