#pragma once
// DDS Security for one participant.

#include <dds/dds.h>

#include <cstdint>
#include <string>

#include "sdk/transport/secure/identity_folder.hpp"
#include "tandem/result.hpp"

namespace tandem::transport::dds {

/// What a participant will do, so that an identity with too few permissions is refused in words.
enum class Purpose : std::uint8_t {
  kServe,    ///< needs a server's identity
  kAct,      ///< needs a participant's or a gateway's
  kObserve,  ///< also an observer's
  kWatch,    ///< any
};

/// What `tandem pki` calls an identity that may not send inputs.
inline constexpr const char* kObserverRole = "observer";

/// Errors: those of secure::check_identity_folder(); kInvalidArgument for an identity that does not suit the
/// purpose. Identities that `tandem pki` did not make suit all.
[[nodiscard]] Result<secure::Identity> suitable_identity(const std::string& folder, Purpose purpose);

/// Checks the identity in `folder` and sets it in a participant's QoS. The files are read again when the
/// participant is made: their contents would be in Cyclone's traces, the key among them. Errors: as above.
[[nodiscard]] Result<secure::Identity> use_identity(const std::string& folder, Purpose purpose,
                                                    dds_qos_t* qos);

}  // namespace tandem::transport::dds
