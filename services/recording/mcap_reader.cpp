#include "services/recording/mcap_reader.hpp"

#include <zstd.h>

#include <algorithm>
#include <concepts>
#include <cstring>
#include <utility>

#include "services/recording/mcap_format.hpp"

namespace tandem::recording {
namespace {

/// The fields of a record, read from its front; once they do not fit, all further ones are 0.
class Fields {
 public:
  explicit Fields(std::span<const std::byte> bytes) : rest_(bytes) {}
  template <std::unsigned_integral T>
  T get() {
    T value = 0;
    for (std::size_t i = 0; i < sizeof value && sizeof value <= rest_.size(); ++i) {
      value = static_cast<T>(value | static_cast<T>(static_cast<T>(rest_[i]) << (8U * i)));
    }
    skip(sizeof value);
    return value;
  }
  std::string_view get_text() {
    const auto size = get<std::uint32_t>();
    const std::span<const std::byte> text = rest_;
    skip(size);
    return short_ ? std::string_view() : std::string_view(reinterpret_cast<const char*>(text.data()), size);
  }
  [[nodiscard]] std::span<const std::byte> rest() const { return rest_; }
  [[nodiscard]] bool too_short() const { return short_; }

 private:
  void skip(std::size_t bytes) {
    if (bytes > rest_.size()) short_ = true;
    rest_ = short_ ? std::span<const std::byte>() : rest_.subspan(bytes);
  }

  std::span<const std::byte> rest_;
  bool short_ = false;
};

struct ChunkHead {
  std::uint64_t first_ns = 0, last_ns = 0, size_bytes = 0;
  std::uint32_t crc = 0;
  std::string_view compression;
  std::span<const std::byte> stored;
  bool good = false;
};

ChunkHead read_head(std::span<const std::byte> content) {
  Fields fields(content);
  ChunkHead head;
  head.first_ns = fields.get<std::uint64_t>();
  head.last_ns = fields.get<std::uint64_t>();
  head.size_bytes = fields.get<std::uint64_t>();
  head.crc = fields.get<std::uint32_t>();
  head.compression = fields.get_text();
  const auto stored_bytes = fields.get<std::uint64_t>();
  head.stored = fields.rest();
  head.good = !fields.too_short() && stored_bytes == head.stored.size();
  return head;
}

bool is_magic(std::span<const std::byte> bytes) {
  return bytes.size() == kMagic.size() && std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) == 0;
}

}  // namespace

void McapReader::FreeContext::operator()(ZSTD_DCtx_s* context) const { ZSTD_freeDCtx(context); }
McapReader::McapReader(McapReader&&) noexcept = default;
McapReader::~McapReader() = default;

Result<McapReader> McapReader::open(std::span<const std::byte> file) {
  constexpr std::size_t kVersionAt = 5;
  const auto begin = file.first(std::min(file.size(), kMagic.size()));
  if (!is_magic(begin)) {
    const bool other_version = begin.size() == kMagic.size() &&
                               std::memcmp(begin.data(), kMagic.data(), kVersionAt) == 0 &&
                               std::memcmp(&begin[kVersionAt + 1], &kMagic[kVersionAt + 1], 2) == 0;
    if (other_version)
      return fail(ErrorCode::kUnsupported, "MCAP of another version than 0, which is the one that is read");
    return fail(ErrorCode::kMalformed, "not an MCAP file: its first eight bytes are others");
  }
  McapReader reader(file);
  reader.data_at_ = reader.at_ = kMagic.size();
  reader.survey();
  return reader;
}

std::optional<McapReader::Record> McapReader::record_at(std::span<const std::byte> bytes, std::uint64_t& at) {
  if (bytes.size() - at < kRecordHead) return std::nullopt;
  Fields head(bytes.subspan(at, kRecordHead));
  Record record{.opcode = head.get<std::uint8_t>(), .content = {}};
  const auto size = head.get<std::uint64_t>();
  if (size > bytes.size() - at - kRecordHead) return std::nullopt;
  record.content = bytes.subspan(at + kRecordHead, size);
  at += kRecordHead + size;
  return record;
}

// Finds the end, the chunks and what their indexes say; errors are told where the records are read.
void McapReader::survey() {
  end_ = data_at_;
  bool ended = false;
  while (!ended) {
    const std::uint64_t begin = end_;
    const auto record = record_at(file_, end_);
    if (!record) break;
    if (record->opcode == kChunk) note_chunk(begin, record->content);
    if (record->opcode == kMessageIndex && !chunks_.empty()) {
      Fields fields(record->content);
      const auto channel = fields.get<std::uint16_t>();
      if (fields.get<std::uint32_t>() > 0)
        indexes_.emplace_back(static_cast<std::uint32_t>(chunks_.size() - 1), channel);
    }
    // Learns the channels of the summary, so that a channel is known before its chunk is read.
    if (record->opcode == kChannel) static_cast<void>(learn(*record));
    ended = record->opcode == kFooter;
  }
  if (!ended || !is_magic(file_.subspan(end_))) torn_at_ = end_;
  if (channels_.empty() && !chunks_.empty()) {  // without a summary: those that the first chunk names
    McapMessage first;
    static_cast<void>(next(first));
    rewind();
  }
}

