#pragma once
// The last lines of a log: of a file, or of systemd's journal. DDS does not carry logs.

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

namespace tandem::top {

/// A line of `--log-format json` as one for people: time, level and message; another line as it is.
[[nodiscard]] std::string without_json(const std::string& line);

/// Reads at most the last 64 KiB and 500 lines. Never waits: the journal is read by a child process
/// (journalctl), which is ended after 5 s. Not thread-safe.
class LogTail {
 public:
  /// `file`: empty for the journal of the units of a session.
  explicit LogTail(std::string file) : file_(std::move(file)) {}
  LogTail(const LogTail&) = delete;
  LogTail& operator=(const LogTail&) = delete;
  LogTail(LogTail&&) = delete;
  LogTail& operator=(LogTail&&) = delete;
  ~LogTail();

  /// Reads again if it is time to. `session`: whose journal.
  void refresh(const std::string& session, std::int64_t now_ns);
  /// What the lines are, or why there are none.
  [[nodiscard]] const std::string& source() const { return source_; }
  [[nodiscard]] const std::vector<std::string>& lines() const { return lines_; }

 private:
  void read_file();
  void start_journal(const std::string& session, std::int64_t now_ns);
  void read_journal(std::int64_t now_ns);
  void end_journal();

  std::string file_, session_;
  std::string source_ = "not read yet";
  std::vector<std::string> lines_;
  std::int64_t read_at_ns_ = INT64_MIN;
  pid_t child_ = 0;
  int pipe_ = -1;
  std::string partial_;  // what the child has written so far
};

}  // namespace tandem::top
