#include <algorithm>
#include <thread>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/dds/domain.hpp"
#include "sdk/transport/dds/node.hpp"
#include "sdk/transport/dds/peers.hpp"
#include "sdk/transport/dds/security.hpp"
#include "sdk/wire/clock.hpp"

namespace tandem::transport {
namespace {

// Strangers may be of any number.
constexpr std::uint32_t kMaxParticipants = 256;

/// "udp/10.0.0.1:7410@2,udp6/[fd00::1]:7410@2,..." without what is around the addresses.
std::vector<std::string> addresses_in(const std::string& text) {
  std::vector<std::string> addresses;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    std::string one = text.substr(at, comma - at);
    if (const std::size_t slash = one.find('/'); slash != std::string::npos) one.erase(0, slash + 1);
    one = one.starts_with('[') ? one.substr(1, one.find(']') - 1) : one.substr(0, one.find_first_of(":@"));
    if (one.starts_with("239.") || one.starts_with("ff"))
      one.clear();  // groups, which say nothing of the machine
    if (!one.empty() && std::ranges::find(addresses, one) == addresses.end())
      addresses.push_back(std::move(one));
    at = comma + 1;
  }
  return addresses;
}

HeardParticipant describe(const dds_builtintopic_participant_t& participant) {
  HeardParticipant heard;
  heard.name = dds::name_of(participant.qos);
  heard.host = dds::property_of(participant.qos, "__Hostname");
  heard.addresses = addresses_in(dds::property_of(participant.qos, "__NetworkAddresses"));
  return heard;
}

std::vector<HeardParticipant> read_all(dds_entity_t reader, const dds_guid_t& self) {
  std::vector<HeardParticipant> heard;
  std::vector<void*> samples(kMaxParticipants, nullptr);
  std::vector<dds_sample_info_t> infos(kMaxParticipants);
  const dds_return_t count =
      dds_read(reader, samples.data(), infos.data(), kMaxParticipants, kMaxParticipants);
  for (dds_return_t i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (!infos[at].valid_data || infos[at].instance_state != DDS_ALIVE_INSTANCE_STATE) continue;
    const auto& participant = *static_cast<const dds_builtintopic_participant_t*>(samples[at]);
    heard.push_back(describe(participant));
    heard.back().own = std::ranges::equal(participant.key.v, self.v);
    // Of participants here Cyclone DDS says "localprocess". It sends from sockets that are bound to its
    // interfaces.
    if (heard.back().own) heard.back().addresses = own_udp_addresses();
  }
  if (count > 0) dds_return_loan(reader, samples.data(), count);
  return heard;
}

}  // namespace

Result<std::vector<HeardParticipant>> listen_for_participants(
    const DdsOptions& options, Side side, std::chrono::nanoseconds patience,
    const std::function<bool(const std::vector<HeardParticipant>&)>& enough) {
  const auto use = dds::DomainUse::acquire(
      options.domain, side == Side::kServer ? dds::Repeat::kSoon : dds::Repeat::kSeldom, options.profile);
  if (!use) return tl::unexpected(use.error());
  const dds::Qos named(dds_create_qos());
  dds_qset_entity_name(named.get(), "tandem doctor");
  if (!options.secure.empty()) {
    const auto identity = dds::use_identity(options.secure, dds::Purpose::kWatch, named.get());
    if (!identity) return tl::unexpected(identity.error());
  }
  const auto participant =
      dds::own(dds_create_participant(options.domain, named.get(), nullptr), "the participant");
  if (!participant) return tl::unexpected(participant.error());
  const auto reader = dds::make_participant_reader(*participant);
  if (!reader) return tl::unexpected(reader.error());
  dds_guid_t self{};
  static_cast<void>(dds_get_guid(participant->get(), &self));
  const auto until = std::chrono::steady_clock::now() + patience;
  dds::CallOut call_out(participant->get(), steady_ns());
  for (;;) {
    call_out.again(steady_ns());
    auto heard = read_all(reader->get(), self);
    if (std::chrono::steady_clock::now() >= until || enough(heard)) return heard;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

}  // namespace tandem::transport
