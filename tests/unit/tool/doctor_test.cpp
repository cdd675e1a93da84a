#include "services/tool/doctor.hpp"

#include <gmock/gmock.h>

#include <algorithm>

namespace tandem::tool {
namespace {

MachineFacts good_machine() {
  MachineFacts facts;
  facts.interfaces = {{"lo", "127.0.0.1", true, true, false}, {"eth0", "10.0.0.2", true, false, true}};
  facts.multicast_works = {"eth0"};
  facts.receive_buffer_max_bytes = facts.send_buffer_max_bytes = 8 << 20;
  facts.open_files_limit = 1024;
  return facts;
}

Check check(const MachineFacts& facts, const std::string& name) {
  for (const Check& found : judge(facts)) {
    if (found.name == name) return found;
  }
  ADD_FAILURE() << "no check " << name;
  return {};
}

TEST(Doctor, finds_nothing_wrong_with_a_good_machine) {
  for (const Check& found : judge(good_machine())) {
    EXPECT_EQ(found.verdict, Verdict::kGood) << found.name;
    EXPECT_EQ(found.advice, "") << found.name;
  }
}

TEST(Doctor, fails_without_an_interface) {
  MachineFacts facts = good_machine();
  facts.interfaces.clear();
  EXPECT_EQ(check(facts, "interfaces").verdict, Verdict::kFailure);
}

TEST(Doctor, says_how_to_stay_on_loopback_when_there_is_no_network) {
  MachineFacts facts = good_machine();
  facts.interfaces.resize(1);
  EXPECT_EQ(check(facts, "interfaces").verdict, Verdict::kWarning);
  EXPECT_THAT(check(facts, "interfaces").advice, ::testing::HasSubstr("CYCLONEDDS_URI"));
}

TEST(Doctor, warns_when_multicast_works_nowhere) {
  MachineFacts facts = good_machine();
  facts.multicast_works.clear();
  EXPECT_EQ(check(facts, "multicast").verdict, Verdict::kWarning);
  EXPECT_THAT(check(facts, "multicast").advice, ::testing::HasSubstr("Peers"));
}

TEST(Doctor, names_the_setting_that_is_too_small) {
  MachineFacts facts = good_machine();
  facts.receive_buffer_max_bytes = 212992;
  EXPECT_EQ(check(facts, "receive buffer").verdict, Verdict::kWarning);
  EXPECT_THAT(check(facts, "receive buffer").advice, ::testing::HasSubstr("sysctl -w net.core.rmem_max="));
  EXPECT_EQ(check(facts, "send buffer").verdict, Verdict::kGood);
}

TEST(Doctor, warns_of_a_low_open_files_limit) {
  MachineFacts facts = good_machine();
  facts.open_files_limit = 64;
  EXPECT_EQ(check(facts, "open files").verdict, Verdict::kWarning);
}

TEST(Doctor, fails_where_the_domain_cannot_be_opened) {
  MachineFacts facts = good_machine();
  facts.cyclonedds_uri = "file:///nowhere.xml";
  facts.domain_fault = "DDS domain 0 cannot be opened";
  EXPECT_EQ(check(facts, "CYCLONEDDS_URI").verdict, Verdict::kFailure);
}

TEST(Doctor, warns_of_a_network_without_security) {
  MachineFacts facts = good_machine();
  facts.networks = {"10.0.0.2"};
  EXPECT_EQ(check(facts, "security").verdict, Verdict::kWarning);
  EXPECT_THAT(check(facts, "security").detail, ::testing::HasSubstr("10.0.0.2"));
  EXPECT_THAT(check(facts, "security").advice, ::testing::HasSubstr("--secure"));
}

TEST(Doctor, fails_with_an_identity_that_is_not_good) {
  const MachineFacts facts = machine_facts(0, "/nowhere");
  EXPECT_EQ(check(facts, "security").verdict, Verdict::kFailure);
  EXPECT_THAT(check(facts, "security").detail, ::testing::HasSubstr("/nowhere"));
}

TEST(Doctor, tells_whose_identity_it_is) {
  MachineFacts facts = good_machine();
  facts.secure = "bob";
  facts.identity = transport::secure::Identity{"/bob", "bob", "participant", 1'800'000'000, true};
  EXPECT_EQ(check(facts, "security").verdict, Verdict::kGood);
  EXPECT_EQ(check(facts, "security").detail, "participant bob, until 2027-01-15 08:00:00 UTC");
}

TEST(Doctor, can_look_at_this_machine) {
  const MachineFacts facts = machine_facts(0);
  EXPECT_GT(facts.open_files_limit, 0U);
  EXPECT_EQ(judge(facts).size(), 7U);
}

}  // namespace
}  // namespace tandem::tool
