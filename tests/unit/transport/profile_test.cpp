#include "sdk/transport/network/profile.hpp"

#include <gmock/gmock.h>

#include <random>
#include <string>

#include "sdk/transport/network/reach.hpp"

namespace tandem::transport {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

Surroundings machine() {
  Surroundings here;
  here.interfaces = {
      {"lo", "127.0.0.1", true, true, false, 65536},      {"eth0", "10.0.0.2", true, false, true, 1500},
      {"docker0", "172.17.0.1", true, false, true, 1500}, {"eth1", "192.168.1.2", false, false, true, 1500},
      {"tun0", "10.8.0.1", true, false, false, 1280},     {"spare", "", true, false, true, 1500}};
  here.look_up = [](const std::string& host) -> std::optional<std::string> {
    if (host == "sim.example") return "203.0.113.5";
    return host.find_first_not_of("0123456789.") == std::string::npos ? std::optional(host) : std::nullopt;
  };
  here.source_address_to = [](const std::string& address) -> std::optional<std::string> {
    if (address == "127.0.0.1") return address;
    if (address.starts_with("192.0.2.")) return std::nullopt;
    return address.starts_with("172.17.") ? "172.17.0.1" : "10.0.0.2";
  };
  here.port_taken = [](std::uint32_t) { return false; };
  return here;
}

Result<Profile> here(const std::string& text, Side side, const Surroundings& around = machine()) {
  auto profile = parse_profile(text, side);
  if (!profile) return profile;
  return resolve_profile(std::move(*profile), side, 0, around);
}

std::string refusal(const std::string& text, Side side = Side::kClient) {
  const auto profile = parse_profile(text, side);
  if (profile) return "";
  EXPECT_EQ(profile.error().code, ErrorCode::kInvalidArgument);
  return profile.error().message;
}

std::string failure(const std::string& text, Side side = Side::kClient,
                    const Surroundings& around = machine()) {
  const auto profile = here(text, side, around);
  if (profile) return "";
  EXPECT_EQ(profile.error().code, ErrorCode::kTransport) << profile.error().message;
  return profile.error().message;
}

TEST(Profile, EveryFileIsOneWithAReasonForWhatItSets) {
  for (const ProfileFile& file : profile_files()) {
    EXPECT_TRUE(file.text.starts_with("<CycloneDDS>")) << file.name;
    EXPECT_THAT(std::string(file.text), HasSubstr("<!-- " + std::string(file.name) + ":"));
    EXPECT_THAT(refusal("moon"), HasSubstr(std::string(file.name)));
  }
}

TEST(Profile, AnUnknownOneNamesThoseThereAre) {
  for (const char* text : {"", "moon", "LAN", " lan", "lan ", ":", "lan;wan"})
    EXPECT_THAT(refusal(text), HasSubstr("loopback, lan, wifi, wan or multihomed")) << text;
}

TEST(Profile, ParametersThatAreUnknownMissingOrWrongAreNamed) {
  EXPECT_THAT(refusal("loopback:interface=lo"), HasSubstr("no parameters, not 'interface'"));
  EXPECT_THAT(refusal("lan:server=10.0.0.1"), HasSubstr("lan takes interface, not 'server'"));
  EXPECT_THAT(refusal("lan:interface=a,interface=b"), HasSubstr("one interface"));
  EXPECT_THAT(refusal("wan"), HasSubstr("wan:server=ADDRESS"));
  EXPECT_EQ(refusal("wan", Side::kServer), "");
  EXPECT_THAT(refusal("wan:server=a:0"), HasSubstr("ADDRESS:PORT"));
  EXPECT_THAT(refusal("wan:server=a:65536"), HasSubstr("ADDRESS:PORT"));
  EXPECT_THAT(refusal("wan:server=a,external=b"), HasSubstr("IPv4 address, not 'b'"));
  EXPECT_THAT(refusal("wan:index=10", Side::kServer), HasSubstr("0 to 9"));
  EXPECT_THAT(refusal("multihomed:interface=a"), HasSubstr("two to four"));
  EXPECT_THAT(refusal("multihomed:interface=a,interface=b,interface=c,interface=d,interface=e"),
              HasSubstr("two to four"));
  for (const char* text : {"lan:", "lan:eth0", "lan:interface=", "lan:interface=eth0,", "lan:interface=<x>",
                           "lan:interface=a\"b"})
    EXPECT_THAT(refusal(text), HasSubstr("KEY=VALUE")) << text;
}

TEST(Profile, AnInterfaceHasToBeThereAndUsable) {
  EXPECT_THAT(failure("lan:interface=eth9"),
              HasSubstr("no interface 'eth9' (there are lo 127.0.0.1, eth0 10.0.0.2"));
  EXPECT_THAT(failure("lan:interface=eth1"), HasSubstr("'eth1' is down"));
  EXPECT_THAT(failure("lan:interface=spare"), HasSubstr("no address"));
  EXPECT_THAT(failure("lan:interface=tun0"), HasSubstr("no multicast; use the profile wan"));
  EXPECT_THAT(failure("multihomed:interface=eth0,interface=eth0"), HasSubstr("named twice"));
  EXPECT_EQ(failure("wan:interface=tun0", Side::kServer), "");
}

TEST(Profile, OfSeveralNetworksTheOneOfTheDefaultRouteIsTaken) {
  EXPECT_THAT(
      failure("lan"),
      HasSubstr("several networks (eth0 10.0.0.2, docker0 172.17.0.1): say which, as in lan:interface=eth0"));
  Surroundings around = machine();
  around.default_route = "eth0";
  EXPECT_THAT(here("lan", Side::kClient, around)->interfaces, ElementsAre("eth0"));
  around.default_route = "tun0";  // carries no multicast
  EXPECT_THAT(failure("lan", Side::kClient, around), HasSubstr("several networks"));
  EXPECT_THAT(here("wan", Side::kServer, around)->interfaces, ElementsAre("tun0"));
  around.interfaces.resize(2);
  EXPECT_THAT(here("lan", Side::kClient, around)->interfaces, ElementsAre("eth0"));
  around.interfaces.resize(1);
  EXPECT_THAT(failure("lan", Side::kClient, around), HasSubstr("no interface of a network is up"));
}

TEST(Profile, AClientTakesTheInterfaceThatLeadsToItsServer) {
  const auto profile = here("wan:server=172.17.0.9,server=sim.example:7412", Side::kClient);
  ASSERT_TRUE(profile) << profile.error().message;
  EXPECT_THAT(profile->interfaces, ElementsAre("docker0"));
  EXPECT_THAT(profile->servers, ElementsAre("172.17.0.9:7410", "203.0.113.5:7412"));
  EXPECT_THAT(failure("wan:server=192.0.2.1"), HasSubstr("no route to the server 192.0.2.1"));
  EXPECT_THAT(failure("wan:server=127.0.0.1"), HasSubstr("is this machine"));
  EXPECT_THAT(failure("wan:server=nowhere.example"), HasSubstr("'nowhere.example' is no address and"));
}

TEST(Profile, AServersPortIsKnownAndItsOwn) {
  EXPECT_EQ(server_port(0, 0), 7410U);
  EXPECT_EQ(server_port(230, kMaxServerIndex), 64'928U);
  Surroundings around = machine();
  around.default_route = "eth0";
  around.port_taken = [](std::uint32_t port) { return port == 7410; };
  EXPECT_THAT(failure("wan", Side::kServer, around), HasSubstr("UDP port 7410 is in use"));
  EXPECT_EQ(failure("wan:index=1", Side::kServer, around), "");
  EXPECT_EQ(failure("wan:server=sim.example", Side::kClient, around), "") << "a client takes any port";
}

TEST(Profile, TheFileIsFilledIn) {
  const auto client = here("wan:server=203.0.113.5,server=203.0.113.6,external=198.51.100.7", Side::kClient);
  const std::string xml = profile_xml(*client, Side::kClient);
  EXPECT_THAT(xml, HasSubstr("<NetworkInterface name=\"eth0\"/>"));
  EXPECT_THAT(xml, HasSubstr("<Peer address=\"203.0.113.5:7410\"/>"));
  EXPECT_THAT(xml, HasSubstr("<Peer address=\"203.0.113.6:7410\"/>"));
  EXPECT_THAT(xml, HasSubstr("<ExternalNetworkAddress>198.51.100.7<"));
  EXPECT_THAT(xml, HasSubstr("<ParticipantIndex>none<"));
  const auto server = here("wan:index=2,interface=eth0", Side::kServer);
  const std::string other = profile_xml(*server, Side::kServer);
  EXPECT_THAT(other, HasSubstr("<ParticipantIndex>2<"));
  EXPECT_THAT(other, HasSubstr("<ExternalNetworkAddress>auto<"));
  EXPECT_THAT(other, Not(HasSubstr("<Peer ")));
  for (const std::string& text : {xml, other}) EXPECT_THAT(text, Not(HasSubstr("${")));
}

TEST(Profile, PeopleAreToldWhatItUsesAndWhereNatMayBe) {
  const auto text = [](const std::string& profile, Side side) {
    return describe(*here(profile, side), side, 0, machine());
  };
  EXPECT_EQ(text("wan:interface=eth0,index=1", Side::kServer), "profile wan on eth0, UDP port 7412");
  EXPECT_THAT(text("wan:server=203.0.113.5", Side::kClient),
              HasSubstr("10.0.0.2 is private and 203.0.113.5 is not"));
  EXPECT_EQ(text("wan:server=10.9.9.9", Side::kClient), "profile wan on eth0, servers 10.9.9.9:7410");
  EXPECT_THAT(text("wan:server=203.0.113.5,external=198.51.100.7", Side::kClient),
              HasSubstr("seen as 198.51.100.7"));
}

/// The same machine where nobody gave it an IPv4 address.
Surroundings v6_machine() {
  Surroundings here = machine();
  here.interfaces = {{"lo", "::1", true, true, false, 65536, {"::1"}},
                     {"eth0", "fd77::1", true, false, true, 1500, {"fd77::1", "fd77::a1"}}};
  here.default_route = "";
  here.look_up = [](const std::string& host) { return std::optional(host); };
  here.source_address_to = [](const std::string&) { return std::optional<std::string>("fd77::a1"); };
  return here;
}

TEST(Profile, WhereThereIsIpv6AloneItIsUsed) {
  for (const char* text : {"lan", "wifi:interface=eth0", "loopback", "wan:server=fd77::2"}) {
    const auto profile = here(text, Side::kClient, v6_machine());
    ASSERT_TRUE(profile.has_value()) << text << ": " << profile.error().message;
    EXPECT_THAT(profile_xml(*profile, Side::kClient), HasSubstr("<Transport>udp6</Transport>")) << text;
  }
  EXPECT_THAT(profile_xml(*here("lan:interface=eth0", Side::kServer), Side::kServer),
              HasSubstr("<Transport>udp</Transport>"));
}

TEST(Profile, AServersAddressDecidesForIpv6) {
  EXPECT_EQ(refusal("wan:server=fd77::2"), "");
  EXPECT_EQ(refusal("wan:server=[fd77::2]:7500"), "");
  for (const char* wrong : {"wan:server=[fd77::2", "wan:server=fd77::2]", "wan:server=[sim.example]",
                            "wan:server=[fd77::2]7500", "wan:server=[", "wan:server=[]"})
    EXPECT_THAT(refusal(wrong), HasSubstr("IPv6 [ADDRESS]:PORT")) << wrong;
  Surroundings both = machine();  // of both families
  both.interfaces[1].v6 = {"fd77::1"};
  both.look_up = [](const std::string& host) { return std::optional(host); };
  both.source_address_to = [](const std::string&) { return std::optional<std::string>("fd77::1"); };
  const auto profile = here("wan:server=[fd77::2]", Side::kClient, both);
  ASSERT_TRUE(profile.has_value()) << profile.error().message;
  EXPECT_TRUE(profile->v6);
  EXPECT_THAT(profile->servers, ElementsAre("[fd77::2]:7410"));
  EXPECT_THAT(profile->interfaces, ElementsAre("eth0"));
  EXPECT_EQ(address_of(profile->servers[0]), "fd77::2");
  EXPECT_THAT(failure("wan:server=[fd77::2],server=203.0.113.5", Side::kClient, both),
              HasSubstr("one server has an IPv4 address and another an IPv6 address"));
  EXPECT_THAT(failure("wan:server=fd77::2,interface=docker0", Side::kClient, both),
              HasSubstr("IPv6 address"));
}

TEST(Profile, NoTextBreaksIt) {
  constexpr unsigned kSeed = 31;
  RecordProperty("seed", kSeed);
  std::mt19937 random(kSeed);
  const std::string alphabet = "lanwifi:server=interface,external=index10.0.0.2eth0<>\"'&${} \t\n";
  for (int i = 0; i < 20'000; ++i) {
    std::string text = i % 2 == 0 ? "wan:" : "";
    for (auto length = random() % 40; length > 0; --length) text += alphabet[random() % alphabet.size()];
    const auto profile = here(text, i % 3 == 0 ? Side::kServer : Side::kClient);
    if (!profile) continue;
    const std::string xml = profile_xml(*profile, Side::kClient);
    EXPECT_THAT(xml, Not(HasSubstr("${"))) << text << ", seed " << kSeed;
  }
}

TEST(Interfaces, OfThisMachineHaveLoopback) {
  const auto all = interfaces();
  const auto loopback = std::ranges::find(all, "127.0.0.1", &Interface::address);
  ASSERT_NE(loopback, all.end());
  EXPECT_TRUE(loopback->up && loopback->loopback);
  EXPECT_GT(loopback->mtu, 0);
  EXPECT_EQ(source_address_to("127.0.0.1"), "127.0.0.1");
  EXPECT_EQ(source_address_to("nothing"), std::nullopt);
}

TEST(Interfaces, PrivateAddressesAreKnown) {
  for (const char* address :
       {"10.1.2.3", "172.16.0.1", "172.31.255.1", "192.168.0.1", "100.64.0.1", "127.0.0.1", "169.254.1.1"})
    EXPECT_TRUE(is_private(address)) << address;
  for (const char* address : {"11.0.0.1", "172.32.0.1", "192.169.0.1", "100.128.0.1", "203.0.113.5", "", "x"})
    EXPECT_FALSE(is_private(address)) << address;
}

// Interfaces come and go; what is configured stays.
TEST(Reach, IsThatOfTheProfile) {
  EXPECT_EQ(reach_of_dds("loopback", ""), "");
  EXPECT_EQ(reach_of_dds("wan", ""), "its network");
  EXPECT_EQ(reach_of_dds("lan", "<NetworkInterface name=\"lo\"/>"), "its network")
      << "the profile counts alone";
  EXPECT_EQ(reach_of_dds("wifi:interface=wlan0", ""), "wlan0");
  EXPECT_EQ(reach_of_dds("multihomed:interface=eth0,interface=eth1", ""), "eth0, eth1");
}

TEST(Reach, IsThatOfCycloneddsUriWithoutAProfile) {
  EXPECT_EQ(reach_of_dds("", ""), "its network");
  EXPECT_EQ(reach_of_dds("", "<General><Interfaces><NetworkInterface name=\"lo\" multicast=\"true\"/>"), "");
  EXPECT_EQ(reach_of_dds("", "<NetworkInterface address='127.0.0.1'/><NetworkInterface\n name='eth0'/>"),
            "eth0");
  EXPECT_EQ(reach_of_dds("", "<NetworkInterface autodetermine=\"true\"/>"), "its network");
  EXPECT_EQ(reach_of_dds("", "<NetworkInterfaceAddress>lo</NetworkInterfaceAddress>"), "");
  EXPECT_EQ(reach_of_dds("", "<!-- <NetworkInterface name=\"lo\"/> --><Tracing/>"), "its network");
  EXPECT_EQ(reach_of_dds("", "<NetworkInterface name="), "its network") << "what is broken keeps nobody out";
}

TEST(Reach, IsToldOfAServerWithoutAnIdentity) {
  EXPECT_THAT(warning_without_security("wan", ""), HasSubstr("without --secure"));
  EXPECT_EQ(warning_without_security("wan", "/etc/tandem/alpha"), "");
  EXPECT_EQ(warning_without_security("loopback", ""), "");
}

}  // namespace
}  // namespace tandem::transport
