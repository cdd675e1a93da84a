#include "services/tool/top/screen/log_tail.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <string_view>

#include "services/program/json/json.hpp"
#include "services/program/system/descriptor.hpp"

namespace tandem::top {
namespace {

constexpr std::size_t kMostBytes = 64U << 10U, kMostLines = 500;
constexpr std::int64_t kFilePeriodNs = 1'000'000'000, kJournalPeriodNs = 5'000'000'000;

/// The lines of a text, without its first if it is a part of one.
std::vector<std::string> lines_of(std::string_view text, bool is_part) {
  std::vector<std::string> lines;
  if (is_part) text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    lines.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  if (lines.size() > kMostLines) lines.erase(lines.begin(), lines.end() - kMostLines);
  return lines;
}

}  // namespace

std::string without_json(const std::string& line) {
  // journald has its own words before the object.
  const std::size_t begin = line.find("{\"");
  if (begin == std::string::npos) return line;
  const auto object = Json::parse(line.substr(begin));
  if (!object || !(*object)["message"].is_text()) return line;
  const auto text = [&object](const char* key) { return (*object)[key].text(); };
  return text("time") + " [" + text("level") + "] " + text("message");
}

LogTail::~LogTail() { end_journal(); }

void LogTail::refresh(const std::string& session, std::int64_t now_ns) {
  if (child_ != 0) read_journal(now_ns);
  const std::int64_t period_ns = file_.empty() ? kJournalPeriodNs : kFilePeriodNs;
  const bool other = file_.empty() && session != session_;
  if (!other && read_at_ns_ != INT64_MIN && now_ns - read_at_ns_ < period_ns) return;
  session_ = session;
  read_at_ns_ = now_ns;
  file_.empty() ? start_journal(session, now_ns) : read_file();
}

void LogTail::read_file() {
  lines_.clear();
  const auto fail = [this](const char* why) { source_ = file_ + ": " + why; };
  // A FIFO must not make this wait.
  const system::Descriptor file(::open(file_.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY));
  if (file.get() < 0) return fail(std::strerror(errno));
  struct stat found {};
  if (::fstat(file.get(), &found) != 0) return fail(std::strerror(errno));
  if (!S_ISREG(found.st_mode)) return fail("is not a regular file");
  const off_t from = std::max<off_t>(0, found.st_size - static_cast<off_t>(kMostBytes));
  std::string text(kMostBytes, '\0');
  const ssize_t got = ::pread(file.get(), text.data(), text.size(), from);
  if (got < 0) return fail(std::strerror(errno));
  text.resize(static_cast<std::size_t>(got));
  source_ = file_;
  lines_ = lines_of(text, from > 0);
}

void LogTail::start_journal(const std::string& session, std::int64_t now_ns) {
  if (child_ != 0) end_journal();
  partial_.clear();
  if (session.empty()) {
    source_ = "no session is chosen";
    lines_.clear();
    return;
  }
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK) != 0) return;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  // This process blocks the signals that it waits for.
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  // The unit is the configuration's name; a session's name has no characters that would be an option or a
  // pattern.
  const std::string server = "--unit=tandemd@" + session + ".service";
  const std::string gateway = "--unit=tandem-gateway@" + session + ".service";
  std::array<const char*, 8> words{"journalctl",         "--no-pager",   "--quiet",       "--lines=200",
                                   "--output=short-iso", server.c_str(), gateway.c_str(), nullptr};
  const int failed = ::posix_spawnp(&child_, words[0], &actions, &attributes,
                                    const_cast<char* const*>(words.data()), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  ::close(ends[1]);
  if (failed != 0) {
    ::close(ends[0]);
    child_ = 0;
    lines_.clear();
    source_ = std::string("no journalctl here (") + std::strerror(failed) + "); name a file with --log FILE";
    return;
  }
  pipe_ = ends[0];
  read_at_ns_ = now_ns;
}

void LogTail::read_journal(std::int64_t now_ns) {
  std::array<char, 4096> piece{};
  for (;;) {
    const ssize_t got = ::read(pipe_, piece.data(), piece.size());
    if (got > 0) {
      partial_.append(piece.data(), static_cast<std::size_t>(got));
      if (partial_.size() > 2 * kMostBytes) partial_.erase(0, kMostBytes);
      continue;
    }
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && errno == EAGAIN && now_ns - read_at_ns_ < kJournalPeriodNs) return;
    break;
  }
  end_journal();
  lines_ = lines_of(partial_, partial_.size() > kMostBytes);
  source_ = "journalctl -u tandemd@" + session_ + " -u tandem-gateway@" + session_;
  if (lines_.empty()) source_ += " has nothing here; on the server's host, or name a file with --log FILE";
}

void LogTail::end_journal() {
  if (child_ == 0) return;
  ::close(pipe_);
  ::kill(child_, SIGKILL);
  int status = 0;
  while (::waitpid(child_, &status, 0) < 0 && errno == EINTR) {
  }
  child_ = 0;
}

}  // namespace tandem::top
