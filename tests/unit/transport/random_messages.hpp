#pragma once
// Messages with random content: all fields of sdk/wire/fields.hpp, all lengths, texts without NUL, any
// bits in floats but NaN.

#include <random>
#include <string>
#include <type_traits>
#include <vector>

#include "sdk/wire/fields.hpp"

namespace tandem::transport {

class RandomMessages {
 public:
  explicit RandomMessages(std::uint64_t seed) : random_(seed) {}

  template <class M>
  M make() {
    M message;
    fields(*this, message);
    if constexpr (std::is_same_v<M, SessionMessage>) complete_layouts(message);
    return message;
  }

  // As a visitor of fields().
  template <class T>
  void primitive(T& value) {
    if constexpr (std::is_enum_v<T>) {
      value = static_cast<T>(random_() % 7);
    } else if constexpr (std::is_floating_point_v<T>) {
      value = static_cast<T>(static_cast<double>(static_cast<std::int64_t>(random_())) * 1e-6);
    } else {
      value = static_cast<T>(random_() >> (random_() % 64));
    }
  }
  void text(std::string& value) {
    value.assign(count(), ' ');
    for (char& c : value) c = static_cast<char>(1 + random_() % 255);
  }
  void sequence(Bytes& values) {
    values.resize(random_() % 2000);
    for (std::byte& byte : values) byte = static_cast<std::byte>(random_());
  }
  template <class T, class Each>
  void sequence(std::vector<T>& values, Each&& each) {
    values.clear();
    for (std::size_t left = count(); left > 0; --left) each(values.emplace_back());
  }
  friend void parameters(RandomMessages& visit, StreamParameters& out) {
    out.codec.threshold = 1 + static_cast<std::int32_t>(visit.random_() % 1000000);
    out.codec.position_step = 1 + static_cast<std::int32_t>(visit.random_() % 1000);
    out.codec.velocity_step = 1 + static_cast<std::int32_t>(visit.random_() % 1000);
    primitives(visit, out.codec.velocity_gain, out.codec.acceleration_gain, out.step.decay);
  }

 private:
  std::size_t count() { return random_() % 4 == 0 ? 0 : random_() % 20; }

  std::mt19937_64 random_;
};

}  // namespace tandem::transport
