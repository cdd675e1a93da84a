// Helper of type_information_test: writes a status and an announcement again and again until it is killed.
//   topic_writer DOMAIN

#include <dds/dds.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "tandem.h"

namespace {

char* text(const char* literal) { return const_cast<char*>(literal); }

template <class Sequence, class Element, std::size_t N>
void lend(Sequence& sequence, Element (&elements)[N]) {
  sequence._length = sequence._maximum = N;
  sequence._buffer = elements;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const dds_entity_t participant =
      dds_create_participant(static_cast<dds_domainid_t>(std::atoi(argv[1])), nullptr, nullptr);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_partition1(qos, "arena");
  const dds_entity_t publisher = dds_create_publisher(participant, qos, nullptr);
  const auto writer = [&](const dds_topic_descriptor_t& type, const char* name) {
    return dds_create_writer(publisher, dds_create_topic(participant, &type, name, nullptr, nullptr), nullptr,
                             nullptr);
  };
  const dds_entity_t statuses = writer(tandem_TandemServerStatus_desc, "TandemServerStatus");
  const dds_entity_t sessions = writer(tandem_TandemSession_desc, "TandemSession");

  tandem_TandemServerStatus status{};
  status.epoch = 1'700'000'000'123;
  status.frame = 4711;
  status.mbit_per_s = 1.5;
  status.bodies = 10'000;
  status.stream = 3;
  status.session = text("arena");
  status.codec = text("entropy");
  status.predictor = text("contact");

  tandem_Parameter parameters[] = {{1, 100}, {2, -7}};
  char* groups[] = {text("position"), text("other")};
  std::uint8_t tables[] = {1, 2, 250};
  tandem_SessionStream streams[2] = {};
  for (tandem_SessionStream& stream : streams) {
    stream.id = static_cast<std::uint32_t>(&stream - streams);
    stream.layout_hash = UINT64_MAX;
    stream.name = text("thin");
    stream.codec = text("tracker");
    stream.predictor = text("ballistic");
    lend(stream.groups, groups);
    lend(stream.parameters, parameters);
    lend(stream.codec_tables, tables);
  }
  float half_sizes[] = {1, 2, 0.5F};
  tandem_BodyType types[1] = {};
  types[0].name = text("box");
  lend(types[0].shape_values, half_sizes);
  tandem_BodyName names[1] = {};
  names[0].slot = 7;
  names[0].name = text("crane");
  tandem_TandemSession session{};
  session.lattice_unit = 1.0 / 1024;
  session.session = text("arena");
  session.scene = text("half_pipe");
  session.scene_json = text("");
  lend(session.types, types);
  session.gravity_y = -9.5;
  lend(session.streams, streams);
  lend(session.names, names);

  std::puts("ready");
  std::fflush(stdout);
  for (;;) {
    if (dds_write(statuses, &status) < 0 || dds_write(sessions, &session) < 0) return 1;
    usleep(20'000);
  }
}
