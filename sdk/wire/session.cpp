// What server and client must agree on about a session before a byte is read.

#include <algorithm>
#include <bit>
#include <string>

#include "sdk/core/lattice/hash.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/port.hpp"

namespace tandem::transport {

Result<void> check_session_name(const std::string& name) {
  const auto allowed = [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
  };
  if (name.empty() || name.size() > kMaxNameBytes) {
    return fail(ErrorCode::kInvalidArgument,
                "a session name has 1 to " + std::to_string(kMaxNameBytes) + " characters");
  }
  if (!std::all_of(name.begin(), name.end(), allowed)) {
    return fail(ErrorCode::kInvalidArgument,
                "a session name consists of letters, digits, '.', '_' and '-' only (wildcards are refused)");
  }
  return {};
}

std::vector<std::string> features_of(const WorldFeatures& world) {
  std::vector<std::string> features;
  if (world.events) features.emplace_back(kEventsFeature);
  if (world.keys) features.emplace_back(kKeysFeature);
  return features;
}

namespace {

// An offer of another one's frames leaves out what it would repeat.
void complete_offer(StreamMessage& offer, const std::vector<StreamMessage>& streams) {
  if (offer.carries == offer.id.id || !offer.layout.groups.empty()) return;
  const auto encodes = std::find_if(streams.begin(), streams.end(), [&](const StreamMessage& other) {
    return other.id.id == offer.carries && other.carries == other.id.id;
  });
  if (encodes == streams.end()) return;  // within_limits() refuses an entry without groups
  const StreamMessage own = offer;
  offer = *encodes;
  offer.id = own.id;
  offer.carries = own.carries;
  offer.delay_ms = own.delay_ms;
  offer.cap_kbit_s = own.cap_kbit_s;
}

}  // namespace

void complete_layouts(SessionMessage& session) {
  for (StreamMessage& stream : session.streams) complete_offer(stream, session.streams);
  const auto has = [&](std::string_view feature) {
    return std::find(session.features.begin(), session.features.end(), feature) != session.features.end();
  };
  const WorldFeatures world{.keys = has(kKeysFeature), .events = has(kEventsFeature)};
  for (StreamMessage& stream : session.streams) {
    stream.layout.capacity = session.capacity;
    stream.layout.lead = session.lead;
    stream.layout.world = world;
    const std::vector<std::string>& groups = stream.layout.groups;
    const bool has_data = !groups.empty() && groups.back() == kDataGroup;
    stream.layout.data = has_data ? session.data : std::vector<DataField>();
    stream.layout.type_count = static_cast<TypeId>(session.types.size());
  }
}

std::string stream_partition(const std::string& session, std::uint32_t stream) {
  std::string partition = session;
  if (stream > 0) partition.append(1, '/').append(std::to_string(stream));
  return partition;
}

std::string figures_partition(const std::string& session) { return session + "/figures"; }

std::string client_partition(const std::string& session, ClientId client) {
  return session + '/' + to_hex(client);
}

std::uint64_t layout_hash(const SessionMessage& session, const StreamMessage& stream) {
  return tandem::layout_hash(stream.layout, session.protocol_version,
                             std::bit_cast<std::uint64_t>(session.lattice_unit));
}

}  // namespace tandem::transport
