#include "services/tool/record_metrics.hpp"

#include <spdlog/spdlog.h>
#include <sys/statvfs.h>

#include <filesystem>
#include <system_error>

namespace tandem::tool {
namespace {

// Symbolic links are followed, as the recorder follows them.
std::string folder_of(const std::string& file) {
  std::error_code error;
  const auto whole = std::filesystem::weakly_canonical(std::filesystem::absolute(file, error), error);
  return error || whole.parent_path().empty() ? "." : whole.parent_path().string();
}

}  // namespace

Result<void> RecordMetrics::serve(const metrics::Address& address, const std::string& session,
                                  const std::string& file) {
  session_ = session;
  folder_ = folder_of(file);
  auto endpoint =
      metrics::Endpoint::create(address, health_, [this](metrics::Page& page) { describe(page); });
  if (!endpoint) return tl::unexpected(endpoint.error());
  endpoint_ = std::move(*endpoint);
  spdlog::info(endpoint_->notice());
  return {};
}

void RecordMetrics::turned(const client::ClientCore& core, const Kept& kept, std::int64_t now_ns) {
  if (!endpoint_) return;
  if (now_ns >= next_ns_) {
    next_ns_ = now_ns + kPeriodNs;
    FiguresNow figures;
    figures.kept = kept;
    figures.client = {.status = core.status(), .lag_s = core.statistics().smoothed_latency_ns / 1e9};
    watch_.saw(figures.client.status, now_ns);
    health_.saw_frames(figures.client.status.frames_applied, core.frames_are_due(now_ns), now_ns);
    latest_.offer(figures);
  }
  health_.beat(now_ns, kept.good ? watch_.obstacle() : "the recording could not be written");
}

void RecordMetrics::describe(metrics::Page& page) const {
  const FiguresNow figures = latest_.get();
  page.count("tandem_recorder_frames_total", "Frames that were recorded",
             static_cast<double>(figures.kept.progress.frames));
  page.count("tandem_recorder_written_bytes_total", "Bytes that were written to the file",
             static_cast<double>(figures.kept.progress.written_bytes));
  page.count("tandem_recorder_snapshots_cut_total", "Snapshots that the recorder made for its file",
             static_cast<double>(figures.kept.progress.snapshots_cut));
  page.gauge("tandem_recorder_file_good", "1 while the file could be written", figures.kept.good ? 1 : 0);
  struct statvfs disk {};
  if (statvfs(folder_.c_str(), &disk) == 0) {
    const auto block_bytes = static_cast<double>(disk.f_frsize);
    page.gauge("tandem_recorder_disk_free_bytes", "Space that is left where the file is",
               static_cast<double>(disk.f_bavail) * block_bytes);
    page.gauge("tandem_recorder_disk_size_bytes", "Size of the file system where the file is",
               static_cast<double>(disk.f_blocks) * block_bytes);
  }
  metrics::describe(page, session_, figures.client);
}

}  // namespace tandem::tool
