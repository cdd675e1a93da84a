#include "services/engines/door/conversation.hpp"

#include <fmt/format.h>

#include <cstring>

namespace tandem::engine::door {
namespace {

constexpr std::size_t kStateCount = 7;
constexpr std::array<Type, kStateCount> kAnswers{Type::kHello, Type::kStart,  Type::kBye, Type::kDone,
                                                 Type::kSaved, Type::kLoaded, Type::kBye};

Type answer_in(Conversation::State state) { return kAnswers[static_cast<std::size_t>(state)]; }

bool brings_slot(Type type) { return type == Type::kStart || type == Type::kDone || type == Type::kLoaded; }

}  // namespace

Result<void> Conversation::take(Type type, std::span<const std::byte> body) {
  auto taken = answer(type, body);
  if (!taken) state_ = State::kOver;
  return taken;
}

Result<void> Conversation::answer(Type type, std::span<const std::byte> body) {
  slot_ = {};
  saved_ = {};
  if (type == Type::kError)
    return fail(ErrorCode::kIo, fmt::format("the engine gave up {}: {}", where(), plain_line(body)));
  if (type == Type::kBye) return fail(ErrorCode::kIo, fmt::format("the engine said BYE {}", where()));
  const auto refuse = [this](std::string what) -> Result<void> {
    return fail(ErrorCode::kMalformed, fmt::format("{} {}", what, where()));
  };
  if (state_ == State::kIdle || state_ == State::kOver)
    return refuse(fmt::format("the engine sent {} unasked", name_of(type)));
  if (type == Type::kNews && state_ == State::kStep) return take_news(body);
  if (type != answer_in(state_))
    return refuse(fmt::format("the engine sent {} instead of {}", name_of(type), name_of(answer_in(state_))));
  if (type == Type::kHello) return take_hello(body);
  if (brings_slot(type) && layout_.in_line) {
    if (body.size() < layout_.slot_bytes)
      return refuse(fmt::format("the engine's {} has {} bytes, fewer than the {} of a slot", name_of(type),
                                body.size(), layout_.slot_bytes));
    slot_ = body.last(layout_.slot_bytes);
    body = body.first(body.size() - layout_.slot_bytes);
  }
  const auto wrong_size = [&] {
    return refuse(fmt::format("the engine's {} has a wrong size of {} bytes", name_of(type), body.size()));
  };
  if (type == Type::kStart) {
    if (!body.empty()) return wrong_size();
  } else if (type == Type::kDone) {
    const auto done = parse_done(body);
    if (!done) return wrong_size();
    if (done->frame != frame_) return refuse(fmt::format("the engine's DONE is of frame {}", done->frame));
    if (done->slot != 0) return refuse(fmt::format("the engine's DONE is of slot {}, not 0", done->slot));
    done_ = *done;
  } else if (type == Type::kSaved) {
    const auto saved = parse_saved(body);
    if (!saved) return wrong_size();
    saved_ = body.subspan(kSavedBytes);
    if (saved_.size() != (remote_ ? *saved : 0)) return wrong_size();
    saved_bytes_ = *saved;
  } else {
    const auto loaded = parse_loaded(body);
    if (!loaded) return wrong_size();
    if (loaded->frame != frame_)
      return refuse(fmt::format("the engine's LOADED is of frame {}", loaded->frame));
    loaded_ = loaded->loaded != 0;
  }
  state_ = State::kIdle;
  return {};
}

Result<void> Conversation::take_hello(std::span<const std::byte> body) {
  std::string text(body.size(), '\0');
  std::memcpy(text.data(), body.data(), body.size());
  auto hello = parse_hello(text);
  if (!hello) return tl::unexpected(hello.error());
  hello_ = std::move(*hello);
  layout_ = layout_of(hello_);
  state_ = State::kStart;
  return {};
}

Result<void> Conversation::take_news(std::span<const std::byte> body) {
  const auto refuse = [this](std::string what) -> Result<void> {
    return fail(ErrorCode::kMalformed, fmt::format("{} {}", what, where()));
  };
  if (!hello_.tells.keys && !hello_.tells.events)
    return refuse("the engine sent NEWS, but its HELLO has no line `news`,");
  if (body.size() < kNewsBytes || body.size() > kMaxBodyBytes)
    return refuse(fmt::format("the engine's NEWS has a wrong size of {} bytes", body.size()));
  std::uint64_t frame = 0;
  std::memcpy(&frame, body.data(), sizeof frame);
  if (frame != frame_) return refuse(fmt::format("the engine's NEWS is of frame {}", frame));
  body = body.subspan(kNewsBytes);
  if (!read_news(body, [](const NewsEntry&) {}))
    return refuse("an entry of the engine's NEWS is longer than the message");
  if (news_.size() + body.size() > kMaxStepNewsBytes)
    return refuse(fmt::format("the engine's NEWS have more than {} bytes", kMaxStepNewsBytes));
  news_.insert(news_.end(), body.begin(), body.end());
  return {};
}

void Conversation::ask_step(std::uint64_t frame) {
  news_.clear();
  frame_ = frame;
  state_ = State::kStep;
}

void Conversation::ask_load(std::uint64_t frame) {
  news_.clear();
  frame_ = frame;
  state_ = State::kLoad;
}

std::string Conversation::where() const {
  switch (state_) {
    case State::kHello:
      return "before HELLO";
    case State::kStart:
      return "before START";
    case State::kStep:
      return fmt::format("in frame {}", frame_);
    case State::kSave:
      return fmt::format("while it saved frame {}", frame_);
    case State::kLoad:
      return fmt::format("while it loaded frame {}", frame_);
    default:
      return fmt::format("after frame {}", frame_);
  }
}

std::size_t Conversation::limit() const {
  if (state_ == State::kSave && remote_) return kSavedBytes + kMaxSavedBytes;
  return kMaxBodyBytes + (state_ != State::kHello && layout_.in_line ? layout_.slot_bytes : 0);
}

Result<void> check_slot(std::span<const std::byte> slot, std::uint64_t frame) {
  std::array<std::uint64_t, 3> head{};  // begun, frame, done
  std::memcpy(head.data(), slot.data(), sizeof head);
  if (head[0] == frame && head[1] == frame && head[2] == frame) return {};
  return fail(ErrorCode::kMalformed,
              fmt::format("the engine's slot says begun {}, frame {}, done {} in frame {}: it was written by "
                          "something else, or is not whole",
                          head[0], head[1], head[2], frame));
}

}  // namespace tandem::engine::door
