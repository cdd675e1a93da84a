// The functions that JavaScript calls. Each instance of the module is one client. ../tandem/module.ts is the
// other side. Times are milliseconds, texts UTF-8. A pointer that is handed out is valid until the next call.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/web/module/web_client.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/units.hpp"

#define TANDEM_EXPORT(name) extern "C" __attribute__((export_name("tandem_" #name)))
#define TANDEM_IMPORT(name) extern "C" __attribute__((import_module("tandem"), import_name(#name)))

TANDEM_IMPORT(log) void import_log(std::uint32_t level, const char* text, std::size_t size);
TANDEM_IMPORT(clock_ms) double import_clock_ms();

namespace tandem::web {
namespace {

/// The places of Sample's arrays. Orientations are null if the session has none.
struct SampleView {
  double frame = 0;
  std::uint32_t capacity = 0;
  const float* positions = nullptr;
  const float* orientations = nullptr;
  const std::uint8_t* alive = nullptr;
  const std::uint8_t* generation = nullptr;
  const TypeId* types = nullptr;
  const BodyChange* changes = nullptr;
  const std::uint8_t* corrected = nullptr;
  const std::uint32_t* corrected_in = nullptr;
};

struct Instance {
  explicit Instance(WebClient::Options options) : client(std::move(options)) {}

  WebClient client;
  std::vector<std::byte> input;  ///< of JavaScript's
  std::string output;            ///< for JavaScript
  SampleView view;
};

std::int64_t to_ns(double ms) { return static_cast<std::int64_t>(ms * double{kMillisecond}); }

std::int64_t measure_ns() { return to_ns(import_clock_ms()); }

client::Now now(double steady_ms, double wall_ms) { return {to_ns(steady_ms), to_ns(wall_ms)}; }

/// Number of bytes in `output`, which then holds `text`.
std::size_t hand_out(Instance& instance, std::string_view text) {
  instance.output.assign(text);
  return instance.output.size();
}

}  // namespace

TANDEM_EXPORT(create)
Instance* tandem_create(std::uint64_t id, std::uint32_t role, std::uint32_t lead, std::uint32_t max_delay_ms,
                        std::uint32_t max_kbit_s) {
  WebClient::Options options;
  options.id = id;
  options.role = role == 0 ? ClientRole::kObserver : ClientRole::kParticipant;
  options.lead = lead;
  options.max_delay_ms = std::min(max_delay_ms, transport::kMaxDelayMs);
  options.cap_kbit_s = transport::is_cap(max_kbit_s) ? max_kbit_s : 0;
  options.log = [](LogLevel level, std::string_view text) {
    import_log(static_cast<std::uint32_t>(level), text.data(), text.size());
  };
  options.measure_ns = measure_ns;
  return std::make_unique<Instance>(std::move(options)).release();  // lives as long as the module's instance
}

/// Room for the input of the next call; null for more than a message may have.
TANDEM_EXPORT(input) std::byte* tandem_input(Instance* instance, std::size_t size) {
  if (size > transport::WebPort::kMaxMessageBytes) return nullptr;
  instance->input.resize(size);
  return instance->input.data();
}
/// The output of the last call.
TANDEM_EXPORT(output) const char* tandem_output(const Instance* instance) { return instance->output.data(); }

/// `anew`: the client joins, although it plays the epoch that is announced.
TANDEM_EXPORT(connected) void tandem_connected(Instance* instance, std::uint32_t anew) {
  instance->client.port().connected(anew != 0);
}
TANDEM_EXPORT(disconnected) void tandem_disconnected(Instance* instance) {
  instance->client.port().disconnected();
}

/// Takes in the input as one message. Returns the size of the output: why it was refused, or 0.
TANDEM_EXPORT(receive) std::size_t tandem_receive(Instance* instance) {
  const auto received = instance->client.port().receive(instance->input);
  return received ? 0 : hand_out(*instance, received.error().message);
}
/// Does what is due; returns when it wants to be called again.
TANDEM_EXPORT(poll) double tandem_poll(Instance* instance, double steady_ms, double wall_ms) {
  return static_cast<double>(instance->client.poll(now(steady_ms, wall_ms))) / double{kMillisecond};
}
/// The next message to send: size of the output, 0 where there is none.
TANDEM_EXPORT(next_message) std::size_t tandem_next_message(Instance* instance) {
  const auto message = instance->client.port().next_message();
  if (!message) return 0;
  return hand_out(*instance, {reinterpret_cast<const char*>(message->data()), message->size()});
}

/// Sends the input, values (f64) or bytes as the kind has them; returns its number. 0: refused, and the
/// output says why, ended by a NUL.
TANDEM_EXPORT(send)
std::uint64_t tandem_send(Instance* instance, std::uint32_t kind, double steady_ms, double wall_ms) {
  std::vector<double> values;
  transport::Bytes bytes;
  const std::vector<std::byte>& in = instance->input;
  if (static_cast<transport::InputKind>(kind) == transport::InputKind::kApplication) {
    bytes = in;
  } else {
    values.resize(in.size() / sizeof(double));
    std::memcpy(values.data(), in.data(), values.size() * sizeof(double));
  }
  const auto sent = instance->client.send(static_cast<transport::InputKind>(kind), std::move(values),
                                          std::move(bytes), now(steady_ms, wall_ms));
  if (sent) return *sent;
  hand_out(*instance, sent.error().message);
  return 0;
}

TANDEM_EXPORT(take_events) std::size_t tandem_take_events(Instance* instance) {
  return hand_out(*instance, instance->client.take_events());
}
TANDEM_EXPORT(status) std::size_t tandem_status(Instance* instance) {
  return hand_out(*instance, instance->client.status());
}
TANDEM_EXPORT(types) std::size_t tandem_types(Instance* instance) {
  return hand_out(*instance, instance->client.types());
}
TANDEM_EXPORT(data_fields) std::size_t tandem_data_fields(Instance* instance) {
  return hand_out(*instance, instance->client.data_fields());
}
/// Records of all slots, one after another.
TANDEM_EXPORT(data) std::size_t tandem_data(Instance* instance) {
  const std::span<const std::byte> data = instance->client.data();
  return hand_out(*instance, {reinterpret_cast<const char*>(data.data()), data.size()});
}
TANDEM_EXPORT(scene_json) std::size_t tandem_scene_json(Instance* instance) {
  return hand_out(*instance, instance->client.scene_json());
}

TANDEM_EXPORT(show_uncorrected) void tandem_show_uncorrected(Instance* instance, std::uint32_t on) {
  instance->client.show_uncorrected(on != 0);
}

/// Null before the first snapshot.
TANDEM_EXPORT(sample)
const SampleView* tandem_sample(Instance* instance, std::uint32_t mode, double steady_ms, double wall_ms) {
  const Sample* const sample = instance->client.sample(
      mode == 0 ? SampleMode::kInterpolate : SampleMode::kExtrapolate, now(steady_ms, wall_ms));
  if (sample == nullptr) return nullptr;
  instance->view = {.frame = sample->frame,
                    .capacity = sample->capacity,
                    .positions = sample->positions.data(),
                    .orientations = sample->orientations.empty() ? nullptr : sample->orientations.data(),
                    .alive = sample->alive.data(),
                    .generation = sample->generation.data(),
                    .types = sample->types.data(),
                    .changes = sample->changes.data(),
                    .corrected = instance->client.corrected().data(),
                    .corrected_in = instance->client.corrected_in().data()};
  return &instance->view;
}

}  // namespace tandem::web
