#include "tests/bench/lab/framerate/thin_device.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

namespace tandem::lab {
namespace {

namespace fs = std::filesystem;
using std::chrono::duration;

// The minimum quota of control groups: shorter turns make the processor more even.
constexpr std::int64_t kTurnUs = 1000;

Result<void> write_text(const fs::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text << std::flush;
  if (!file) return fail(ErrorCode::kIo, fmt::format("{}: {}", path.string(), std::strerror(errno)));
  return {};
}

class ControlGroup final : public ThinDevice {
 public:
  ControlGroup(fs::path path, bool unified) : path_(std::move(path)), unified_(unified) {}
  ControlGroup(const ControlGroup&) = delete;
  ControlGroup& operator=(const ControlGroup&) = delete;
  ~ControlGroup() override {
    // A process that was just killed may still be in the group.
    std::error_code error;
    for (int i = 0; i < 50 && !fs::remove(path_, error) && error; ++i)
      std::this_thread::sleep_for(duration<double>(0.02));
  }
  [[nodiscard]] std::string name() const override { return unified_ ? "cgroup v2" : "cgroup v1"; }
  [[nodiscard]] std::string procs() const override { return path_ / "cgroup.procs"; }
  Result<void> set_share(double share) override {
    const auto period_us = std::clamp<std::int64_t>(
        std::llround(static_cast<double>(kTurnUs) / std::clamp(share, 0.001, 1.0)), kTurnUs, 1'000'000);
    if (unified_) return write_text(path_ / "cpu.max", fmt::format("{} {}", kTurnUs, period_us));
    // In this order both values are legal at every moment.
    return write_text(path_ / "cpu.cfs_quota_us", "-1")
        .and_then([&] { return write_text(path_ / "cpu.cfs_period_us", std::to_string(period_us)); })
        .and_then([&] { return write_text(path_ / "cpu.cfs_quota_us", std::to_string(kTurnUs)); });
  }
  void hold(pid_t /*process*/) override {}
  void release() override {}

 private:
  fs::path path_;
  bool unified_;
};

class StopAndGo final : public ThinDevice {
 public:
  StopAndGo() = default;
  StopAndGo(const StopAndGo&) = delete;
  StopAndGo& operator=(const StopAndGo&) = delete;
  ~StopAndGo() override = default;
  [[nodiscard]] std::string name() const override { return "SIGSTOP and SIGCONT"; }
  [[nodiscard]] std::string procs() const override { return {}; }
  Result<void> set_share(double share) override {
    share_ = std::clamp(share, 0.001, 1.0);
    return {};
  }
  void hold(pid_t process) override {
    thread_ = std::jthread([process, share = share_](const std::stop_token& stop) {
      const duration<double> turn(1e-6 * static_cast<double>(kTurnUs));
      while (!stop.stop_requested()) {
        kill(process, SIGCONT);
        std::this_thread::sleep_for(turn);
        kill(process, SIGSTOP);
        std::this_thread::sleep_for(turn * (1 / share - 1));
      }
      kill(process, SIGCONT);
    });
  }
  void release() override { thread_ = {}; }

 private:
  double share_ = 1;
  std::jthread thread_;
};

}  // namespace

std::unique_ptr<ThinDevice> ThinDevice::create() {
  const struct {
    const char* folder;
    bool unified;
  } places[] = {{"/sys/fs/cgroup/cpu", false}, {"/sys/fs/cgroup", true}};
  for (const auto& place : places) {
    const fs::path path = fs::path(place.folder) / fmt::format("tandem-{}", getpid());
    std::error_code error;
    if (!fs::exists(fs::path(place.folder) / "cgroup.procs", error) || !fs::create_directory(path, error))
      continue;
    auto group = std::make_unique<ControlGroup>(path, place.unified);
    if (group->set_share(0.5)) return group;
  }
  return std::make_unique<StopAndGo>();
}

}  // namespace tandem::lab
