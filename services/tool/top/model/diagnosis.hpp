#pragma once
// Says in words why a client lags, or why a session does not keep its rate.

#include <string>
#include <vector>

#include "services/tool/top/model/overview.hpp"
#include "services/tool/top/model/trouble.hpp"

namespace tandem::top {

/// What the reports of a client's last 20 s tell, besides its newest status. Numbers are finite.
struct ClientFacts {
  double lag_ms = 0;         ///< corrected by the difference of the clocks, if that is large
  double worst_lag_ms = 0;   ///< of the last 20 s
  double clock_ahead_s = 0;  ///< of the client's host, compared with the server's; 0: not noticeable
  double rate_hz = 0;
  double period_ms = 0;  ///< of a frame; 0: unknown
  double work_ms = 0;    ///< its own work for a frame
  double late_ms = 0;    ///< by how much its reports were written later than is due, at most
  int late_reports = 0;
  int reports = 0, missing = 0;  ///< of the last minute
  std::uint64_t rejoins = 0;     ///< in the last minute
};
[[nodiscard]] ClientFacts facts_of(const Overview& overview, const Client& client);

struct Diagnosis {
  Trouble trouble = Trouble::kNone;
  std::string why;                 ///< in a few words; empty: nothing is wrong
  std::vector<std::string> facts;  ///< sentences: what that is concluded from, and what helps
};
[[nodiscard]] Diagnosis diagnose(const Overview& overview, const Client& client, Moment now);
[[nodiscard]] Diagnosis diagnose(const Overview& overview, const StreamKey& key, const Stream& stream,
                                 Moment now);

/// A number of the network that may be printed: finite, and of limited length.
[[nodiscard]] double sane(double number);
/// A duration in words: "12 s", "3 min".
[[nodiscard]] std::string duration_text(std::int64_t duration_ns);

}  // namespace tandem::top
