#include "services/follow/audience/writer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/client/following/scheduled_inputs.hpp"
#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/bytes.hpp"
#include "sdk/wire/envelope.hpp"
#include "sdk/wire/parcels.hpp"

namespace tandem::audience {
namespace {

/// Well below the maximum of a message.
constexpr std::size_t kPartBytes = 32U << 20U;

/// A message of a WebSocket behind its size.
template <class M>
void append(const M& message, transport::Bytes& out) {
  const std::size_t at = out.size();
  out.resize(at + sizeof(std::uint32_t));
  transport::write_envelope(message, out);
  const auto size = static_cast<std::uint32_t>(out.size() - at - sizeof(std::uint32_t));
  ByteWriter(std::span(out).subspan(at)).put(size);
}

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

}  // namespace

Object Writer::put(std::span<const std::byte> bytes, ObjectKind kind) {
  Object object = name_of(bytes, kind);
  use(object);
  if (used_[object.path()].times > 1) return object;
  std::erase_if(removals_, [&](const Removal& removal) { return removal.path == object.path(); });
  if (written_) written_ = shelf_->put(object.path(), bytes);
  return object;
}

void Writer::use(const Object& object) {
  Use& use = used_[object.path()];
  if (use.times++ > 0) return;
  use.size_bytes = object.size_bytes;
  ++totals_.objects;
  totals_.object_bytes += object.size_bytes;
}

void Writer::use(const std::vector<Passage>& passages) {
  for (const Passage& passage : passages) {
    use(passage.snapshot);
    for (const Segment& segment : passage.segments) use(segment.object);
  }
}

void Writer::go_on(Manifest before, std::vector<std::vector<Passage>> chapters) {
  TANDEM_ASSERT(manifest_.passages.empty() && !before.passages.empty());
  TANDEM_ASSERT(chapters.empty() || chapters.size() == before.chapters.size());
  // Readers take a manifest of a later writer only, and a wall clock may have been set back.
  before.writer = std::max(manifest_.writer, before.writer + 1);
  before.number = 0;
  before.live = true;
  manifest_ = std::move(before);
  for (const Run& run : manifest_.runs) use(run.session);
  for (const Chapter& chapter : manifest_.chapters) use(chapter.object);
  for (const std::vector<Passage>& chapter : chapters) use(chapter);
  use(manifest_.passages);
  folded_.assign(std::make_move_iterator(chapters.begin()), std::make_move_iterator(chapters.end()));
  at_ns_ = static_cast<std::int64_t>(manifest_.passages.back().to_ms()) * kMillisecond;
}

void Writer::drop(const Object& object, std::int64_t steady_ns) {
  const auto found = used_.find(object.path());
  if (found == used_.end() || --found->second.times > 0) return;
  TANDEM_ASSERT(totals_.objects > 0 && totals_.object_bytes >= found->second.size_bytes);
  --totals_.objects;
  totals_.object_bytes -= found->second.size_bytes;
  removals_.push_back({steady_ns + kGraceNs, found->first});
  used_.erase(found);
}

void Writer::drop(const std::vector<Passage>& passages, std::int64_t steady_ns) {
  for (const Passage& passage : passages) {
    drop(passage.snapshot, steady_ns);
    for (const Segment& segment : passage.segments) drop(segment.object, steady_ns);
  }
}

void Writer::put_manifest() {
  ++manifest_.number;
  const std::string text = to_text(manifest_);
  ++totals_.manifests;
  totals_.manifest_bytes += text.size();
  if (written_ && text.size() > kMaxManifestBytes)
    written_ = fail(ErrorCode::kCapacity,
                    "the manifest would be larger than readers take: --keep or --keep-mb drops what is old");
  if (written_) written_ = shelf_->put(kManifestName, bytes_of(text));
  changed_ = false;
}

void Writer::add(const transport::SessionMessage& session) {
  const bool goes_on = session_ && session_->epoch == session.epoch && session_->streams == session.streams;
  if (!goes_on) {
    end_segment();
    in_run_ = false;
  }
  if (session_ && session_->epoch != session.epoch) inputs_.clear();
  session_ = session;
  if (goes_on && in_run_) announce();
}

// The object of the run's session, new or in the place of the one with older names.
void Writer::announce() {
  transport::Bytes bytes;
  append(*session_, bytes);
  Object object = put(bytes, ObjectKind::kMessages);
  Run& run = manifest_.runs.back();
  if (!run.session.sha256.empty()) drop(run.session, segment_began_ns_);
  run.session = std::move(object);
  changed_ = true;
}

void Writer::add_snapshot(Frame frame, std::span<const std::byte> snapshot) {
  if (!session_) return;
  end_segment();
  const StreamId stream = session_->streams.front().id;
  if (!in_run_ || frame != frame_) {
    manifest_.session = session_->session;
    manifest_.scene = session_->scene;
    manifest_.frame_rate_hz = session_->frame_rate_hz;
    const std::uint32_t number = manifest_.runs.empty() ? 0 : manifest_.runs.back().number + 1;
    manifest_.runs.push_back({.number = number, .epoch = session_->epoch, .stream = stream, .session = {}});
    announce();
    in_run_ = true;
    server_time_ns_ = 0;
  }
  frame_ = frame;
  passage_ns_ = segment_ns_ = at_ns_;
  transport::SnapshotMessage message;
  message.epoch = session_->epoch;
  message.stream = stream;
  message.frame = frame;
  transport::Bytes bytes;
  for (std::size_t part = 0; part < transport::part_count(snapshot.size(), kPartBytes); ++part) {
    transport::cut_part(snapshot, kPartBytes, part, message);
    append(message, bytes);
  }
  Object object = put(bytes, ObjectKind::kMessages);
  ++totals_.snapshots;
  totals_.snapshot_bytes += bytes.size();
  // A passage without a segment is of no use to anybody.
  if (!manifest_.passages.empty() && manifest_.passages.back().segments.empty()) {
    drop(manifest_.passages.back().snapshot, segment_began_ns_);
    manifest_.passages.pop_back();
  }
  manifest_.passages.push_back({.run = manifest_.runs.back().number,
                                .frame = frame,
                                .from_ms = newest_ms(),
                                .snapshot = std::move(object),
                                .segments = {}});
  fold();
  changed_ = true;
}

void Writer::add(const transport::ScheduledInputMessage& input) {
  if (!session_ || input.epoch != session_->epoch) return;
  inputs_.emplace(input.number, input);
  if (inputs_.size() > client::ScheduledInputs::kKept) inputs_.erase(inputs_.begin());
}

void Writer::add(Epoch epoch, const client::CompleteDelta& delta, std::int64_t steady_ns) {
  if (!in_run_ || epoch != session_->epoch || delta.frame != frame_ + 1) return;
  if (segment_frames_ == 0) segment_began_ns_ = steady_ns;
  for (auto input = inputs_.begin(); input != inputs_.end() && input->first <= delta.last_input;) {
    append(input->second, segment_);
    input = inputs_.erase(input);
  }
  append(client::to_message(delta, epoch, session_->streams.front().id), segment_);
  ++segment_frames_;
  ++totals_.frames;
  totals_.payload_bytes += delta.payload.size();
  const auto period_ns = static_cast<std::int64_t>(1e9 / std::max(session_->frame_rate_hz, 1.0));
  // Stamps are another machine's: the difference of any two of them is bounded before it is used.
  std::int64_t since_ns = period_ns;
  if (server_time_ns_ != 0) {
    const auto before = static_cast<std::uint64_t>(server_time_ns_);
    since_ns = static_cast<std::int64_t>(static_cast<std::uint64_t>(delta.server_time_ns) - before);
  }
  at_ns_ += std::clamp<std::int64_t>(since_ns, 0, kLongestFrameNs);
  frame_ = delta.frame;
  server_time_ns_ = delta.server_time_ns;
  manifest_.newest_ms = std::max<std::int64_t>(0, delta.server_time_ns / kMillisecond);
  // The frame that would go beyond a second, give or take half a period, is the next segment's.
  if (at_ns_ - segment_ns_ + period_ns / 2 >= kSegmentNs || segment_.size() >= kMaxSegmentBytes)
    end_segment();
}

void Writer::end_segment() {
  if (segment_frames_ == 0) return;
  Object object = put(segment_, ObjectKind::kMessages);
  ++totals_.segments;
  totals_.segment_bytes += segment_.size();
  TANDEM_ASSERT(!manifest_.passages.empty() && newest_ms() >= manifest_.passages.back().to_ms());
  const std::uint64_t from_ms = manifest_.passages.back().to_ms();
  manifest_.passages.back().segments.push_back(
      {.object = std::move(object), .frames = segment_frames_, .ms = newest_ms() - from_ms});
  segment_.clear();
  segment_frames_ = 0;
  segment_ns_ = at_ns_;
  changed_ = true;
}

bool Writer::wants_snapshot() const {
  return in_run_ && segment_frames_ == 0 && at_ns_ - passage_ns_ + kSegmentNs / 2 >= kPassageNs;
}

// The manifest stays small: old passages move into an object. The newest stay, so that who plays the present
// needs no chapter.
void Writer::fold() {
  std::vector<Passage>& passages = manifest_.passages;
  const std::uint64_t first_ms = passages.front().from_ms;
  constexpr std::uint64_t kChapterMs = kChapterNs / kMillisecond;
  constexpr std::uint64_t kStayingMs = 2 * kPassageNs / kMillisecond;
  if (passages.back().from_ms < first_ms + kChapterMs + kStayingMs) return;
  const auto end = std::ranges::find_if(
      passages, [&](const Passage& passage) { return passage.from_ms >= first_ms + kChapterMs; });
  std::vector<Passage> chapter(std::make_move_iterator(passages.begin()), std::make_move_iterator(end));
  passages.erase(passages.begin(), end);
  TANDEM_ASSERT(!chapter.empty() && !passages.empty());
  const Span span{first_ms, chapter.back().to_ms()};
  manifest_.chapters.push_back({put(bytes_of(to_text(chapter)), ObjectKind::kChapter), span});
  if (options_.keep_ns > 0 || options_.keep_bytes > 0) folded_.push_back(std::move(chapter));
}

void Writer::forget_old(std::int64_t steady_ns) {
  const auto too_old = [&](std::uint64_t to_ms) {
    return options_.keep_ns > 0 &&
           static_cast<std::int64_t>(newest_ms() - to_ms) > options_.keep_ns / kMillisecond;
  };
  const auto too_much = [&] { return options_.keep_bytes > 0 && totals_.object_bytes > options_.keep_bytes; };
  while (!manifest_.chapters.empty() && (too_old(manifest_.chapters.front().span.to_ms) || too_much())) {
    TANDEM_ASSERT(folded_.size() == manifest_.chapters.size());
    drop(folded_.front(), steady_ns);
    drop(manifest_.chapters.front().object, steady_ns);
    folded_.pop_front();
    manifest_.chapters.erase(manifest_.chapters.begin());
    changed_ = true;
  }
  auto& passages = manifest_.passages;
  // The last passage may have no segment yet; then the one before it is what readers play.
  while (manifest_.chapters.empty() && passages.size() > 2 &&
         (too_old(passages.front().to_ms()) || too_much())) {
    drop({passages.front()}, steady_ns);
    passages.erase(passages.begin());
    changed_ = true;
  }
  const std::uint32_t first_run = !folded_.empty()   ? folded_.front().front().run
                                  : passages.empty() ? 0
                                                     : passages.front().run;
  if (!manifest_.chapters.empty() && folded_.empty()) return;  // all is kept
  while (manifest_.runs.size() > 1 && manifest_.runs.front().number < first_run) {
    drop(manifest_.runs.front().session, steady_ns);
    manifest_.runs.erase(manifest_.runs.begin());
    changed_ = true;
  }
}

void Writer::turned(std::int64_t steady_ns) {
  if (segment_frames_ > 0 && steady_ns - segment_began_ns_ >= kSegmentNs + kSegmentNs / 4) end_segment();
  // Before the first segment there is nothing to play, and an older manifest stays.
  if (manifest_.passages.empty() || (manifest_.number == 0 && manifest_.passages.front().segments.empty()))
    return;
  if (changed_) {
    forget_old(steady_ns);
    put_manifest();
  }
  while (!removals_.empty() && removals_.front().due_ns <= steady_ns) {
    shelf_->remove(removals_.front().path);
    removals_.pop_front();
  }
}

Result<void> Writer::finish(std::int64_t steady_ns) {
  end_segment();
  manifest_.live = false;
  changed_ = true;
  turned(steady_ns);
  return written_;
}

}  // namespace tandem::audience
