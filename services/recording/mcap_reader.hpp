#pragma once
// Messages out of an MCAP file (mcap.dev), whole or cut short.

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "services/recording/input_file.hpp"
#include "services/recording/mcap_format.hpp"
#include "tandem/result.hpp"

struct ZSTD_DCtx_s;

namespace tandem::recording {

struct McapMessage {
  std::string_view topic, encoding;
  std::uint64_t log_time_ns = 0, publish_time_ns = 0;
  std::span<const std::byte> content;  ///< until the next call
};

/// Reads chunks without compression and with zstd, and messages outside of chunks. Bytes are untrusted:
/// memory is bounded by kMaxChunkBytes, the names of channels, and a small share of the file. Not
/// thread-safe.
class McapReader {
 public:
  /// Maximum size of a chunk as it is stored, with its head. Data that cannot be compressed grows a little.
  static constexpr std::uint64_t kMostRecordBytes = kMaxChunkBytes + (1U << 20U);

  /// Looks at the head of every record. Errors: kMalformed (not MCAP), kUnsupported (another version of it),
  /// kIo.
  static Result<McapReader> open(InputFile file);
  /// Opens bytes, which must outlive the reader.
  static Result<McapReader> open(std::span<const std::byte> file) { return open(InputFile(file)); }
  McapReader(McapReader&&) noexcept;
  McapReader& operator=(McapReader&&) = delete;
  McapReader(const McapReader&) = delete;
  McapReader& operator=(const McapReader&) = delete;
  ~McapReader();

  /// Reads the next message; false at the end of the data. Errors: kMalformed (a record's fields, a
  /// checksum), kUnsupported (compression), kIo. After an error nothing more can be read.
  [[nodiscard]] Result<bool> next(McapMessage& out);

  /// A place to read from.
  struct Place {
    std::uint64_t at = 0;
    std::uint64_t first_ns = 0;  ///< log time, by the chunk's head
  };
  /// The chunks that hold messages of a topic, by their indexes, in the file's order.
  [[nodiscard]] std::vector<Place> chunks_with(std::string_view topic) const;
  void go_to(const Place& place);
  void rewind();
  /// True if the next message is of another chunk than the last one.
  [[nodiscard]] bool at_chunk_end() const { return chunk_at_ >= chunk_.size(); }

  /// The first and the last log time of all chunks, by their heads; 0 without any.
  [[nodiscard]] std::uint64_t first_ns() const { return first_ns_; }
  [[nodiscard]] std::uint64_t last_ns() const { return last_ns_; }
  /// The place where the file is cut short: the first byte that belongs to no complete record.
  [[nodiscard]] std::optional<std::uint64_t> torn_at() const { return torn_at_; }

 private:
  struct Channel {
    std::string topic, encoding;
  };
  struct Record {
    std::uint8_t opcode = 0;
    std::span<const std::byte> content;
  };
  /// A record in the file. Its content stands at `content_at`.
  struct Head {
    std::uint8_t opcode = 0;
    std::uint64_t content_at = 0, size_bytes = 0;
    [[nodiscard]] std::uint64_t end() const { return content_at + size_bytes; }
  };
  struct FreeContext {
    void operator()(ZSTD_DCtx_s* context) const;
  };

  explicit McapReader(InputFile file) : file_(std::move(file)) {}
  /// Returns nothing if the file ends before the record does.
  [[nodiscard]] Result<std::optional<Head>> head_at(std::uint64_t at);
  [[nodiscard]] Result<void> survey();
  [[nodiscard]] Result<void> note(const Head& head, std::uint64_t at);
  /// The record at at_, with its content if next() looks at it.
  [[nodiscard]] Result<Record> next_in_file();
  [[nodiscard]] Result<Record> next_in_chunk();
  [[nodiscard]] Result<void> learn(const Record& record);
  [[nodiscard]] Result<void> open_chunk(std::span<const std::byte> content);
  [[nodiscard]] Result<void> read_message(std::span<const std::byte> content, McapMessage& out) const;
  [[nodiscard]] tl::unexpected<Error> malformed(const std::string& what) const;

  InputFile file_;
  ReadBuffer buffer_;            // of the last record in the file
  std::uint64_t data_at_ = 0;    // behind the magic
  std::uint64_t end_ = 0;        // of the whole records
  std::uint64_t at_ = 0;         // of the next record in the file
  std::uint64_t record_at_ = 0;  // place of the current record, for errors
  std::map<std::uint16_t, Channel> channels_;
  std::vector<Place> chunks_;
  std::vector<std::pair<std::uint32_t, std::uint16_t>> indexes_;  // place in chunks_, channel
  std::uint64_t first_ns_ = 0, last_ns_ = 0;
  std::optional<std::uint64_t> torn_at_;

  std::span<const std::byte> chunk_;  // being read: in buffer_, or in unpacked_
  std::uint64_t chunk_at_ = 0;
  ReadBuffer unpacked_;
  std::unique_ptr<ZSTD_DCtx_s, FreeContext> zstd_;
};

}  // namespace tandem::recording
