#include "services/program/logging/log.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <memory>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/wire/clock.hpp"
#include "services/program/logging/lines.hpp"

namespace tandem::logging {
namespace {

std::shared_ptr<Context> context() {
  static const auto the_context = std::make_shared<Context>();
  return the_context;
}

// systemd says which device and inode its end of stderr has; a redirected stderr has others.
bool journald_reads_stderr() {
  const char* const stream = std::getenv("JOURNAL_STREAM");
  struct stat info = {};
  if (stream == nullptr || fstat(STDERR_FILENO, &info) != 0) return false;
  return stream == std::to_string(info.st_dev) + ':' + std::to_string(info.st_ino);
}

}  // namespace

void begin(const std::string& program, const LogOptions& options) {
  const Look text = journald_reads_stderr() ? Look::kJournal : Look::kText;
  auto sink = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  sink->set_formatter(std::make_unique<LineFormatter>(options.json ? Look::kJson : text, context()));
  auto logger =
      std::make_shared<spdlog::logger>(program, std::make_shared<LimitedSink>(sink, &transport::steady_ns));
  const auto level = spdlog::level::from_str(options.level);
  TANDEM_ASSERT(level != spdlog::level::off);  // as which it reads an unknown word
  logger->set_level(level);
  logger->flush_on(spdlog::level::trace);
  spdlog::set_default_logger(std::move(logger));
}

void write(LogLevel level, std::string_view line) {
  // In the order of LogLevel.
  constexpr std::array kOurs{spdlog::level::info, spdlog::level::warn, spdlog::level::err};
  spdlog::log(kOurs[static_cast<std::size_t>(level)], line);
}

void error(const std::string& text) { spdlog::error(text); }

void set_context(std::string_view session, std::uint64_t epoch) {
  context()->set(std::string(session), epoch);
}

}  // namespace tandem::logging
