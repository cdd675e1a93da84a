#include "services/signals/signal_watch.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

namespace tandem {
namespace {

TEST(SignalWatch, ASignalIsSeenAsAFlag) {
  const SignalWatch watch;
  EXPECT_FALSE(watch.stop());
  kill(getpid(), SIGINT);
  while (!watch.stop()) usleep(1000);
}

TEST(SignalWatch, GoingOnAfterAStopIsNoSignal) {
  const pid_t child = fork();
  if (child == 0) {
    const SignalWatch watch;
    raise(SIGSTOP);
    usleep(100'000);
    _exit(watch.stop() ? 1 : 0);
  }
  int status = 0;
  waitpid(child, &status, WUNTRACED);
  ASSERT_TRUE(WIFSTOPPED(status));
  usleep(10'000);
  kill(child, SIGCONT);
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

TEST(SignalWatch, ItEndsWithoutASignal) {
  for (int i = 0; i < 100; ++i) {
    const SignalWatch watch;
    EXPECT_FALSE(watch.stop());
  }
}

}  // namespace
}  // namespace tandem
