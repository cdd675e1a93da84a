#include "services/tool/doctor/doctor.hpp"

#include <gmock/gmock.h>

#include <cstdlib>
#include <ctime>
#include <filesystem>

#include "services/credentials/pki/authority.hpp"
#include "services/tool/doctor/configuration.hpp"

namespace tandem::doctor {
namespace {

using ::testing::AllOf;
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
  facts.reach = "its network";
  facts.secure = "/bob";
  facts.identity = transport::secure::Identity{"/bob", "bob", "participant", facts.clock_s + 30 * pki::kDay};
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

TEST(Doctor, warns_of_a_network_without_security) {
  MachineFacts facts = good_machine();
  facts.secure.clear();
  facts.identity.reset();
  EXPECT_EQ(check(facts, "security").verdict, Verdict::kWarning);
  EXPECT_THAT(check(facts, "security").detail, HasSubstr("reaches 10.0.0.2 can"));
  EXPECT_THAT(check(facts, "security").advice, HasSubstr("--secure"));
  facts.reach.clear();
  EXPECT_EQ(check(facts, "security").verdict, Verdict::kGood) << "nobody reaches loopback";
}

// As at boot, or with the profile wan, whose sockets are bound to no address.
TEST(Doctor, WarnsOfANetworkThatIsNotUpYet) {
  MachineFacts facts = good_machine();
  facts.secure.clear();
  facts.identity.reset();
  facts.participants = {{"tandem doctor", "host", {"127.0.0.1"}, true}};
  EXPECT_EQ(check(facts, "security").verdict, Verdict::kWarning);
  EXPECT_THAT(check(facts, "security").detail, HasSubstr("this machine over its network"));
  facts.participants.clear();
  EXPECT_EQ(check(facts, "security").verdict, Verdict::kWarning);
}

TEST(Doctor, tells_whose_identity_it_is_and_when_it_ends) {
  MachineFacts facts = good_machine();
  EXPECT_EQ(check(facts, "security").detail, "participant bob, until 2027-02-14 08:00:00 UTC");
  facts.clock_s += 24 * 86'400;
  EXPECT_EQ(check(facts, "security").verdict, Verdict::kWarning);
  EXPECT_THAT(check(facts, "security").advice, HasSubstr("tandem pki renew bob"));
}

/// An identity that is good now, with its authority.
class DoctorOfIdentity : public ::testing::Test {
 protected:
  DoctorOfIdentity() {
    std::string pattern = ::testing::TempDir() + "doctorXXXXXX";
    root_ = ::mkdtemp(pattern.data());
    const std::int64_t now_s = std::time(nullptr);
    auto authority = pki::Authority::init(root_, now_s);
    EXPECT_TRUE(authority->issue(pki::Role::kParticipant, "bob", 30 * pki::kDay, now_s));
    EXPECT_TRUE(authority->issue(pki::Role::kServer, "alpha", 30 * pki::kDay, now_s));
    EXPECT_TRUE(authority->issue(pki::Role::kObserver, "old", pki::kDay, now_s - 2 * pki::kDay));
    EXPECT_TRUE(authority->issue(pki::Role::kObserver, "early", pki::kDay, now_s + pki::kDay));
    EXPECT_TRUE(authority->issue(pki::Role::kObserver, "thief", pki::kDay, now_s));
    EXPECT_TRUE(authority->revoke("thief", now_s));
  }
  ~DoctorOfIdentity() override { std::filesystem::remove_all(root_); }
  DoctorOfIdentity(const DoctorOfIdentity&) = delete;
  DoctorOfIdentity& operator=(const DoctorOfIdentity&) = delete;
  DoctorOfIdentity(DoctorOfIdentity&&) = delete;
  DoctorOfIdentity& operator=(DoctorOfIdentity&&) = delete;

