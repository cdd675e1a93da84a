#pragma once
// An engine that speaks IMD, at the other end of a TCP connection.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "services/adapters/imd/wire.hpp"
#include "tandem/result.hpp"

namespace tandem::imd {

/// The newest frame and the two before it, as far as there are so many.
struct Newest {
  std::uint64_t number = 0;
  std::vector<float> now, before, earlier;  ///< positions
  std::vector<float> velocities;            ///< of the engine; empty: it sends none
  std::optional<Moment> moment;
  std::optional<std::array<float, 9>> box;
};

/// A thread reads always, because an engine drops frames or waits when nobody does. All members may be called
/// from any thread.
class Source {
 public:
  struct Options {
    std::string host, port;
    std::uint32_t atoms = 0;
    std::int32_t rate = 0;   ///< steps of the engine between two frames; 0: as it likes
    double patience_s = 50;  ///< while nobody listens there
  };
  explicit Source(Options options);
  ~Source();
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  /// Waits for the address to answer, and for the engine's handshake. Errors: kTransport, kTimeout, and those
  /// of EngineReader.
  Result<Session> connect();
  /// Waits until there is a frame behind number `after`, at most that long. Gives false if there is none.
  bool wait(std::uint64_t after, std::chrono::milliseconds limit, Newest& out);
  /// Sends forces; the engine applies the last ones until others come.
  void send_forces(std::span<const std::int32_t> atoms, std::span<const float> forces);
  /// Why nothing will come any more; empty while the connection is good.
  [[nodiscard]] std::string failure() const;

 private:
  Result<void> dial();
  void read();
  void end(const std::string& why);
  void take(Frame& frame);
  bool send(std::span<const std::byte> bytes);
  [[nodiscard]] std::string place() const { return options_.host + ":" + options_.port; }

  Options options_;
  EngineReader reader_;
  int socket_ = -1;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Session> session_;
  Newest newest_;
  std::string failure_;
  std::thread thread_;
};

}  // namespace tandem::imd
