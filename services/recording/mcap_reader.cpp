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

Result<McapReader> McapReader::open(InputFile file) {
  constexpr std::size_t kVersionAt = 5;
  McapReader reader(std::move(file));
  const auto begin =
      reader.file_.read(0, std::min<std::uint64_t>(reader.file_.size_bytes(), kMagic.size()), reader.buffer_);
  if (!begin) return tl::unexpected(begin.error());
  if (!is_magic(*begin)) {
    const bool other_version = begin->size() == kMagic.size() &&
                               std::memcmp(begin->data(), kMagic.data(), kVersionAt) == 0 &&
                               std::memcmp(&(*begin)[kVersionAt + 1], &kMagic[kVersionAt + 1], 2) == 0;
    if (other_version)
      return fail(ErrorCode::kUnsupported, "MCAP of another version than 0, which is the one that is read");
    return fail(ErrorCode::kMalformed, "not an MCAP file: its first eight bytes are others");
  }
  reader.data_at_ = reader.at_ = kMagic.size();
  if (auto surveyed = reader.survey(); !surveyed) return tl::unexpected(surveyed.error());
  return reader;
}

Result<std::optional<McapReader::Head>> McapReader::head_at(std::uint64_t at) {
  const std::uint64_t rest = file_.size_bytes() - at;
  if (rest < kRecordHead) return std::nullopt;
  const auto bytes = file_.read(at, kRecordHead, buffer_);
  if (!bytes) return tl::unexpected(bytes.error());
  Fields fields(*bytes);
  Head head;
  head.opcode = fields.get<std::uint8_t>();
  head.size_bytes = fields.get<std::uint64_t>();
  head.content_at = at + kRecordHead;
  if (head.size_bytes > rest - kRecordHead) return std::nullopt;
  return head;
}

// Finds the end, the chunks and their indexes. Errors within records are reported when the records are read.
Result<void> McapReader::survey() {
  end_ = data_at_;
  bool ended = false;
  while (!ended) {
    const auto head = head_at(end_);
    if (!head) return tl::unexpected(head.error());
    if (!*head) break;
    if (auto noted = note(**head, end_); !noted) return noted;
    end_ = (*head)->end();
    ended = (*head)->opcode == kFooter;
  }
  const std::uint64_t rest = file_.size_bytes() - end_;
  if (!ended || rest != kMagic.size()) {
    torn_at_ = end_;
  } else {
    const auto magic = file_.read(end_, kMagic.size(), buffer_);
    if (!magic) return tl::unexpected(magic.error());
    if (!is_magic(*magic)) torn_at_ = end_;
  }
  if (channels_.empty() && !chunks_.empty()) {  // without a summary: those that the first chunk names
    McapMessage first;
    static_cast<void>(next(first));
    rewind();
  }
  return {};
}

Result<void> McapReader::note(const Head& head, std::uint64_t at) {
  constexpr std::uint64_t kTimes = 8 + 8, kIndexHead = 2 + 4;
  const bool whole = head.opcode == kChannel && head.size_bytes <= kMostRecordBytes;
  const std::uint64_t wanted = head.opcode == kChunk          ? kTimes
                               : head.opcode == kMessageIndex ? kIndexHead
                               : whole                        ? head.size_bytes
                                                              : 0;
  const auto begin = file_.read(head.content_at, std::min(head.size_bytes, wanted), buffer_);
  if (!begin) return tl::unexpected(begin.error());
  Fields fields(*begin);
  if (head.opcode == kChunk) {
    const auto first_ns = fields.get<std::uint64_t>();
    const auto last_ns = fields.get<std::uint64_t>();
    if (last_ns != 0) {  // else it holds no message
      first_ns_ = last_ns_ == 0 ? first_ns : std::min(first_ns_, first_ns);
      last_ns_ = std::max(last_ns_, last_ns);
    }
    chunks_.push_back({at, first_ns});
  }
  if (head.opcode == kMessageIndex && !chunks_.empty()) {
    const auto channel = fields.get<std::uint16_t>();
    if (fields.get<std::uint32_t>() > 0)
      indexes_.emplace_back(static_cast<std::uint32_t>(chunks_.size() - 1), channel);
  }
  // Learns the channels of the summary, so that a channel is known before its chunk is read.
  if (whole) static_cast<void>(learn({.opcode = head.opcode, .content = *begin}));
  return {};
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

Result<McapReader::Record> McapReader::next_in_file() {
  record_at_ = at_;
  chunk_ = {};  // its bytes may be overwritten
  chunk_at_ = 0;
  const auto head = head_at(at_);
  if (!head) return tl::unexpected(head.error());
  if (!*head) return malformed("a record that is longer than the file");
  Record record{.opcode = (*head)->opcode, .content = {}};
  at_ = (*head)->end();
  if (record.opcode != kMessage && record.opcode != kChannel && record.opcode != kChunk) return record;
  if ((*head)->size_bytes > kMostRecordBytes)
    return malformed("a record of " + std::to_string((*head)->size_bytes) + " bytes, at most " +
                     std::to_string(kMostRecordBytes) + " are read");
  const auto content = file_.read((*head)->content_at, (*head)->size_bytes, buffer_);
  if (!content) return tl::unexpected(content.error());
  record.content = *content;
  return record;
}

Result<McapReader::Record> McapReader::next_in_chunk() {
  const auto too_long = [this] { return malformed("a record that is longer than its chunk"); };
  if (chunk_.size() - chunk_at_ < kRecordHead) return too_long();
  Fields head(chunk_.subspan(chunk_at_, kRecordHead));
  Record record{.opcode = head.get<std::uint8_t>(), .content = {}};
  const auto size = head.get<std::uint64_t>();
  if (size > chunk_.size() - chunk_at_ - kRecordHead) return too_long();
  record.content = chunk_.subspan(chunk_at_ + kRecordHead, size);
  chunk_at_ += kRecordHead + size;
  return record;
}

Result<bool> McapReader::next(McapMessage& out) {
  for (;;) {
    const bool in_chunk = chunk_at_ < chunk_.size();
    if (!in_chunk && at_ >= end_) return false;
    const auto record = in_chunk ? next_in_chunk() : next_in_file();
    if (!record) return tl::unexpected(record.error());
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
  if (head.size_bytes > kMaxChunkBytes)
    return malformed("a chunk of " + std::to_string(head.size_bytes) + " bytes, at most " +
                     std::to_string(kMaxChunkBytes) + " are read");
  if (head.compression.empty()) {
    chunk_ = head.stored;
  } else if (head.compression == "zstd") {
    const std::span<std::byte> unpacked = unpacked_.of(head.size_bytes);
    if (!zstd_) zstd_.reset(ZSTD_createDCtx());
    const std::size_t size = ZSTD_decompressDCtx(zstd_.get(), unpacked.data(), unpacked.size(),
                                                 head.stored.data(), head.stored.size());
    if (ZSTD_isError(size) != 0) return malformed(std::string("a damaged chunk: ") + ZSTD_getErrorName(size));
    chunk_ = unpacked.first(size);
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
