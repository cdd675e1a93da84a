#pragma once
// Maps handles to objects. A handle is never used twice. An object lives while a call uses it.

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <unordered_map>
#include <utility>

#include "sdk/client/api/forked.hpp"

namespace tandem::api {

using Handle = std::uint64_t;  ///< 0: none

/// Returns a handle that is unique among all registries of the process. Thread-safe.
[[nodiscard]] Handle next_handle();

/// Maps handles to objects of one type. Thread-safe; the lock is held only during a look-up. In a forked
/// child it finds nothing.
template <class T>
class Registry {
 private:
  struct Slot {
    std::unique_ptr<T> object;
    std::atomic<std::uint32_t> users = 0;
  };

 public:
  /// Keeps the object alive; converts to false if there is no object.
  class Use {
   public:
    explicit Use(std::shared_ptr<Slot> slot) : slot_(std::move(slot)) {}
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;
    ~Use() {
      if (slot_ != nullptr && --slot_->users == 0) slot_->users.notify_all();
    }
    [[nodiscard]] explicit operator bool() const { return slot_ != nullptr; }
    [[nodiscard]] T& operator*() const { return *slot_->object; }
    [[nodiscard]] T* operator->() const { return slot_->object.get(); }

   private:
    std::shared_ptr<Slot> slot_;
  };

  [[nodiscard]] Handle add(std::unique_ptr<T> object) {
    watch_forks();
    auto slot = std::make_shared<Slot>();
    slot->object = std::move(object);
    const Handle handle = next_handle();
    const std::unique_lock lock(mutex_);
    slots_.emplace(handle, std::move(slot));
    return handle;
  }

  [[nodiscard]] Use find(Handle handle) const {
    if (in_forked_child()) return Use(nullptr);
    const std::shared_lock lock(mutex_);
    const auto found = slots_.find(handle);
    if (found == slots_.end()) return Use(nullptr);
    ++found->second->users;  // under the lock: remove() sees it
    return Use(found->second);
  }

  /// Removes the object so that it is not found any more. Calls `end(object)`, which makes long uses end,
  /// waits for all uses and returns the object; null if there is none.
  template <class End>
  [[nodiscard]] std::unique_ptr<T> remove(Handle handle, End&& end) {
    if (in_forked_child()) return nullptr;
    std::shared_ptr<Slot> slot;
    {
      const std::unique_lock lock(mutex_);
      const auto found = slots_.find(handle);
      if (found == slots_.end()) return nullptr;
      slot = std::move(found->second);
      slots_.erase(found);
    }
    end(*slot->object);
    while (const std::uint32_t users = slot->users) slot->users.wait(users);
    return std::move(slot->object);
  }

 private:
  mutable std::shared_mutex mutex_;
  std::unordered_map<Handle, std::shared_ptr<Slot>> slots_;
};

}  // namespace tandem::api
