#pragma once
// A ClientCore with a clock, a port and optionally a thread. A tandem_client is a handle of it.

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>
#include <vector>

#include "sdk/client/api/drawn_scene.hpp"
#include "sdk/client/api/event_log.hpp"
#include "sdk/client/client_core.hpp"

namespace tandem::api {

/// The scene of a session, and the epoch that it belongs to.
struct KnownScene {
  Epoch epoch = 0;
  Result<DrawnScene> scene;
};

/// All members may be called from any thread, including end() and the destructor. The port waits without the
/// lock, so no thread waits for the network.
class RunningClient {
 public:
  using Clock = client::Now (*)();

  /// `background`: the client has a thread that does its work.
  RunningClient(client::CoreOptions options, std::unique_ptr<transport::ClientPort> port, Clock clock,
                bool background);
  ~RunningClient();
  RunningClient(const RunningClient&) = delete;
  RunningClient& operator=(const RunningClient&) = delete;

  /// Makes calls that are waiting return kInvalidHandle soon.
  void end();

  /// Does one round of work and waits for the next. Errors: kWrongThread, and those of usable().
  Result<void> update(double wait_s);
  /// Errors: also kTimeout.
  Result<void> wait_until_playing(double timeout_s);
  /// Errors: kNotReady, kOutOfOrder, kInvalidArgument, kTransport.
  Result<std::uint64_t> send(transport::InputKind kind, std::vector<double> values, transport::Bytes bytes);
  /// Errors: kInternal, kOutOfMemory.
  Result<void> prefer(std::string_view preference);
  [[nodiscard]] std::optional<Event> next_event();
  [[nodiscard]] std::optional<QueuedNews> next_news();
  [[nodiscard]] Result<ClientStatus> status() const;
  [[nodiscard]] std::uint64_t events_dropped() const;
  /// Calls `look(session)` while the client is locked; null before one is known.
  template <class Look>
  auto with_session(Look&& look) const {
    const std::lock_guard lock(mutex_);
    return look(core_.session());
  }
  /// Calls `look(core)` while the client is locked.
  template <class Look>
  auto with_core(Look&& look) const {
    const std::lock_guard lock(mutex_);
    return look(core_);
  }
  /// The scene that was read last; null before the first.
  [[nodiscard]] std::shared_ptr<const KnownScene> scene() const;
  void hold_scene(std::shared_ptr<const KnownScene> scene);
  [[nodiscard]] ClientPhase phase() const { return phase_; }
  /// Samples. Only the first call takes the lock. Errors: kNotReady, kCapacity (`frame` has capacity, epoch
  /// and has_orientations).
  Result<void> sample(const tandem_sample_options& options, const tandem_columns& columns,
                      tandem_frame& frame);

 private:
  /// Errors: what went wrong in a round. The error stays, because the core may have been left half-way.
  [[nodiscard]] Result<void> usable() const;
  Result<void> round(std::int64_t longest_ns);
  Result<void> poll(std::int64_t& due_ns);
  void work();
  [[nodiscard]] bool has_thread() const { return thread_.joinable(); }

  const Clock clock_;
  const bool participant_;
  std::unique_ptr<transport::ClientPort> port_;
  EventLog events_;
  mutable std::mutex mutex_;  // guards core_ except its sample(), events_, fault_ and scene_
  std::condition_variable phase_changed_;
  client::ClientCore core_;
  std::optional<ErrorCode> fault_;
  std::shared_ptr<const KnownScene> scene_;
  std::atomic<ClientPhase> phase_ = ClientPhase::kSearching;
  std::atomic<bool> sampling_ = false;
  std::atomic<bool> ending_ = false;
  std::atomic<bool> updating_ = false;  // without a thread: a caller is in round()
  std::thread thread_;
};

}  // namespace tandem::api
