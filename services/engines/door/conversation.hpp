#pragma once
// The order of messages of idl/ENGINE.md, seen from the server: one question, one answer. Pure.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "services/engines/door/wire.hpp"

namespace tandem::engine::door {

/// Decides whether a message of the engine may come now and is right. After an error the conversation is
/// over. Not thread-safe.
class Conversation {
 public:
  enum class State : std::uint8_t { kHello, kStart, kIdle, kStep, kSave, kLoad, kOver };

  /// The engine is on another machine: what it saves comes in messages.
  void set_remote() { remote_ = true; }
  /// Takes a message. Errors: kMalformed (it may not come now, or is wrong), kUnsupported (another version),
  /// kIo (the engine says that it ends, or why).
  [[nodiscard]] Result<void> take(Type type, std::span<const std::byte> body);

  // The questions; only while idle.
  void ask_step(std::uint64_t frame);
  void ask_save() { state_ = State::kSave; }
  void ask_load(std::uint64_t frame);

  [[nodiscard]] State state() const { return state_; }
  /// Where the conversation is, to go behind "the engine hung up".
  [[nodiscard]] std::string where() const;
  /// Maximum body of the message that may come next.
  [[nodiscard]] std::size_t limit() const;

  [[nodiscard]] const Hello& hello() const { return hello_; }
  [[nodiscard]] const Layout& layout() const { return layout_; }
  [[nodiscard]] std::uint64_t frame() const { return frame_; }  ///< asked for last
  // The last answers.
  [[nodiscard]] const Done& done() const { return done_; }
  /// The entries of NEWS of the last step, to be read by read_news().
  [[nodiscard]] std::span<const std::byte> news() const { return news_; }
  [[nodiscard]] std::uint64_t saved_bytes() const { return saved_bytes_; }
  /// Those bytes, if the engine is on another machine; valid as long as the message.
  [[nodiscard]] std::span<const std::byte> saved() const { return saved_; }
  [[nodiscard]] bool loaded() const { return loaded_; }
  /// The slot that came with the last answer, in the inline form; valid as long as the message.
  [[nodiscard]] std::span<const std::byte> slot() const { return slot_; }

 private:
  Result<void> answer(Type type, std::span<const std::byte> body);
  Result<void> take_hello(std::span<const std::byte> body);
  Result<void> take_news(std::span<const std::byte> body);

  State state_ = State::kHello;
  Hello hello_;
  Layout layout_;
  std::uint64_t frame_ = 0;
  Done done_;
  std::vector<std::byte> news_;
  std::uint64_t saved_bytes_ = 0;
  std::span<const std::byte> saved_;
  bool remote_ = false;
  bool loaded_ = false;
  std::span<const std::byte> slot_;
};

/// Checks that a slot holds that frame, whole. Errors: kMalformed.
[[nodiscard]] Result<void> check_slot(std::span<const std::byte> slot, std::uint64_t frame);

}  // namespace tandem::engine::door
