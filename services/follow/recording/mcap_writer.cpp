#include "services/follow/recording/mcap_writer.hpp"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <concepts>

#include "sdk/core/lattice/assert.hpp"
#include "services/follow/recording/mcap_format.hpp"

namespace tandem::recording {
namespace {

using transport::Bytes;

// Most of a chunk is payloads, which no compressor makes smaller. The fastest level is enough for the rest.
constexpr int kLevel = 1;

/// The fields of a record, little-endian, without padding.
class Fields {
 public:
  explicit Fields(Bytes& out) : out_(out) { out_.clear(); }
  template <std::unsigned_integral T>
  Fields& put(T value) {
    for (std::size_t i = 0; i < sizeof value; ++i) {
      out_.push_back(static_cast<std::byte>(static_cast<std::uint64_t>(value) >> (8U * i)));
    }
    return *this;
  }
  Fields& put_text(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size()));
    const auto bytes = std::as_bytes(std::span(text));
    out_.insert(out_.end(), bytes.begin(), bytes.end());
    return *this;
  }

 private:
  Bytes& out_;
};

/// Of a message: the record's head, channel, sequence and two times.
constexpr std::size_t kMessageHeadBytes = kRecordHead + 2 + 4 + 8 + 8;

std::uint64_t to_time(std::int64_t ns) { return static_cast<std::uint64_t>(std::max<std::int64_t>(ns, 0)); }

void append_record(Bytes& out, std::uint8_t opcode, std::span<const std::byte> content,
                   std::span<const std::byte> more = {}) {
  Bytes head;
  Fields(head).put(opcode).put(std::uint64_t{content.size() + more.size()});
  out.insert(out.end(), head.begin(), head.end());
  out.insert(out.end(), content.begin(), content.end());
  out.insert(out.end(), more.begin(), more.end());
}

}  // namespace

