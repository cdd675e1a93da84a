#include "services/program/metrics/probe.hpp"

#include <fmt/format.h>
#include <sys/time.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "sdk/wire/clock.hpp"
#include "sdk/wire/units.hpp"
#include "services/program/metrics/socket_address.hpp"
#include "services/program/system/descriptor.hpp"

namespace tandem::metrics {
namespace {

using transport::steady_ns;

constexpr std::int64_t kPatienceNs = 2 * kSecond;
constexpr std::size_t kMaxAnswerBytes = 4096;

tl::unexpected<Error> no_answer(const Question& question, const char* why) {
  return fail(ErrorCode::kIo, fmt::format("{} does not answer: {}", to_text(question.address), why));
}

/// Bounds the next connect, send or receive. Returns false if there is no time left.
bool limit(int fd, std::int64_t until_ns) {
  constexpr std::int64_t kMicrosecond = 1000;
  const std::int64_t left_ns = until_ns - steady_ns();
  if (left_ns < kMicrosecond) return false;
  const timeval left{.tv_sec = left_ns / kSecond, .tv_usec = left_ns % kSecond / kMicrosecond};
  return setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &left, sizeof(left)) == 0 &&
         setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &left, sizeof(left)) == 0;
}

/// The first line of the body, without what a terminal would obey.
std::string line_of(std::string_view answer) {
  const std::size_t head = answer.find("\r\n\r\n");
  if (head == std::string_view::npos) return {};
  answer.remove_prefix(head + 4);
  std::string line(answer.substr(0, answer.find('\n')));
  std::erase_if(line, [](char c) { return c < ' ' || c > '~'; });
  return line;
}

}  // namespace

Result<Question> read_question(std::string_view text) {
  Question question;
  if (const std::size_t slash = text.find('/'); slash != std::string_view::npos) {
    question.path = text.substr(slash);
    text = text.substr(0, slash);
  }
  if (question.path != "/healthz" && question.path != "/readyz")
    return fail(ErrorCode::kInvalidArgument, "behind the port only /healthz or /readyz may stand");
  auto address = read_address(text);
  if (!address) return tl::unexpected(address.error());
  question.address = std::move(*address);
  return question;
}

Result<std::string> ask(const Question& question, std::int64_t patience_ns) {
  constexpr const char* kTooLate = "nothing came in time";
  const std::int64_t until_ns = steady_ns() + patience_ns;
  SocketAddress at{};
  const socklen_t size = to_socket_address(question.address, at);
  const system::Descriptor fd(socket(at.any.sa_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (fd.get() < 0 || !limit(fd.get(), until_ns)) return no_answer(question, strerror(errno));
  // A connect that takes too long ends with EINPROGRESS.
  if (connect(fd.get(), &at.any, size) != 0)
    return no_answer(question, errno == EINPROGRESS ? kTooLate : strerror(errno));
  const std::string request =
      "GET " + question.path + " HTTP/1.1\r\nHost: " + to_text(question.address) + "\r\n\r\n";
  if (send(fd.get(), request.data(), request.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(request.size()))
    return no_answer(question, kTooLate);
  std::string answer;
  std::array<char, 512> piece{};
  while (answer.size() < kMaxAnswerBytes) {
    if (!limit(fd.get(), until_ns)) return no_answer(question, kTooLate);
    const ssize_t got = recv(fd.get(), piece.data(), piece.size(), 0);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return no_answer(question, errno == EAGAIN ? kTooLate : strerror(errno));
    if (got == 0) break;
    answer.append(piece.data(), static_cast<std::size_t>(got));
  }
  const std::string line = line_of(answer);
  if (answer.starts_with("HTTP/1.1 200 ")) return line;
  if (!answer.starts_with("HTTP/1.1 ")) return no_answer(question, "it does not speak HTTP");
  return fail(ErrorCode::kIo, line.empty() ? "it answers with an error" : line);
}

int probe(const char* program, std::string_view text) {
  const auto question = read_question(text);
  if (!question) {
    std::fputs(fmt::format("{}: --probe: {}\n", program, question.error().message).c_str(), stderr);
    return 2;
  }
  const auto answer = ask(*question, kPatienceNs);
  std::FILE* const out = answer ? stdout : stderr;
  std::fputs(((answer ? *answer : answer.error().message) + '\n').c_str(), out);
  return answer ? 0 : 1;
}

}  // namespace tandem::metrics
