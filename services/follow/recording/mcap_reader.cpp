#include "services/follow/recording/mcap_reader.hpp"

#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <iterator>
#include <numeric>
#include <utility>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/bytes.hpp"
#include "services/follow/recording/mcap_format.hpp"

namespace tandem::recording {
namespace {

std::string_view get_text(ByteReader& fields) {
  const auto text = fields.get_bytes(fields.get<std::uint32_t>());
  return {reinterpret_cast<const char*>(text.data()), text.size()};
}

template <class T>
void skip(ByteReader& fields) {
  static_cast<void>(fields.get<T>());
}

struct ChunkHead {
  std::uint64_t first_ns = 0, last_ns = 0, size_bytes = 0;
  std::uint32_t crc = 0;
  std::string_view compression;
  std::span<const std::byte> stored;
  bool good = false;
};

ChunkHead read_head(std::span<const std::byte> content) {
  ByteReader fields(content);
  ChunkHead head;
  head.first_ns = fields.get<std::uint64_t>();
  head.last_ns = fields.get<std::uint64_t>();
  head.size_bytes = fields.get<std::uint64_t>();
  head.crc = fields.get<std::uint32_t>();
  head.compression = get_text(fields);
  const auto stored_bytes = fields.get<std::uint64_t>();
  head.stored = fields.get_bytes(fields.remaining());
  head.good = fields.ok() && stored_bytes == head.stored.size();
  return head;
}

bool is_magic(std::span<const std::byte> bytes) {
  return bytes.size() == kMagic.size() && std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) == 0;
}

std::string at_byte(std::uint64_t at, const std::string& what) {
  return "at byte " + std::to_string(at) + ": " + what;
}

constexpr std::size_t kMessageHead = 2 + 4 + 8 + 8;

}  // namespace

void McapReader::FreeContext::operator()(ZSTD_DCtx_s* context) const { ZSTD_freeDCtx(context); }
McapReader::McapReader(McapReader&&) noexcept = default;
McapReader::~McapReader() = default;

Result<McapReader> McapReader::open(InputFile file, Rank rank) {
  constexpr std::size_t kVersionAt = 5;
  McapReader reader(std::move(file), rank);
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
  if (auto surveyed = reader.survey(); !surveyed) return tl::unexpected(surveyed.error());
  return reader;
}

Result<std::optional<McapReader::Head>> McapReader::head_at(std::uint64_t at) {
  TANDEM_ASSERT(at <= file_.size_bytes());
  const std::uint64_t rest = file_.size_bytes() - at;
  if (rest < kRecordHead) return std::nullopt;
  const auto bytes = file_.read(at, kRecordHead, buffer_);
  if (!bytes) return tl::unexpected(bytes.error());
  ByteReader fields(*bytes);
  Head head;
  head.opcode = fields.get<std::uint8_t>();
  head.size_bytes = fields.get<std::uint64_t>();
  head.content_at = at + kRecordHead;
  if (head.size_bytes > rest - kRecordHead) return std::nullopt;
  return head;
}

// Finds the chunks, their indexes and the end. Errors within records are reported when the records are read.
Result<void> McapReader::survey() {
  std::uint64_t end = kMagic.size();
  bool ended = false;
  while (!ended) {
    const auto head = head_at(end);
    if (!head) return tl::unexpected(head.error());
    if (!*head) break;
    if (auto noted = note(**head, end); !noted) return noted;
    end = (*head)->end();
    ended = (*head)->opcode == kFooter;
  }
  const std::uint64_t rest = file_.size_bytes() - end;
  if (!ended || rest != kMagic.size()) {
    torn_at_ = end;
  } else {
    const auto magic = file_.read(end, kMagic.size(), buffer_);
    if (!magic) return tl::unexpected(magic.error());
    if (!is_magic(*magic)) torn_at_ = end;
  }
  decide_order();
  // Without a summary the first chunk names channels.
  if (channels_.empty() && !chunks_.empty())
    return visit({.at = chunks_.front().at}, [](const McapMessage&) { return false; });
  return {};
}

