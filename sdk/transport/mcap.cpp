#include "sdk/transport/mcap.hpp"

#include <algorithm>
#include <array>
#include <concepts>
#include <utility>

namespace tandem::transport {
namespace {

constexpr std::array<std::uint8_t, 8> kMagic{0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};

enum Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kStatistics = 0x0B,
  kDataEnd = 0x0F,
};

constexpr std::uint32_t kNoChecksum = 0;

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

std::uint64_t to_time(std::int64_t ns) { return static_cast<std::uint64_t>(std::max<std::int64_t>(ns, 0)); }

}  // namespace

McapWriter::McapWriter(Sink sink) : sink_(std::move(sink)) {
  write(std::as_bytes(std::span(kMagic)));
  Fields(record_).put_text("").put_text("tandem " TANDEM_VERSION);  // no profile
  write_record(kHeader, record_);
}

void McapWriter::add(const char* topic, std::int64_t log_time_ns, std::int64_t publish_time_ns) {
  const auto next_id = static_cast<std::uint16_t>(channels_.size() + 1);
  const auto [known, is_new] = channels_.try_emplace(topic, Channel{next_id, 0});
  if (is_new) {
    write_schema(topic, next_id);
    write_channel(topic, next_id);
  }
  const std::uint64_t log_time = to_time(log_time_ns);
  Fields(record_)
      .put(known->second.id)
      .put(known->second.messages++)
      .put(log_time)
      .put(to_time(publish_time_ns));
  write_record(kMessage, record_, cdr_);
  first_ns_ = messages_ == 0 ? log_time : std::min(first_ns_, log_time);
  last_ns_ = std::max(last_ns_, log_time);
  ++messages_;
}

void McapWriter::write_schema(const std::string& topic, std::uint16_t id) {
  Fields(record_).put(id).put_text("tandem::" + topic).put_text("omgidl").put_text(idl_text());
  write_record(kSchema, record_);
}

// A topic has a schema of its own, of the same id.
void McapWriter::write_channel(const std::string& topic, std::uint16_t id) {
  constexpr std::uint32_t kNoMetadata = 0;
  Fields(record_).put(id).put(id).put_text(topic).put_text("cdr").put(kNoMetadata);
  write_record(kChannel, record_);
}

void McapWriter::write_summary() {
  for (const auto& [topic, channel] : channels_) write_schema(topic, channel.id);
  for (const auto& [topic, channel] : channels_) write_channel(topic, channel.id);
  constexpr std::uint32_t kNone = 0;  // attachments, metadata, chunks
  constexpr std::size_t kCountBytes = 2 + 8;
  Fields fields(record_);
  fields.put(messages_)
      .put(static_cast<std::uint16_t>(channels_.size()))
      .put(static_cast<std::uint32_t>(channels_.size()))
      .put(kNone)
      .put(kNone)
      .put(kNone)
      .put(first_ns_)
      .put(last_ns_)
      .put(static_cast<std::uint32_t>(channels_.size() * kCountBytes));
  for (const auto& [topic, channel] : channels_) fields.put(channel.id).put(std::uint64_t{channel.messages});
  write_record(kStatistics, record_);
}

Result<void> McapWriter::finish() {
  Fields(record_).put(kNoChecksum);
  write_record(kDataEnd, record_);
  const std::uint64_t summary_start = size_;
  write_summary();
  constexpr std::uint64_t kNoOffsets = 0;
  Fields(record_).put(summary_start).put(kNoOffsets).put(kNoChecksum);
  write_record(kFooter, record_);
  write(std::as_bytes(std::span(kMagic)));
  return written_;
}

void McapWriter::write_record(std::uint8_t opcode, const Bytes& content, std::span<const std::byte> more) {
  Bytes head;
  Fields(head).put(opcode).put(std::uint64_t{content.size() + more.size()});
  write(head);
  write(content);
  write(more);
}

void McapWriter::write(std::span<const std::byte> bytes) {
  size_ += bytes.size();
  if (written_ && !bytes.empty()) written_ = sink_(bytes);
}

}  // namespace tandem::transport
