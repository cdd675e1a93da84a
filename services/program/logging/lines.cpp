#include "services/program/logging/lines.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>
#include <string_view>
#include <utility>

#include "services/program/json/json.hpp"

namespace tandem::logging {
namespace {

// syslog(3): LOG_ERR, LOG_WARNING, LOG_INFO, LOG_DEBUG.
int priority_of(spdlog::level::level_enum level) {
  if (level >= spdlog::level::err) return 3;
  if (level == spdlog::level::warn) return 4;
  return level == spdlog::level::info ? 6 : 7;
}

// UTC, to the millisecond.
std::string time_of(spdlog::log_clock::time_point at, std::string_view between, std::string_view zone) {
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(at.time_since_epoch()).count();
  const auto seconds = static_cast<std::time_t>(ms / 1000);
  return fmt::format("{:%Y-%m-%d}{}{:%H:%M:%S}.{:03}{}", fmt::gmtime(seconds), between, fmt::gmtime(seconds),
                     ms % 1000, zone);
}

std::string one_line(std::string_view text) {
  std::string line(text);
  for (char& c : line)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = ' ';
  return line;
}

std::string text_context(const std::pair<std::string, std::uint64_t>& context) {
  const auto& [session, epoch] = context;
  if (session.empty()) return {};
  return epoch == 0 ? fmt::format("[{}] ", session) : fmt::format("[{} {}] ", session, epoch);
}

}  // namespace

void Context::set(std::string session, std::uint64_t epoch) {
  const std::scoped_lock lock(mutex_);
  session_ = std::move(session);
  epoch_ = epoch;
}

std::pair<std::string, std::uint64_t> Context::get() const {
  const std::scoped_lock lock(mutex_);
  return {session_, epoch_};
}

void LineFormatter::format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& out) {
  const std::string_view program(message.logger_name.data(), message.logger_name.size());
  const std::string text = one_line({message.payload.data(), message.payload.size()});
  const auto context = context_->get();
  const auto name = spdlog::level::to_string_view(message.level);
  const std::string_view level(name.data(), name.size());
  std::string line;
  switch (look_) {
    case Look::kText:
      line = fmt::format("[{}] [{}] {}[{}] {}\n", time_of(message.time, " ", ""), program,
                         text_context(context), level, text);
      break;
    case Look::kJournal:
      line = fmt::format("<{}>{}{}\n", priority_of(message.level), text_context(context), text);
      break;
    case Look::kJson:
      line = Json{{"time", time_of(message.time, "T", "Z")},
                  {"level", level},
                  {"program", std::string(program)},
                  {"session", context.first},
                  {"epoch", context.second},
                  {"message", text}}
                 .dump() +
             '\n';
      break;
  }
  out.append(line.data(), line.data() + line.size());
}

std::unique_ptr<spdlog::formatter> LineFormatter::clone() const {
  return std::make_unique<LineFormatter>(look_, context_);
}

void LimitedSink::sink_it_(const spdlog::details::log_msg& message) {
  const bool taken = lines_.take(clock_ns_());
  if (!taken && message.level < spdlog::level::err) {
    ++left_out_;
  } else {
    inner_->log(message);
  }
  if (left_out_ > 0 && clock_ns_() - told_ns_ >= kTellNs) tell_left_out(message);
}

void LimitedSink::tell_left_out(const spdlog::details::log_msg& message) {
  const std::string text = fmt::format("{} lines were left out: there are too many", left_out_);
  spdlog::details::log_msg line = message;
  line.level = spdlog::level::warn;
  line.payload = text;
  inner_->log(line);
  left_out_ = 0;
  told_ns_ = clock_ns_();
}

}  // namespace tandem::logging
