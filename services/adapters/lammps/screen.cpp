// SPDX-License-Identifier: MIT
#include "services/adapters/lammps/screen.hpp"

#include <unistd.h>

#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <thread>

namespace tandem_lammps {
namespace {

int kept_output = -1;
std::thread* reader = nullptr;

bool is_row(const std::string& line) {
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    const bool of_number = c == 'e' && i > 0 && std::isdigit(static_cast<unsigned char>(line[i - 1])) != 0;
    if (std::isdigit(static_cast<unsigned char>(c)) == 0 && !of_number &&
        std::string_view(" .-+\n").find(c) == std::string_view::npos)
      return false;
  }
  return true;
}

bool is_noise(const std::string& line) {
  for (const char* const begin : {"Step ", "   Step ", "Per MPI rank memory", "Loop time of "})
    if (line.starts_with(begin)) return true;
  return is_row(line);
}

void pass(const std::string& line) {
  for (std::size_t sent = 0; sent < line.size();) {
    const ssize_t now = ::write(kept_output, line.data() + sent, line.size() - sent);
    if (now <= 0) return;
    sent += static_cast<std::size_t>(now);
  }
}

void filter(int from) {
  std::string line;
  char bytes[4096];
  for (ssize_t got; (got = ::read(from, bytes, sizeof bytes)) > 0;) {
    for (ssize_t i = 0; i < got; ++i) {
      line += bytes[i];
      if (bytes[i] != '\n') continue;
      if (!is_noise(line)) pass(line);
      line.clear();
    }
  }
  pass(line);
  ::close(from);
}

/// LAMMPS ends the program by exit(3), so this is called there, too.
void finish() {
  if (reader == nullptr) return;
  std::fflush(stdout);
  ::dup2(kept_output, STDOUT_FILENO);  // the pipe's last writer is gone
  reader->join();
  delete reader;
  reader = nullptr;
}

}  // namespace

Screen::Screen(bool first) {
  int pipe[2];
  kept_output = first ? ::dup(STDOUT_FILENO) : -1;
  if (kept_output < 0 || ::pipe(pipe) != 0) return;
  ::dup2(pipe[1], STDOUT_FILENO);
  ::close(pipe[1]);
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  reader = new std::thread(filter, pipe[0]);
  std::atexit(finish);
  on_ = true;
}

Screen::~Screen() {
  if (on_) finish();
}

}  // namespace tandem_lammps
