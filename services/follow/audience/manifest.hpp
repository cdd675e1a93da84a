#pragma once
// What the manifest of an audience's folder says, and its text (idl/AUDIENCE.md).

#include <cstdint>
#include <string>
#include <vector>

#include "sdk/wire/messages.hpp"
#include "services/follow/audience/object_name.hpp"
#include "tandem/result.hpp"

namespace tandem::audience {

inline constexpr std::uint32_t kFormatVersion = 1;
inline constexpr const char* kManifestName = "manifest.json";
inline constexpr std::size_t kMaxManifestBytes = 64U << 20U;  ///< readers take no more

/// The frames between two places of the time line, in milliseconds since the writer began.
struct Span {
  std::uint64_t from_ms = 0, to_ms = 0;
};

/// Deltas of about a second, and the scheduled inputs that they count.
struct Segment {
  Object object;
  std::uint32_t frames = 0;
  std::uint64_t ms = 0;
};

/// A snapshot and the segments that follow it without a gap.
struct Passage {
  std::uint32_t run = 0;
  Frame frame = 0;  ///< of the snapshot
  std::uint64_t from_ms = 0;
  Object snapshot;
  std::vector<Segment> segments;
  [[nodiscard]] std::uint64_t to_ms() const;
};

/// An object that lists passages.
struct Chapter {
  Object object;
  Span span;
};

/// One stream of one epoch. Its frames have no gap.
struct Run {
  std::uint32_t number = 0;
  Epoch epoch = 0;
  StreamId stream;
  Object session;  ///< TandemSession with this stream alone
};

struct Manifest {
  std::string session, scene;
  double frame_rate_hz = 0;
  bool live = true;
  std::uint64_t writer = 0;    ///< when the writer began, its wall clock, ms since 1970
  std::uint64_t number = 0;    ///< counts the writer's manifests, from 1
  std::int64_t newest_ms = 0;  ///< the server's wall clock at the newest frame, ms since 1970
  std::vector<Run> runs;
  std::vector<Chapter> chapters;
  std::vector<Passage> passages;  ///< behind those of the chapters
};

[[nodiscard]] std::string to_text(const Manifest& manifest);
/// The bytes of a chapter.
[[nodiscard]] std::string to_text(const std::vector<Passage>& passages);

/// What to_text() made, of a manifest and of a chapter; both have a passage at least.
/// Errors: kMalformed; kUnsupported (of another version, or of a session of another).
[[nodiscard]] Result<Manifest> read_manifest(const std::string& text);
[[nodiscard]] Result<std::vector<Passage>> read_chapter(const std::string& text);

}  // namespace tandem::audience
