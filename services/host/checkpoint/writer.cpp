#include "services/host/checkpoint/writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "services/host/checkpoint/format.hpp"

namespace tandem::checkpoint {
namespace {

double ms(std::int64_t ns) { return static_cast<double>(ns) * 1e-6; }
double seconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-9; }

// A write that takes longer than this is told of.
constexpr std::int64_t kSlowNs = 10'000'000'000;

}  // namespace

Writer::Writer(Folder* folder, std::int64_t interval_ns, std::int64_t (*clock_ns)(),
               std::vector<std::byte> memory, WritesIn writes_in)
    : folder_(folder),
      interval_ns_(interval_ns),
      clock_ns_(clock_ns),
      began_ns_(clock_ns()),
      asked_ns_(began_ns_) {
  TANDEM_ASSERT(interval_ns > 0 && clock_ns != nullptr);
  checkpoint_.engine_state = std::move(memory);
  if (writes_in == WritesIn::kOwnThread) thread_ = std::thread([this] { run(); });
}

Writer::~Writer() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

bool Writer::idle() const {
  const std::lock_guard lock(mutex_);
  return !busy_;
}

bool Writer::due(std::int64_t now_ns) {
  const std::int64_t frame_ns = now_ns - std::exchange(asked_ns_, now_ns);
  const std::lock_guard lock(mutex_);
  if (busy_ || !taken_ns_) return !busy_;
  // A disk that needs half of the interval is slow, and asking more of it would make it slower.
  const std::int64_t ahead_ns = std::clamp<std::int64_t>(frame_ns + write_ns_, 0, interval_ns_ / 2);
  return now_ns - *taken_ns_ >= interval_ns_ - ahead_ns;
}

void Writer::take(std::int64_t now_ns, const std::function<void(Checkpoint&)>& fill) {
  TANDEM_ASSERT(idle());
  const std::int64_t start_ns = clock_ns_();
  fill(checkpoint_);
  taken_ns_ = now_ns;
  {
    const std::lock_guard lock(mutex_);
    busy_ = true;
    handed_over_ns_ = clock_ns_();
    figures_.copy_ms_max = std::max(figures_.copy_ms_max, ms(handed_over_ns_ - start_ns));
  }
  changed_.notify_all();
}

bool Writer::finish(std::int64_t longest_ns) {
  if (!thread_.joinable()) write_now();
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, std::chrono::nanoseconds(longest_ns), [this] { return !busy_; });
}

void Writer::write_now() {
  TANDEM_ASSERT(!thread_.joinable());
  std::unique_lock lock(mutex_);
  if (busy_) write(lock);
}

void Writer::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return busy_ || stop_; });
    if (!busy_) return;
    write(lock);
  }
}

void Writer::write(std::unique_lock<std::mutex>& lock) {
  TANDEM_ASSERT(lock.owns_lock() && busy_ && taken_ns_);
  const std::int64_t taken_ns = *taken_ns_;
  const std::int64_t start_ns = handed_over_ns_;
  lock.unlock();
  const auto encoded = encode(checkpoint_, file_);
  const Moment moment{checkpoint_.epoch, checkpoint_.frame};
  // Servers that stand by do not wait for the disk.
  lock.lock();
  if (encoded && keep_latest_)
    latest_ = std::make_shared<const Encoded>(Encoded{moment, checkpoint_.journal, file_});
  lock.unlock();
  const auto stored = !encoded || folder_ == nullptr ? encoded : folder_->store(moment, file_);
  const std::int64_t took_ns = clock_ns_() - start_ns;
  lock.lock();
  figures_.write_ms_max = std::max(figures_.write_ms_max, ms(took_ns));
  write_ns_ = took_ns;
  if (stored) {
    ++figures_.written;
    figures_.frame = checkpoint_.frame;
    figures_.bytes = file_.size();
    newest_ns_ = taken_ns;
    trouble_.clear();
  } else {
    ++figures_.failed;
    trouble_ = stored.error().message;
  }
  busy_ = false;
  changed_.notify_all();
}

std::shared_ptr<const Encoded> Writer::latest() const {
  const std::lock_guard lock(mutex_);
  return latest_;
}

void Writer::keep_latest(bool keep) {
  const std::lock_guard lock(mutex_);
  keep_latest_ = keep;
  if (!keep) latest_.reset();
}

Figures Writer::figures(std::int64_t now_ns) const {
  const std::lock_guard lock(mutex_);
  Figures now = figures_;
  if (now.written > 0) now.age_s = seconds(std::max<std::int64_t>(now_ns - newest_ns_, 0));
  return now;
}

std::vector<std::string> Writer::take_notices(std::int64_t now_ns) {
  std::string trouble;
  std::int64_t newest_ns = began_ns_;
  bool none = true;
  {
    const std::lock_guard lock(mutex_);
    trouble = trouble_;
    none = figures_.written == 0;
    if (!none) newest_ns = newest_ns_;
    if (trouble.empty() && busy_ && now_ns - *taken_ns_ > kSlowNs) trouble = "the disk is slow";
  }
  if (trouble.empty()) {
    if (!std::exchange(told_trouble_, false)) return {};
    told_ns_ = INT64_MIN;
    return {"checkpoints are written again"};
  }
  if (told_ns_ != INT64_MIN && now_ns - told_ns_ < kTellNs) return {};
  told_ns_ = now_ns;
  told_trouble_ = true;
  const double age_s = seconds(now_ns - newest_ns);
  return {fmt::format("no checkpoint can be written; {}; the world goes on, {}", trouble,
                      none ? fmt::format("without a checkpoint of this run for {:.0f} s", age_s)
                           : fmt::format("and the last checkpoint is {:.0f} s old", age_s))};
}

}  // namespace tandem::checkpoint
