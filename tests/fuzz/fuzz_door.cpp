// What an engine sends through the door: any bytes in any pieces, to any questions. Refused with a line, or a
// conversation that keeps its order.

#include <cstring>

#include "services/engines/door/conversation.hpp"
#include "tests/fuzz/program.hpp"

namespace {

using namespace tandem::engine::door;
using State = Conversation::State;

void require_sane(const Conversation& talk) {
  const Hello& hello = talk.hello();
  tandem::fuzz::require(hello.capacity >= 1 && hello.dt_s > 0 && !hello.types.empty());
  const auto again = parse_hello(print_hello(hello));
  tandem::fuzz::require(again.has_value() && again->capacity == hello.capacity);
  std::size_t end = kSlotHeadBytes;
  for (const Column& column : talk.layout().columns) {
    tandem::fuzz::require(column.offset >= end && column.offset % 64 == 0);
    end = column.offset + column.axes * column.element_bytes * talk.layout().padded;
  }
  tandem::fuzz::require(end <= talk.layout().slot_bytes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Reader reader;
  Conversation talk;
  const bool remote = size % 2 == 1;  // the engine is on another machine
  if (remote) talk.set_remote();
  std::uint64_t frame = 0;
  for (std::size_t at = 0; at < size;) {
    const auto room = reader.room();
    if (!room) {
      tandem::fuzz::require(!room.error().message.empty());
      return 0;
    }
    const std::size_t count = std::min({room->size(), size - at, std::size_t{1} + data[at] % 64});
    std::memcpy(room->data(), data + at, count);
    reader.filled(count);
    at += count;
    const auto message = reader.take();
    if (!message) continue;
    const State before = talk.state();
    if (const auto taken = talk.take(message->type, message->body); !taken) {
      tandem::fuzz::require(!taken.error().message.empty() && talk.state() == State::kOver);
      return 0;
    }
    if (before == State::kHello) {
      require_sane(talk);
    }
    if (before == State::kSave)
      tandem::fuzz::require(talk.saved().size() == (remote ? talk.saved_bytes() : 0));
    tandem::fuzz::require(talk.news().size() <= kMaxStepNewsBytes &&
                          read_news(talk.news(), [](const NewsEntry&) {}));
    if (talk.layout().in_line && !talk.slot().empty())
      tandem::fuzz::require(talk.slot().size() == talk.layout().slot_bytes);
    if (talk.state() != State::kIdle) continue;
    // The next question, by what is left of the bytes.
    ++frame;
    if (at < size && data[at] % 8 == 1 && talk.hello().saves) {
      talk.ask_save();
    } else if (at < size && data[at] % 8 == 2 && talk.hello().saves) {
      talk.ask_load(frame);
    } else {
      talk.ask_step(frame);
    }
    if (talk.layout().slot_bytes < 1U << 20U) reader.set_limit(talk.limit());
  }
  return 0;
}
