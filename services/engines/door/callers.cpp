#include "services/engines/door/callers.hpp"

#include <fmt/format.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "services/engines/door/door.hpp"

namespace tandem::engine::door {
namespace {

// Takes as long wherever they differ.
bool same(std::string_view a, std::string_view b) {
  unsigned differs = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    differs |= static_cast<unsigned>(static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]));
  return differs == 0;
}

}  // namespace

void Callers::add(Channel channel, Clock::time_point now) {
  if (callers_.size() >= kMaxCallers) callers_.pop_front();
  callers_.push_back({std::move(channel), now});
}

std::string Callers::objection(std::span<const std::byte> bytes) const {
  std::string text(bytes.size(), '\0');
  std::memcpy(text.data(), bytes.data(), bytes.size());
  const auto hello = parse_hello(text);
  // Who has not shown the token learns nothing else.
  if (!hello || !same(hello->token, token_))
    return hello && hello->token.empty() ? "it showed no token" : "it did not show the token of this server";
  if (!hello->in_line)
    return "an engine on another machine has no shared memory: its HELLO needs `memory inline`";
  return {};
}

std::optional<Callers::Engine> Callers::poll(Clock::time_point now, std::vector<std::string>& told) {
  for (auto next = callers_.begin(); next != callers_.end();) {
    const auto caller = next++;
    const auto message = caller->channel.receive();
    std::string why;
    if (!message) {
      why = message.error().message;
    } else if (*message) {
      const std::span<const std::byte> body = (*message)->body;
      why = (*message)->type == Type::kHello ? objection(body) : "it did not say HELLO";
      if (why.empty()) {
        Engine engine{std::move(caller->channel), {body.begin(), body.end()}};
        callers_.clear();
        return engine;
      }
    } else if (now - caller->since > limit_) {
      why = "it did not say HELLO in time";
    }
    if (why.empty()) continue;
    turn_away(caller->channel, why, now, told);
    callers_.erase(caller);
  }
  return std::nullopt;
}

void Callers::turn_away(Channel& channel, const std::string& why, Clock::time_point now,
                        std::vector<std::string>& told) {
  append(channel.out(), Type::kError, why);
  static_cast<void>(channel.flush());
  if (now - told_ < std::chrono::seconds{1}) {
    ++untold_;
    return;
  }
  told_ = now;
  const std::string more = untold_ == 0 ? "" : fmt::format("; and {} others before it", untold_);
  untold_ = 0;
  told.push_back(fmt::format("{} called as an engine: refused: {}{}", channel.from(), why, more));
}

std::string wrong_with_token(std::string_view text) {
  constexpr std::size_t kMinCharacters = 16, kMaxCharacters = 256;
  const bool plain = std::ranges::all_of(text, [](char c) { return c > ' ' && c < 127; });
  if (plain && text.size() >= kMinCharacters && text.size() <= kMaxCharacters) return {};
  return fmt::format("a token has {} to {} printable characters without blanks", kMinCharacters,
                     kMaxCharacters);
}

Result<std::string> make_token() {
  std::array<unsigned char, 16> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    return fail(ErrorCode::kIo, "there is no randomness for a token");
  std::string text;
  for (const unsigned char byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace tandem::engine::door
