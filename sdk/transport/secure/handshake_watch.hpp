#pragma once
// Notices that Cyclone DDS hears nothing any more, because the handshakes of DDS Security spin.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace tandem::transport::secure {

/// What a thread of this process has done since its start.
struct ThreadUse {
  int id = 0;
  std::string name;
  std::uint64_t user_ms = 0, system_ms = 0;  ///< processor time
  std::uint64_t waits = 0;                   ///< how often it waited for something
  std::uint64_t turns = 0;                   ///< how often it stopped running, for whatever reason
};

/// The threads of this process; empty where the system does not say, which is anything but Linux.
[[nodiscard]] std::vector<ThreadUse> threads_of_this_process();

/// The thread `fsm` of Cyclone DDS conducts the handshakes, and can spin for ever with their lock
/// (SECURITY.md). From then on nobody can join. As soon as somebody else comes or goes, the thread
/// `dq.builtins`, which learns that, waits for that lock for ever, and in the end nothing is heard any more.
///
/// A busy machine does not look like that. Handshakes that make progress are caused by packets, for which
/// `dq.builtins` runs. Those that repeat themselves send packets, which is time in the system. A thread that
/// lacks a processor uses none.
class HandshakeWatch {
 public:
  /// True if `fsm` has computed without ever waiting, and hardly in the system, and either `dq.builtins` has
  /// not run at all for kPatienceNs or it was for kAloneUserMs. `now_ns` is a steady clock. Not thread-safe.
  [[nodiscard]] bool stuck(const std::vector<ThreadUse>& threads, std::int64_t now_ns);

  static constexpr std::int64_t kPatienceNs = 10'000'000'000;
  static constexpr std::uint64_t kLeastUserMs = 2000;     ///< of `fsm` while `dq.builtins` stands
  static constexpr std::uint64_t kAloneUserMs = 120'000;  ///< hundreds of clients need a few seconds to join
  static constexpr std::uint64_t kUserToSystem =
      10;  ///< a thread that spins has 1 or 2 % in the system, by interrupts

 private:
  struct Since {
    ThreadUse use;
    std::int64_t ns = 0;
  };
  std::map<int, Since> spins_, stands_;  // by thread: since when it does
};

}  // namespace tandem::transport::secure
