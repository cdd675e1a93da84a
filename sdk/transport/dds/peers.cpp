#include "sdk/transport/dds/peers.hpp"

#include <algorithm>
#include <string>
#include <vector>

namespace tandem::transport::dds {
namespace {

void describe_participant(dds_entity_t participants, dds_instance_handle_t instance, Peer& peer) {
  void* sample = nullptr;
  dds_sample_info_t info;
  if (dds_read_instance(participants, &sample, &info, 1, 1, instance) <= 0) return;
  if (info.valid_data) {
    const dds_qos_t* const qos = static_cast<const dds_builtintopic_participant_t*>(sample)->qos;
    peer.name = name_of(qos);
    peer.host = property_of(qos, "__Hostname");  // Cyclone DDS calls them so
    peer.process = property_of(qos, "__ProcessName");
    peer.pid = property_of(qos, "__Pid");
  }
  dds_return_loan(participants, &sample, 1);
}

}  // namespace

Result<Entity> make_participant_reader(const Entity& participant) {
  return own(dds_create_reader(participant.get(), DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr),
             "the reader of participants");
}

std::optional<Peer> describe_writer(dds_entity_t participants, dds_entity_t reader, const ParticipantId& of) {
  const dds_return_t count = dds_get_matched_publications(reader, nullptr, 0);
  if (count <= 0) return std::nullopt;
  std::vector<dds_instance_handle_t> writers(static_cast<std::size_t>(count));
  const dds_return_t listed = dds_get_matched_publications(reader, writers.data(), writers.size());
  if (listed < static_cast<dds_return_t>(writers.size()))
    writers.resize(static_cast<std::size_t>(std::max(listed, 0)));
  for (const dds_instance_handle_t writer : writers) {
    const Endpoint endpoint(dds_get_matched_publication_data(reader, writer));
    if (!endpoint || to_participant_id(endpoint->participant_key) != of) continue;
    Peer peer;
    dds_liveliness_kind_t kind = DDS_LIVELINESS_AUTOMATIC;
    dds_duration_t lease = 0;
    if (dds_qget_liveliness(endpoint->qos, &kind, &lease)) peer.lease = std::chrono::nanoseconds(lease);
    describe_participant(participants, endpoint->participant_instance_handle, peer);
    return peer;
  }
  return std::nullopt;
}

}  // namespace tandem::transport::dds
