#pragma once
// Between the plain messages and the types generated from idl/tandem.idl.

#include <dds/dds.h>

#include "sdk/transport/messages.hpp"
#include "tandem.h"  // generated from idl/tandem.idl

namespace tandem::transport::dds {

/// Writes without copying payloads. Returns what dds_write returned.
[[nodiscard]] dds_return_t write_sample(dds_entity_t writer, const SessionMessage& message);
[[nodiscard]] dds_return_t write_sample(dds_entity_t writer, const DeltaMessage& message);
[[nodiscard]] dds_return_t write_sample(dds_entity_t writer, const ScheduledInputMessage& message);
[[nodiscard]] dds_return_t write_sample(dds_entity_t writer, const SnapshotMessage& message);
[[nodiscard]] dds_return_t write_sample(dds_entity_t writer, const ReplyMessage& message);
[[nodiscard]] dds_return_t write_sample(dds_entity_t writer, const InputMessage& message);
[[nodiscard]] dds_return_t write_sample(dds_entity_t writer, const AckMessage& message);
[[nodiscard]] dds_return_t write_sample(dds_entity_t writer, const ServerStatusMessage& message);
[[nodiscard]] dds_return_t write_sample(dds_entity_t writer, const ClientStatusMessage& message);

[[nodiscard]] SessionMessage to_message(const tandem_TandemSession& wire);
[[nodiscard]] DeltaMessage to_message(const tandem_TandemDelta& wire);
[[nodiscard]] ScheduledInputMessage to_message(const tandem_TandemScheduledInput& wire);
[[nodiscard]] SnapshotMessage to_message(const tandem_TandemSnapshot& wire);
[[nodiscard]] ReplyMessage to_message(const tandem_TandemReply& wire);
[[nodiscard]] InputMessage to_message(const tandem_TandemInput& wire);
[[nodiscard]] AckMessage to_message(const tandem_TandemAck& wire);
[[nodiscard]] ServerStatusMessage to_message(const tandem_TandemServerStatus& wire);
[[nodiscard]] ClientStatusMessage to_message(const tandem_TandemClientStatus& wire);

}  // namespace tandem::transport::dds