  [[nodiscard]] std::string file(const std::string& name) const { return root_ + "/bob/" + name; }
  /// A failure in one line that names the file and a cure.
  void expect_failure(const std::string& name, const std::string& part, const std::string& cure) const {
    // Without a domain, for which it would wait.
    const MachineFacts facts = machine_facts(0, "lan:interface=nowhere0", root_ + "/" + name);
    const Check said = check(facts, "security");
    EXPECT_EQ(said.verdict, Verdict::kFailure) << name << ": " << said.detail;
    EXPECT_THAT(said.detail, AllOf(HasSubstr(part), HasSubstr(cure), Not(HasSubstr("\n"))));
  }

  std::string root_;
};

TEST_F(DoctorOfIdentity, JoinsTheDomainWithOneThatIsGood) {
  const MachineFacts facts = machine_facts(0, "loopback", root_ + "/bob");
  EXPECT_EQ(facts.domain_fault, "");
  EXPECT_EQ(check(facts, "security").verdict, Verdict::kGood);
  EXPECT_THAT(check(facts, "security").detail, HasSubstr("participant bob, until 2"));
}

TEST_F(DoctorOfIdentity, SaysOfAFileThatIsMissingWhatAProgramSays) {
  std::filesystem::remove(file("crl.pem"));
  const auto program = transport::secure::check_identity_folder(root_ + "/bob", std::time(nullptr));
  ASSERT_FALSE(program);
  expect_failure("bob", program.error().message, "copy the whole folder");
  expect_failure("nobody", "nobody", "tandem pki");
}

TEST_F(DoctorOfIdentity, NamesTheKeyThatOthersCanRead) {
  std::filesystem::permissions(file("key.pem"), std::filesystem::perms(0644));
  expect_failure("bob", "key.pem", "chmod 600");
}

TEST_F(DoctorOfIdentity, NamesTheFileThatIsCutShortOrAnothers) {
  std::filesystem::resize_file(file("identity.pem"), 100);
  expect_failure("bob", "identity.pem", "copy the whole folder");
  std::filesystem::copy_file(root_ + "/alpha/identity.pem", file("identity.pem"),
                             std::filesystem::copy_options::overwrite_existing);
  expect_failure("bob", "bob", "copy the whole folder");
}

TEST_F(DoctorOfIdentity, NamesTheOneThatIsExpiredOrEarlyOrRevoked) {
  expect_failure("old", "identity.pem", "tandem pki renew old");
  expect_failure("early", "identity.pem", "set the clock");
  expect_failure("thief", "identity.pem", "revoked");
}

TEST(Doctor, knows_xml) {
  for (const char* good :
       {"", "<a/>", "<a><b c='>'/>text<!-- <d> --></a>", "<?xml version=\"1.0\"?><a>\n</a>,<b></b >"})
    EXPECT_EQ(fault_of_xml(good), "") << good;
  for (const char* good : {"<a/>,<?xml version=\"1.0\"?><b/>", "<a/>,", "<!DOCTYPE a><a/>"})
    EXPECT_EQ(fault_of_xml(good), "") << good;
  EXPECT_EQ(fault_of_xml("<a>\n<b>"), "line 2: mismatched element");
  EXPECT_EQ(fault_of_xml("<a></b>"), "line 1: mismatched element");
  EXPECT_NE(fault_of_xml("</a>"), "");
  EXPECT_NE(fault_of_xml("<a/></a>"), "");
  EXPECT_NE(fault_of_xml("<a"), "");
  EXPECT_NE(fault_of_xml("<?xml"), "");
  EXPECT_EQ(fault_of_xml("<a>\n<b c=\">"), "line 2: parsing attribute");
  EXPECT_EQ(fault_of_xml("<a><!-- </a>"), "line 1: parsing comment");
}

TEST(Doctor, can_look_at_this_machine) {
  const MachineFacts facts = machine_facts(0, "loopback");
  EXPECT_GT(facts.open_files_limit, 0U);
  EXPECT_EQ(judge(facts).size(), 11U);
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
