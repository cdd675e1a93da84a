#include "services/program/process/init.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <functional>

namespace tandem {
namespace {

constexpr int kNotAllowed = 77;

/// The exit code of a process 1 of a namespace of its own.
int as_process_1(const std::function<int()>& work) {
  const pid_t outer = fork();
  if (outer == 0) {
    if (unshare(CLONE_NEWPID) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWPID) != 0) _exit(kNotAllowed);
    const pid_t first = fork();
    if (first == 0) _exit(getpid() == 1 ? work() : kNotAllowed);
    int how = 0;
    waitpid(first, &how, 0);
    _exit(WIFEXITED(how) ? WEXITSTATUS(how) : 1);
  }
  int how = 0;
  waitpid(outer, &how, 0);
  return WIFEXITED(how) ? WEXITSTATUS(how) : 1;
}

/// Leaves a process without a parent behind, which ends. Returns its number.
pid_t leave_an_orphan() {
  int numbers[2];
  if (pipe(numbers) != 0) return 0;
  const pid_t parent = fork();
  if (parent == 0) {
    const pid_t orphan = fork();
    if (orphan == 0) _exit(0);
    _exit(write(numbers[1], &orphan, sizeof orphan) == sizeof orphan ? 0 : 1);
  }
  pid_t orphan = 0;
  const bool told = read(numbers[0], &orphan, sizeof orphan) == sizeof orphan;
  waitpid(parent, nullptr, 0);
  return told ? orphan : 0;
}

TEST(Process1, OrphansDoNotStayAsZombies) {
  const int exit_code = as_process_1([] {
    leave_process_1();
    if (getpid() == 1) return 1;
    const pid_t orphan = leave_an_orphan();
    for (int i = 0; i < 1000; ++i, usleep(10'000))
      if (kill(orphan, 0) != 0 && errno == ESRCH) return 7;
    return 2;  // a zombie is still there for kill(2)
  });
  if (exit_code == kNotAllowed) GTEST_SKIP() << "no PID namespaces here";
  EXPECT_EQ(exit_code, 7);
}

TEST(Process1, SignalsReachTheWorkAndItsEndIsThatOfAll) {
  const int exit_code = as_process_1([]() -> int {
    leave_process_1();
    std::signal(SIGTERM, SIG_DFL);
    kill(1, SIGTERM);
    for (;;) pause();
  });
  if (exit_code == kNotAllowed) GTEST_SKIP() << "no PID namespaces here";
  EXPECT_EQ(exit_code, 128 + SIGTERM);
}

TEST(Process1, OthersAreLeftAlone) {
  const pid_t before = getpid();
  leave_process_1();
  EXPECT_EQ(getpid(), before);
}

}  // namespace
}  // namespace tandem
