#pragma once
// The output of tandemd while it runs: log lines, and on a terminal one live line.

#include <cstdint>
#include <optional>
#include <string>

#include "services/host/checkpoint/writer.hpp"
#include "services/host/host.hpp"

namespace tandem::daemon {

/// Gains and decay of codec `tracker`; an empty text for the other codecs.
[[nodiscard]] std::string gains_text(const StreamParameters& parameters);

/// Describes how bodies are predicted and corrected from the first frame on: codec, predictor, threshold,
/// target and budget.
[[nodiscard]] std::string coding_text(const host::StreamConfig& stream);

/// Says how many bodies clients do not see.
[[nodiscard]] std::string hidden_text(const host::Host& host);

/// Writes to stderr. Not thread-safe.
class Console {
 public:
  Console();
  ~Console();
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  /// Logs the host's notices and, once a second on a terminal, rewrites the live line. `checkpoints`: empty
  /// if there are none.
  void show(host::Host& host, const std::optional<checkpoint::Figures>& checkpoints, std::int64_t now_ns);

 private:
  void clear_line();

  bool terminal_;
  bool line_shown_ = false;
  std::int64_t next_ns_ = 0;
  host::HostTotals last_;
  std::int64_t last_ns_ = 0;
};

}  // namespace tandem::daemon
