#include "services/engine/door/door.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <system_error>
#include <utility>

#include "services/engine/door/channel.hpp"
#include "services/engine/door/columns.hpp"
#include "services/engine/door/conversation.hpp"
#include "services/engine/door/process.hpp"
#include "services/engine/door/segment.hpp"

namespace tandem::engine::door {
namespace {

using Clock = std::chrono::steady_clock;
using State = Conversation::State;

std::chrono::nanoseconds seconds(double s) { return std::chrono::nanoseconds(std::llround(s * 1e9)); }

/// A folder of this user alone, for a socket and for checkpoints; removed at the end.
class Folder {
 public:
  Folder() = default;
  ~Folder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  Folder(Folder&&) = delete;
  Folder& operator=(Folder&&) = delete;

  Result<std::string> file(const std::string& name) {
    if (path_.empty()) {
      std::error_code why;
      std::string path = (std::filesystem::temp_directory_path(why) / "tandem-door-XXXXXX").string();
      if (why || ::mkdtemp(path.data()) == nullptr)
        return fail(ErrorCode::kIo, fmt::format("{}: no folder can be made there", path));
      path_ = path;
    }
    return path_ + "/" + name;
  }

 private:
  std::string path_;
};

// What a checkpoint holds in front of the engine's own bytes.
struct Saved {
  std::uint64_t magic = 0x314f4f444d444e54;  // "TNDMDOO1"
  std::uint64_t frame = 0;
  std::array<double, 3> gravity{};
};

/// The only implementation of Door.
class Session final : public Door {
 public:
  explicit Session(Options options) : options_(std::move(options)) {}
  ~Session() override { end(); }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  Session(Session&&) = delete;
  Session& operator=(Session&&) = delete;

  Result<void> begin();

  [[nodiscard]] const Hello& hello() const override { return talk_.hello(); }
  [[nodiscard]] int engine_process() const override { return channel_.peer(); }
  [[nodiscard]] std::uint32_t capacity() const override { return hello().capacity; }
  [[nodiscard]] double dt_s() const override { return hello().dt_s; }
  [[nodiscard]] Vec3 gravity() const override { return gravity_; }
  [[nodiscard]] double damping_per_s() const override { return hello().damping_per_s; }
  [[nodiscard]] Classification classify(const Input& input) const override;
  void apply(const Input& input) override;
  void step() override;
  void begin_step() override;
  [[nodiscard]] bool step_ready() override;
  [[nodiscard]] int step_descriptor() const override { return channel_.descriptor(); }
  [[nodiscard]] std::string failure() override;
  [[nodiscard]] Bodies bodies() const override { return columns_->bodies(); }
  [[nodiscard]] std::span<const Event> events() const override { return columns_->events(); }
  [[nodiscard]] std::uint32_t colliding() const override { return talk_.done().colliding; }
  void save(std::vector<std::byte>& out) const override { saver_(out); }
  [[nodiscard]] bool load(std::span<const std::byte> bytes) override;

 private:
  Result<void> connect();
  Result<void> wait_for_engine();
  /// Sends and receives what is there; what comes changes talk_. After an error the door is shut: failure_.
  void pump();
  /// Takes the engine's output, turns strangers away, and says when the engine seems to stand still.
  void attend();
  void save_into(std::vector<std::byte>& out);
  void read_slot(bool with_events);
  /// Waits until the question is answered. False: failure_.
  bool wait_for_answer(std::chrono::nanoseconds limit);
  void wait_a_while(std::chrono::nanoseconds longest);
  void shut(const Error& error);
  void end();
  [[nodiscard]] bool busy() const { return talk_.state() != State::kIdle && talk_.state() != State::kOver; }

