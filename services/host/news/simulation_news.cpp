#include "services/host/news/simulation_news.hpp"

#include <fmt/format.h>

#include <utility>

#include "sdk/wire/plain_text.hpp"

namespace tandem::host {

void SimulationNews::ask(engine::Simulation& simulation, NewsDesk& desk, Frame frame) {
  desk_ = &desk;
  frame_ = frame;
  simulation.tell(*this);
  desk_ = nullptr;
}

bool SimulationNews::set_key(std::string_view key, std::span<const std::byte> value) {
  const auto set = desk_->set_key(key, value);
  return note(set, set ? "" : fmt::format("key '{}'", transport::plain_text(key, kMaxKeyBytes)));
}

bool SimulationNews::remove_key(std::string_view key) {
  const auto removed = desk_->remove_key(key);
  return note(removed, removed ? "" : fmt::format("key '{}'", transport::plain_text(key, kMaxKeyBytes)));
}

bool SimulationNews::broadcast(std::uint32_t kind, std::span<const std::byte> bytes,
                               std::optional<std::uint32_t> slot) {
  const auto left = desk_->broadcast(kind, bytes, slot);
  return note(left, left ? "" : fmt::format("event of kind {}", kind));
}

bool SimulationNews::note(const Result<void>& result, std::string_view what) {
  if (result) return true;
  ++refused_;
  last_ = fmt::format("{} in frame {}: {}", what, frame_, result.error().message);
  return false;
}

std::optional<std::string> SimulationNews::take_warning(std::int64_t now_ns) {
  if (refused_ == told_ || now_ns - told_ns_ < 10 * kSecond) return std::nullopt;
  told_ns_ = now_ns;
  told_ = refused_;
  return fmt::format("{} keys or events of the simulation were refused since its start; the last: {}",
                     refused_, last_);
}

}  // namespace tandem::host
