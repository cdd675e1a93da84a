#include "services/host/clients/notices.hpp"

#include <fmt/format.h>

#include <utility>

namespace tandem::host {

void Notices::add(std::string line, std::int64_t now_ns) { add_to(lines_, std::move(line), now_ns); }
void Notices::warn(std::string line, std::int64_t now_ns) { add_to(warnings_, std::move(line), now_ns); }

void Notices::add_to(std::vector<std::string>& lines, std::string line, std::int64_t now_ns) {
  if (lines.size() >= kMaxLines || !all_.take(now_ns)) {
    ++left_out_;
    return;
  }
  if (left_out_ > 0 && now_ns - told_ns_ >= kTellLeftOutNs) {
    lines_.push_back(fmt::format("{} lines left out", std::exchange(left_out_, 0)));
    told_ns_ = now_ns;
  }
  lines.push_back(std::move(line));
}

void Notices::add(std::string line, accounts::TokenBucket& of_client, std::int64_t now_ns) {
  if (of_client.take(now_ns)) return add(std::move(line), now_ns);
  ++left_out_;
}

std::vector<std::string> Notices::take() { return std::exchange(lines_, {}); }
std::vector<std::string> Notices::take_warnings() { return std::exchange(warnings_, {}); }

}  // namespace tandem::host
