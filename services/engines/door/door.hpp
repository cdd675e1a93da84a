#pragma once
// An engine in another process as a simulation (idl/ENGINE.md).

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "services/engines/door/wire.hpp"
#include "tandem/result.hpp"
#include "tandem/simulation.hpp"

namespace tandem::engine::door {

/// How an engine comes to its server: one of command, path, descriptor and host is set, or command and host.
struct Way {
  std::string command =
      {};                 ///< started with sh(1); it finds the server in TANDEM_DOOR (and TANDEM_DOOR_TOKEN)
  std::string path = {};  ///< of a socket at which the server waits for it
  int descriptor = -1;    ///< a connected socket that the server inherited; it belongs to the door then
  /// An address in numbers: the server waits there for an engine on any machine, in the inline form.
  std::string host = {};
  std::uint16_t port = 0;  ///< of `host`; 0: any free one
  std::string token = {};  ///< what such an engine has to show; may be empty if there is a command
};

/// A token has 16 to 256 printable characters without blanks. Empty: `text` is one; otherwise what is wrong.
[[nodiscard]] std::string wrong_with_token(std::string_view text);

struct DoorOptions {
  Way way = {};
  double connect_limit_s = 60;  ///< from the start of a command to HELLO
  double call_limit_s = 10;     ///< from another engine's connection to HELLO
  double start_limit_s = 60;    ///< from LAYOUT to START, and for SAVE and LOAD
  /// Receives lines for a log; warnings need somebody's attention. An engine's own output begins with
  /// "engine: ".
  std::function<void(const std::string& line, bool warning)> log = [](const std::string&, bool) {};
  const std::atomic<bool>* stop = nullptr;  ///< ends a wait for an engine
  /// Called at least every 50 ms while the caller waits: for an engine, which may take for ever
  /// (`engine_there` is false), or until it has saved or loaded.
  std::function<void(bool engine_there)> idle = [](bool) {};
};

/// How an engine does.
struct Figures {
  std::int64_t trip_ns = 0;  ///< of the last step, from the question to the answer
  std::int64_t step_ns = 0;  ///< of the last step, as the engine says; 0: it does not say
  bool slow = false;         ///< the step under way takes more than half of its limit
  bool stopped = false;      ///< by a signal
};

/// A simulation whose engine has said START. Steps can be waited for. Its checkpoints are the engine's files.
/// After a failure() it makes no further step, and the engine's process group is killed if it was started
/// here. While an engine saves or loads, or step() is called, the caller waits. Not thread-safe.
class Door : public Simulation {
 public:
  /// Waits for the engine: a command's for connect_limit_s, others until `stop`. Errors: kIo (it cannot be
  /// started, or hung up), kMalformed, kUnsupported (what it says is wrong), kTimeout, kInvalidArgument (the
  /// way).
  static Result<std::unique_ptr<Door>> open(DoorOptions options);

  [[nodiscard]] virtual const Hello& hello() const = 0;
  /// The process that speaks; 0: not known.
  [[nodiscard]] virtual int engine_process() const = 0;
  [[nodiscard]] virtual Figures figures() const = 0;
  /// At its end the engine hears this error instead of BYE: the server does not end as planned.
  virtual void dismiss(std::string why) = 0;
};

/// Tells an engine at a descriptor that the server inherited why it cannot even start.
void turn_away(int descriptor, std::string_view why);

}  // namespace tandem::engine::door
