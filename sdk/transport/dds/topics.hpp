#pragma once
// The topics, each with its generated type and QoS. Reasons: idl/PROTOCOL.md, "Topics".

#include <dds/dds.h>

#include <cstdint>

#include "sdk/transport/dds/entity.hpp"
#include "sdk/wire/limits.hpp"
#include "tandem.h"  // generated from idl/tandem.idl

namespace tandem::transport::dds {

/// The QoS that a topic's endpoints request. It is always keep-last, because a KEEP_ALL writer loses samples
/// to one frozen reader.
struct TopicQos {
  bool reliable = true;
  bool transient_local = false;
  std::int32_t writer_depth = 1;
  std::int32_t reader_depth = 1;           ///< per instance
  std::int32_t kept = 1;                   ///< samples of one writer that are kept until they are taken: see
                                           ///< Arrivals
  std::int32_t durable_depth = 0;          ///< part of the writer's history that late readers get; 0: all of
                                           ///< it
  dds_duration_t lifespan = DDS_INFINITY;  ///< an older sample is not repeated
  bool shows_life = false;  ///< liveliness of its own, manual by topic, which its samples show: those who
                            ///< read it notice a death first
};

template <class M>
struct Topic;

template <>
struct Topic<SessionMessage> {
  static const dds_topic_descriptor_t& descriptor() { return tandem_TandemSession_desc; }
  // Two servers that start at the same time share the instance; a reader must see both.
  static constexpr TopicQos kQos{true, true, 1, 8, 8};
};
template <>
struct Topic<DeltaMessage> {
  static const dds_topic_descriptor_t& descriptor() { return tandem_TandemDelta_desc; }
  // The options set the depth. Cyclone asks the readers of a keep-last writer for acknowledgements only when
  // it pauses, so its history would always be full; the lifespan keeps it at what a slow reader may want.
  static constexpr TopicQos kQos{
      true, false, 64, 64, 64, 0, static_cast<dds_duration_t>(kHistorySeconds* DDS_NSECS_IN_SEC), true};
};
template <>
struct Topic<ScheduledInputMessage> {
  static const dds_topic_descriptor_t& descriptor() { return tandem_TandemScheduledInput_desc; }
  static constexpr TopicQos kQos{true, true, 4096, 4096, 4096, 256};
};
template <>
struct Topic<SnapshotMessage> {
  static const dds_topic_descriptor_t& descriptor() { return tandem_TandemSnapshot_desc; }
  // On a thin link a part may be queued for longer than a reader waits before it repeats its request. Without
  // this limit the repetitions would fill the link.
  static constexpr TopicQos kQos{true, false, 64, 4096, 4096, 0, DDS_MSECS(300)};
};
template <>
struct Topic<ReplyMessage> {
  static const dds_topic_descriptor_t& descriptor() { return tandem_TandemReply_desc; }
  static constexpr TopicQos kQos{true, true, 1, 1, 64};
};
template <>
struct Topic<InputMessage> {
  static const dds_topic_descriptor_t& descriptor() { return tandem_TandemInput_desc; }
  static constexpr TopicQos kQos{true, false, 64, 64, 64};
};
template <>
struct Topic<AckMessage> {
  static const dds_topic_descriptor_t& descriptor() { return tandem_TandemAck_desc; }
  static constexpr TopicQos kQos{true, false, 1, 16, 16};
};
template <>
struct Topic<ServerStatusMessage> {
  static const dds_topic_descriptor_t& descriptor() { return tandem_TandemServerStatus_desc; }
  static constexpr TopicQos kQos{false, false, 1, 1, 8};
};
template <>
struct Topic<ClientStatusMessage> {
  static const dds_topic_descriptor_t& descriptor() { return tandem_TandemClientStatus_desc; }
  static constexpr TopicQos kQos{false, false, 1, 1, 8};
};

template <>
struct Topic<JournalMessage> {
  static const dds_topic_descriptor_t& descriptor() { return tandem_TandemJournal_desc; }
  static constexpr TopicQos kQos{true, false, 4096, 4096, 4096, 0, DDS_INFINITY, true};
};
template <>
struct Topic<CheckpointMessage> {
  static const dds_topic_descriptor_t& descriptor() { return tandem_TandemCheckpoint_desc; }
  // Without a lifespan the repetitions would fill a thin link, as with snapshots.
  static constexpr TopicQos kQos{true, false, 256, 1024, 1024, 0, DDS_MSECS(300)};
};
template <>
struct Topic<StandbyMessage> {
  static const dds_topic_descriptor_t& descriptor() { return tandem_TandemStandby_desc; }
  static constexpr TopicQos kQos{true, false, 1, 16, 16};
};
template <>
struct Topic<CommandMessage> {
  static const dds_topic_descriptor_t& descriptor() { return tandem_TandemCommand_desc; }
  static constexpr TopicQos kQos{true, false, 1, 1, 8};
};

/// The QoS of a writer (`depth` samples of history) or of a reader. A reader leaves `lease` infinite and so
/// accepts any.
[[nodiscard]] Qos make_qos(const TopicQos& topic, std::int32_t depth, dds_duration_t lease);

}  // namespace tandem::transport::dds
