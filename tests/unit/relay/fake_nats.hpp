#pragma once
// A NATS server in memory, with a manual clock, seeded loss and delay.

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sdk/transport/nats/nats_bus.hpp"
#include "tests/support/dice/dice.hpp"

namespace tandem::transport {

class FakeNats {
 public:
  explicit FakeNats(std::uint64_t seed) : dice_(seed) {}

  std::int64_t now_ns = 0;
  std::int64_t delay_ns = kMillisecond;  ///< from the sender to the receiver
  double loss = 0;                       ///< chance that a packet does not reach a receiver
  bool down = false;                     ///< nobody is connected
  std::size_t most_bytes = 64 * 1024;
  std::uint64_t published = 0, published_bytes = 0;
  std::function<bool(const std::string& subject)> counts;  ///< if set, only these count above

  class Bus final : public NatsBus {
   public:
    Bus(FakeNats& nats, std::function<bool(const std::string&)> may)
        : nats_(&nats), may_publish(std::move(may)) {
      nats_->buses_.insert(this);
    }
    ~Bus() override { nats_->buses_.erase(this); }
    Bus(const Bus&) = delete;
    Bus& operator=(const Bus&) = delete;
    Bus(Bus&&) = delete;
    Bus& operator=(Bus&&) = delete;

    [[nodiscard]] bool connected() const override { return !nats_->down && !cut; }
    [[nodiscard]] std::size_t most_bytes() const override { return nats_->most_bytes; }
    Result<void> subscribe(const std::string& subject) override {
      subjects_.insert(subject);
      return {};
    }
    void unsubscribe(const std::string& subject) override { subjects_.erase(subject); }
    Result<void> publish(const std::string& subject, std::span<const std::byte> bytes) override {
      if (!connected()) return fail(ErrorCode::kTransport, "not connected");
      if (bytes.size() > nats_->most_bytes) return fail(ErrorCode::kTransport, "too large");
      if (may_publish && !may_publish(subject)) {
        ++refused_;
        return {};
      }
      if (!nats_->counts || nats_->counts(subject)) {
        ++nats_->published;
        nats_->published_bytes += bytes.size();
      }
      for (Bus* const bus : nats_->buses_) {
        if (bus == this || !bus->connected() || !bus->listens(subject)) continue;
        ++bus->received;
        bus->received_bytes += bytes.size() + subject.size();
        if (nats_->dice_.chance(nats_->loss)) continue;
        bus->queue_.push_back(
            {nats_->now_ns + nats_->delay_ns, {subject, Bytes(bytes.begin(), bytes.end())}});
      }
      return {};
    }
    void take(std::vector<NatsArrival>& out) override {
      while (!queue_.empty() && queue_.front().first <= nats_->now_ns) {
        out.push_back(std::move(queue_.front().second));
        queue_.pop_front();
      }
    }
    [[nodiscard]] std::uint64_t overrun() const override { return 0; }
    [[nodiscard]] std::string trouble() const override { return connected() ? "" : "no NATS"; }
    void wait(std::chrono::nanoseconds /*timeout*/) override {}
    void wake() override {}
    Result<std::int64_t> round_trip_ns() override { return 2 * nats_->delay_ns; }
    [[nodiscard]] std::uint64_t refusals() const override { return refused_; }

    bool cut = false;
    std::uint64_t received = 0,
                  received_bytes = 0;  ///< packets, with their subjects; those that are lost, too

   private:
    [[nodiscard]] bool listens(const std::string& subject) const {
      for (const std::string& pattern : subjects_) {
        if (pattern == subject) return true;
        // "tandem.*.beat" and the like: any session.
        const std::size_t any = pattern.find(".*.");
        if (any != std::string::npos && subject.starts_with(pattern.substr(0, any + 1)) &&
            subject.ends_with(pattern.substr(any + 2)))
          return true;
        if (pattern.ends_with(".>") && subject.starts_with(pattern.substr(0, pattern.size() - 1)))
          return true;
      }
      return false;
    }
    FakeNats* nats_;
    std::function<bool(const std::string&)> may_publish;
    std::set<std::string> subjects_;
    std::uint64_t refused_ = 0;
    std::deque<std::pair<std::int64_t, NatsArrival>> queue_;
  };

  /// `may`: the permission to publish; without it everything is permitted.
  [[nodiscard]] std::unique_ptr<Bus> connect(std::function<bool(const std::string& subject)> may = {}) {
    return std::make_unique<Bus>(*this, std::move(may));
  }

 private:
  friend class Bus;
  std::set<Bus*> buses_;
  Dice dice_;
};

}  // namespace tandem::transport
