#pragma once
// A NATS server in memory, with a manual clock, seeded loss and delay.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
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
  std::size_t most_subscriptions = 1024;  ///< of one connection, which is cut if it has more
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
    using NatsBus::subscribe;
    Result<void> subscribe(const std::string& subject, const std::string& group) override {
      subjects_.emplace(subject, group);
      if (subjects_.size() > nats_->most_subscriptions) cut = true;
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
        if (bus == this || !bus->connected()) continue;
        for (std::size_t copies = bus->copies(subject, leaf ? may_publish : nullptr); copies > 0; --copies) {
          ++bus->received;
          bus->received_bytes += bytes.size() + subject.size();
          if (nats_->dice_.chance(nats_->loss)) continue;
          bus->queue_.push_back(
              {nats_->now_ns + nats_->delay_ns, {subject, Bytes(bytes.begin(), bytes.end())}});
        }
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

    [[nodiscard]] const std::map<std::string, std::string>& subjects() const { return subjects_; }

    bool cut = false;
    bool leaf = false;  ///< behind a leaf node, which knows no subscription that is wider than `may_publish`
    std::uint64_t received = 0,
                  received_bytes = 0;  ///< packets, with their subjects; those that are lost, too

   private:
    static bool matches(const std::string& pattern, const std::string& subject) {
      if (pattern == subject) return true;
      // "tandem.*.beat" and the like: any session.
      const std::size_t any = pattern.find(".*.");
      if (any != std::string::npos && subject.starts_with(pattern.substr(0, any + 1)) &&
          subject.ends_with(pattern.substr(any + 2)))
        return true;
      return pattern.ends_with(".>") && subject.starts_with(pattern.substr(0, pattern.size() - 1));
    }
    /// How often a message arrives: once for each subscription of no group, and once for each group.
    [[nodiscard]] std::size_t copies(const std::string& subject,
                                     const std::function<bool(const std::string&)>& knows) const {
      std::size_t alone = 0;
      std::set<std::string> groups;
      for (const auto& [pattern, group] : subjects_) {
        if (!matches(pattern, subject) || (knows && !knows(pattern))) continue;
        if (group.empty()) {
          ++alone;
        } else {
          groups.insert(group);
        }
      }
      return alone + groups.size();
    }
    FakeNats* nats_;
    std::function<bool(const std::string&)> may_publish;
    std::map<std::string, std::string> subjects_;  // with their groups
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
