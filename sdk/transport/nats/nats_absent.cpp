// In a build without libnats.
#include "sdk/transport/nats/nats_bus.hpp"

namespace tandem::transport {

Result<std::unique_ptr<NatsBus>> make_nats_bus(const NatsOptions& /*options*/) {
  return fail(ErrorCode::kUnsupported,
              "this program was built without libnats (libnats-dev), so it knows no NATS");
}

}  // namespace tandem::transport
