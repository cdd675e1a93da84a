#include "sdk/transport/nats/nats_split.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::transport {

struct NatsSplit::Shared {
  std::unique_ptr<NatsBus> bus;
  std::map<std::string, std::vector<Part*>> subscribers;  // by subject
  std::vector<Part*> parts;
  std::vector<NatsArrival> arrivals;  // kept to reuse its memory

  void distribute();
  void leave(const std::string& subject, Part* part) {
    const auto found = subscribers.find(subject);
    if (found == subscribers.end() || std::erase(found->second, part) == 0) return;
    if (!found->second.empty()) return;
    subscribers.erase(found);
    bus->unsubscribe(subject);
  }
};

class NatsSplit::Part final : public NatsBus {
 public:
  explicit Part(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {
    shared_->parts.push_back(this);
  }
  ~Part() override {
    for (const std::string& subject : subjects_) shared_->leave(subject, this);
    std::erase(shared_->parts, this);
  }
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;

  [[nodiscard]] bool connected() const override { return shared_->bus->connected(); }
  [[nodiscard]] std::size_t most_bytes() const override { return shared_->bus->most_bytes(); }
  using NatsBus::subscribe;
  Result<void> subscribe(const std::string& subject, const std::string& group) override {
    if (subjects_.contains(subject)) return {};
    if (auto subscribed = shared_->bus->subscribe(subject, group); !subscribed) return subscribed;
    shared_->subscribers[subject].push_back(this);
    subjects_.insert(subject);
    return {};
  }
  void unsubscribe(const std::string& subject) override {
    if (subjects_.erase(subject) > 0) shared_->leave(subject, this);
  }
  Result<void> publish(const std::string& subject, std::span<const std::byte> bytes) override {
    return shared_->bus->publish(subject, bytes);
  }
  void take(std::vector<NatsArrival>& out) override {
    shared_->distribute();
    std::move(queue_.begin(), queue_.end(), std::back_inserter(out));
    queue_.clear();
  }
  // Nobody can say whose they were.
  [[nodiscard]] std::uint64_t overrun() const override {
    return shared_->parts.front() == this ? shared_->bus->overrun() : 0;
  }
  [[nodiscard]] std::uint64_t lost() const override { return shared_->bus->lost(); }
  [[nodiscard]] std::string trouble() const override { return shared_->bus->trouble(); }
  void wait(std::chrono::nanoseconds timeout) override { shared_->bus->wait(timeout); }
  void wake() override { shared_->bus->wake(); }
  Result<std::int64_t> round_trip_ns() override { return shared_->bus->round_trip_ns(); }
  [[nodiscard]] std::uint64_t refusals() const override { return shared_->bus->refusals(); }

 private:
  friend struct Shared;
  std::shared_ptr<Shared> shared_;
  std::set<std::string> subjects_;
  std::vector<NatsArrival> queue_;
};

// All that share are polled in turn, so no queue grows.
void NatsSplit::Shared::distribute() {
  arrivals.clear();
  bus->take(arrivals);
  for (NatsArrival& arrival : arrivals) {
    const auto found = subscribers.find(arrival.subject);
    if (found == subscribers.end()) continue;
    const std::span<Part* const> takers = found->second;
    TANDEM_ASSERT(!takers.empty());
    for (Part* const part : takers.first(takers.size() - 1)) part->queue_.push_back(arrival);
    takers.back()->queue_.push_back(std::move(arrival));
  }
}

NatsSplit::NatsSplit(std::unique_ptr<NatsBus> bus) : shared_(std::make_shared<Shared>()) {
  shared_->bus = std::move(bus);
}

std::unique_ptr<NatsBus> NatsSplit::share() { return std::make_unique<Part>(shared_); }

}  // namespace tandem::transport
