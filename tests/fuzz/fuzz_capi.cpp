// Whatever an application calls, in any order and with any arguments: tandem.h answers with a result, writes
// nothing beyond what it was given, and forgets no client.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "sdk/client/api/drawn_scene.hpp"
#include "tests/fuzz/program.hpp"
#include "tests/support/playground/playground.hpp"

namespace tandem::api {
namespace {

using fuzz::Program;
using fuzz::require;

constexpr std::size_t kClients = 4;
constexpr std::uint8_t kGuard = 0xA5;

/// A struct of any size, exactly as long as it says, so that a sanitizer sees what is written beyond.
template <class T>
class AnyStruct {
 public:
  AnyStruct(Program& program, T initial) {
    const std::uint8_t choice = program.u8();
    std::uint32_t size = sizeof(T);
    if (choice % 8 == 1) size = static_cast<std::uint32_t>(program.number() % 5000);
    if (choice % 8 == 2) size = sizeof(T) + program.u8();
    bytes_.assign(std::max<std::size_t>(size, sizeof size), choice % 16 < 8 ? 0 : program.u8());
    std::memcpy(bytes_.data(), &initial, std::min(bytes_.size(), sizeof(T)));
    std::memcpy(bytes_.data(), &size, sizeof size);
    null_ = choice % 32 == 31;
  }
  /// Another value of a part of it.
  template <class U>
  void set(U T::*member, U value) {
    T whole{};
    const std::size_t held = std::min(bytes_.size(), sizeof(T));
    std::memcpy(&whole, bytes_.data(), held);
    whole.*member = value;
    std::memcpy(bytes_.data(), &whole, held);
  }
  [[nodiscard]] T* get() { return null_ ? nullptr : reinterpret_cast<T*>(bytes_.data()); }

 private:
  std::vector<std::uint8_t> bytes_;  // as new gives it: aligned for everything
  bool null_ = false;
};

class Run {
 public:
  explicit Run(Program& program) : program_(program), playground_(1 + program.u8()) {}
  ~Run() {
    for (const tandem_client client : clients_) {
      if (client != 0) require(tandem_leave(client) == TANDEM_OK);
    }
  }
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;
  Run(Run&&) = delete;
  Run& operator=(Run&&) = delete;

  void play() {
    for (int step = 0; step < 96 && !program_.over(); ++step) {
      const tandem_result result = call();
      require(result >= TANDEM_OK && result <= TANDEM_INTERNAL && result != TANDEM_INTERNAL);
      require(result == TANDEM_OK || *tandem_error_text() != '\0');
    }
    make_peace();
  }

 private:
  tandem_client& slot() { return clients_[program_.u8() % kClients]; }
  /// One of the clients mostly, any number sometimes.
  tandem_client handle() {
    const std::uint8_t choice = program_.u8();
    return choice % 16 == 15 ? program_.u64() : clients_[choice % kClients];
  }
  double real() {
    const std::uint8_t choice = program_.u8();
    return choice < 200 ? choice * 0.1 - 10 : program_.real();
  }
  // Time passes while a call waits: not for ever.
  double wait() {
    const std::uint8_t choice = program_.u8();
    if (choice < 250) return choice * 0.002;
    return choice < 253 ? -1 : std::nan("");
  }

  tandem_result call() {
    switch (program_.u8() % 18) {
      case 0:
      case 1:
        return join();
      case 2:
        return leave();
      case 3:
      case 4:
      case 5:
        return tandem_update(handle(), wait());
      case 6:
        return tandem_wait_until_playing(handle(), wait());
      case 7: {
        AnyStruct<tandem_status> status(program_, TANDEM_STATUS_INIT);
        return tandem_get_status(handle(), status.get());
      }
      case 8:
      case 9:
        return sample();
      case 10: {
        AnyStruct<tandem_event> event(program_, TANDEM_EVENT_INIT);
        return tandem_next_event(handle(), event.get());
      }
      case 11: {
        const std::array<double, 3> gravity{real(), real(), real()};
        std::uint64_t number = 0;
        return tandem_send_gravity(handle(), program_.u8() % 16 == 1 ? nullptr : gravity.data(), &number);
      }
      case 12: {
        const std::array<double, 3> centre{real(), 0, 0}, velocity{0, real(), 0};
        return tandem_send_push(handle(), centre.data(), real(), velocity.data(), nullptr);
      }
      case 13: {
        const transport::Bytes bytes = program_.bytes(1100);
        if (bytes.empty()) return tandem_send_seek(handle(), real(), nullptr);
        return tandem_send_bytes(handle(), bytes.data(), bytes.size(), nullptr);
      }
      case 14:
        return look();
      case 15:
        playground_.pass(program_.u8() * 0.01);
        return TANDEM_OK;
      case 16:
        if (program_.u8() % 4 != 1) return TANDEM_OK;
        if (playground_.serving()) {
          playground_.stop_server();
        } else {
          playground_.start_server();
        }
        return TANDEM_OK;
      default:
        return read_text();
    }
  }