std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t before) {
  if (bytes.empty()) return before;  // to zlib, no address means to begin anew
  return static_cast<std::uint32_t>(
      ::crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

void McapWriter::Span::include(std::uint64_t ns) {
  first_ns = std::min(first_ns, ns);
  last_ns = std::max(last_ns, ns);
}

McapWriter::McapWriter(Sink sink, Compression compression)
    : sink_(std::move(sink)), compression_(compression) {
  if (compression_ == Compression::kZstd) zstd_ = ZSTD_createCCtx();
  write(std::as_bytes(std::span(kMagic)));
  Fields(record_).put_text("").put_text("tandem " TANDEM_VERSION);  // no profile
  write_record(kHeader, record_);
}

McapWriter::~McapWriter() { ZSTD_freeCCtx(zstd_); }

McapWriter::Kind McapWriter::kind_of(const char* topic) {
  return {.topic = topic,
          .message_encoding = "cdr",
          .schema_name = "tandem::" + std::string(topic),
          .schema_encoding = "omgidl",
          .schema = idl_text()};
}

// A channel has a schema of its own, of the same id. Both stand in the chunk of the first message.
void McapWriter::declare(const Kind& kind) {
  TANDEM_ASSERT(channels_.size() < UINT16_MAX);
  const auto next_id = static_cast<std::uint16_t>(channels_.size() + 1);
  const auto [channel, is_new] = channels_.try_emplace(kind.topic, Channel{kind, next_id});
  if (!is_new) return;
  append_record(chunk_, kSchema, schema_record(channel->second));
  append_record(chunk_, kChannel, channel_record(channel->second));
}

void McapWriter::add(std::string_view topic, std::span<const std::byte> content, std::int64_t log_time_ns,
                     std::int64_t publish_time_ns) {
  const auto known = channels_.find(topic);
  TANDEM_ASSERT(known != channels_.end());
  Channel& channel = known->second;
  if (chunk_.size() + content.size() + kMessageHeadBytes > kMaxChunkBytes) {
    if (written_)
      written_ = fail(ErrorCode::kCapacity, "a message of " + std::to_string(content.size()) + " bytes on " +
                                                channel.kind.topic + " is larger than recordings hold");
    return;
  }
  const std::uint64_t log_time = to_time(log_time_ns);
  channel.index.emplace_back(log_time, chunk_.size());
  Fields(record_).put(channel.id).put(channel.messages++).put(log_time).put(to_time(publish_time_ns));
  append_record(chunk_, kMessage, record_, content);
  chunk_time_.include(log_time);
  ++messages_;
  if (chunk_.size() >= kChunkBytes || chunk_time_.last_ns - chunk_time_.first_ns >= kChunkNs) end_chunk();
}

void McapWriter::end_chunk() {
  if (chunk_.empty()) return;
  if (chunk_time_.first_ns <= chunk_time_.last_ns) {
    time_.include(chunk_time_.first_ns);
    time_.include(chunk_time_.last_ns);
  } else {
    chunk_time_ = {.first_ns = 0, .last_ns = 0};  // no message
  }
  std::span<const std::byte> stored = chunk_;
  if (zstd_ != nullptr) {
    packed_.resize(ZSTD_compressBound(chunk_.size()));
    const std::size_t size =
        ZSTD_compressCCtx(zstd_, packed_.data(), packed_.size(), chunk_.data(), chunk_.size(), kLevel);
    if (ZSTD_isError(size) != 0 && written_)
      written_ = fail(ErrorCode::kIo, std::string("zstd: ") + ZSTD_getErrorName(size));
    if (!written_) return;
    stored = std::span(packed_).first(size);
  }
  TANDEM_ASSERT(chunk_.size() <= UINT32_MAX && stored.size() <= UINT32_MAX);
  ChunkPlace place;
  place.time = chunk_time_;
  place.at = size_;
  place.stored_bytes = static_cast<std::uint32_t>(stored.size());
  place.content_bytes = static_cast<std::uint32_t>(chunk_.size());
  Fields(record_)
      .put(chunk_time_.first_ns)
      .put(chunk_time_.last_ns)
      .put(std::uint64_t{place.content_bytes})
      .put(crc32(chunk_))
      .put_text(zstd_ != nullptr ? "zstd" : "")
      .put(std::uint64_t{place.stored_bytes});
  write_record(kChunk, record_, stored);
  place.size_bytes = static_cast<std::uint32_t>(size_ - place.at);
  place.indexes = write_indexes();
  chunks_.push_back(place);
  chunk_.clear();
  chunk_time_ = {};
}

std::uint32_t McapWriter::write_indexes() {
  std::uint32_t written = 0;
  for (auto& [topic, channel] : channels_) {
    if (channel.index.empty()) continue;
    const std::uint64_t begin = size_;
    Fields fields(record_);
    fields.put(channel.id).put(static_cast<std::uint32_t>(channel.index.size() * 16));
    for (const auto& [time, offset] : channel.index) fields.put(time).put(offset);
    write_record(kMessageIndex, record_);
    channel.index.clear();
    indexes_.push_back({.size_bytes = static_cast<std::uint32_t>(size_ - begin), .channel = channel.id});
    ++written;
  }
  return written;
}

Bytes McapWriter::schema_record(const Channel& channel) const {
  Bytes out;
  Fields(out)
      .put(channel.id)
      .put_text(channel.kind.schema_name)
      .put_text(channel.kind.schema_encoding)
      .put_text(channel.kind.schema);
  return out;
}

Bytes McapWriter::channel_record(const Channel& channel) const {
  constexpr std::uint32_t kNoMetadata = 0;
  Bytes out;
  Fields(out)
      .put(channel.id)
      .put(channel.id)
      .put_text(channel.kind.topic)
      .put_text(channel.kind.message_encoding)
      .put(kNoMetadata);
  return out;
}

void McapWriter::write_summary() {
  for (const auto& [topic, channel] : channels_) write_record(kSchema, schema_record(channel));
  for (const auto& [topic, channel] : channels_) write_record(kChannel, channel_record(channel));
  constexpr std::uint32_t kNone = 0;  // attachments, metadata
  constexpr std::size_t kCountBytes = 2 + 8;
  Fields statistics(record_);
  statistics.put(messages_)
      .put(static_cast<std::uint16_t>(channels_.size()))
      .put(static_cast<std::uint32_t>(channels_.size()))
      .put(kNone)
      .put(kNone)
      .put(static_cast<std::uint32_t>(chunks_.size()))
      .put(messages_ == 0 ? 0 : time_.first_ns)
      .put(time_.last_ns)
      .put(static_cast<std::uint32_t>(channels_.size() * kCountBytes));
  for (const auto& [topic, channel] : channels_)
    statistics.put(channel.id).put(std::uint64_t{channel.messages});
  write_record(kStatistics, record_);
  auto index = indexes_.cbegin();
  for (const ChunkPlace& chunk : chunks_) {
    Fields fields(record_);
    fields.put(chunk.time.first_ns)
        .put(chunk.time.last_ns)
        .put(chunk.at)
        .put(std::uint64_t{chunk.size_bytes})
        .put(static_cast<std::uint32_t>(chunk.indexes * kCountBytes));
    const std::uint64_t begin = chunk.at + chunk.size_bytes;
    std::uint64_t end = begin;
    for (std::uint32_t i = 0; i < chunk.indexes; ++i, ++index) {
      fields.put(index->channel).put(end);
      end += index->size_bytes;
    }
    fields.put(end - begin)
        .put_text(zstd_ != nullptr ? "zstd" : "")
        .put(std::uint64_t{chunk.stored_bytes})
        .put(std::uint64_t{chunk.content_bytes});
    write_record(kChunkIndex, record_);
  }
  TANDEM_ASSERT(index == indexes_.cend());
}

Result<void> McapWriter::finish() {
  end_chunk();
  Fields(record_).put(kNoChecksum);
  write_record(kDataEnd, record_);
  const std::uint64_t summary_start = size_;
  summary_crc_ = 0;
  write_summary();
  constexpr std::uint64_t kNoOffsets = 0;
  // The checksum covers the footer up to itself.
  Fields(record_)
      .put(static_cast<std::uint8_t>(kFooter))
      .put(std::uint64_t{8 + 8 + 4})
      .put(summary_start)
      .put(kNoOffsets);
  write(record_);
  Fields(record_).put(summary_crc_);
  write(record_);
  write(std::as_bytes(std::span(kMagic)));
  return written_;
}

void McapWriter::write_record(std::uint8_t opcode, std::span<const std::byte> content,
                              std::span<const std::byte> more) {
  Bytes head;
  Fields(head).put(opcode).put(std::uint64_t{content.size() + more.size()});
  write(head);
  write(content);
  write(more);
}

void McapWriter::write(std::span<const std::byte> bytes) {
  summary_crc_ = crc32(bytes, summary_crc_);
  if (written_ && !bytes.empty()) written_ = sink_(bytes);
  if (written_) size_ += bytes.size();
}

}  // namespace tandem::recording
