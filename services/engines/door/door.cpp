#include "services/engines/door/door.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <exception>
#include <optional>
#include <utility>

#include "services/engines/door/callers.hpp"
#include "services/engines/door/channel.hpp"
#include "services/engines/door/columns.hpp"
#include "services/engines/door/conversation.hpp"
#include "services/engines/door/files.hpp"
#include "services/engines/door/inputs.hpp"
#include "services/engines/door/process.hpp"
#include "services/engines/door/segment.hpp"

namespace tandem::engine::door {
namespace {

using Clock = std::chrono::steady_clock;
using State = Conversation::State;

/// After this time without an answer the engine's process is looked at.
constexpr std::chrono::milliseconds kSeemsStill{300};

// For engines that load and compile for longer than they may before START.
constexpr std::string_view kCure =
    "what takes long belongs into its first step, for which it may ask as much time as it needs (step_limit)";

std::chrono::nanoseconds seconds(double s) { return std::chrono::nanoseconds(std::llround(s * 1e9)); }

// What a checkpoint holds in front of the engine's own bytes.
struct Saved {
  std::uint64_t magic = 0x314f4f444d444e54;  // "TNDMDOO1"
  std::uint64_t frame = 0;
  std::array<double, 3> gravity{};
};

/// The only implementation of Door.
class Session final : public Door {
 public:
  explicit Session(DoorOptions options) : options_(std::move(options)) {}
  ~Session() override { end(); }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  Session(Session&&) = delete;
  Session& operator=(Session&&) = delete;

  Result<void> begin();

  [[nodiscard]] const Hello& hello() const override { return talk_.hello(); }
  [[nodiscard]] int engine_process() const override { return channel_.peer(); }
  [[nodiscard]] Figures figures() const override {
    constexpr std::uint64_t kMaxNs = 1ULL << 62U;
    return {.trip_ns = trip_.count(),
            .step_ns = static_cast<std::int64_t>(std::min(talk_.done().step_ns, kMaxNs)),
            .slow = told_slow_,
            .stopped = told_stopped_};
  }
  void dismiss(std::string why) override { farewell_ = std::move(why); }
  [[nodiscard]] std::uint32_t capacity() const override { return hello().capacity; }
  [[nodiscard]] double dt_s() const override { return hello().dt_s; }
  [[nodiscard]] Vec3 gravity() const override { return gravity_; }
  [[nodiscard]] double damping_per_s() const override { return hello().damping_per_s; }
  [[nodiscard]] Classification classify(const Input& input) const override {
    return door::classify(hello(), input);
  }
  void apply(const Input& input) override;
  void step() override;
  void begin_step() override;
  [[nodiscard]] bool step_ready() override;
  [[nodiscard]] int step_descriptor() const override { return channel_.descriptor(); }
  [[nodiscard]] std::string failure() override;
  [[nodiscard]] Bodies bodies() const override { return columns_->bodies(); }
  [[nodiscard]] std::span<const Event> events() const override { return columns_->events(); }
  [[nodiscard]] NewsFeatures tells() const override { return hello().tells; }
  void tell(StepNews& news) override;
  [[nodiscard]] std::uint32_t colliding() const override { return talk_.done().colliding; }
  void save(std::vector<std::byte>& out) const override { saver_(out); }
  [[nodiscard]] bool load(std::span<const std::byte> bytes) override;

 private:
  Result<void> connect();
  Result<Listener> listen();
  Result<void> start_command();
  Result<void> wait_for_engine();
  /// Lets an engine in that knocks.
  void answer_door();
  /// Sends and receives what is there; what comes changes talk_. After an error the door is shut: failure_.
  void pump();
  /// Takes the engine's output, turns strangers away, and says when the engine seems to stand still.
  void attend();
  void turn_away_another();
  void save_into(std::vector<std::byte>& out);
  void read_slot(bool with_events);
  /// Waits until the question is answered. False: failure_. `stoppable`: DoorOptions::stop ends the wait,
  /// too.
  bool wait_for_answer(std::chrono::nanoseconds limit, bool stoppable);
  void wait_a_while(std::chrono::nanoseconds longest);
  void shut(const Error& error);
  void end();
  [[nodiscard]] bool busy() const { return talk_.state() != State::kIdle && talk_.state() != State::kOver; }

