#pragma once
// Who wrote a sample, as far as discovery tells.

#include <dds/dds.h>

#include <optional>
#include <string>

#include "sdk/transport/dds/node.hpp"

namespace tandem::transport::dds {

/// Makes a reader of the participants that discovery knows. It causes no traffic.
[[nodiscard]] Result<Entity> make_participant_reader(const Entity& participant);

/// Describes the participant `of`, which has a writer that is matched with `reader`; empty if it has none.
[[nodiscard]] std::optional<Peer> describe_writer(dds_entity_t participants, dds_entity_t reader,
                                                  const ParticipantId& of);

/// Makes a reader of the writers that discovery knows. It causes no traffic.
[[nodiscard]] Result<Entity> make_publication_reader(const Entity& participant);

/// True if a writer of the topic of `reader` is in `partition`, but not matched with it: its type is another
/// version's. `publications`: see above.
[[nodiscard]] bool has_other_version(dds_entity_t publications, dds_entity_t reader, const char* topic,
                                     const std::string& partition);

}  // namespace tandem::transport::dds
