#pragma once
// Samples between DDS and the thread that takes them, kept separately for each writer.

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/news/news.hpp"
#include "sdk/transport/dds/history_cache.hpp"
#include "sdk/transport/network/wire_bytes.hpp"
#include "sdk/wire/cdr.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/workers/doorbell.hpp"

namespace tandem::transport::dds {

/// Maximum size of a sample, with its header, that keeps to `limits`.
template <class M>
[[nodiscard]] std::size_t most_bytes(const Limits& limits) {
  constexpr std::size_t kFieldBytes = 4096;  // size without a payload; a reply needs 2,700
  if constexpr (std::is_same_v<M, SessionMessage>) return kMaxSampleBytes;
  if constexpr (std::is_same_v<M, DeltaMessage>) return kFieldBytes + limits.max_delta_bytes;
  if constexpr (std::is_same_v<M, SnapshotMessage>) return kFieldBytes + limits.max_snapshot_bytes;
  if constexpr (std::is_same_v<M, CheckpointMessage>) return kFieldBytes + kMaxCheckpointPartBytes;
  if constexpr (std::is_same_v<M, JournalMessage>)
    return kFieldBytes + kMaxDecisions * kMaxDecisionBytes + kMaxNewsBytes;
  return kFieldBytes;
}

/// Counts what a reader's samples take on the network. Not thread-safe.
struct ArrivalCount {
  std::shared_ptr<DdsWireCount> wire;  // null: nothing is counted
  bool reliable = false, shows_life = false;
  std::int64_t answered_ns = 0, came_ns = 0;

  void take(std::size_t bytes) {
    if (wire == nullptr) return;
    const std::int64_t now_ns = steady_ns();
    if (shows_life && came_ns != 0) wire->silence(now_ns - came_ns);
    came_ns = now_ns;
    wire->sample(bytes, reliable, DdsWire::kServerAsksNs, now_ns, answered_ns);
  }
};

/// Takes every sample of a reader as it arrives, in a thread of Cyclone DDS. A writer can displace only its
/// own samples. A sample that is larger than its topic allows is dropped before it is copied. Thread-safe.
template <class M>
class Arrivals {
 public:
  struct Arrival {
    dds_instance_handle_t writer = 0;
    std::size_t bytes = 0;
    std::int64_t written_ns = 0;  ///< wall clock of the writer's host
    M message;
  };

  /// Keeps at most `of_writer` samples of each writer. `bell`: rung by each arrival; may be null.
  Arrivals(std::size_t of_writer, Doorbell* bell, ArrivalCount count)
      : of_writer_(of_writer), bell_(bell), count_(std::move(count)) {}

  void set_limits(const Limits& limits) {
    const std::lock_guard lock(mutex_);
    limits_ = limits;
  }

  /// Needed to create the reader, which must not outlive this object.
  [[nodiscard]] dds_rhc* cache() { return &cache_; }

  /// Replaces `out` by all samples that came since the last call, oldest first. Adds to `dropped` the number
  /// of samples that broke a limit.
  void take(std::deque<Arrival>& out, std::uint64_t& dropped) {
    out.clear();
    const std::lock_guard lock(mutex_);
    dropped += std::exchange(dropped_, 0);
    if (arrivals_.empty()) return;
    out.swap(arrivals_);
    held_.clear();
    bytes_ = 0;
  }

 private:
  struct Held {
    std::size_t samples = 0, bytes = 0;
  };
  // Limits of all writers together; beyond them the writer that holds the most makes room.
  static constexpr std::size_t kMaxSamples = 4096;
  static constexpr std::size_t kMaxBytes = 256U << 20U;

  static void on_sample(void* self, dds_instance_handle_t writer, ddsi_serdata& sample) {
    auto& arrivals = *static_cast<Arrivals*>(self);
    arrivals.accept(writer, sample);
    if (arrivals.bell_ != nullptr) arrivals.bell_->ring();
  }

  void accept(dds_instance_handle_t writer, ddsi_serdata& sample) {
    const std::lock_guard lock(mutex_);
    const std::size_t size = ddsi_serdata_size(&sample);
    count_.take(size);
    if (size > most_bytes<M>(limits_)) {
      ++dropped_;
      return;
    }
    ddsrt_iovec_t bytes{};
    ddsi_serdata* const held = ddsi_serdata_to_ser_ref(&sample, 0, size, &bytes);
    // Some DDS implementations do not announce the bytes that fill up the last word.
    auto message = read_cdr<M>({static_cast<const std::byte*>(bytes.iov_base), bytes.iov_len}, Padding::kAny);
    ddsi_serdata_to_ser_unref(held, &bytes);
    if (!message || !within_limits(*message, limits_)) {
      ++dropped_;
      return;
    }
    if (held_[writer].samples >= of_writer_) drop_oldest_of(writer);
    held_[writer].samples += 1;
    held_[writer].bytes += size;
    bytes_ += size;
    arrivals_.push_back({writer, size, sample.timestamp.v, std::move(*message)});
    while (arrivals_.size() > std::max(kMaxSamples, 2 * of_writer_) || bytes_ > kMaxBytes) {
      const auto less = [](const auto& a, const auto& b) { return a.second.bytes < b.second.bytes; };
      drop_oldest_of(std::max_element(held_.begin(), held_.end(), less)->first);
    }
  }

  void drop_oldest_of(dds_instance_handle_t writer) {
    const auto oldest = std::find_if(arrivals_.begin(), arrivals_.end(),
                                     [writer](const Arrival& arrival) { return arrival.writer == writer; });
    TANDEM_ASSERT(oldest != arrivals_.end() && oldest->bytes <= held_[writer].bytes);
    held_[writer].samples -= 1;
    held_[writer].bytes -= oldest->bytes;
    bytes_ -= oldest->bytes;
    arrivals_.erase(oldest);
  }

  HistoryCache cache_{&on_sample, this};
  const std::size_t of_writer_;
  Doorbell* const bell_;
  ArrivalCount count_;
  std::mutex mutex_;
  Limits limits_;
  std::deque<Arrival> arrivals_;
  std::unordered_map<dds_instance_handle_t, Held> held_;  // of each writer
  std::size_t bytes_ = 0;                                 // of all
  std::uint64_t dropped_ = 0;
};

}  // namespace tandem::transport::dds
