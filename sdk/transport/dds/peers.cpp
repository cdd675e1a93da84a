#include "sdk/transport/dds/peers.hpp"

#include <algorithm>
#include <cstring>
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

std::vector<dds_instance_handle_t> matched_writers(dds_entity_t reader) {
  const dds_return_t count = dds_get_matched_publications(reader, nullptr, 0);
  if (count <= 0) return {};
  std::vector<dds_instance_handle_t> writers(static_cast<std::size_t>(count));
  const dds_return_t listed = dds_get_matched_publications(reader, writers.data(), writers.size());
  if (listed < static_cast<dds_return_t>(writers.size()))
    writers.resize(static_cast<std::size_t>(std::max(listed, 0)));
  return writers;
}

bool is_in_partition(const dds_qos_t* qos, const std::string& partition) {
  std::uint32_t count = 0;
  char** names = nullptr;
  if (!dds_qget_partition(qos, &count, &names)) return false;
  bool found = false;
  for (std::uint32_t i = 0; i < count; ++i) {
    found = found || partition == names[i];
    dds_free(names[i]);
  }
  dds_free(names);
  return found;
}

}  // namespace

Result<Entity> make_participant_reader(const Entity& participant) {
  return own(dds_create_reader(participant.get(), DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr),
             "the reader of participants");
}

Result<Entity> make_publication_reader(const Entity& participant) {
  return own(dds_create_reader(participant.get(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr),
             "the reader of publications");
}

bool has_other_version(dds_entity_t publications, dds_entity_t reader, const char* topic,
                       const std::string& partition) {
  constexpr std::size_t kMax = 4096;  // more are strangers who flood discovery
  std::vector<void*> samples(kMax);
  std::vector<dds_sample_info_t> infos(kMax);
  const dds_return_t count = dds_read(publications, samples.data(), infos.data(), kMax, kMax);
  const std::vector<dds_instance_handle_t> matched = matched_writers(reader);
  bool found = false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(std::max(count, 0)) && !found; ++i) {
    const auto* const writer = static_cast<const dds_builtintopic_endpoint_t*>(samples[i]);
    found = infos[i].valid_data && infos[i].instance_state == DDS_IST_ALIVE &&
            std::strcmp(writer->topic_name, topic) == 0 && is_in_partition(writer->qos, partition) &&
            std::ranges::find(matched, infos[i].instance_handle) == matched.end();
  }
  if (count > 0) static_cast<void>(dds_return_loan(publications, samples.data(), count));
  return found;
}

std::optional<Peer> describe_writer(dds_entity_t participants, dds_entity_t reader, const ParticipantId& of) {
  for (const dds_instance_handle_t writer : matched_writers(reader)) {
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