  tandem_result join() {
    tandem_client& client = slot();
    if (client != 0) return TANDEM_OK;
    AnyStruct<tandem_options> options(program_, TANDEM_OPTIONS_INIT);
    options.set(&tandem_options::background, 0U);
    options.set(&tandem_options::role,
                tandem_role{program_.u8() % 8 == 1 ? program_.i32() : program_.u8() % 2});
    options.set(&tandem_options::lead, std::uint32_t{program_.u8()} % 3);
    options.set(&tandem_options::echo, std::uint32_t{program_.u8()} % 3);
    options.set<tandem_log>(&tandem_options::log, [](void*, tandem_log_level, const char* line) {
      require(line != nullptr && tandem_update(1, 0) == TANDEM_IN_CALLBACK);
    });
    // Null means the defaults, which have a thread; the playground has one of its own meaning for it.
    tandem_client made = 0;
    const tandem_result result = playground_.join(options.get(), &made);
    require((result == TANDEM_OK) == (made != 0));
    if (made != 0) client = made;
    return result;
  }

  tandem_result leave() {
    tandem_client& client = slot();
    const tandem_result result = tandem_leave(client);
    require((result == TANDEM_OK) == (client != 0));
    require(tandem_leave(client) == TANDEM_INVALID_HANDLE);
    client = 0;
    return result;
  }

  tandem_result sample() {
    AnyStruct<tandem_sample_options> options(program_, TANDEM_SAMPLE_OPTIONS_INIT);
    const std::uint8_t choice = program_.u8();
    options.set(&tandem_sample_options::mode, tandem_sample_mode{choice % 3});
    if (choice % 5 == 1)
      options.set(&tandem_sample_options::at_ns, static_cast<std::int64_t>(program_.u64()));
    if (choice % 7 == 1) options.set(&tandem_sample_options::smoothing_s, program_.real());
    // One array of structs of 1..64 bytes for all columns, and a guard behind.
    const std::uint32_t capacity = program_.u8() % 64;
    const std::uint32_t stride = program_.u8() % 64;
    std::vector<std::uint8_t> memory(std::size_t{capacity} * std::max(stride, 16U) + 1, kGuard);
    tandem_columns set = TANDEM_COLUMNS_INIT;
    set.capacity = capacity;
    const std::uint8_t wanted = program_.u8();
    auto* const floats = reinterpret_cast<float*>(memory.data());
    if (wanted & 1U) set.positions = floats;
    if (wanted & 2U) set.velocities = floats;
    if (wanted & 4U) set.orientations = floats;
    if (wanted & 8U) set.angular_velocities = floats;
    if (wanted & 16U) set.types = reinterpret_cast<std::uint16_t*>(memory.data());
    if (wanted & 32U) set.alive = memory.data();
    if (wanted & 64U) set.reuse = memory.data();
    if (wanted & 128U) set.changes = memory.data();
    set.position_stride = set.velocity_stride = set.orientation_stride = stride;
    set.angular_velocity_stride = set.type_stride = set.alive_stride = stride;
    set.reuse_stride = set.change_stride = stride;
    AnyStruct<tandem_columns> columns(program_, set);
    AnyStruct<tandem_frame> frame(program_, TANDEM_FRAME_INIT);
    const tandem_result result = tandem_sample(handle(), options.get(), columns.get(), frame.get());
    require(memory.back() == kGuard);
    if (result != TANDEM_OK) {
      require(std::all_of(memory.begin(), memory.end(), [](std::uint8_t b) { return b == kGuard; }));
    }
    return result;
  }

  tandem_result look() {
    std::size_t count = 0;
    std::vector<float> values(program_.u8() % 5);
    switch (program_.u8() % 5) {
      case 0: {
        AnyStruct<tandem_scene> scene(program_, TANDEM_SCENE_INIT);
        return tandem_get_scene(handle(), scene.get());
      }
      case 1: {
        AnyStruct<tandem_solid> solid(program_, TANDEM_SOLID_INIT);
        return tandem_get_geometry(handle(), solid.get(), program_.u8() % 2, &count);
      }
      case 2: {
        AnyStruct<tandem_body_type> type(program_, TANDEM_BODY_TYPE_INIT);
        return tandem_get_type(handle(), static_cast<std::uint32_t>(program_.number()), type.get());
      }
      case 3: {
        std::vector<char> name(program_.u8() % 70);
        const auto slot = static_cast<std::uint32_t>(program_.number() % (2 * Playground::kBodies));
        if (playground_.serving()) playground_.name({{slot, std::string(slot * 3, 'n')}});
        return tandem_get_body_name(handle(), slot, name.data(), name.size());
      }
      default:
        return tandem_get_type_values(handle(), program_.u8() % 2, values.data(), values.size(), &count);
    }
  }

  /// A description of a scene as a server may send it.
  tandem_result read_text() {
    const transport::Bytes bytes = program_.bytes(600);
    const auto scene = read_scene_json({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    if (!scene) return TANDEM_OK;
    for (const Solid& solid : scene->solids) {
      require(std::isfinite(solid.radius) && std::isfinite(solid.centre[0]) &&
              std::isfinite(solid.normal[0]));
      require(std::isfinite(solid.orientation[3]) && std::isfinite(solid.size[2]));
    }
    return TANDEM_OK;
  }

  // After all that a client that behaves plays.
  void make_peace() {
    if (!playground_.serving()) playground_.start_server();
    const tandem_client client = playground_.join();
    require(client != 0 && tandem_wait_until_playing(client, 30) == TANDEM_OK);
    require(tandem_leave(client) == TANDEM_OK);
  }

  Program& program_;
  Playground playground_;
  std::array<tandem_client, kClients> clients_{};
};

}  // namespace
}  // namespace tandem::api

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tandem::fuzz::Program program(std::as_bytes(std::span(data, size)));
  tandem::api::Run(program).play();
  return 0;
}
