#include "services/doctor/doctor.hpp"

#include <gmock/gmock.h>

#include <cstdlib>

#include "services/doctor/configuration.hpp"

namespace tandem::doctor {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

MachineFacts good_machine() {
  MachineFacts facts;
  facts.interfaces = {{"lo", "127.0.0.1", true, true, false, 65536},
                      {"eth0", "10.0.0.2", true, false, true, 1500}};
  facts.multicast_works = {"eth0"};
  facts.receive_buffer_max_bytes = facts.send_buffer_max_bytes = 8 << 20;
  facts.open_files_limit = 1024;
  facts.clock_s = 1'800'000'000;
  facts.first_ephemeral_port = 32768;
  facts.last_ephemeral_port = 60999;
  facts.participants = {{"tandem doctor", "host", {"10.0.0.2"}, true}};
  return facts;
}

MachineFacts client_over_wan() {
  MachineFacts facts = good_machine();
  facts.profile_text = "wan:server=203.0.113.5";
  facts.profile = transport::Profile{"wan", {"203.0.113.5:7410"}, {"eth0"}, "", 0};
  facts.max_message_bytes = 1232;
  facts.paths = {{"203.0.113.5:7410", "10.0.0.2", 1500, false}};
  facts.participants.push_back({"tandemd default", "far", {"203.0.113.5"}, false});
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
  for (const MachineFacts& facts : {good_machine(), client_over_wan()}) {
    for (const Check& found : judge(facts)) {
      EXPECT_EQ(found.verdict, Verdict::kGood) << found.name << ": " << found.detail;
      EXPECT_EQ(found.advice, "") << found.name;
    }
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
  EXPECT_THAT(check(facts, "interfaces").advice, HasSubstr("CYCLONEDDS_URI"));
}

TEST(Doctor, warns_when_multicast_works_nowhere) {
  MachineFacts facts = good_machine();
  facts.multicast_works.clear();
  EXPECT_EQ(check(facts, "multicast").verdict, Verdict::kWarning);
  EXPECT_THAT(check(facts, "multicast").advice, HasSubstr("--profile wan"));
}

TEST(Doctor, names_the_setting_that_is_too_small) {
  MachineFacts facts = good_machine();
  facts.receive_buffer_max_bytes = 212992;
  EXPECT_EQ(check(facts, "receive buffer").verdict, Verdict::kWarning);
  EXPECT_THAT(check(facts, "receive buffer").advice, HasSubstr("sysctl -w net.core.rmem_max="));
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

TEST(Doctor, fails_where_the_profile_cannot_be_used) {
  MachineFacts facts = good_machine();
  facts.profile_text = "lan:interface=eth9";
  facts.domain_fault = "profile lan: there is no interface 'eth9'";
  EXPECT_EQ(check(facts, "profile").verdict, Verdict::kFailure);
  EXPECT_THAT(check(facts, "profile").detail, HasSubstr("no interface 'eth9'"));
  EXPECT_EQ(check(facts, "peers").verdict, Verdict::kWarning);
}

TEST(Doctor, says_that_a_profile_stands_above_the_environment) {
  MachineFacts facts = client_over_wan();
  facts.cyclonedds_uri = "<CycloneDDS/>";
  EXPECT_THAT(check(facts, "profile").detail, HasSubstr("CYCLONEDDS_URI is set too, and not used"));
}

TEST(Doctor, warns_where_cyclone_would_choose_a_network) {
  MachineFacts facts = good_machine();
  facts.interfaces.push_back({"docker0", "172.17.0.1", true, false, true, 1500});
  EXPECT_EQ(check(facts, "interfaces").verdict, Verdict::kWarning);
  EXPECT_THAT(check(facts, "interfaces").advice, HasSubstr("--profile lan:interface=eth0"));
  facts.cyclonedds_uri = "<CycloneDDS/>";
  EXPECT_EQ(check(facts, "interfaces").verdict, Verdict::kWarning) << "it names none";
  facts.uri_names_interface = true;
  EXPECT_EQ(check(facts, "interfaces").verdict, Verdict::kGood) << "the user has chosen";
}

TEST(Doctor, warns_when_the_interface_that_dds_uses_carries_no_multicast) {
  MachineFacts facts = good_machine();
  facts.multicast_works = {"lo", "eth0"};
  facts.interfaces[1].multicast = false;  // the system still loops it back
  EXPECT_EQ(check(facts, "multicast").verdict, Verdict::kWarning);
}

TEST(Doctor, warns_of_packets_that_do_not_fit) {
  MachineFacts facts = good_machine();
  facts.interfaces[1].mtu = 1400;
  EXPECT_EQ(check(facts, "MTU").verdict, Verdict::kWarning);
  EXPECT_THAT(check(facts, "MTU").advice, HasSubstr("--profile wan"));
  facts = client_over_wan();
  facts.paths[0].mtu = 1259;
  EXPECT_EQ(check(facts, "MTU").verdict, Verdict::kWarning);
  EXPECT_THAT(check(facts, "MTU").advice, HasSubstr("raise the MTU on the way to 1260 bytes"));
  facts.paths[0].mtu = 1280;
  EXPECT_EQ(check(facts, "MTU").verdict, Verdict::kGood);
}

TEST(Doctor, judges_the_clock) {
  MachineFacts facts = good_machine();
  facts.clock_synchronised = false;
  EXPECT_EQ(check(facts, "clock").verdict, Verdict::kWarning);
  EXPECT_THAT(check(facts, "clock").advice, HasSubstr("timedatectl set-ntp true"));
  facts.clock_s = 0;
  EXPECT_EQ(check(facts, "clock").verdict, Verdict::kFailure);
}

TEST(Doctor, judges_the_ports) {
  MachineFacts facts = good_machine();
  facts.domain = 101;
  EXPECT_EQ(check(facts, "ports").verdict, Verdict::kWarning);
  facts.domain = 100;
  EXPECT_EQ(check(facts, "ports").verdict, Verdict::kGood);
  facts.port_in_use = 7400;
  EXPECT_EQ(check(facts, "ports").verdict, Verdict::kFailure);
  EXPECT_THAT(check(facts, "ports").detail, HasSubstr("7400"));
}

TEST(Doctor, says_why_a_server_may_be_silent) {
  MachineFacts facts = client_over_wan();
  facts.participants.resize(1);
  EXPECT_EQ(check(facts, "peers").verdict, Verdict::kFailure);
  EXPECT_THAT(check(facts, "peers").advice, HasSubstr("external=ADDRESS"))
      << "a private address, a server with a public one";
  facts.paths[0].source = "198.51.100.7";
  EXPECT_THAT(check(facts, "peers").advice, Not(HasSubstr("external")));
  facts.paths[0].refused = true;
  EXPECT_THAT(check(facts, "peers").detail, HasSubstr("nothing listens"));
}

TEST(Doctor, shows_no_control_characters_of_strangers) {
  MachineFacts facts = good_machine();
  facts.participants.push_back({"a\x1b[2Jb\n", "", {}, false});
  EXPECT_EQ(check(facts, "peers").detail, "a?[2Jb?");
}

TEST(Doctor, shows_what_was_found_about_security) {
  MachineFacts facts = good_machine();
  facts.security = {{"security files", Verdict::kFailure, "key.pem can be read by all", "chmod 600 key.pem"}};
  EXPECT_EQ(check(facts, "security files").verdict, Verdict::kFailure);
}

TEST(Doctor, knows_xml) {
  for (const char* good :
       {"", "<a/>", "<a><b c='>'/>text<!-- <d> --></a>", "<?xml version=\"1.0\"?><a>\n</a>,<b></b >"})
    EXPECT_EQ(fault_of_xml(good), "") << good;
  EXPECT_EQ(fault_of_xml("<a><b>"), "<b> is not closed");
  EXPECT_EQ(fault_of_xml("<a></b>"), "</b> closes no element that is open");
  EXPECT_EQ(fault_of_xml("</a>"), "</a> closes no element that is open");
  EXPECT_EQ(fault_of_xml("<a><b c=\">"), "it breaks off within a tag");
  EXPECT_EQ(fault_of_xml("<a><!-- </a>"), "a comment is not closed");
}

TEST(Doctor, can_look_at_this_machine) {
  const MachineFacts facts = machine_facts(0, "loopback");
  EXPECT_GT(facts.open_files_limit, 0U);
  EXPECT_EQ(judge(facts).size(), 10U);
  EXPECT_EQ(facts.domain_fault, "");
  EXPECT_EQ(facts.max_message_bytes, 65'500U);
}

TEST(Doctor, fails_for_a_configuration_that_is_none) {
  for (
      const char* uri :
      {"nonsense", "file:///nowhere.xml", "<CycloneDDS><Domain>", "<CycloneDDS><NoSuchThing/></CycloneDDS>",
       "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"nowhere0\"/></Interfaces></General>"
       "</Domain></CycloneDDS>"}) {
    setenv("CYCLONEDDS_URI", uri, 1);
    const MachineFacts facts = machine_facts(0, "");
    EXPECT_EQ(check(facts, "CYCLONEDDS_URI").verdict, Verdict::kFailure) << uri;
  }
  EXPECT_EQ(machine_facts(0, "loopback").domain_fault, "") << "with a profile it is not used";
}

}  // namespace
}  // namespace tandem::doctor
