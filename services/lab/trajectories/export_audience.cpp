#include "services/lab/trajectories/export_audience.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <vector>

#include "sdk/wire/clock.hpp"
#include "sdk/wire/units.hpp"
#include "services/follow/audience/folder.hpp"
#include "services/follow/audience/writer.hpp"
#include "services/follow/recording/playback.hpp"
#include "services/tool/print_error.hpp"

namespace tandem::lab {
namespace {

using recording::Playback;
using Step = Playback::Step;

void add_session(const Playback& playback, audience::Writer& writer) {
  transport::SessionMessage session = playback.session();
  session.streams = {playback.stream()};
  writer.add(session);
}

void add_snapshot(Playback& playback, audience::Writer& writer, std::vector<std::byte>& snapshot) {
  playback.timeline().snapshot(snapshot);
  writer.add_snapshot(playback.timeline().applied(), snapshot);
}

/// Adds the whole recording.
Result<void> add_all(Playback& playback, audience::Writer& writer, const std::atomic<bool>& stop) {
  std::vector<transport::BodyName> names;
  std::vector<std::byte> snapshot;
  for (;;) {
    if (stop)
      return fail(ErrorCode::kIo, "stopped by a signal before its end; the folder has no manifest of it");
    const auto step = playback.next();
    if (!step) return tl::unexpected(step.error());
    if (*step == Step::kEnd) return {};
    if (*step == Step::kStarted || playback.session().names != names) {
      names = playback.session().names;
      add_session(playback, writer);
    }
    if (*step == Step::kStarted) {
      add_snapshot(playback, writer, snapshot);
      continue;
    }
    for (const transport::ScheduledInputMessage& input : playback.inputs()) writer.add(input);
    writer.add(playback.session().epoch, playback.delta(), static_cast<std::int64_t>(playback.time_ns()));
    if (writer.wants_snapshot()) add_snapshot(playback, writer, snapshot);
    if (!writer.good()) return writer.written();
  }
}

}  // namespace

Result<void> export_audience(const std::string& recording, const std::string& folder,
                             const std::atomic<bool>& stop) {
  auto playback = Playback::open(recording);
  if (!playback) return tl::unexpected(playback.error());
  auto shelf = audience::Folder::open(folder);
  if (!shelf) return tl::unexpected(shelf.error());
  audience::Writer writer(*shelf,
                          {.began_ms = static_cast<std::uint64_t>(transport::wall_ns() / kMillisecond)});
  if (auto added = add_all(**playback, writer, stop); !added)
    return fail(added.error().code, recording + ": " + added.error().message);
  if (const std::string left_out = (*playback)->left_out(); !left_out.empty())
    tool::print_error(fmt::format("tandem export: {} {}\n", recording, left_out));
  if (writer.totals().frames == 0) return fail(ErrorCode::kMalformed, recording + ": it has no frame");
  auto finished = writer.finish(0);
  if (!finished) return finished;
  shelf->remove_leftovers();
  return shelf->sync();
}

}  // namespace tandem::lab
