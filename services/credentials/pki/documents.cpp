#include "services/credentials/pki/documents.hpp"

#include <fmt/format.h>

#include <array>
#include <ctime>
#include <utility>

namespace tandem::pki {
namespace {

constexpr std::array<std::pair<Role, std::string_view>, 5> kRoles = {{{Role::kServer, "server"},
                                                                      {Role::kParticipant, "participant"},
                                                                      {Role::kObserver, "observer"},
                                                                      {Role::kGateway, "gateway"},
                                                                      {Role::kOperator, "operator"}}};

constexpr const char* kDomains = "<domains><id_range><min>0</min><max>230</max></id_range></domains>";

std::string xml_time(std::int64_t seconds) {
  const std::time_t time = seconds;
  std::tm parts{};
  gmtime_r(&time, &parts);
  std::array<char, 64> text{};
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &parts)};
}

std::string criteria(const char* action, const std::vector<std::string_view>& topics) {
  if (topics.empty()) return {};
  std::string text = fmt::format("          <{}>\n            <topics>\n", action);
  for (const std::string_view topic : topics) text += fmt::format("              <topic>{}</topic>\n", topic);
  // Sessions are partitions, and so are the replies to each client.
  text += "            </topics>\n            <partitions><partition>*</partition></partitions>\n";
  return text + fmt::format("          </{}>\n", action);
}

}  // namespace

std::string_view role_name(Role role) { return kRoles[static_cast<std::size_t>(role)].second; }

std::optional<Role> read_role(std::string_view name) {
  for (const auto& [role, called] : kRoles)
    if (called == name) return role;
  return std::nullopt;
}

Rights rights_of(Role role) {
  const std::vector<std::string_view> watching = {"TandemSession",     "TandemDelta", "TandemScheduledInput",
                                                  "TandemSnapshot",    "TandemReply", "TandemServerStatus",
                                                  "TandemClientStatus"};
  switch (role) {
    case Role::kServer:
      return {{"TandemSession", "TandemDelta", "TandemScheduledInput", "TandemSnapshot", "TandemReply",
               "TandemServerStatus", "TandemJournal", "TandemCheckpoint", "TandemStandby"},
              {"TandemSession", "TandemServerStatus", "TandemClientStatus", "TandemInput", "TandemAck",
               "TandemStandby", "TandemCommand", "TandemJournal", "TandemCheckpoint"}};
    case Role::kParticipant:
    case Role::kGateway:
      return {{"TandemAck", "TandemInput", "TandemClientStatus"}, watching};
    case Role::kObserver:
      return {{"TandemAck", "TandemClientStatus"}, watching};
    case Role::kOperator:
      break;
  }
  return {{"TandemCommand"}, {"TandemSession", "TandemServerStatus", "TandemClientStatus"}};
}

std::string governance_xml() {
  // metadata_protection encrypts whole submessages once for all readers of a writer, the payload in them;
  // encrypting the payload apart or signing each packet would only do it twice.
  return fmt::format(R"(<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="https://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_governance.xsd">
  <domain_access_rules>
    <domain_rule>
      {}
      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
      <enable_join_access_control>true</enable_join_access_control>
      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>
      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
      <rtps_protection_kind>NONE</rtps_protection_kind>
      <topic_access_rules>
        <topic_rule>
          <topic_expression>*</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>true</enable_read_access_control>
          <enable_write_access_control>true</enable_write_access_control>
          <metadata_protection_kind>ENCRYPT</metadata_protection_kind>
          <data_protection_kind>NONE</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
)",
                     kDomains);
}

std::string permissions_xml(Role role, const std::string& subject, std::int64_t from_s,
                            std::int64_t until_s) {
  const Rights rights = rights_of(role);
  return fmt::format(R"(<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="https://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_permissions.xsd">
  <permissions>
    <grant name="{}">
      <subject_name>{}</subject_name>
      <validity><not_before>{}</not_before><not_after>{}</not_after></validity>
      <allow_rule>
        {}
{}{}      </allow_rule>
      <default>DENY</default>
    </grant>
  </permissions>
</dds>
)",
                     role_name(role), subject, xml_time(from_s), xml_time(until_s), kDomains,
                     criteria("publish", rights.writes), criteria("subscribe", rights.reads));
}

}  // namespace tandem::pki
