#include "services/program/logging/log.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <memory>

#include "services/program/logging/lines.hpp"

namespace tandem::logging {
namespace {

std::shared_ptr<Context> context() {
  static const auto the_context = std::make_shared<Context>();
  return the_context;
}

std::int64_t steady_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

// systemd says which device and inode its end of stderr has; a redirected stderr has others.
bool journald_reads_stderr() {
  const char* const stream = std::getenv("JOURNAL_STREAM");
  struct stat info = {};
  if (stream == nullptr || fstat(STDERR_FILENO, &info) != 0) return false;
  return stream == std::to_string(info.st_dev) + ':' + std::to_string(info.st_ino);
}

spdlog::level::level_enum spdlog_level(Level level) {
  switch (level) {
    case Level::kError:
      return spdlog::level::err;
    case Level::kWarning:
      return spdlog::level::warn;
    case Level::kDebug:
      return spdlog::level::debug;
    case Level::kInfo:
      break;
  }
  return spdlog::level::info;
}

}  // namespace

std::optional<Format> read_format(std::string_view text) {
  if (text == "text") return Format::kText;
  if (text == "json") return Format::kJson;
  return std::nullopt;
}

std::optional<Level> read_level(std::string_view text) {
  if (text == "error") return Level::kError;
  if (text == "warning") return Level::kWarning;
  if (text == "info") return Level::kInfo;
  if (text == "debug") return Level::kDebug;
  return std::nullopt;
}

void begin(const std::string& program, const LogOptions& options) {
  const Look text = journald_reads_stderr() ? Look::kJournal : Look::kText;
  auto sink = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  sink->set_formatter(
      std::make_unique<LineFormatter>(options.format == Format::kJson ? Look::kJson : text, context()));
  auto logger = std::make_shared<spdlog::logger>(program, std::make_shared<LimitedSink>(sink, &steady_ns));
  logger->set_level(spdlog_level(options.level));
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
