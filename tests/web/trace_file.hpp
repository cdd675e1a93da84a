#pragma once
// The file of messages that tests of the WebAssembly module play: of each the time in ms (f64), its size
// (u32), and the WebSocket message.

#include <fstream>
#include <string>

#include "sdk/transport/envelope.hpp"

namespace tandem {

class TraceFile {
 public:
  explicit TraceFile(const std::string& path) : out_(path + ".trace", std::ios::binary) {}

  template <class M>
  void write(const M& message, double at_ms) {
    transport::Bytes bytes;
    transport::write_envelope(message, bytes);
    const auto size = static_cast<std::uint32_t>(bytes.size());
    out_.write(reinterpret_cast<const char*>(&at_ms), sizeof at_ms);
    out_.write(reinterpret_cast<const char*>(&size), sizeof size);
    out_.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(size));
  }
  [[nodiscard]] bool finish() { return out_.flush().good(); }

 private:
  std::ofstream out_;
};

}  // namespace tandem
