#include "services/host/clients/moment.hpp"

#include <algorithm>
#include <utility>

namespace tandem::host {

HostMoment host_moment(const Roster& roster, const FrameSource& source, std::span<const SentFrames> sent,
                       const Outbox& outbox) {
  HostMoment moment;
  moment.window = roster.window();
  moment.dds_participants = static_cast<std::uint32_t>(roster.peers());
  moment.queued = outbox.size();
  moment.queued_most = outbox.high_water();
  moment.queued_frames = outbox.unwritten_frames();
  const StreamSet active = source.active();
  const transport::SessionMessage& session = source.session();
  moment.streams.resize(session.streams.size());
  bool counted = false;  // the bodies, which are the same in all streams
  for (std::uint32_t id = 0; id < moment.streams.size(); ++id) {
    StreamMoment& stream = moment.streams[id];
    stream.threshold_m = source.parameters(id).codec.threshold * session.lattice_unit;
    if (!active[id]) continue;
    if (!std::exchange(counted, true)) moment.bodies = source.bodies(id).alive;
    stream.at_rest = source.bodies(id).at_rest;
    stream.crowded = source.bodies(id).crowded;
    const PositionError error = source.error_of(id);
    stream.error_rms_m = error.rms;
    stream.error_largest_m = error.largest;
  }
  for (const auto& [id, account] : roster.accounts()) {
    if (const auto joins = joined_stream(account); joins && *joins < moment.streams.size())
      ++moment.streams[*joins].joining;
    if (!account.plays() || account.stream >= moment.streams.size()) continue;
    StreamMoment& stream = moment.streams[account.stream];
    const std::size_t behind = sent[account.stream].beyond(account.applied);
    stream.longest_lag = std::max(stream.longest_lag, static_cast<std::uint32_t>(behind));
    if (account.counted)
      moment.longest_round_trip_ns = std::max(moment.longest_round_trip_ns, account.round_trip.high_ns());
  }
  return moment;
}

}  // namespace tandem::host
