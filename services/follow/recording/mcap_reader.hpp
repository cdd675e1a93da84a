#pragma once
// Messages out of an MCAP file (mcap.dev), whole or cut short.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "services/follow/recording/input_file.hpp"
#include "services/follow/recording/mcap_format.hpp"
#include "tandem/result.hpp"

struct ZSTD_DCtx_s;

namespace tandem::recording {

struct McapMessage {
  std::string_view topic, encoding;
  std::uint64_t log_time_ns = 0, publish_time_ns = 0;
  std::span<const std::byte> content;  ///< until the next call
};

/// Reads chunks without compression and with zstd, and messages outside of chunks. A file that Tandem wrote
/// is read in its own order, as messages stand there in the order in which a client took them in. All others
/// are read by log time: a tool that writes a file anew may write topic by topic. A damaged chunk is passed
/// over, and told by damage(). Bytes are untrusted: memory is bounded by a few times kMaxChunkBytes, the
/// names of channels, and a small share of the file. Not thread-safe.
class McapReader {
 public:
  /// Maximum size of a chunk as it is stored, with its head. Data that cannot be compressed grows a little.
  static constexpr std::uint64_t kMaxRecordBytes = kMaxChunkBytes + (1U << 20U);
  /// Of a file in another order: chunks whose times overlap, which have to be open at once, and their bytes
  /// as they are stored and as they are read.
  static constexpr std::size_t kMaxOpen = 256;
  static constexpr std::uint64_t kMaxOpenBytes = 512U << 20U;

  /// The order of messages that have the same log time: ascending by what it makes of their topics.
  using Rank = std::uint32_t (*)(std::string_view topic);

  /// Looks at the head of every record. Errors: kMalformed (not MCAP), kUnsupported (another version of it),
  /// kIo.
  static Result<McapReader> open(InputFile file, Rank rank = nullptr);
  /// Opens bytes, which must outlive the reader.
  static Result<McapReader> open(std::span<const std::byte> file, Rank rank = nullptr) {
    return open(InputFile(file), rank);
  }
  McapReader(McapReader&&) noexcept;
  McapReader& operator=(McapReader&&) = delete;
  McapReader(const McapReader&) = delete;
  McapReader& operator=(const McapReader&) = delete;
  ~McapReader();

  /// Reads the next message; false at the end of the data. Errors: kUnsupported (compression, a chunk that is
  /// too large, too many that overlap), kIo. After an error nothing more can be read.
  [[nodiscard]] Result<bool> next(McapMessage& out);

  /// A chunk.
  struct Place {
    std::uint64_t at = 0;
    std::uint64_t first_ns = 0;  ///< log time, by the chunk's head
  };
  /// The chunks that hold messages of a topic, by their indexes, in the file's order.
  [[nodiscard]] std::vector<Place> chunks_with(std::string_view topic) const;
  /// Hands the messages of a chunk to `visitor` until it returns false. Does not move the reader. A chunk
  /// that cannot be read has none. Errors: kIo.
  using Visitor = std::function<bool(const McapMessage& message)>;
  [[nodiscard]] Result<void> visit(const Place& place, const Visitor& visitor);
  /// False if no place but the begin can be gone to, as the times of chunks overlap.
  [[nodiscard]] bool in_order() const { return in_order_; }
  void go_to(const Place& place);
  void rewind();

  /// The first and the last log time of all chunks, by their heads; 0 without any.
  [[nodiscard]] std::uint64_t first_ns() const { return first_ns_; }
  [[nodiscard]] std::uint64_t last_ns() const { return last_ns_; }
  /// The place where the file is cut short: the first byte that belongs to no complete record.
  [[nodiscard]] std::optional<std::uint64_t> torn_at() const { return torn_at_; }
  /// The chunks that were passed over so far, and what was wrong with the first.
  struct Damage {
    std::size_t chunks = 0;
    std::string first;
  };
  [[nodiscard]] Damage damage() const { return {damaged_.size(), first_damage_}; }

 private:
  struct Channel {
    std::string topic, encoding;
    std::uint32_t rank = 0;
  };
  /// A record in the file. Its content stands at `content_at`.
  struct Head {
    std::uint8_t opcode = 0;
    std::uint64_t content_at = 0, size_bytes = 0;
    [[nodiscard]] std::uint64_t end() const { return content_at + size_bytes; }
  };
  /// A chunk, or records of messages that stand in none, one behind the other.
  struct Chunk {
    std::uint64_t at = 0, end = 0;
    std::uint64_t first_ns = 0, last_ns = 0;
    bool plain = false;
  };
  struct Entry {
    std::uint64_t time_ns = 0;
    std::uint32_t rank = 0, offset = 0;
  };
  /// A chunk that is being read.
  struct Open {
    ReadBuffer stored, unpacked;
    std::span<const std::byte> bytes;  // in one of them, or in the file in memory
    std::vector<Entry> messages;
    std::size_t next = 0;
    std::uint64_t size_bytes = 0;
  };
  struct FreeContext {
    void operator()(ZSTD_DCtx_s* context) const;
  };

  McapReader(InputFile file, Rank rank) : file_(std::move(file)), rank_(rank) {}
  /// Returns nothing if the file ends before the record does.
  [[nodiscard]] Result<std::optional<Head>> head_at(std::uint64_t at);
  [[nodiscard]] Result<void> survey();
  [[nodiscard]] Result<void> note(const Head& head, std::uint64_t at);
  void note_message(std::span<const std::byte> begin, const Head& head, std::uint64_t at);
  void note_time(std::uint64_t first_ns, std::uint64_t last_ns);
  void decide_order();
  /// False if it is damaged.
  [[nodiscard]] Result<bool> open_chunk(const Chunk& chunk, Open& to);
  [[nodiscard]] Result<void> unpack(const Chunk& chunk, Open& to);
  [[nodiscard]] Result<void> list_messages(Open& of);
  [[nodiscard]] Result<void> open_more();
  void close(std::size_t which);
  [[nodiscard]] Result<void> learn(std::span<const std::byte> channel);
  [[nodiscard]] McapMessage message_at(const Open& open, std::size_t which) const;

  InputFile file_;
  Rank rank_;
  ReadBuffer buffer_;  // of a record's begin
  std::map<std::uint16_t, Channel> channels_;
  std::vector<Chunk> chunks_;
  std::vector<std::pair<std::uint32_t, std::uint16_t>> indexes_;  // place in chunks_, channel
  std::uint64_t first_ns_ = 0, last_ns_ = 0;
  std::optional<std::uint64_t> torn_at_;
  std::set<std::uint64_t> damaged_;  // where they begin
  std::string first_damage_;

  bool of_tandem_ = false;            // its own order is that of the messages
  bool in_order_ = true;              // the chunks follow one another in time
  std::vector<std::uint32_t> order_;  // places in chunks_, by time
  std::size_t next_ = 0;              // of order_: the next chunk to be opened
  std::vector<Open> open_;            // the first with a message of the least time is read
  Open spare_;
  std::size_t reading_ = 0;  // of open_: the one that the last message came from
  std::uint64_t open_bytes_ = 0;
  std::unique_ptr<ZSTD_DCtx_s, FreeContext> zstd_;
};

}  // namespace tandem::recording
