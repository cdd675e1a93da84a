#pragma once
// A folder in memory that loses power at a chosen step, and what is left of it.

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/host/checkpoint/disk.hpp"

namespace tandem::checkpoint {

/// What a file system may do with what was not synced: names survive in order, a file's bytes up to any
/// point.
class SimulatedDisk final : public Disk {
 public:
  using Bytes = std::vector<std::byte>;

  /// Counts every step that can fail; a write has one step for each byte boundary of interest.
  std::optional<std::uint64_t> power_fails_at;
  bool lies = false;       ///< syncs say that all is well and do nothing
  std::string fails_with;  ///< every change fails so, if it is not empty
  std::uint64_t steps = 0;

  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] Result<std::vector<std::string>> list() override {
    std::vector<std::string> names;
    for (const auto& [file, content] : now_) names.push_back(file);
    return names;
  }
  [[nodiscard]] Result<Bytes> read(const std::string& file, std::uint64_t most_bytes) override {
    const auto found = now_.find(file);
    if (found == now_.end()) return fail(ErrorCode::kIo, "no such file");
    if (found->second->bytes.size() > most_bytes) return fail(ErrorCode::kCapacity, "too large");
    return found->second->bytes;
  }
  [[nodiscard]] Result<void> write(const std::string& file, std::span<const std::byte> bytes) override {
    if (auto on = step(); !on) return on;
    auto content = std::make_shared<Content>();
    content->bytes.assign(bytes.begin(), bytes.end());
    change([=](Names& names) { names[file] = content; });
    return {};
  }
  [[nodiscard]] Result<void> sync(const std::string& file) override {
    if (auto on = step(); !on) return on;
    if (!lies) now_.at(file)->synced = true;
    return {};
  }
  [[nodiscard]] Result<void> rename(const std::string& from, const std::string& to) override {
    if (auto on = step(); !on) return on;
    change([=](Names& names) {
      const auto moved = names.extract(from);
      if (!moved.empty()) names[to] = moved.mapped();
    });
    return {};
  }
  [[nodiscard]] Result<void> remove(const std::string& file) override {
    if (auto on = step(); !on) return on;
    change([=](Names& names) { names.erase(file); });
    return {};
  }
  [[nodiscard]] Result<void> sync_folder() override {
    if (auto on = step(); !on) return on;
    if (!lies) {
      changes_.clear();
      durable_ = now_;
    }
    return {};
  }
  [[nodiscard]] Result<void> reopen() override {
    if (fails_with.empty()) return {};
    return fail(ErrorCode::kIo, fails_with);
  }

  /// The folder after the power is back: the first `changes` changes of names that were not synced are there,
  /// and of every file that was not synced the first `kept` bytes of `of`.
  [[nodiscard]] SimulatedDisk after_power_loss(std::size_t changes, std::size_t kept, std::size_t of) const {
    SimulatedDisk after;
    after.now_ = durable_;
    for (std::size_t i = 0; i < std::min(changes, changes_.size()); ++i) changes_[i](after.now_);
    for (auto& [file, content] : after.now_) {
      auto left = std::make_shared<Content>(*content);
      if (!left->synced) left->bytes.resize(left->bytes.size() * kept / of);
      left->synced = true;
      content = left;
    }
    after.durable_ = after.now_;
    return after;
  }
  [[nodiscard]] std::size_t unsynced_changes() const { return changes_.size(); }
  [[nodiscard]] Bytes& content(const std::string& file) { return now_.at(file)->bytes; }

 private:
  struct Content {
    Bytes bytes;
    bool synced = false;
  };
  using Names = std::map<std::string, std::shared_ptr<Content>>;

  Result<void> step() {
    if (!fails_with.empty()) return fail(ErrorCode::kIo, fails_with);
    if (power_fails_at && steps >= *power_fails_at) return fail(ErrorCode::kIo, "no power");
    ++steps;
    return {};
  }
  void change(std::function<void(Names&)> apply) {
    apply(now_);
    changes_.push_back(std::move(apply));
  }

  std::string name_ = "disk";
  Names now_, durable_;
  std::vector<std::function<void(Names&)>> changes_;
};

}  // namespace tandem::checkpoint
