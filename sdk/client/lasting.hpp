#pragma once
// What a client keeps when the server starts anew.

#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "sdk/client/core_options.hpp"
#include "sdk/client/drawing/picture.hpp"
#include "sdk/client/session/sent_inputs.hpp"
#include "sdk/client/session/statistics.hpp"
#include "sdk/client/session/stream_choice.hpp"
#include "sdk/client/session/told_news.hpp"
#include "sdk/wire/port.hpp"

namespace tandem::client {

/// The data that the epochs of one client share. Not thread-safe, except `pictures`.
struct Lasting {
  Lasting(CoreOptions wanted, transport::ClientPort& connection, CoreListener& told)
      : options(std::move(wanted)),
        preference(read_preference(options.prefer)),
        port(connection),
        listener(told),
        news(told) {}

  CoreOptions options;
  StreamPreference preference;
  transport::ClientPort& port;
  CoreListener& listener;
  ToldNews news;
  Statistics statistics;
  SentInputs sent;
  std::vector<InputOutcome> outcomes;  ///< outcomes that the listener was not told yet
  PictureExchange pictures;
  bool shows_uncorrected = false;
  std::optional<double> own_step_ns;  ///< empty until it was measured
  std::uint32_t join_attempts = 0;    ///< of earlier epochs
  bool told_measured = false;         ///< that the stream which was asked for is not offered

  bool server_alive = false;
  std::int64_t told_ns = INT64_MIN / 2;  ///< when the server's last status came
  bool makes_frames = false;             ///< as it said
  std::int64_t part_ns = INT64_MIN / 2;  ///< when the last part of a snapshot came

  bool ack_due = false;
  std::int64_t last_ack_ns = 0;
  Frame acknowledged = 0;          ///< `applied` of the last acknowledgement
  std::int64_t poll_began_ns = 0;  ///< by options.measure_ns

  [[nodiscard]] std::int64_t measure() const {
    return options.measure_ns != nullptr ? options.measure_ns() : 0;
  }
  /// A poll that has worked for so long begins no further step, so that a stream whose steps take long
  /// freezes nobody. Without a clock none ever has.
  static constexpr std::int64_t kMaxPollNs = 50'000'000;
  [[nodiscard]] bool is_spent() const { return measure() - poll_began_ns >= kMaxPollNs; }
  void log(LogLevel level, std::string_view line) const {
    if (options.log) options.log(level, line);
  }
};

}  // namespace tandem::client