Result<void> McapReader::note(const Head& head, std::uint64_t at) {
  constexpr std::uint64_t kTimes = 8 + 8, kIndexHead = 2 + 4, kNames = 1024;
  const bool whole = head.opcode == kChannel && head.size_bytes <= kMaxRecordBytes;
  const std::uint64_t wanted = head.opcode == kChunk          ? kTimes
                               : head.opcode == kMessageIndex ? kIndexHead
                               : head.opcode == kMessage      ? kMessageHead
                               : head.opcode == kHeader       ? kNames
                               : whole                        ? head.size_bytes
                                                              : 0;
  const auto begin = file_.read(head.content_at, std::min(head.size_bytes, wanted), buffer_);
  if (!begin) return tl::unexpected(begin.error());
  ByteReader fields(*begin);
  if (head.opcode == kHeader) {
    static_cast<void>(get_text(fields));  // profile
    of_tandem_ = get_text(fields).starts_with("tandem ");
  }
  if (head.opcode == kChunk) {
    const auto first_ns = fields.get<std::uint64_t>();
    const auto last_ns = fields.get<std::uint64_t>();
    note_time(first_ns, last_ns);
    chunks_.push_back({.at = at, .end = head.end(), .first_ns = first_ns, .last_ns = last_ns});
  }
  if (head.opcode == kMessageIndex && !chunks_.empty()) {
    const auto channel = fields.get<std::uint16_t>();
    if (fields.get<std::uint32_t>() > 0)
      indexes_.emplace_back(static_cast<std::uint32_t>(chunks_.size() - 1), channel);
  }
  if (head.opcode == kMessage) note_message(*begin, head, at);
  // Learns the channels of the summary, so that a channel is known before its chunk is read.
  if (whole) static_cast<void>(learn(*begin));
  return {};
}

// Messages in no chunk are read as if they stood in chunks of a usual size.
void McapReader::note_message(std::span<const std::byte> begin, const Head& head, std::uint64_t at) {
  constexpr std::uint64_t kUsualBytes = 1U << 20U;
  constexpr std::size_t kMaxCompared = 16;
  ByteReader fields(begin);
  const auto channel = fields.get<std::uint16_t>();
  skip<std::uint32_t>(fields);  // sequence
  const auto time_ns = fields.get<std::uint64_t>();
  const bool goes_on = !chunks_.empty() && chunks_.back().plain && chunks_.back().end == at &&
                       head.end() - chunks_.back().at <= kUsualBytes;
  if (!goes_on) chunks_.push_back({.at = at, .first_ns = time_ns, .last_ns = time_ns, .plain = true});
  Chunk& chunk = chunks_.back();
  chunk.end = head.end();
  chunk.first_ns = std::min(chunk.first_ns, time_ns);
  chunk.last_ns = std::max(chunk.last_ns, time_ns);
  note_time(time_ns, time_ns);
  const std::pair index(static_cast<std::uint32_t>(chunks_.size() - 1), channel);
  const auto compared = std::min(indexes_.size(), kMaxCompared);
  if (std::find(indexes_.end() - static_cast<std::ptrdiff_t>(compared), indexes_.end(), index) ==
      indexes_.end())
    indexes_.push_back(index);
}

void McapReader::note_time(std::uint64_t first_ns, std::uint64_t last_ns) {
  if (last_ns == 0) return;  // no message
  first_ns_ = last_ns_ == 0 ? first_ns : std::min(first_ns_, first_ns);
  last_ns_ = std::max(last_ns_, last_ns);
}

void McapReader::decide_order() {
  order_.resize(chunks_.size());
  std::iota(order_.begin(), order_.end(), 0U);
  if (of_tandem_) return;
  for (std::size_t i = 1; i < chunks_.size(); ++i)
    in_order_ = in_order_ && chunks_[i].first_ns > chunks_[i - 1].last_ns;
  std::ranges::stable_sort(order_, {}, [this](std::uint32_t chunk) { return chunks_[chunk].first_ns; });
}

std::vector<McapReader::Place> McapReader::chunks_with(std::string_view topic) const {
  std::vector<Place> found;
  for (const auto& [chunk, id] : indexes_) {
    const auto channel = channels_.find(id);
    if (channel == channels_.end() || channel->second.topic != topic) continue;
    if (found.empty() || found.back().at != chunks_[chunk].at)
      found.push_back({chunks_[chunk].at, chunks_[chunk].first_ns});
  }
  return found;
}

