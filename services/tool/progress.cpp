#include "services/tool/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <utility>

#include "sdk/wire/clock.hpp"

namespace tandem::tool {
namespace {

constexpr std::int64_t kPatienceNs = 2'000'000'000;
constexpr std::int64_t kPeriodNs = 250'000'000;

}  // namespace

Progress::Progress(std::string what, std::uint64_t total)
    : what_(std::move(what)),
      total_(total),
      terminal_(::isatty(STDERR_FILENO) != 0),
      next_ns_(transport::steady_ns() + kPatienceNs) {}

Progress::~Progress() {
  if (shown_) std::fputs("\r\x1b[K", stderr);
}

void Progress::at(std::uint64_t done) {
  if (!terminal_) return;
  const std::int64_t now_ns = transport::steady_ns();
  if (now_ns < next_ns_) return;
  next_ns_ = now_ns + kPeriodNs;
  shown_ = true;
  std::fputs(fmt::format("\r\x1b[K{}: {} of {}", what_, done, total_).c_str(), stderr);
  std::fflush(stderr);
}

}  // namespace tandem::tool
