#pragma once
// Converts plain messages to the types generated from idl/tandem.idl.

#include <dds/dds.h>

#include "sdk/wire/messages.hpp"
#include "sdk/wire/standby_messages.hpp"
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
[[nodiscard]] dds_return_t write_sample(dds_entity_t writer, const JournalMessage& message);
[[nodiscard]] dds_return_t write_sample(dds_entity_t writer, const CheckpointMessage& message);
[[nodiscard]] dds_return_t write_sample(dds_entity_t writer, const StandbyMessage& message);
[[nodiscard]] dds_return_t write_sample(dds_entity_t writer, const CommandMessage& message);

}  // namespace tandem::transport::dds
