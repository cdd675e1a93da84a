#include "services/tandemd/console.hpp"
#include "sdk/core/tables/codec_table.hpp"
#include "sdk/wire/units.hpp"
#include "services/host/host.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace tandem::daemon {

std::string gains_text(const StreamParameters& parameters) {
  if (parameters.step.decay == 0) return {};  // no tracker
  return fmt::format("gains {:.2f} {:.3f} decay {:.1f} %", parameters.codec.velocity_gain / 32768.0,
                     parameters.codec.acceleration_gain / 65536.0, parameters.step.decay / 655.36);
}

std::string coding_text(const host::StreamConfig& stream) {
  std::string text = fmt::format("codec {}, predictor {}", stream.layout.codec, stream.layout.predictor);
  const auto metres = [&](std::int32_t units) { return units * stream.lattice.unit; };
  if (codec_traits(stream.layout.codec)->reads_threshold)
    text += fmt::format(", threshold {:.4g} m", metres(stream.layout.parameters.codec.threshold));
  if (stream.quality) {
    text += fmt::format(" (automatic, up to {:.4g} m)", metres(stream.quality->largest_threshold));
    if (stream.quality->target_mbit_per_s > 0)
      text += fmt::format(", target {} Mbit/s", stream.quality->target_mbit_per_s);
  }
  if (stream.cap_kbit_s > 0) text += fmt::format(", cap {} kbit/s on the wire", stream.cap_kbit_s);
  if (stream.budget != kNoBudget) text += fmt::format(", budget {} bytes a frame", stream.budget);
  return text;
}

std::string hidden_text(const host::Host& host) {
  const std::uint32_t hidden = host.totals().hidden;
  return fmt::format("{} of {} bodies are not shown", hidden, hidden + host.present().bodies);
}

namespace {

// The numbers of clients by stream; empty if there is only one stream.
std::string streams_text(const host::HostTotals& totals) {
  std::string text;
  for (const host::StreamTotals& stream : totals.streams) {
    if (totals.streams.size() > 1)
      text += fmt::format("  {}{} {}+{}", stream.name,
                          stream.encodes ? "" : fmt::format("@{:g}", 1e-3 * stream.delay_ms),
                          stream.participants, stream.observers);
  }
  return text;
}

std::string age_text(const std::optional<checkpoint::Figures>& checkpoints) {
  if (!checkpoints) return {};
  return checkpoints->age_s ? fmt::format("  checkpoint {:.1f} s old", *checkpoints->age_s)
                            : std::string("  no checkpoint yet");
}

}  // namespace

Console::Console() : terminal_(isatty(STDERR_FILENO) == 1) {}
Console::~Console() { clear_line(); }

void Console::clear_line() {
  if (line_shown_) std::fputs("\r\x1b[K", stderr);
  line_shown_ = false;
}

void Console::show(host::Host& host, const std::optional<checkpoint::Figures>& checkpoints,
                   std::int64_t now_ns) {
  const auto log = [this](spdlog::level::level_enum level, const std::vector<std::string>& lines) {
    if (!lines.empty()) clear_line();
    for (const std::string& line : lines) spdlog::log(level, line);
  };
  log(spdlog::level::warn, host.take_warnings());
  log(spdlog::level::info, host.take_notices());
  if (!terminal_ || now_ns < next_ns_) return;
  const host::HostTotals totals = host.totals();
  const double elapsed_s = std::max(static_cast<double>(now_ns - last_ns_) * 1e-9, 1e-9);
  const double frames = static_cast<double>(totals.frames - last_.frames);
  const double bits = static_cast<double>(totals.payload_bytes - last_.payload_bytes) * 8;
  const double corrected = static_cast<double>(totals.corrected - last_.corrected);
  clear_line();
  const std::string line = fmt::format(
      "frame {}  {:.1f} Hz  {:.2f} Mbit/s  {:.0f} corrected  {:.1f} ms  {} participants  {} observers "
      " window {}  threshold {:.3g} m  {}",
      host.frame(), frames / elapsed_s, bits / kBitsPerMbit / elapsed_s, frames > 0 ? corrected / frames : 0,
      host.report().frame_ms, host.participants(), host.observers(), host.window(),
      host.threshold_m(host.first_made()), gains_text(host.parameters(host.first_made())));
  const std::string hidden = totals.hidden == 0 ? "" : "  " + hidden_text(host);
  std::fputs((line + streams_text(totals) + age_text(checkpoints) + hidden).c_str(), stderr);
  std::fflush(stderr);
  line_shown_ = true;
  last_ = totals;
  last_ns_ = now_ns;
  next_ns_ = now_ns + kSecond;
}

}  // namespace tandem::daemon
