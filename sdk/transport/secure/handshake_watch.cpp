#include "sdk/transport/secure/handshake_watch.hpp"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>

namespace tandem::transport::secure {
namespace {

/// Reads /proc/self/task/ID/stat, whose second field is the name in brackets; the 14th and 15th are times.
bool read_times(const std::filesystem::path& task, ThreadUse& use) {
  static const auto tick_ms = 1000 / static_cast<std::uint64_t>(sysconf(_SC_CLK_TCK));
  std::ifstream file(task / "stat");
  std::string text;
  std::getline(file, text);
  const std::size_t begin = text.find('('), end = text.rfind(')');
  if (begin == std::string::npos || end == std::string::npos) return false;
  use.name = text.substr(begin + 1, end - begin - 1);
  std::istringstream rest(text.substr(end + 1));
  std::string skipped;
  for (int field = 3; field < 14; ++field) rest >> skipped;
  std::uint64_t user = 0, system = 0;
  rest >> user >> system;
  use.user_ms = user * tick_ms;
  use.system_ms = system * tick_ms;
  return !rest.fail();
}

bool read_switches(const std::filesystem::path& task, ThreadUse& use) {
  std::ifstream file(task / "status");
  std::uint64_t forced = 0;
  int found = 0;
  for (std::string word; file >> word && found < 2;) {
    if (word == "voluntary_ctxt_switches:" && file >> use.waits) ++found;
    if (word == "nonvoluntary_ctxt_switches:" && file >> forced) ++found;
  }
  use.turns = use.waits + forced;
  return found == 2;
}

}  // namespace

std::vector<ThreadUse> threads_of_this_process() {
  std::vector<ThreadUse> threads;
  std::error_code error;
  for (std::filesystem::directory_iterator task("/proc/self/task", error), end; !error && task != end;
       task.increment(error)) {
    ThreadUse use;
    use.id = std::atoi(task->path().filename().c_str());
    if (read_times(task->path(), use) && read_switches(task->path(), use)) threads.push_back(std::move(use));
  }
  return threads;
}

bool HandshakeWatch::stuck(const std::vector<ThreadUse>& threads, std::int64_t now_ns) {
  std::map<int, Since> spins, stands;  // threads that have ended are forgotten
  bool spins_long = false, spins_longer = false, stands_long = false;
  for (const ThreadUse& use : threads) {
    if (use.name == "fsm") {
      const auto before = spins_.find(use.id);
      const bool same = before != spins_.end() && before->second.use.waits == use.waits &&
                        before->second.use.user_ms <= use.user_ms;
      const Since since = same ? before->second : Since{use, now_ns};
      spins.emplace(use.id, since);
      const std::uint64_t user_ms = use.user_ms - since.use.user_ms;
      if (user_ms < kUserToSystem * (use.system_ms - since.use.system_ms)) continue;
      spins_long |= user_ms >= kLeastUserMs && now_ns - since.ns >= kPatienceNs;
      spins_longer |= user_ms >= kAloneUserMs;
    } else if (use.name == "dq.builtins") {
      const auto before = stands_.find(use.id);
      const bool same = before != stands_.end() && before->second.use.turns == use.turns &&
                        before->second.use.user_ms == use.user_ms &&
                        before->second.use.system_ms == use.system_ms;
      const Since since = same ? before->second : Since{use, now_ns};
      stands.emplace(use.id, since);
      stands_long |= now_ns - since.ns >= kPatienceNs;
    }
  }
  spins_ = std::move(spins);
  stands_ = std::move(stands);
  return spins_longer || (spins_long && stands_long);
}

}  // namespace tandem::transport::secure
