#pragma once
// Messages in a file: MCAP (mcap.dev), without chunks and compression. A channel is a topic, its schema the
// IDL, and every message its CDR bytes. idl/PROTOCOL.md, "Captures".

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/transport/cdr.hpp"
#include "sdk/transport/messages.hpp"
#include "tandem/result.hpp"

namespace tandem::transport {

/// The text of idl/tandem.idl.
[[nodiscard]] std::string_view idl_text();

/// Writes one file, front to back. A sink that failed is not called again. Not thread-safe.
class McapWriter {
 public:
  using Sink = std::function<Result<void>(std::span<const std::byte>)>;

  explicit McapWriter(Sink sink);

  /// Appends a message. Times are wall clock, ns since 1970: when it was taken in, and when it was published,
  /// where that is known.
  template <class M>
  void add(const M& message, std::int64_t log_time_ns, std::int64_t publish_time_ns) {
    cdr_.clear();
    write_cdr(message, cdr_);
    add(M::kTopic, log_time_ns, publish_time_ns);
  }
  /// Ends the file: nothing may be added afterwards. Errors: the first one of the sink.
  [[nodiscard]] Result<void> finish();

 private:
  struct Channel {
    std::uint16_t id = 0;
    std::uint32_t messages = 0;
  };
  void add(const char* topic, std::int64_t log_time_ns, std::int64_t publish_time_ns);
  void write_schema(const std::string& topic, std::uint16_t id);
  void write_channel(const std::string& topic, std::uint16_t id);
  void write_summary();
  void write_record(std::uint8_t opcode, const Bytes& content, std::span<const std::byte> more = {});
  void write(std::span<const std::byte> bytes);

  Sink sink_;
  Result<void> written_;
  std::uint64_t size_ = 0;  // of the file so far
  std::map<std::string, Channel> channels_;
  std::uint64_t messages_ = 0;
  std::uint64_t first_ns_ = 0, last_ns_ = 0;  // log times
  Bytes record_, cdr_;                        // kept to reuse their memory
};

}  // namespace tandem::transport