  Options options_;
  Folder folder_;
  Listener listener_;
  Process process_;
  Channel channel_;
  Conversation talk_;
  Segment segment_;
  std::vector<std::byte> own_;  // the slot, in the inline form
  std::optional<Columns> columns_;
  Vec3 gravity_{};
  std::uint64_t frame_ = 0;
  Clock::time_point asked_ = Clock::now();
  Clock::time_point attended_{};
  bool told_slow_ = false, told_stopped_ = false;
  std::optional<Error> failure_;
  // save() is const for the world that it saves, but the engine has to be asked.
  std::function<void(std::vector<std::byte>&)> saver_ = [this](std::vector<std::byte>& out) {
    save_into(out);
  };
};

Result<void> Session::begin() {
  if (auto connected = connect(); !connected) return connected;
  const auto failed = [this]() -> Result<void> { return tl::unexpected(*failure_); };
  if (!wait_for_answer(seconds(options_.connect_limit_s))) return failed();  // HELLO
  const Layout& layout = talk_.layout();
  std::string path;
  if (!layout.in_line) {
    auto made = Segment::make(layout.bytes());
    if (!made) {
      shut(made.error());
      return failed();
    }
    segment_ = std::move(*made);
    path = segment_.path();
    // For people with a debugger; it is never read back.
    const std::string text = print_layout(layout, path);
    std::memcpy(segment_.bytes().data(), text.data(), std::min(text.size(), layout.first));
    channel_.pass(segment_.descriptor());
  } else {
    own_.resize(layout.slot_bytes);
  }
  gravity_ = hello().gravity;
  channel_.reader().set_limit(talk_.limit());
  columns_.emplace(layout);
  append(channel_.out(), Type::kLayout, print_layout(layout, path));
  asked_ = Clock::now();
  if (!wait_for_answer(seconds(options_.start_limit_s))) return failed();
  read_slot(false);
  if (failure_) return failed();
  return {};
}

Result<void> Session::connect() {
  const Way& way = options_.way;
  if (way.descriptor >= 0) {
    channel_ = Channel(Descriptor(way.descriptor));
    return {};
  }
  std::string path = way.path;
  if (!way.command.empty()) {
    auto own = folder_.file("door");
    if (!own) return tl::unexpected(own.error());
    path = *own;
  }
  auto listener = Listener::open(path);
  if (!listener) return tl::unexpected(listener.error());
  listener_ = std::move(*listener);
  if (!way.command.empty()) {
    auto process = Process::start(way.command, {{"TANDEM_DOOR", path}});
    if (!process) return tl::unexpected(process.error());
    process_ = std::move(*process);
  } else {
    options_.log(fmt::format("waits for an engine at {}", path), false);
  }
  return wait_for_engine();
}

Result<void> Session::wait_for_engine() {
  const Clock::time_point until = Clock::now() + seconds(options_.connect_limit_s);
  while (!channel_.open()) {
    if (options_.stop != nullptr && options_.stop->load(std::memory_order_relaxed))
      return fail(ErrorCode::kTimeout, "stopped before an engine came");
    std::string told;
    if (auto channel = listener_.accept(told)) channel_ = std::move(*channel);
    if (!told.empty()) options_.log(told, true);
    if (channel_.open()) break;
    if (process_.started()) {
      attend();
      if (const std::string how = process_.ended(); !how.empty()) {
        shut({ErrorCode::kIo, fmt::format("the engine ended with {} before HELLO", how)});
      } else if (Clock::now() >= until) {
        shut({ErrorCode::kTimeout,
              fmt::format("the engine did not connect within {:g} s", options_.connect_limit_s)});
      }
      if (failure_) return tl::unexpected(*failure_);
    }
    wait_a_while(std::chrono::milliseconds{50});
  }
  asked_ = Clock::now();
  return {};
}

void Session::wait_a_while(std::chrono::nanoseconds longest) {
  std::array<pollfd, 3> awaited{};
  awaited[0] = {channel_.descriptor(), static_cast<short>(POLLIN | (channel_.unsent() ? POLLOUT : 0)), 0};
  awaited[1] = {process_.output(), POLLIN, 0};
  awaited[2] = {channel_.open() ? -1 : listener_.descriptor(), POLLIN, 0};
  const timespec timeout{.tv_sec = longest.count() / 1'000'000'000,
                         .tv_nsec = longest.count() % 1'000'000'000};
  ::ppoll(awaited.data(), awaited.size(), &timeout, nullptr);
}

void Session::pump() {
  if (failure_) return;
  // Where that fails, the engine may have said why before it hung up.
  static_cast<void>(channel_.flush());
  for (;;) {
    auto message = channel_.receive();
    if (!message) {
      const bool hung_up = message.error().code == ErrorCode::kIo;
      return shut({message.error().code, hung_up
                                             ? fmt::format("{} {}", message.error().message, talk_.where())
                                             : fmt::format("the engine broke the rules {}: {}", talk_.where(),
                                                           message.error().message)});
    }
    if (!*message) return;
    const bool answers_step = talk_.state() == State::kStep;
    const bool brings_bodies = answers_step || talk_.state() == State::kLoad;
    if (auto taken = talk_.take((*message)->type, (*message)->body); !taken) return shut(taken.error());
    if (told_slow_ || told_stopped_) {
      options_.log(fmt::format("the engine goes on with frame {}, after {:.1f} s", frame_,
                               std::chrono::duration<double>(Clock::now() - asked_).count()),
                   false);
      told_slow_ = told_stopped_ = false;
    }
    if (talk_.layout().in_line && !talk_.slot().empty())
      std::memcpy(own_.data(), talk_.slot().data(), own_.size());
    if (brings_bodies && (answers_step || talk_.loaded())) read_slot(answers_step);
    if (failure_ || talk_.state() == State::kStart) return;
  }
}

void Session::read_slot(bool with_events) {
  const Layout& layout = talk_.layout();
  const std::span<const std::byte> slot =
      layout.in_line ? std::span<const std::byte>(own_)
                     : std::span<const std::byte>(segment_.bytes()).subspan(layout.first, layout.slot_bytes);
  if (auto whole = check_slot(slot, talk_.frame()); !whole) return shut(whole.error());
  columns_->read(slot, with_events);
  if (auto whole = check_slot(slot, talk_.frame()); !whole) shut(whole.error());
}

void Session::attend() {
  attended_ = Clock::now();
  for (const std::string& line : process_.read()) options_.log("engine: " + line, false);
  std::string told;
  if (channel_.open()) {
    if (auto second = listener_.accept(told)) {
      append(second->out(), Type::kError, std::string_view("this server has an engine already"));
      static_cast<void>(second->flush());
      told = fmt::format("process {} knocked at {}, but there is an engine already: refused", second->peer(),
                         listener_.path());
    }
  }
  if (!told.empty()) options_.log(told, true);
  if (!busy() || !columns_) return;
  const auto waited = attended_ - asked_;
  if (!told_stopped_ && waited > std::chrono::milliseconds{300} && is_stopped(channel_.peer())) {
    told_stopped_ = true;
    options_.log(fmt::format("the engine, process {}, is stopped {}", channel_.peer(), talk_.where()), true);
  }
  if (!told_slow_ && talk_.state() == State::kStep && waited > seconds(hello().step_limit_s / 2)) {
    told_slow_ = true;
    options_.log(fmt::format("the engine has not answered for {:.1f} s {}; its limit is {:g} s",
                             hello().step_limit_s / 2, talk_.where(), hello().step_limit_s),
                 true);
  }
}

Classification Session::classify(const Input& input) const {
  const auto refuse = [](std::string why) {
    Classification refused;
    refused.reason = std::move(why);
    return refused;
  };
  const auto length = [&input](std::size_t first) {
    double squared = 0;
    for (std::size_t i = first; i < first + 3; ++i) squared += input.values[i] * input.values[i];
    return std::sqrt(squared);
  };
  const bool finite = std::ranges::all_of(input.values, [](double v) { return std::isfinite(v); });
  if (!finite) return refuse("a value is not finite");
  Classification effect;
  switch (static_cast<InputKind>(input.kind)) {
    case InputKind::kGravity:
      if (!hello().most_gravity) return refuse(hello().name + " takes no gravity");
      if (input.values.size() != 3 || !input.bytes.empty()) return refuse("gravity takes 3 values");
      if (!(length(0) <= *hello().most_gravity))
        return refuse(fmt::format("gravity is at most {:g}", *hello().most_gravity));
      effect.effect = Classification::Effect::kScheduled;
      std::copy_n(input.values.begin(), 3, effect.gravity.begin());
      effect.damping_per_s = hello().damping_per_s;
      return effect;
    case InputKind::kPush:
      if (!hello().most_push) return refuse(hello().name + " takes no pushes");
      if (input.values.size() != 7 || !input.bytes.empty()) return refuse("a push takes 7 values");
      if (!(input.values[3] > 0)) return refuse("a push's radius must be above 0");
      if (!(length(4) <= *hello().most_push))
        return refuse(fmt::format("a push is at most {:g}", *hello().most_push));
      effect.effect = Classification::Effect::kImmediate;
      return effect;
    case InputKind::kApplication:
      if (!hello().most_bytes) return refuse(hello().name + " takes no application bytes");
      if (!input.values.empty()) return refuse("an application's input has bytes only");
      if (input.bytes.size() > *hello().most_bytes)
        return refuse(fmt::format("an application's input has at most {} bytes", *hello().most_bytes));
      effect.effect = Classification::Effect::kImmediate;
      return effect;
    default:
      return refuse(fmt::format("{} takes no input of kind {}", hello().name, input.kind));
  }
}

void Session::apply(const Input& input) {
  if (input.kind == static_cast<std::uint32_t>(InputKind::kGravity))
    std::copy_n(input.values.begin(), 3, gravity_.begin());
  append_input(channel_.out(), frame_ + 1, input);
}

void Session::begin_step() {
  if (failure_) return;
  ++frame_;
  talk_.ask_step(frame_);
  append_step(channel_.out(), frame_, 0);
  asked_ = Clock::now();
  told_slow_ = told_stopped_ = false;
  static_cast<void>(channel_.flush());  // step_ready() finds out why it fails
}

bool Session::step_ready() {
  pump();
  if (failure_ || !busy()) return true;
  const Clock::time_point now = Clock::now();
  if (now - attended_ > std::chrono::milliseconds{20}) attend();
  if (now - asked_ > seconds(hello().step_limit_s)) {
    shut({ErrorCode::kTimeout,
          fmt::format("the engine did not answer for {:g} s {}{}", hello().step_limit_s, talk_.where(),
                      is_stopped(channel_.peer()) ? ": it is stopped" : "")});
    return true;
  }
  return false;
}

void Session::step() {
  begin_step();
  while (!step_ready()) wait_a_while(std::chrono::milliseconds{10});
}

std::string Session::failure() {
  const Clock::time_point now = Clock::now();
  // Between two steps nothing may come, but the engine may be gone.
  if (!failure_ && !busy()) pump();
  if (!failure_ && now - attended_ > std::chrono::milliseconds{20}) attend();
  return failure_ ? failure_->message : std::string();
}

bool Session::wait_for_answer(std::chrono::nanoseconds limit) {
  const State asked = talk_.state();
  for (;;) {
    pump();
    attend();
    if (failure_) return false;
    if (talk_.state() != asked) return true;
    if (Clock::now() - asked_ > limit) {
      shut({ErrorCode::kTimeout, fmt::format("the engine did not answer for {:g} s {}",
                                             static_cast<double>(limit.count()) * 1e-9, talk_.where())});
      return false;
    }
    if (options_.stop != nullptr && options_.stop->load(std::memory_order_relaxed) && !columns_) {
      shut({ErrorCode::kTimeout, "stopped before the engine had started"});
      return false;
    }
    wait_a_while(std::chrono::milliseconds{20});
  }
}

void Session::save_into(std::vector<std::byte>& out) {
  out.clear();
  if (!hello().saves || failure_ || busy()) return;
  const auto file = folder_.file("save");
  if (!file) return options_.log(file.error().message, true);
  talk_.ask_save();
  append(channel_.out(), Type::kSave, *file);
  asked_ = Clock::now();
  if (!wait_for_answer(seconds(options_.start_limit_s)) || talk_.saved_bytes() == 0) return;
  std::ifstream in(*file, std::ios::binary | std::ios::ate);
  const auto bytes = in ? static_cast<std::uint64_t>(in.tellg()) : 0;
  const Saved head{.frame = frame_, .gravity = gravity_};
  if (!in || bytes != talk_.saved_bytes()) {
    options_.log(
        fmt::format("the engine says that it saved {} bytes of frame {}, but there are {}: no checkpoint",
                    talk_.saved_bytes(), frame_, bytes),
        true);
    return;
  }
  out.resize(sizeof head + bytes);
  std::memcpy(out.data(), &head, sizeof head);
  in.seekg(0);
  in.read(reinterpret_cast<char*>(out.data()) + sizeof head,  // NOLINT: as read() wants it
          static_cast<std::streamsize>(bytes));
  if (!in) out.clear();
  std::error_code ignored;
  std::filesystem::remove(*file, ignored);
}

bool Session::load(std::span<const std::byte> bytes) {
  Saved head;
  const std::uint64_t magic = head.magic;
  if (!hello().saves || failure_ || busy() || bytes.size() < sizeof head) return false;
  std::memcpy(&head, bytes.data(), sizeof head);
  if (head.magic != magic) return false;
  const auto file = folder_.file("load");
  if (!file) return false;
  {
    std::ofstream out(*file, std::ios::binary | std::ios::trunc);
    const auto rest = bytes.subspan(sizeof head);
    out.write(reinterpret_cast<const char*>(rest.data()),  // NOLINT: as write() wants it
              static_cast<std::streamsize>(rest.size()));
    if (!out.flush()) return false;
  }
  talk_.ask_load(head.frame);
  append_load(channel_.out(), head.frame, *file);
  asked_ = Clock::now();
  if (!wait_for_answer(seconds(options_.start_limit_s)) || !talk_.loaded()) return false;
  frame_ = head.frame;
  gravity_ = head.gravity;
  std::error_code ignored;
  std::filesystem::remove(*file, ignored);
  return true;
}

void Session::shut(const Error& error) {
  if (failure_) return;
  std::string line = error.message;
  if (channel_.open()) {
    append(channel_.out(), Type::kError, line);
    static_cast<void>(channel_.flush());
    channel_.close();
  }
  if (process_.started()) {
    for (int i = 0; i < 20 && process_.ended().empty(); ++i) {  // its last words are on their way
      attend();
      wait_a_while(std::chrono::milliseconds{5});
    }
    attend();
    if (const std::string how = process_.ended(); !how.empty()) line += fmt::format(" ({})", how);
    // An engine may repeat what it was told.
    if (!process_.last_lines().empty() && process_.last_lines().back() != error.message)
      line += fmt::format("; its last words: {}", process_.last_lines().back());
  }
  failure_ = Error{error.code, std::move(line)};
  end();
}

void Session::end() {
  if (channel_.open() && !failure_) {
    append(channel_.out(), Type::kBye, std::string_view());
    static_cast<void>(channel_.flush());
  }
  channel_.close();
  process_.end(failure_ ? 0 : 1000);
}

}  // namespace

Result<std::unique_ptr<Door>> Door::open(Options options) {
  const Way& way = options.way;
  const int ways = (way.command.empty() ? 0 : 1) + (way.path.empty() ? 0 : 1) + (way.descriptor >= 0 ? 1 : 0);
  if (ways != 1) return fail(ErrorCode::kInvalidArgument, "an engine comes in one way");
  auto session = std::make_unique<Session>(std::move(options));
  if (auto begun = session->begin(); !begun) return tl::unexpected(begun.error());
  return session;
}

}  // namespace tandem::engine::door
