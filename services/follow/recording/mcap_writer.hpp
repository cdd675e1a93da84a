#pragma once
// Writes messages to an MCAP file (mcap.dev). A channel is a topic, its schema a text that describes its
// type. idl/PROTOCOL.md, "Recordings".

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sdk/wire/cdr.hpp"
#include "sdk/wire/messages.hpp"
#include "tandem/result.hpp"

struct ZSTD_CCtx_s;

namespace tandem::recording {

/// The text of idl/tandem.idl.
[[nodiscard]] std::string_view idl_text();

enum class Compression : std::uint8_t { kNone, kZstd };

/// Writes one file, front to back, in chunks with an index behind each and one of all at the end. A sink that
/// failed is not called again. Not thread-safe.
class McapWriter {
 public:
  using Sink = std::function<Result<void>(std::span<const std::byte>)>;
  /// A chunk is closed with the message that reaches one of these. A file that is cut short lacks at most
  /// that.
  static constexpr std::size_t kChunkBytes = 1U << 20U;
  static constexpr std::uint64_t kChunkNs = 2'000'000'000;  ///< by log time

  McapWriter(Sink sink, Compression compression);
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;
  McapWriter(McapWriter&&) = delete;
  McapWriter& operator=(McapWriter&&) = delete;

  /// The kind of a channel's messages, for readers of the file.
  struct Kind {
    std::string topic, message_encoding;
    std::string schema_name, schema_encoding;
    std::string_view schema;  ///< outlives the writer
  };
  /// Makes a channel before its first message. No effect if the topic has one.
  void declare(const Kind& kind);
  /// The kind for a topic of Tandem: CDR, described by the IDL.
  template <class M>
  void declare() {
    declare(kind_of(M::kTopic));
  }
  /// Appends a message of a topic that was declared. Times are wall clock, ns since 1970. Errors, told by
  /// written(): kCapacity (kMaxChunkBytes).
  void add(std::string_view topic, std::span<const std::byte> content, std::int64_t log_time_ns,
           std::int64_t publish_time_ns);
  /// Appends a message of Tandem with the time when it was taken in and, if known, when it was published.
  /// Returns its size.
  template <class M>
  std::size_t add(const M& message, std::int64_t log_time_ns, std::int64_t publish_time_ns) {
    cdr_.clear();
    transport::write_cdr(message, cdr_);
    declare<M>();
    add(M::kTopic, cdr_, log_time_ns, publish_time_ns);
    return cdr_.size();
  }
  /// Ends the chunk: the next message starts a new one.
  void end_chunk();
  /// Ends the file: nothing may be added afterwards. Errors: the first one of the sink.
  [[nodiscard]] Result<void> finish();

  [[nodiscard]] const Result<void>& written() const { return written_; }
  [[nodiscard]] std::uint64_t size_bytes() const { return size_; }  ///< of the file, without an open chunk

 private:
  struct Channel {
    Kind kind;
    std::uint16_t id = 0;
    std::uint32_t messages = 0;
    std::vector<std::pair<std::uint64_t, std::uint64_t>> index = {};  // of the open chunk: time, offset
  };
  struct Span {
    std::uint64_t first_ns = UINT64_MAX, last_ns = 0;
    void include(std::uint64_t ns);
  };
  // What the end of the file says of each chunk. Kept small, because it grows for as long as the file does.
  struct ChunkPlace {
    Span time;
    std::uint64_t at = 0;
    std::uint32_t size_bytes = 0, stored_bytes = 0, content_bytes = 0;
    std::uint32_t indexes = 0;  // how many of indexes_ lie behind it
  };
  struct IndexPlace {
    std::uint32_t size_bytes = 0;
    std::uint16_t channel = 0;
  };
  [[nodiscard]] static Kind kind_of(const char* topic);
  [[nodiscard]] transport::Bytes schema_record(const Channel& channel) const;
  [[nodiscard]] transport::Bytes channel_record(const Channel& channel) const;
  std::uint32_t write_indexes();
  void write_summary();
  void write_record(std::uint8_t opcode, std::span<const std::byte> content,
                    std::span<const std::byte> more = {});
  void write(std::span<const std::byte> bytes);

  Sink sink_;
  Compression compression_;
  ZSTD_CCtx_s* zstd_ = nullptr;
  Result<void> written_;
  std::uint64_t size_ = 0;         // of the file so far
  std::uint32_t summary_crc_ = 0;  // of what was written since it was set to 0
  std::map<std::string, Channel, std::less<>> channels_;
  transport::Bytes chunk_;  // records of the open chunk
  Span chunk_time_, time_;
  std::deque<ChunkPlace> chunks_;
  std::deque<IndexPlace> indexes_;  // of all chunks, in the file's order
  std::uint64_t messages_ = 0;
  transport::Bytes record_, packed_, cdr_;  // kept to reuse their memory
};

}  // namespace tandem::recording
