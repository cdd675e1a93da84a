#include "services/program/process/init.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

namespace tandem {
namespace {

[[noreturn]] void serve_as_process_1(pid_t child, const sigset_t& signals) {
  for (;;) {
    siginfo_t info{};
    const int signal = sigwaitinfo(&signals, &info);
    if (signal > 0 && signal != SIGCHLD) kill(child, signal);
    int how = 0;
    for (pid_t ended = 0; (ended = waitpid(-1, &how, WNOHANG)) > 0;) {
      if (ended == child) _exit(WIFEXITED(how) ? WEXITSTATUS(how) : 128 + WTERMSIG(how));
    }
  }
}

}  // namespace

void leave_process_1() {
  if (getpid() != 1) return;
  sigset_t all, before;
  sigfillset(&all);
  sigprocmask(SIG_BLOCK, &all, &before);  // before the fork, so that none is lost
  const pid_t child = fork();
  if (child > 0) serve_as_process_1(child, all);
  sigprocmask(SIG_SETMASK, &before, nullptr);  // of the child; or of process 1, if there can be none
}

}  // namespace tandem