void McapReader::go_to(const Place& place) {
  rewind();
  while (next_ < order_.size() && chunks_[order_[next_]].at != place.at) ++next_;
  TANDEM_ASSERT(next_ < order_.size());
}

void McapReader::rewind() {
  while (!open_.empty()) close(0);
  next_ = 0;
}

// One is kept for its memory. Of more than one it might be too much.
void McapReader::close(std::size_t which) {
  TANDEM_ASSERT(which < open_.size() && open_[which].size_bytes <= open_bytes_);
  open_bytes_ -= open_[which].size_bytes;
  if (in_order_) spare_ = std::move(open_[which]);
  open_.erase(open_.begin() + static_cast<std::ptrdiff_t>(which));
}

Result<void> McapReader::visit(const Place& place, const Visitor& visitor) {
  const auto chunk = std::ranges::find(chunks_, place.at, &Chunk::at);
  if (chunk == chunks_.end()) return {};
  Open open;
  const auto opened = open_chunk(*chunk, open);
  if (!opened) return opened.error().code == ErrorCode::kIo ? tl::unexpected(opened.error()) : Result<void>();
  for (std::size_t i = 0; *opened && i < open.messages.size(); ++i) {
    if (!visitor(message_at(open, i))) break;
  }
  return {};
}

Result<bool> McapReader::next(McapMessage& out) {
  if (reading_ < open_.size() && open_[reading_].next == open_[reading_].messages.size()) close(reading_);
  if (auto opened = open_more(); !opened) return tl::unexpected(opened.error());
  if (open_.empty()) return false;
  const auto least = std::ranges::min_element(open_, {}, [](const Open& open) {
    const Entry& entry = open.messages[open.next];
    return std::pair(entry.time_ns, entry.rank);
  });
  TANDEM_ASSERT(least->next < least->messages.size());
  reading_ = static_cast<std::size_t>(least - open_.begin());
  out = message_at(*least, least->next++);
  return true;
}

// All chunks that may hold the next message: one, unless they overlap in time.
Result<void> McapReader::open_more() {
  const auto least_ns = [this] {
    std::uint64_t least = UINT64_MAX;
    for (const Open& open : open_) least = std::min(least, open.messages[open.next].time_ns);
    return least;
  };
  while (next_ < order_.size() &&
         (open_.empty() || (!in_order_ && chunks_[order_[next_]].first_ns <= least_ns()))) {
    Open& open = open_.emplace_back(std::exchange(spare_, Open()));
    const auto opened = open_chunk(chunks_[order_[next_++]], open);
    open_bytes_ += open.size_bytes;
    if (!opened) return tl::unexpected(opened.error());
    if (!*opened || open.messages.empty()) close(open_.size() - 1);
    if (open_.size() > kMaxOpen || (open_.size() > 1 && open_bytes_ > kMaxOpenBytes))
      return fail(ErrorCode::kUnsupported,
                  "its messages are too far from the order of their log times; put them in order first, as "
                  "`mcap sort` does");
  }
  return {};
}

Result<bool> McapReader::open_chunk(const Chunk& chunk, Open& to) {
  to.messages.clear();
  to.next = 0;
  to.size_bytes = chunk.end - chunk.at;
  auto read = unpack(chunk, to).and_then([&] { return list_messages(to); });
  if (read) return true;
  if (read.error().code != ErrorCode::kMalformed) return tl::unexpected(read.error());
  if (damaged_.empty()) first_damage_ = at_byte(chunk.at, read.error().message);
  damaged_.insert(chunk.at);
  return false;
}

