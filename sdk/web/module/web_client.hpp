#pragma once
// A client whose connection, clock and screen are JavaScript's.

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/client/client_core.hpp"
#include "sdk/transport/websocket/web_port.hpp"
#include "tandem/client_types.hpp"
#include "tandem/result.hpp"

namespace tandem::web {

/// The client of every other transport on a transport::WebPort, and what JavaScript asks of it, as JSON and
/// arrays. Not thread-safe.
class WebClient final : private client::CoreListener {
 public:
  struct Options {
    transport::ClientId id = 0;  ///< random, not 0
    ClientRole role = ClientRole::kParticipant;
    std::uint32_t lead = 1;
    std::uint32_t max_delay_ms = 0;                       ///< as CoreOptions
    std::uint32_t cap_kbit_s = 0;                         ///< the same; the gateway holds it
    std::function<void(LogLevel, std::string_view)> log;  ///< may be empty
    std::int64_t (*measure_ns)() = nullptr;               ///< as CoreOptions
  };

  explicit WebClient(Options options);
  ~WebClient() override = default;
  WebClient(const WebClient&) = delete;
  WebClient& operator=(const WebClient&) = delete;

  [[nodiscard]] transport::WebPort& port() { return port_; }
  [[nodiscard]] const transport::WebPort& port() const { return port_; }
  [[nodiscard]] const client::ClientCore& core() const { return core_; }

  /// Takes what the port received and does what is due. Returns the steady time at which it wants to be
  /// called again even if nothing arrives.
  std::int64_t poll(client::Now now);
  /// As ClientCore::send().
  Result<std::uint64_t> send(transport::InputKind kind, std::vector<double> values, transport::Bytes bytes,
                             client::Now now);

  /// Returns the events since the last call, oldest first, as a JSON list of objects:
  /// {"type": "session", "epoch": N}, {"type": "applied", "epoch": N, "frame": N, "hash": "16 hex digits",
  /// "bytes": N, "corrected": N}, {"type": "outcome", "number": N, "kind": "acted" | "refused" | "unknown",
  /// "frame": N, "reason": "text", "latencyMs": X}, and of the session's keys and events {"type": "happened",
  /// "epoch", "frame", "number", "kind", "body": null or {"slot", "reuse"}, "data": hex digits},
  /// {"type": "lost" | "takenBack", "epoch", "frame", "count"}, {"type": "key", "epoch", "frame", "key",
  /// "value": null or hex digits}. Empty when nothing did.
  [[nodiscard]] std::string take_events();
  /// Figures as a JSON object; its members are those of `ModuleStatus` in ../tandem.
  [[nodiscard]] std::string status() const;
  /// A JSON list of {"name", "radius", "colour": "#rrggbbaa", "shape", "shapeValues"}.
  [[nodiscard]] std::string types() const;
  /// The fields of the data of bodies as a JSON list: [{"name", "kind"}], the kind a word as `u8`.
  [[nodiscard]] std::string data_fields() const;
  /// The records of all slots at the last frame applied; empty if the stream played has none. Valid until the
  /// next poll().
  [[nodiscard]] std::span<const std::byte> data() const;
  /// The session's scene: TandemSession::scene_json; empty before one is known.
  [[nodiscard]] std::string_view scene_json() const;

  /// As ClientCore::show_uncorrected().
  void show_uncorrected(bool on) { core_.show_uncorrected(on); }
  /// As Client::sample(). The arrays are valid until the next call.
  [[nodiscard]] const Sample* sample(SampleMode mode, client::Now now);
  /// For each slot: 1 if the last applied delta corrected its body.
  [[nodiscard]] std::span<const std::uint8_t> corrected() const { return corrected_; }
  /// For each slot: the frame, modulo 2^32, of the last delta that corrected it; 0 if none of this epoch did.
  [[nodiscard]] std::span<const std::uint32_t> corrected_in() const { return corrected_in_; }

 private:
  // Events are bounded by what one poll applies, and dropped where nobody takes them.
  static constexpr std::size_t kMaxEventBytes = 1U << 20U;
  /// The same with keys and events, which are told once: 64 frames of them have 2.6 MB.
  static constexpr std::size_t kMaxNewsBytes = 1U << 22U;

  void on_session(const transport::SessionMessage& session) override;
  void on_applied(Epoch epoch, const client::CompleteDelta& delta) override;
  void on_outcome(const client::InputOutcome& outcome) override;
  void on_happened(const client::Happened& event) override;
  void on_events_lost(Epoch epoch, Frame frame, std::uint64_t count) override;
  void on_events_taken_back(Epoch epoch, Frame frame, std::uint64_t count) override;
  void on_key(Epoch epoch, Frame frame, const KeyChange& change) override;
  /// The next object of events_, for as long as there is room.
  template <class Fill>
  void add_event(const char* type, Fill&& fill, std::size_t most = kMaxEventBytes);

  transport::WebPort port_;
  client::ClientCore core_;
  std::string events_;
  std::vector<std::uint8_t> corrected_;
  std::vector<std::uint32_t> corrected_in_;
  std::uint32_t corrected_count_ = 0;
  std::int64_t polled_ns_ = 0;    ///< steady
  std::optional<double> lag_ns_;  ///< publish to applied by the server's clock, over about half a second
  Sample sample_;
};

}  // namespace tandem::web
