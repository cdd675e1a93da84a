#include "services/program/process/signal_watch.hpp"

#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <functional>
#include <string>

namespace tandem {
namespace {

using namespace std::chrono_literals;

/// How a child ended that has `stuck` in it, and what it wrote.
struct Ended {
  int exit_code = -1;  ///< negative: not by an exit
  std::string out, err;
};

Ended run_child(const std::function<void()>& stuck) {
  int out[2];
  int err[2];
  if (pipe(out) != 0 || pipe(err) != 0) return {};
  const pid_t child = fork();
  if (child == 0) {
    dup2(out[1], STDOUT_FILENO);
    dup2(err[1], STDERR_FILENO);
    for (const int end : {out[0], out[1], err[0], err[1]}) close(end);
    stuck();
    for (;;) pause();  // as DDS does
  }
  const auto read_all = [](const int(&ends)[2]) {
    close(ends[1]);
    std::string all;
    char part[256];
    for (ssize_t size = 0; (size = read(ends[0], part, sizeof part)) > 0;)
      all.append(part, static_cast<std::size_t>(size));
    close(ends[0]);
    return all;
  };
  Ended ended;
  ended.out = read_all(out);
  ended.err = read_all(err);
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFEXITED(status)) ended.exit_code = WEXITSTATUS(status);
  return ended;
}

TEST(SignalWatch, ASignalIsSeenAsAFlag) {
  const SignalWatch watch("test");
  EXPECT_FALSE(watch.stop());
  kill(getpid(), SIGINT);
  while (!watch.stop()) usleep(1000);
}

/// The exit code of a child that watches, gets SIGHUP and exits: 7 if it is a stop, else 1.
int after_hangup(bool ignored) {
  const pid_t child = fork();
  if (child == 0) {
    if (ignored) std::signal(SIGHUP, SIG_IGN);
    const SignalWatch watch("test");
    kill(getpid(), SIGHUP);
    usleep(100'000);
    _exit(watch.stop() ? 7 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(SignalWatch, AHangupIsAStopUnlessItIsIgnored) {
  EXPECT_EQ(after_hangup(false), 7);
  EXPECT_EQ(after_hangup(true), 1);
}

TEST(SignalWatch, AHangupIsAWishToReloadWhereTheProgramSaysSo) {
  SignalWatch watch("test", SignalWatch::Hangup::kReload);
  EXPECT_FALSE(watch.take_reload());
  for (int i = 0; i < 2; ++i) {
    kill(getpid(), SIGHUP);
    while (!watch.take_reload()) usleep(1000);
    EXPECT_FALSE(watch.take_reload()) << "once";
  }
  EXPECT_FALSE(watch.stop());
  kill(getpid(), SIGTERM);
  while (!watch.stop()) usleep(1000);
}

TEST(SignalWatch, ATerminalThatGoesIsAWishToEndEvenThen) {
  int terminal = -1;
  const pid_t child = forkpty(&terminal, nullptr, nullptr, nullptr);
  if (child == 0) {
    const SignalWatch watch("test", SignalWatch::Hangup::kReload);
    if (write(STDOUT_FILENO, "!", 1) != 1) _exit(1);
    while (!watch.stop()) usleep(1000);
    _exit(7);
  }
  ASSERT_GT(child, 0);
  char there = 0;
  ASSERT_EQ(read(terminal, &there, 1), 1);
  close(terminal);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 7) << status;
}

TEST(SignalWatch, AFileAtItsSizeLimitDoesNotEndTheProcess) {
  const pid_t child = fork();
  if (child == 0) {
    const SignalWatch watch("test");
    raise(SIGXFSZ);
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status));
}

TEST(SignalWatch, GoingOnAfterAStopIsNoSignal) {
  const pid_t child = fork();
  if (child == 0) {
    const SignalWatch watch("test");
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
    const SignalWatch watch("test");
    EXPECT_FALSE(watch.stop());
  }
}

TEST(SignalWatch, AProgramThatIsDoneMayEndOrderly) {
  for (int i = 0; i < 100; ++i) {
    SignalWatch watch("test", {1h, 1h});
    EXPECT_EQ(watch.finish(3), 3);
  }
}

TEST(SignalWatch, WhoIsStuckAtWorkAfterASignalFails) {
  const Ended ended = run_child([] {
    const SignalWatch watch("test", {50ms, 1h});
    kill(getpid(), SIGTERM);
    for (;;) pause();
  });
  EXPECT_EQ(ended.exit_code, 1);
  EXPECT_EQ(
      ended.err,
      "test: the work had not ended 0.05 s after the signal. The program stopped it: reports are missing, "
      "and files may lack their end.\n");
}

TEST(SignalWatch, WhoIsStuckInTheEndEndsWithTheExitCodeOfItsWork) {
  for (const int exit_code : {0, 2}) {
    const Ended ended = run_child([exit_code] {
      SignalWatch watch("test", {50ms, 1h});
      kill(getpid(), SIGTERM);
      while (!watch.stop()) usleep(1000);
      std::fputs("the report", stdout);  // without its end, so that it stays in the buffer
      static_cast<void>(watch.finish(exit_code));
      for (;;) pause();
    });
    EXPECT_EQ(ended.exit_code, exit_code);
    EXPECT_EQ(ended.out, "the report");
    EXPECT_NE(ended.err.find("test: DDS had not ended 0.05 s after the signal"), std::string::npos)
        << ended.err;
  }
}

TEST(SignalWatch, TheEndIsLimitedWithoutASignalToo) {
  const Ended ended = run_child([] {
    SignalWatch watch("test", {50ms, 1h});
    static_cast<void>(watch.finish(0));
    for (;;) pause();
  });
  EXPECT_EQ(ended.exit_code, 0);
  EXPECT_NE(ended.err.find("had not ended 0.05 s after the work was done"), std::string::npos) << ended.err;
}

TEST(SignalWatch, AFurtherSignalEndsTheProcessAtOnce) {
  const Ended ended = run_child([] {
    const SignalWatch watch("test", {1h, 1ms});
    kill(getpid(), SIGINT);
    while (!watch.stop()) usleep(1000);
    usleep(10'000);
    kill(getpid(), SIGINT);
    for (;;) pause();
  });
  EXPECT_EQ(ended.exit_code, 1);
  EXPECT_NE(ended.err.find("had not ended when a further signal came"), std::string::npos) << ended.err;
}

TEST(SignalWatch, TheSameWishSentTwiceIsOne) {
  const SignalWatch watch("test", {1h, 1h});
  kill(getpid(), SIGINT);
  while (!watch.stop()) usleep(1000);
  kill(getpid(), SIGTERM);  // would end this test
  usleep(10'000);
}

std::string deafness() { return "it is deaf"; }
void print(const std::string& text) { std::fprintf(stderr, "%s\n", text.c_str()); }

TEST(SignalWatch, AFaultEndsAServerAtOnce) {
  const Ended ended = run_child([] {
    const SignalWatch watch("test", {1h, 1h}, SignalWatch::Hangup::kStop, {&deafness, &print, true});
    for (;;) pause();
  });
  EXPECT_EQ(ended.exit_code, 1);
  EXPECT_EQ(ended.err, "it is deaf\n");
}

TEST(SignalWatch, AFaultIsAWishToEndWithAnotherExitCodeThan0) {
  const Ended ended = run_child([] {
    SignalWatch watch("test", {50ms, 1h}, SignalWatch::Hangup::kStop, {&deafness, &print});
    while (!watch.stop()) usleep(1000);
    std::fputs("the report", stdout);
    static_cast<void>(watch.finish(0));
    for (;;) pause();
  });
  EXPECT_EQ(ended.exit_code, 1);
  EXPECT_EQ(ended.out, "the report");
  EXPECT_EQ(ended.err.find("it is deaf\ntest: DDS had not ended 0.05 s after the fault"), 0U) << ended.err;
}

TEST(SignalWatch, WhoIsOutdatedEndsItsWorkAndNotWithZero) {
  const Ended ended = run_child([] {
    SignalWatch watch("test", {1h, 1h}, SignalWatch::Hangup::kStop,
                      {[] { return std::string(); }, &print, true, &deafness});
    while (!watch.stop()) usleep(1000);
    _exit(watch.finish(0) + 6);
  });
  EXPECT_EQ(ended.exit_code, 7);
}

TEST(SignalWatch, WhereThereIsNoFaultTheProgramGoesOn) {
  std::atomic<int> asked = 0;
  SignalWatch watch("test", SignalWatch::Hangup::kStop,
                    {[&asked] {
                       ++asked;
                       return std::string();
                     },
                     &print, true});
  while (asked == 0) usleep(1000);
  EXPECT_FALSE(watch.stop());
  EXPECT_EQ(watch.finish(0), 0);
}

TEST(SignalWatch, AFullStderrKeepsNobody) {
  const Ended ended = run_child([] {
    int full[2];
    if (pipe(full) != 0) return;
    dup2(full[1], STDERR_FILENO);
    const std::string page(4096, 'x');
    for (int i = 0; i < 16; ++i) static_cast<void>(!write(STDERR_FILENO, page.data(), page.size()));
    SignalWatch watch("test", {50ms, 1h});
    static_cast<void>(watch.finish(0));
    for (;;) pause();
  });
  EXPECT_EQ(ended.exit_code, 0);
}

}  // namespace
}  // namespace tandem
