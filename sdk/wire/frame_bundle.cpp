#include "sdk/wire/frame_bundle.hpp"

#include <utility>

#include "sdk/core/lattice/bytes.hpp"

namespace tandem::transport {

namespace {

// A run begins with 2 * bytes of its payload, or with 2 * frames + 1 if there is none.
constexpr std::size_t kMaxHeadBytes = 5;
constexpr std::size_t kHashBytes = 8;

}  // namespace

std::vector<FrameRun> read_frames(const DeltaMessage& delta) {
  if (delta.earlier >= delta.frame || delta.parts != 1) return {};
  if (delta.earlier == 0 || delta.payload.empty())
    return {{.last = delta.frame, .before = delta.earlier, .hash = delta.hash, .payload = delta.payload}};
  std::vector<FrameRun> runs;
  ByteReader in(delta.payload);
  for (Frame last = delta.frame - delta.earlier - 1; last < delta.frame;) {
    const std::uint64_t head = in.get_leb128(kMaxHeadBytes);
    FrameRun run;
    const bool is_quiet = (head & 1U) != 0;
    const std::uint64_t frames = is_quiet ? head >> 1U : 1;
    if (frames == 0 || frames > delta.frame - last || head == 0) return {};
    if (!is_quiet) run.payload = in.get_bytes(static_cast<std::size_t>(head >> 1U));
    last += frames;
    run.last = last;
    run.before = static_cast<std::uint32_t>(frames - 1);
    run.hash = last == delta.frame ? delta.hash : in.get<std::uint64_t>();
    if (!in.ok()) return {};
    runs.push_back(run);
  }
  if (!in.at_end()) runs.clear();
  return runs;
}

void FrameBundle::add(Frame frame, std::uint64_t hash, std::span<const std::byte> payload) {
  TANDEM_ASSERT(empty() || frame == last() + 1);
  ++frames_;
  const bool goes_on = !empty() && payload.empty() && runs_.back().bytes == 0 && runs_.back().hash == hash;
  if (goes_on) {
    runs_.back().last = frame;
    ++runs_.back().before;
    return;
  }
  runs_.push_back({.last = frame, .hash = hash, .begin = payloads_.size(), .bytes = payload.size()});
  payloads_.insert(payloads_.end(), payload.begin(), payload.end());
}

std::size_t FrameBundle::bytes_with(std::size_t payload_bytes) const {
  return payloads_.size() + payload_bytes + (runs_.size() + 1) * (kMaxHeadBytes + kHashBytes);
}

DeltaMessage FrameBundle::take() {
  TANDEM_ASSERT(!empty());
  DeltaMessage delta;
  delta.frame = last();
  delta.earlier = frames_ - 1;
  delta.hash = runs_.back().hash;
  if (runs_.size() == 1) {
    delta.payload = std::move(payloads_);
  } else {
    delta.payload.resize(bytes_with(0));
    ByteWriter out(delta.payload);
    for (const Run& run : runs_) {
      out.put_leb128(run.bytes > 0 ? 2 * run.bytes : 2 * (std::uint64_t{run.before} + 1) + 1);
      out.put_bytes(std::span(payloads_).subspan(run.begin, run.bytes));
      if (&run != &runs_.back()) out.put(run.hash);
    }
    TANDEM_ASSERT(!out.overflow());
    delta.payload.resize(out.size());
  }
  *this = {};
  return delta;
}

}  // namespace tandem::transport
