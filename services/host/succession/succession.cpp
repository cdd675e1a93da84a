#include "services/host/succession/succession.hpp"

#include <algorithm>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::host {

void Succession::poll(transport::ServerPort& port, Frame frame, Notices& notices, std::int64_t now_ns) {
  said_.clear();
  commands_.clear();
  port.take(said_);
  port.take(commands_);
  for (const auto& standby : said_) standbys_.heard(standby, notices, now_ns);
  standbys_.look(port, notices, now_ns);
  if (standbys_.any() != journal_.open()) journal_.set_open(standbys_.any());
  for (const auto& command : commands_) {
    if (command.message.epoch != epoch_ || command.message.session != session_) continue;
    // A tool repeats its command until it is heard.
    if (std::ranges::find(obeyed_, command.message.request) != obeyed_.end()) continue;
    if (obeyed_.size() >= kMaxObeyed) obeyed_.erase(obeyed_.begin());
    obeyed_.push_back(command.message.request);
    handover_.ask(standbys_, frame, notices, now_ns);
  }
  handover_.look(standbys_, notices, now_ns);
  if (!stopped()) journal_.write(frame + 1, now_ns);
}

void Succession::made(FrameSource& source, std::int64_t now_ns) {
  TANDEM_ASSERT(!stopped());
  if (!journal_.open()) return;
  const NewsDesk* const desk = source.news();
  const std::span<const std::byte> news = desk != nullptr ? desk->told() : std::span<const std::byte>();
  if (handover_.made(now_ns)) {
    journal_.last(source.frame(), source.bodies_hash(), news, handover_.to(), now_ns);
  } else {
    journal_.made(source.frame(), source.bodies_hash(), news, now_ns);
  }
}

}  // namespace tandem::host
