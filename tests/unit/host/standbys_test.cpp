#include "services/host/succession/standbys.hpp"

#include <gtest/gtest.h>

#include "tests/unit/host/fakes.hpp"

namespace tandem::host {
namespace {

/// A server stands by, holds the checkpoint that it is given, and falls silent.
void stands_by_for_a_while(Standbys& standbys, Outbox& outbox, FakePort& port, transport::ParticipantId who,
                           std::int64_t& now_ns) {
  Notices notices;
  transport::StandbyMessage message;
  message.epoch = 1000;
  message.standby = who.bytes[0] + 1U;
  const auto hear = [&] { standbys.heard({message, who}, notices, now_ns); };
  const auto pass = [&](std::int64_t ns) {
    now_ns += ns;
    standbys.look(port, notices, now_ns);
    while (outbox.pop(std::chrono::nanoseconds(0))) {
    }
  };
  hear();
  port.standby_writers.insert(message.standby);
  pass(kSecond / 5);
  auto checkpoint = std::make_shared<checkpoint::Encoded>();
  checkpoint->moment = {1000, 30};
  checkpoint->bytes.resize(10);
  standbys.offer(checkpoint, now_ns);
  message.holds_frame = 30;
  hear();
  pass(Standbys::kSilentNs);
}

TEST(Standbys, WhoStoodByLatelyMaySucceedHoweverManyCameBefore) {
  Outbox outbox({});
  FakePort port(participant(0));
  Standbys standbys(1000, outbox);
  std::int64_t now_ns = kSecond;
  constexpr std::uint8_t kAll = Standbys::kMaxStoodBy + 20;
  for (std::uint8_t tag = 1; tag <= kAll; ++tag) {
    stands_by_for_a_while(standbys, outbox, port, participant(tag), now_ns);
    ASSERT_TRUE(standbys.may_succeed(participant(tag))) << int{tag};
  }
  EXPECT_FALSE(standbys.may_succeed(participant(1))) << "it is long ago";
}

}  // namespace
}  // namespace tandem::host
