#pragma once
// How a line of a log looks, and which lines are left out: what log.cpp gives to spdlog.

#include <spdlog/formatter.h>
#include <spdlog/sinks/base_sink.h>

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "services/program/logging/log.hpp"
#include "services/program/token_bucket.hpp"

namespace tandem::logging {

/// The session that a program works for; shared by its formatters. Thread-safe.
class Context {
 public:
  void set(std::string session, std::uint64_t epoch);
  [[nodiscard]] std::pair<std::string, std::uint64_t> get() const;

 private:
  mutable std::mutex mutex_;
  std::string session_;
  std::uint64_t epoch_ = 0;
};

enum class Look : std::uint8_t { kText, kJournal, kJson };

/// Formats a line with its end. Control characters of a message become spaces, so that one line stays one.
class LineFormatter final : public spdlog::formatter {
 public:
  LineFormatter(Look look, std::shared_ptr<const Context> context)
      : look_(look), context_(std::move(context)) {}
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& out) override;
  [[nodiscard]] std::unique_ptr<spdlog::formatter> clone() const override;

 private:
  Look look_;
  std::shared_ptr<const Context> context_;
};

/// Passes lines on to another sink, as far as the rate permits. Thread-safe.
class LimitedSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  static constexpr std::int64_t kTellNs = 10'000'000'000;

  LimitedSink(std::shared_ptr<spdlog::sinks::sink> inner, std::int64_t (*clock_ns)())
      : inner_(std::move(inner)), clock_ns_(clock_ns) {}

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override;
  void flush_() override { inner_->flush(); }

 private:
  void tell_left_out(const spdlog::details::log_msg& message);

  std::shared_ptr<spdlog::sinks::sink> inner_;
  std::int64_t (*clock_ns_)();
  accounts::TokenBucket lines_{kLinesPerSecond, kBurst};
  std::uint64_t left_out_ = 0;
  std::int64_t told_ns_ = INT64_MIN / 2;
};

}  // namespace tandem::logging