  DoorOptions options_;
  Folder folder_;
  Listener listener_;
  std::optional<Callers> callers_;  // over the network
  Process process_;
  Channel channel_;
  Conversation talk_;
  Segment segment_;
  std::vector<std::byte> own_;  // the message with the slot, in the inline form
  std::optional<Columns> columns_;
  Vec3 gravity_{};
  std::uint64_t frame_ = 0;
  Clock::time_point asked_ = Clock::now();
  Clock::time_point attended_{};
  std::chrono::nanoseconds trip_{0};
  bool told_slow_ = false, told_stopped_ = false;
  std::optional<Error> failure_;
  std::string farewell_;  // empty: BYE
  // save() is const for the world that it saves, but the engine has to be asked.
  std::function<void(std::vector<std::byte>&)> saver_ = [this](std::vector<std::byte>& out) {
    save_into(out);
  };
};

Result<void> Session::begin() {
  if (auto connected = connect(); !connected) return connected;
  const auto failed = [this]() -> Result<void> { return tl::unexpected(*failure_); };
  // Over the network its HELLO let the engine in.
  if (talk_.state() == State::kHello && !wait_for_answer(seconds(options_.call_limit_s), true))
    return failed();
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
  }
  gravity_ = hello().gravity;
  channel_.reader().set_limit(talk_.limit());
  columns_.emplace(layout);
  append(channel_.out(), Type::kLayout, print_layout(layout, path));
  asked_ = Clock::now();
  if (!wait_for_answer(seconds(options_.start_limit_s), true)) return failed();
  read_slot(false);
  if (failure_) return failed();
  return {};
}

Result<void> Session::connect() {
  const Way& way = options_.way;
  if (way.descriptor >= 0) {
    channel_ = Channel(system::Descriptor(way.descriptor));
    return {};
  }
  auto listener = listen();
  if (!listener) return tl::unexpected(listener.error());
  listener_ = std::move(*listener);
  if (!way.command.empty()) {
    if (auto started = start_command(); !started) return started;
  } else {
    options_.log(fmt::format("waits for an engine at {}", listener_.place()), false);
  }
  return wait_for_engine();
}

Result<Listener> Session::listen() {
  const Way& way = options_.way;
  if (!way.host.empty()) {
    auto token = way.token.empty() ? make_token() : way.token;
    if (!token) return tl::unexpected(token.error());
    options_.way.token = *token;
    callers_.emplace(*token, seconds(options_.call_limit_s));
    talk_.set_remote();
    return Listener::open_port(way.host, way.port);
  }
  if (way.command.empty()) return Listener::open(way.path);
  auto own = folder_.file("door");
  if (!own) return tl::unexpected(own.error());
  return Listener::open(*own);
}

Result<void> Session::start_command() {
  const Way& way = options_.way;
  std::vector<std::pair<std::string, std::string>> environment{{"TANDEM_DOOR", listener_.place()}};
  if (!way.host.empty()) {
    // An engine on another machine needs a name of this one.
    if (way.host == "0.0.0.0" || way.host == "::") {
      std::array<char, 256> name{};
      ::gethostname(name.data(), name.size() - 1);
      const std::string& place = listener_.place();
      environment[0].second = fmt::format("tcp:{}{}", name.data(), place.substr(place.rfind(':')));
    }
    environment.emplace_back("TANDEM_DOOR_TOKEN", way.token);
  }
  auto process = Process::start(way.command, environment);
  if (!process) return tl::unexpected(process.error());
  process_ = std::move(*process);
  return {};
}

void Session::answer_door() {
  std::string told;
  if (!callers_) {
    if (auto channel = listener_.accept(told)) channel_ = std::move(*channel);
    if (!told.empty()) options_.log(told, true);
    return;
  }
  const Clock::time_point now = Clock::now();
  while (auto channel = listener_.accept(told)) callers_->add(std::move(*channel), now);
  std::vector<std::string> lines;
  auto engine = callers_->poll(now, lines);
  for (const std::string& line : lines) options_.log(line, true);
  if (!engine) return;
  channel_ = std::move(engine->channel);
  if (auto taken = talk_.take(Type::kHello, engine->hello); !taken) shut(taken.error());
}

Result<void> Session::wait_for_engine() {
  const Clock::time_point until = Clock::now() + seconds(options_.connect_limit_s);
  while (!channel_.open()) {
    if (options_.stop != nullptr && options_.stop->load(std::memory_order_relaxed))
      return fail(ErrorCode::kTimeout, "stopped before an engine came");
    options_.idle(false);
    answer_door();
    if (failure_) return tl::unexpected(*failure_);
    if (channel_.open()) break;
    if (process_.started()) {
      attend();
      if (const std::string how = process_.ended(); !how.empty()) {
        shut({ErrorCode::kIo, fmt::format("the engine ended with {} before HELLO", how)});
      } else if (Clock::now() >= until) {
        shut({ErrorCode::kTimeout,
              fmt::format("the engine did not connect within {:g} s; {}", options_.connect_limit_s, kCure)});
      }
      if (failure_) return tl::unexpected(*failure_);
    }
    wait_a_while(std::chrono::milliseconds{callers_ && !callers_->empty() ? 5 : 50});
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
    const bool answers_step = talk_.state() == State::kStep && (*message)->type != Type::kNews;
    if (answers_step) trip_ = Clock::now() - asked_;
    const bool brings_bodies = answers_step || talk_.state() == State::kLoad;
    if (auto taken = talk_.take((*message)->type, (*message)->body); !taken) return shut(taken.error());
    if (told_slow_ || told_stopped_) {
      options_.log(fmt::format("the engine goes on with frame {}, after {:.1f} s", frame_,
                               std::chrono::duration<double>(Clock::now() - asked_).count()),
                   false);
      told_slow_ = told_stopped_ = false;
    }
    // The bodies stay where they arrived until the next ones are there.
    if (!talk_.slot().empty()) own_ = channel_.reader().exchange(std::move(own_));
    if (brings_bodies && (answers_step || talk_.loaded())) read_slot(answers_step);
    if (failure_ || talk_.state() == State::kStart) return;
  }
}

void Session::read_slot(bool with_events) {
  const Layout& layout = talk_.layout();
  const std::span<const std::byte> slot =
      layout.in_line ? talk_.slot()
                     : std::span<const std::byte>(segment_.bytes()).subspan(layout.first, layout.slot_bytes);
  if (auto whole = check_slot(slot, talk_.frame()); !whole) return shut(whole.error());
  columns_->read(slot, with_events);
  if (auto whole = check_slot(slot, talk_.frame()); !whole) shut(whole.error());
}

void Session::attend() {
  attended_ = Clock::now();
  for (const std::string& line : process_.read()) options_.log("engine: " + line, false);
  if (channel_.open()) turn_away_another();
  if (!busy() || !columns_) return;
  const auto waited = attended_ - asked_;
  // A hangup is seen when the last copy of its socket closes, and what it left behind may hold one.
  if (channel_.open() && process_.started() && waited > kSeemsStill && is_gone(channel_.peer())) {
    if (const std::string how = process_.ended(); !how.empty())
      return shut({ErrorCode::kIo, fmt::format("the engine ended with {} {}", how, talk_.where())});
  }
  if (!told_stopped_ && waited > kSeemsStill && is_stopped(channel_.peer())) {
    told_stopped_ = true;
    options_.log(fmt::format("the engine, process {}, is stopped {}", channel_.peer(), talk_.where()), true);
  }
  if (!told_slow_ && talk_.state() == State::kStep && waited > seconds(hello().step_limit_s / 2)) {
    told_slow_ = true;
    options_.log(fmt::format("the engine has not answered for {:.1f} s {}; its step_limit is {:g} s",
                             hello().step_limit_s / 2, talk_.where(), hello().step_limit_s),
                 true);
  }
}

void Session::turn_away_another() {
  constexpr std::string_view kWhy = "this server has an engine already";
  std::string told;
  auto another = listener_.accept(told);
  if (another && callers_) {
    std::vector<std::string> lines;
    callers_->turn_away(*another, std::string(kWhy), attended_, lines);
    if (!lines.empty()) told = lines.front();
  } else if (another) {
    append(another->out(), Type::kError, kWhy);
    static_cast<void>(another->flush());
    told = fmt::format("process {} knocked at {}, but there is an engine already: refused", another->peer(),
                       listener_.place());
  }
  if (!told.empty()) options_.log(told, true);
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
  if (!failure_ && now - asked_ > seconds(hello().step_limit_s)) {
    shut({ErrorCode::kTimeout,
          fmt::format("the engine did not answer for {:g} s {}: {}", hello().step_limit_s, talk_.where(),
                      is_stopped(channel_.peer())
                          ? "it is stopped"
                          : "if it needs longer, it says so with a larger step_limit")});
  }
  return failure_.has_value();
}

void Session::tell(StepNews& news) {
  const bool whole = read_news(talk_.news(), [&news](const NewsEntry& entry) {
    // What is refused the receiver counts.
    switch (entry.kind) {
      case NewsEntry::Kind::kEvent:
        return static_cast<void>(news.broadcast(entry.event, entry.bytes, entry.slot));
      case NewsEntry::Kind::kKey:
        return static_cast<void>(news.set_key(entry.key, entry.bytes));
      default:
        return static_cast<void>(news.remove_key(entry.key));
    }
  });
  TANDEM_ASSERT(whole);  // the conversation read them when they came
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

bool Session::wait_for_answer(std::chrono::nanoseconds limit, bool stoppable) {
  const State asked = talk_.state();
  for (;;) {
    pump();
    attend();
    options_.idle(asked != State::kHello && asked != State::kStart);
    if (failure_) return false;
    if (talk_.state() != asked) return true;
    if (Clock::now() - asked_ > limit) {
      const bool starts = asked == State::kHello || asked == State::kStart;
      shut({ErrorCode::kTimeout, fmt::format("the engine did not answer for {:g} s {}{}",
                                             static_cast<double>(limit.count()) * 1e-9, talk_.where(),
                                             starts ? fmt::format("; {}", kCure) : "")});
      return false;
    }
    if (stoppable && options_.stop != nullptr && options_.stop->load(std::memory_order_relaxed)) {
      shut({ErrorCode::kTimeout, "stopped before the engine had started"});
      return false;
    }
    wait_a_while(std::chrono::milliseconds{20});
  }
}

void Session::save_into(std::vector<std::byte>& out) {
  out.clear();
  if (!hello().saves || failure_ || busy()) return;
  std::string file;
  if (!callers_) {
    auto place = folder_.file("save");
    if (!place) return options_.log(place.error().message, true);
    file = std::move(*place);
  }
  talk_.ask_save();
  channel_.reader().set_limit(talk_.limit());
  append(channel_.out(), Type::kSave, file);
  asked_ = Clock::now();
  const bool saved = wait_for_answer(seconds(options_.start_limit_s), false) && talk_.saved_bytes() > 0;
  channel_.reader().set_limit(talk_.limit());
  if (saved) {
    const Saved head{.frame = frame_, .gravity = gravity_};
    out.resize(sizeof head);
    std::memcpy(out.data(), &head, sizeof head);
    if (callers_) {
      out.insert(out.end(), talk_.saved().begin(), talk_.saved().end());
    } else if (const auto read = append_saved(file, talk_.saved_bytes(), out); !read) {
      out.clear();
      options_.log(fmt::format("the engine says that it saved {} bytes of frame {}, {}: no checkpoint",
                               talk_.saved_bytes(), frame_, read.error().message),
                   true);
    }
  }
  if (!file.empty()) remove_file(file);
}

bool Session::load(std::span<const std::byte> bytes) {
  Saved head;
  const std::uint64_t magic = head.magic;
  if (!hello().saves || failure_ || bytes.size() < sizeof head) return false;
  std::memcpy(&head, bytes.data(), sizeof head);
  if (head.magic != magic) return false;
  // A server that stands by again may have left a step under way.
  if (busy() && !wait_for_answer(seconds(hello().step_limit_s), true)) return false;
  const auto rest = bytes.subspan(sizeof head);
  std::string file;
  if (callers_) {
    if (rest.size() > kMaxSavedBytes) return false;
    append_load(channel_.out(), head.frame, rest);
  } else {
    auto place = folder_.file("load");
    if (!place || !write_file(*place, rest)) return false;
    file = std::move(*place);
    append_load(channel_.out(), head.frame, std::as_bytes(std::span(file)));
  }
  talk_.ask_load(head.frame);
  asked_ = Clock::now();
  const bool loaded = wait_for_answer(seconds(options_.start_limit_s), true) && talk_.loaded();
  if (!file.empty()) remove_file(file);
  if (!loaded) return false;
  frame_ = head.frame;
  gravity_ = head.gravity;
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
    if (const std::string how = process_.ended(); !how.empty() && line.find(how) == std::string::npos)
      line += fmt::format(" ({})", how);
    // An engine may repeat what it was told.
    if (!process_.last_lines().empty() &&
        process_.last_lines().back().find(error.message) == std::string::npos)
      line += fmt::format("; its last words: {}", process_.last_lines().back());
  }
  failure_ = Error{error.code, std::move(line)};
  end();
  listener_ = Listener();  // the next door opens at the same place
}

void Session::end() {
  if (channel_.open() && !failure_) {
    if (farewell_.empty() && std::uncaught_exceptions() > 0) farewell_ = "the server failed";
    append(channel_.out(), farewell_.empty() ? Type::kBye : Type::kError, farewell_);
    static_cast<void>(channel_.flush());
  }
  channel_.close();
  for (const std::string& line : process_.end(failure_ ? 0 : 1000)) options_.log("engine: " + line, false);
}

}  // namespace

Result<std::unique_ptr<Door>> Door::open(DoorOptions options) {
  const Way& way = options.way;
  const bool of_network = !way.host.empty();
  const int ways = (way.command.empty() && !of_network ? 0 : 1) + (way.path.empty() ? 0 : 1) +
                   (way.descriptor >= 0 ? 1 : 0);
  if (ways != 1) return fail(ErrorCode::kInvalidArgument, "an engine comes in one way");
  if (of_network && (way.command.empty() || !way.token.empty())) {
    if (std::string wrong = wrong_with_token(way.token); !wrong.empty())
      return fail(ErrorCode::kInvalidArgument, std::move(wrong));
  }
  auto session = std::make_unique<Session>(std::move(options));
  if (auto begun = session->begin(); !begun) return tl::unexpected(begun.error());
  return session;
}

void turn_away(int descriptor, std::string_view why) {
  Channel channel{system::Descriptor(descriptor)};
  append(channel.out(), Type::kError, why);
  static_cast<void>(channel.flush());
}

}  // namespace tandem::engine::door
