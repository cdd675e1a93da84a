#include "sdk/client/session_check.hpp"

#include <cmath>

#include "sdk/transport/port.hpp"

namespace tandem::client {
namespace {

constexpr std::uint32_t kDefinedLead = 1;
constexpr double kMinFrameRateHz = 1;
constexpr double kMaxFrameRateHz = 10'000;
// The largest payload is `none` over all slots with a lifecycle record each: below 64 bytes a slot, plus
// headers.
constexpr std::uint64_t kMaxBytesPerSlot = 128;
constexpr std::uint64_t kMaxFixedBytes = 1U << 20U;

Result<void> check_values(const transport::SessionMessage& s) {
  const auto bad = [](const std::string& what) {
    return fail(ErrorCode::kMalformed, "session refused: " + what);
  };
  if (s.epoch == 0) return bad("epoch 0");
  if (auto good = check_layout(s.layout); !good) return bad(good.error().message);
  if (!(s.frame_rate_hz >= kMinFrameRateHz && s.frame_rate_hz <= kMaxFrameRateHz))
    return bad("frame rate out of range");
  if (!(s.lattice_unit > 0) || !std::isfinite(s.lattice_unit)) return bad("lattice unit out of range");
  if (s.layout.lead > kDefinedLead)
    return bad("lead " + std::to_string(s.layout.lead) + ", at most 1 is defined");
  if (s.types.size() != s.layout.type_count)
    return bad("a list of " + std::to_string(s.types.size()) + " body types");
  for (const auto& type : s.types) {
    if (!std::isfinite(type.radius) || type.radius < 0) return bad("radius of type " + type.name);
  }
  const std::uint64_t most = kMaxFixedBytes + kMaxBytesPerSlot * s.layout.capacity;
  if (s.max_delta_bytes > most) return bad("deltas of " + std::to_string(s.max_delta_bytes) + " bytes");
  if (s.max_snapshot_bytes > most)
    return bad("snapshots of " + std::to_string(s.max_snapshot_bytes) + " bytes");
  return {};
}

}  // namespace

Result<Layout> check_session(const transport::SessionMessage& session) {
  if (session.protocol_version != transport::kProtocolVersion) {
    return fail(ErrorCode::kUnsupported, "the server speaks protocol version " +
                                             std::to_string(session.protocol_version) + ", this client " +
                                             std::to_string(transport::kProtocolVersion));
  }
  if (auto ok = check_values(session); !ok) return tl::unexpected<Error>(ok.error());
  if (transport::layout_hash(session) != session.layout_hash) {
    return fail(ErrorCode::kMismatch, "the session's layout hash differs from what this client computes");
  }
  return session.layout;
}

}  // namespace tandem::client