void McapReader::note_chunk(std::uint64_t at, std::span<const std::byte> content) {
  const ChunkHead head = read_head(content);
  if (head.last_ns != 0) {  // else it holds no message
    first_ns_ = last_ns_ == 0 ? head.first_ns : std::min(first_ns_, head.first_ns);
    last_ns_ = std::max(last_ns_, head.last_ns);
  }
  chunks_.push_back({at, head.first_ns});
}

std::vector<McapReader::Place> McapReader::chunks_with(std::string_view topic) const {
  std::vector<Place> found;
  for (const auto& [chunk, id] : indexes_) {
    const auto channel = channels_.find(id);
    if (channel == channels_.end() || channel->second.topic != topic) continue;
    if (found.empty() || found.back().at != chunks_[chunk].at) found.push_back(chunks_[chunk]);
  }
  return found;
}

void McapReader::go_to(const Place& place) {
  at_ = place.at;
  chunk_ = {};
  chunk_at_ = 0;
}

void McapReader::rewind() { go_to({.at = data_at_}); }

tl::unexpected<Error> McapReader::malformed(const std::string& what) const {
  return fail(ErrorCode::kMalformed, "at byte " + std::to_string(record_at_) + ": " + what);
}

Result<bool> McapReader::next(McapMessage& out) {
  for (;;) {
    const bool in_chunk = chunk_at_ < chunk_.size();
    std::uint64_t& at = in_chunk ? chunk_at_ : at_;
    if (!in_chunk) record_at_ = at_;
    if (!in_chunk && at_ >= end_) return false;
    const auto record = record_at(in_chunk ? chunk_ : file_, at);
    if (!record) return malformed("a record that is longer than its chunk");
    if (record->opcode == kMessage) {
      return read_message(record->content, out).transform([] { return true; });
    }
    if (!in_chunk && (record->opcode == kDataEnd || record->opcode == kFooter)) {
      at_ = end_;
      return false;
    }
    auto taken = Result<void>();
    if (record->opcode == kChannel) taken = learn(*record);
    if (record->opcode == kChunk)
      taken = in_chunk ? Result<void>(malformed("a chunk in a chunk")) : open_chunk(record->content);
    if (!taken) return tl::unexpected(taken.error());
  }
}

Result<void> McapReader::learn(const Record& record) {
  Fields fields(record.content);
  const auto id = fields.get<std::uint16_t>();
  fields.get<std::uint16_t>();  // schema: a topic's type is known by the topic
  Channel channel;
  channel.topic = fields.get_text();
  channel.encoding = fields.get_text();
  if (fields.too_short()) return malformed("a channel that is shorter than its fields");
  channels_.insert_or_assign(id, std::move(channel));
  return {};
}

Result<void> McapReader::open_chunk(std::span<const std::byte> content) {
  const ChunkHead head = read_head(content);
  if (!head.good) return malformed("a chunk that is shorter or longer than its fields say");
  if (head.size_bytes > kMostChunkBytes)
    return malformed("a chunk of " + std::to_string(head.size_bytes) + " bytes, at most " +
                     std::to_string(kMostChunkBytes) + " are read");
  if (head.compression.empty()) {
    chunk_ = head.stored;
  } else if (head.compression == "zstd") {
    if (unpacked_bytes_ < head.size_bytes) {
      unpacked_ = std::make_unique_for_overwrite<std::byte[]>(head.size_bytes);
      unpacked_bytes_ = head.size_bytes;
    }
    if (!zstd_) zstd_.reset(ZSTD_createDCtx());
    const std::size_t size = ZSTD_decompressDCtx(zstd_.get(), unpacked_.get(), head.size_bytes,
                                                 head.stored.data(), head.stored.size());
    if (ZSTD_isError(size) != 0) return malformed(std::string("a damaged chunk: ") + ZSTD_getErrorName(size));
    chunk_ = {unpacked_.get(), size};
  } else {
    return fail(ErrorCode::kUnsupported,
                "chunks compressed by '" + std::string(head.compression) + "'; zstd and none are read");
  }
  chunk_at_ = 0;
  if (chunk_.size() != head.size_bytes) return malformed("a chunk of another size than it says");
  if (head.crc != kNoChecksum && crc32(chunk_) != head.crc)
    return malformed("a damaged chunk: wrong checksum");
  return {};
}

Result<void> McapReader::read_message(std::span<const std::byte> content, McapMessage& out) const {
  Fields fields(content);
  const auto id = fields.get<std::uint16_t>();
  fields.get<std::uint32_t>();  // sequence
  out.log_time_ns = fields.get<std::uint64_t>();
  out.publish_time_ns = fields.get<std::uint64_t>();
  out.content = fields.rest();
  if (fields.too_short()) return malformed("a message that is shorter than its fields");
  const auto channel = channels_.find(id);
  if (channel == channels_.end()) return malformed("a message of a channel that is not there");
  out.topic = channel->second.topic;
  out.encoding = channel->second.encoding;
  return {};
}

}  // namespace tandem::recording
