#pragma once
// Writes checkpoints beside the simulation.

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "services/host/checkpoint/checkpoint.hpp"
#include "services/host/checkpoint/folder.hpp"

namespace tandem::checkpoint {

/// A checkpoint as the bytes of a file.
struct Encoded {
  Moment moment;
  std::uint64_t journal = 0;  ///< see Checkpoint::journal
  std::vector<std::byte> bytes;
};

/// What a writer has done since it was made.
struct Figures {
  std::uint64_t written = 0, failed = 0;
  Frame frame = 0;              ///< of the newest checkpoint on the disk; 0: none
  std::uint64_t bytes = 0;      ///< of that file
  std::optional<double> age_s;  ///< since the frame of that checkpoint; empty: none was written
  double interval_s = 0;        ///< between two checkpoints
  double copy_ms_max = 0;       ///< longest time that a frame was delayed for a copy
  double write_ms_max = 0;      ///< longest time from copy to disk
};

/// Where a writer writes.
enum class WritesIn : std::uint8_t {
  kOwnThread,
  kWriteNow,  ///< in the caller's thread, when write_now() is called: for a simulated machine
};

/// All members are called from one thread, that of the simulation. It waits only in finish().
class Writer {
 public:
  static constexpr std::int64_t kTellNs = 10'000'000'000;  ///< between two lines about the same trouble

  /// `folder` is used by the writer's thread from now on, and must outlive it; null: checkpoints are only
  /// encoded, for latest(). `clock_ns`: a steady clock. `memory`: for the engine's part. The first copy takes
  /// several times as long into memory that the system has not handed out yet.
  Writer(Folder* folder, std::int64_t interval_ns, std::int64_t (*clock_ns)(), std::vector<std::byte> memory,
         WritesIn writes_in = WritesIn::kOwnThread);
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  void set_interval(std::int64_t interval_ns) { interval_ns_ = interval_ns; }
  /// Call after every frame. True if the checkpoint before is written, and a copy made after the next frame
  /// might not be on the disk when the interval is over. So no more than the interval can be lost; a slow
  /// disk makes checkpoints rarer, and delays no frame.
  [[nodiscard]] bool due(std::int64_t now_ns);
  /// Has `fill` copy the world, and returns. Only when idle().
  void take(std::int64_t now_ns, const std::function<void(Checkpoint&)>& fill);
  /// True if no write is under way.
  [[nodiscard]] bool idle() const;
  /// Waits until no write is under way, at most so long. Returns idle().
  bool finish(std::int64_t longest_ns);
  /// Writes what was taken, if there is something. Only for WritesIn::kWriteNow.
  void write_now();

  /// The newest checkpoint, for servers that stand by; null: none was encoded since keep_latest(true).
  [[nodiscard]] std::shared_ptr<const Encoded> latest() const;
  void keep_latest(bool keep);

  [[nodiscard]] Figures figures(std::int64_t now_ns) const;
  /// Lines for a log: the first failure at once and then one every kTellNs, and when it is over.
  [[nodiscard]] std::vector<std::string> take_notices(std::int64_t now_ns);

 private:
  void run();
  /// Writes what was taken. The lock is held before and after, but not meanwhile.
  void write(std::unique_lock<std::mutex>& lock);

  Folder* folder_;
  std::int64_t interval_ns_;
  std::int64_t (*clock_ns_)();
  std::int64_t began_ns_;
  std::optional<std::int64_t> taken_ns_;
  std::int64_t handed_over_ns_ = 0;  // by the clock, after the copy
  std::int64_t asked_ns_;            // in due()
  std::int64_t told_ns_ = INT64_MIN;
  bool told_trouble_ = false;

  Checkpoint checkpoint_;  // belongs to the thread while busy_
  std::vector<std::byte> file_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool busy_ = false, stop_ = false;
  bool keep_latest_ = false;
  std::shared_ptr<const Encoded> latest_;
  Figures figures_;
  std::int64_t newest_ns_ = 0;
  std::int64_t write_ns_ = 0;  // of the last write
  std::string trouble_;        // of the last write; empty: it was good
  std::thread thread_;         // none for WritesIn::kWriteNow
};

}  // namespace tandem::checkpoint
