#include "services/host/clients/notices.hpp"

#include <fmt/format.h>

#include <utility>

namespace tandem::host {

void Notices::add(std::string line, std::int64_t now_ns) {
  if (lines_.size() >= kMostLines || !all_.take(now_ns)) {
    ++left_out_;
    return;
  }
  if (left_out_ > 0 && now_ns - told_ns_ >= kTellLeftOutNs) {
    lines_.push_back(fmt::format("{} lines left out", std::exchange(left_out_, 0)));
    told_ns_ = now_ns;
  }
  lines_.push_back(std::move(line));
}

void Notices::add(std::string line, accounts::TokenBucket& of_client, std::int64_t now_ns) {
  if (of_client.take(now_ns)) return add(std::move(line), now_ns);
  ++left_out_;
}

std::vector<std::string> Notices::take() { return std::exchange(lines_, {}); }

}  // namespace tandem::host