Result<void> McapReader::unpack(const Chunk& chunk, Open& to) {
  const auto refuse = [](const std::string& what) { return fail(ErrorCode::kMalformed, what); };
  const auto too_large = [&](const char* what, std::uint64_t bytes, std::uint64_t most) {
    return fail(ErrorCode::kUnsupported,
                at_byte(chunk.at, std::string("a ") + what + " of " + std::to_string(bytes) +
                                      " bytes, at most " + std::to_string(most) + " are read"));
  };
  if (chunk.end - chunk.at > kMaxRecordBytes)
    return too_large("record", chunk.end - chunk.at, kMaxRecordBytes);
  const auto bytes = file_.read(chunk.at, chunk.end - chunk.at, to.stored);
  if (!bytes) return tl::unexpected(bytes.error());
  to.bytes = *bytes;
  if (chunk.plain) return {};
  const ChunkHead head = read_head(bytes->subspan(kRecordHead));
  if (!head.good) return refuse("a chunk that is shorter or longer than its fields say");
  if (head.size_bytes > kMaxChunkBytes) return too_large("chunk", head.size_bytes, kMaxChunkBytes);
  if (head.compression.empty()) {
    to.bytes = head.stored;
  } else if (head.compression == "zstd") {
    const std::span<std::byte> unpacked = to.unpacked.of(head.size_bytes);
    if (!zstd_) zstd_.reset(ZSTD_createDCtx());
    const std::size_t size = ZSTD_decompressDCtx(zstd_.get(), unpacked.data(), unpacked.size(),
                                                 head.stored.data(), head.stored.size());
    if (ZSTD_isError(size) != 0) return refuse(std::string("a damaged chunk: ") + ZSTD_getErrorName(size));
    to.bytes = unpacked.first(size);
    to.size_bytes += size;
  } else {
    return fail(ErrorCode::kUnsupported,
                "chunks compressed by '" + std::string(head.compression) + "'; zstd and none are read");
  }
  if (to.bytes.size() != head.size_bytes) return refuse("a chunk of another size than it says");
  if (head.crc != kNoChecksum && crc32(to.bytes) != head.crc)
    return refuse("a damaged chunk: wrong checksum");
  return {};
}

Result<void> McapReader::list_messages(Open& of) {
  const auto refuse = [](const char* what) { return fail(ErrorCode::kMalformed, what); };
  for (std::size_t at = 0; at < of.bytes.size();) {
    const std::size_t rest = of.bytes.size() - at;
    ByteReader head(of.bytes.subspan(at));
    const auto opcode = head.get<std::uint8_t>();
    const auto size = head.get<std::uint64_t>();
    if (rest < kRecordHead || size > rest - kRecordHead)
      return refuse("a damaged chunk: a record that is longer than its chunk");
    const auto content = of.bytes.subspan(at + kRecordHead, size);
    if (opcode == kChunk) return refuse("a chunk in a chunk");
    if (opcode == kChannel) {
      if (auto learned = learn(content); !learned) return learned;
    }
    if (opcode == kMessage) {
      ByteReader fields(content);
      const auto channel = channels_.find(fields.get<std::uint16_t>());
      skip<std::uint32_t>(fields);  // sequence
      const auto time_ns = fields.get<std::uint64_t>();
      if (content.size() < kMessageHead) return refuse("a message that is shorter than its fields");
      if (channel == channels_.end()) return refuse("a message of a channel that is not there");
      of.messages.push_back({time_ns, channel->second.rank, static_cast<std::uint32_t>(at)});
    }
    at += kRecordHead + size;
  }
  if (!of_tandem_)
    std::ranges::stable_sort(of.messages, {},
                             [](const Entry& entry) { return std::pair(entry.time_ns, entry.rank); });
  return {};
}

Result<void> McapReader::learn(std::span<const std::byte> channel) {
  ByteReader fields(channel);
  const auto id = fields.get<std::uint16_t>();
  skip<std::uint16_t>(fields);  // schema: a topic's type is known by the topic
  Channel learned;
  learned.topic = get_text(fields);
  learned.encoding = get_text(fields);
  if (!fields.ok()) return fail(ErrorCode::kMalformed, "a channel that is shorter than its fields");
  if (rank_ != nullptr) learned.rank = rank_(learned.topic);
  // The first stays: messages at hand point to its name.
  channels_.try_emplace(id, std::move(learned));
  return {};
}

McapMessage McapReader::message_at(const Open& open, std::size_t which) const {
  const auto record = open.bytes.subspan(open.messages[which].offset);
  const auto size = ByteReader(record.subspan(1)).get<std::uint64_t>();
  ByteReader fields(record.subspan(kRecordHead, size));
  McapMessage message;
  const Channel& channel = channels_.at(fields.get<std::uint16_t>());
  message.topic = channel.topic;
  message.encoding = channel.encoding;
  skip<std::uint32_t>(fields);  // sequence
  message.log_time_ns = fields.get<std::uint64_t>();
  message.publish_time_ns = fields.get<std::uint64_t>();
  message.content = fields.get_bytes(fields.remaining());
  return message;
}

}  // namespace tandem::recording
