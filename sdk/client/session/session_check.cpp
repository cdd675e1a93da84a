#include "sdk/client/session/session_check.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "sdk/core/tables/predictor_table.hpp"
#include "sdk/wire/port.hpp"

namespace tandem::client {
namespace {

constexpr std::uint32_t kDefinedLead = 1;
constexpr double kMinFrameRateHz = 1;
constexpr double kMaxFrameRateHz = 10'000;
// The largest payload has a correction and a lifecycle record of every slot: less than 128 bytes per slot
// with orientations, plus headers.
constexpr std::uint64_t kMaxBytesPerSlot = 256;
constexpr std::uint64_t kMaxFixedBytes = 1U << 20U;

tl::unexpected<Error> bad(const std::string& what) { return fail(ErrorCode::kMalformed, what); }

// Whoever encodes makes one payload for all who carry its frames, so they are read alike.
bool is_carried(const transport::SessionMessage& session, const transport::StreamMessage& stream) {
  return std::any_of(session.streams.begin(), session.streams.end(), [&](const auto& other) {
    return other.id.id == stream.carries && other.carries == other.id.id &&
           other.id.generation == stream.id.generation && other.layout_hash == stream.layout_hash;
  });
}

Result<void> check_session(const transport::SessionMessage& s) {
  if (s.protocol_version != transport::kProtocolVersion) {
    return fail(ErrorCode::kUnsupported, "the server speaks protocol version " +
                                             std::to_string(s.protocol_version) + ", but this client " +
                                             std::to_string(transport::kProtocolVersion));
  }
  const auto unknown = [](const std::string& what) {
    return fail(ErrorCode::kUnsupported, "it has '" + what + "', which this client does not know");
  };
  for (const std::string& feature : s.features)
    if (feature != transport::kKeysFeature && feature != transport::kEventsFeature) return unknown(feature);
  if (std::adjacent_find(s.features.begin(), s.features.end(), std::greater_equal<>()) != s.features.end())
    return bad("features that are repeated or out of order");
  if (auto good = check_data_fields(s.data); !good) return bad(good.error().message);
  if (s.topology_bytes > 0) return unknown("topology");
  if (s.epoch == 0) return bad("the epoch is 0");
  if (!(s.frame_rate_hz >= kMinFrameRateHz && s.frame_rate_hz <= kMaxFrameRateHz))
    return bad("the frame rate is out of range");
  if (!(s.lattice_unit > 0) || !std::isfinite(s.lattice_unit)) return bad("the lattice unit is out of range");
  if (s.lead > kDefinedLead) return bad("lead " + std::to_string(s.lead) + " is above the maximum of 1");
  for (const transport::StreamMessage& stream : s.streams) {
    if (!is_carried(s, stream)) return bad("carries of stream " + std::to_string(stream.id.id));
  }
  for (const auto& type : s.types) {
    if (!std::isfinite(type.radius) || type.radius < 0) return bad("radius of type " + type.name);
  }
  return {};
}

Result<void> check_stream(const transport::SessionMessage& session, const transport::StreamMessage& s) {
  const Layout& layout = s.layout;
  if (auto good = check_layout(layout); !good) return good;
  if (auto good = check_predictor(layout.predictor, layout.capacity, layout.predictor_constants); !good)
    return good;
  if (session.types.size() != s.layout.type_count)
    return bad("a list of " + std::to_string(session.types.size()) + " body types");
  if (s.world_slots > 0)
    return fail(ErrorCode::kUnsupported, "it is a view, which this client does not know");
  const std::uint64_t most = kMaxFixedBytes + kMaxBytesPerSlot * s.layout.capacity;
  if (s.max_delta_bytes > most) return bad("deltas of " + std::to_string(s.max_delta_bytes) + " bytes");
  if (s.max_snapshot_bytes > most)
    return bad("snapshots of " + std::to_string(s.max_snapshot_bytes) + " bytes");
  if (transport::layout_hash(session, s) != s.layout_hash) {
    return fail(ErrorCode::kMismatch, "its layout hash differs from what this client computes");
  }
  return {};
}

}  // namespace

Result<Playable> choose_stream(const transport::SessionMessage& session) {
  return playable_streams(session).and_then([&](const std::vector<std::size_t>& playable) {
    return ClientTimeline::create(session.streams[playable.front()].layout)
        .map([&](ClientTimeline&& timeline) {
          return Playable{playable.front(), std::move(timeline)};
        });
  });
}

Result<std::vector<std::size_t>> playable_streams(const transport::SessionMessage& session) {
  if (auto good = check_session(session); !good) {
    return fail(good.error().code, "session refused: " + good.error().message);
  }
  Error refused{ErrorCode::kMalformed, "session refused: no stream can be played"};
  std::vector<std::size_t> playable;
  for (std::size_t i = 0; i < session.streams.size(); ++i) {
    const transport::StreamMessage& stream = session.streams[i];
    const auto good = check_stream(session, stream);
    // Codec, predictor and tables are refused alike with one slot. So nothing of the announced size is
    // allocated for a stream that is not chosen.
    Layout one_slot = stream.layout;
    one_slot.capacity = 1;
    const auto timeline = good ? ClientTimeline::create(one_slot) : tl::unexpected<Error>(good.error());
    const bool listed_twice = std::any_of(playable.begin(), playable.end(), [&](std::size_t other) {
      return session.streams[other].id.id == stream.id.id;
    });
    if (timeline && !listed_twice) playable.push_back(i);
    if (timeline) continue;
    if (i == 0) refused.code = timeline.error().code;
    refused.message +=
        (i == 0 ? ": stream " : "; stream ") + std::to_string(stream.id.id) + ": " + timeline.error().message;
  }
  if (playable.empty()) return tl::unexpected<Error>(std::move(refused));
  return playable;
}

}  // namespace tandem::client
