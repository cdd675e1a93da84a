#include "sdk/transport/nats/nats_wire.hpp"

#include <algorithm>
#include <charconv>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/lattice/bytes.hpp"
#include "sdk/core/lattice/hash.hpp"
#include "sdk/transport/nats/nats_bus.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/parcels.hpp"

namespace tandem::transport::nats {
namespace {

constexpr std::string_view kRoot = "tandem.";
// A packet: version, flags, sender; if the message is cut, also its number, the part and the number of parts.
constexpr std::size_t kWholeHeader = 6, kCutHeader = 14;
constexpr std::uint8_t kCut = 1;

template <class T>
void put(Bytes& out, T value) {
  for (std::size_t i = 0; i < sizeof value; ++i) out.push_back(static_cast<std::byte>(value >> (8U * i)));
}

void put(Bytes& out, const Beat::Range& range) {
  put(out, range.oldest);
  put(out, range.newest);
}
Beat::Range get_range(ByteReader& in) {
  Beat::Range range;
  range.oldest = in.get<std::uint64_t>();
  range.newest = in.get<std::uint64_t>();
  return range;
}

std::optional<std::uint64_t> read_hex(std::string_view digits) {
  std::uint64_t value = 0;
  const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
  if (digits.size() != 16 || read.ec != std::errc() || read.ptr != digits.data() + digits.size() ||
      value == 0)
    return std::nullopt;
  return value;
}

// A dot divides the tokens of a subject.
std::string token(const std::string& session) {
  std::string text = session;
  std::replace(text.begin(), text.end(), '.', '~');
  return text;
}

}  // namespace

void write(const Beat& beat, Bytes& out) {
  put(out, kBeatKind);
  put(out, beat.epoch);
  put(out, beat.announcement);
  put(out, static_cast<std::uint8_t>(beat.leaving ? 1 : 0));
  put(out, beat.inputs);
  put(out, static_cast<std::uint8_t>(beat.streams.size()));
  for (const Beat::OfStream& of : beat.streams) {
    put(out, of.stream.id);
    put(out, of.stream.generation);
    put(out, of.frames);
  }
}

void write(const Ask& ask, Bytes& out) {
  put(out, kAskKind);
  put(out, ask.epoch);
  put(out, static_cast<std::uint32_t>(ask.what));
  put(out, ask.stream.id);
  put(out, ask.stream.generation);
  put(out, ask.first);
  put(out, ask.count);
}

void write(const Hello& hello, Bytes& out) {
  put(out, kHelloKind);
  const std::string text = hello.proof == 0 ? hello.site : hello.site + '.' + to_hex(hello.proof);
  for (const char c : text) out.push_back(static_cast<std::byte>(c));
}

void write_proof(std::uint64_t proof, Bytes& out) {
  put(out, kProofKind);
  put(out, proof);
}

Result<Hello> read_hello(std::span<const std::byte> message) {
  std::string text;
  for (const std::byte c : message.subspan(std::min<std::size_t>(message.size(), 1)))
    text += static_cast<char>(c);
  Hello hello;
  const std::size_t dot = text.find('.');
  hello.site = text.substr(0, dot);
  const auto proof =
      dot == std::string::npos ? std::optional<std::uint64_t>(0) : read_hex(text.substr(dot + 1));
  if (message.empty() || message[0] != std::byte{kHelloKind} || !is_site_name(hello.site) || !proof)
    return fail(ErrorCode::kMalformed, "a site that is called by other characters");
  hello.proof = *proof;
  return hello;
}

Result<std::uint64_t> read_proof(std::span<const std::byte> message) {
  ByteReader in(message);
  const auto kind = in.get<std::uint8_t>();
  const auto proof = in.get<std::uint64_t>();
  if (!in.at_end() || kind != kProofKind || proof == 0)
    return fail(ErrorCode::kMalformed, "a proof that breaks a rule");
  return proof;
}

Result<Beat> read_beat(std::span<const std::byte> message) {
  ByteReader in(message);
  Beat beat;
  const auto kind = in.get<std::uint8_t>();
  beat.epoch = in.get<std::uint64_t>();
  beat.announcement = in.get<std::uint64_t>();
  const auto leaving = in.get<std::uint8_t>();
  beat.leaving = leaving == 1;
  beat.inputs = get_range(in);
  const std::size_t streams = in.get<std::uint8_t>();
  if (!in.ok() || kind != kBeatKind || leaving > 1 || streams > kMaxStreams || beat.epoch == 0)
    return fail(ErrorCode::kMalformed, "a beat that breaks a rule");
  for (std::size_t i = 0; i < streams; ++i) {
    Beat::OfStream& of = beat.streams.emplace_back();
    of.stream.id = in.get<std::uint32_t>();
    of.stream.generation = in.get<std::uint32_t>();
    of.frames = get_range(in);
    if (of.stream.id >= kMaxStreams) return fail(ErrorCode::kMalformed, "a beat of a stream above 7");
  }
  if (!in.at_end()) return fail(ErrorCode::kMalformed, "a beat of another length");
  return beat;
}

Result<Ask> read_ask(std::span<const std::byte> message) {
  ByteReader in(message);
  Ask ask;
  const auto kind = in.get<std::uint8_t>();
  ask.epoch = in.get<std::uint64_t>();
  const auto what = in.get<std::uint32_t>();
  ask.what = static_cast<Ask::For>(what);
  ask.stream.id = in.get<std::uint32_t>();
  ask.stream.generation = in.get<std::uint32_t>();
  ask.first = in.get<std::uint64_t>();
  ask.count = in.get<std::uint32_t>();
  if (!in.at_end() || kind != kAskKind || what > static_cast<std::uint32_t>(Ask::For::kInputs) ||
      ask.stream.id >= kMaxStreams || ask.count > kMaxAsked || ask.first > UINT64_MAX - ask.count)
    return fail(ErrorCode::kMalformed, "a request that breaks a rule");
  return ask;
}

std::string subject(const std::string& session, std::string_view what) {
  std::string text(kRoot);
  text += token(session);
  text += '.';
  text += what;
  return text;
}

std::string delta_subject(const std::string& session, std::uint32_t stream) {
  return subject(session, "delta." + std::to_string(stream));
}

std::string site_subject(const std::string& session, const std::string& site) {
  return subject(session, "from." + site + ".>");
}

std::string from_subject(const std::string& session, const std::string& site, ClientId client) {
  return subject(session, "from." + site + '.' + to_hex(client));
}

std::string to_subject(const std::string& session, const std::string& site, ClientId client) {
  return subject(session, "to." + site + '.' + to_hex(client));
}

std::string proof_subject(const std::string& session, const std::string& site) {
  return subject(session, "to." + site + ".hello");
}

std::optional<Sender> read_from_subject(const std::string& session, std::string_view text) {
  const std::string begin = subject(session, "from.");
  if (!text.starts_with(begin)) return std::nullopt;
  text.remove_prefix(begin.size());
  const std::size_t dot = text.find('.');
  if (dot == std::string_view::npos || !is_site_name(text.substr(0, dot))) return std::nullopt;
  const auto client = read_hex(text.substr(dot + 1));
  if (!client) return std::nullopt;
  return Sender{std::string(text.substr(0, dot)), *client};
}

bool is_site_name(std::string_view text) {
  return !text.empty() && text.size() <= 32 && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
}

const std::vector<Bytes>& Packer::pack(std::span<const std::byte> message, std::size_t most_bytes) {
  packets_.clear();
  const std::size_t most = std::max<std::size_t>(std::min(most_bytes, kPacketBytes), 2 * kCutHeader);
  const bool cut = message.size() + kWholeHeader > most;
  const std::size_t piece = cut ? most - kCutHeader : std::max<std::size_t>(message.size(), 1);
  const std::size_t parts = part_count(message.size(), piece);
  if (parts > UINT16_MAX) return packets_;
  if (cut) ++number_;
  for (std::size_t part = 0; part < parts; ++part) {
    Bytes& packet = packets_.emplace_back();
    const auto bytes = part_of(message, piece, part);
    packet.reserve(kCutHeader + bytes.size());
    put(packet, kRelayVersion);
    put(packet, static_cast<std::uint8_t>(cut ? kCut : 0));
    put(packet, sender_);
    if (cut) {
      put(packet, number_);
      put(packet, static_cast<std::uint16_t>(part));
      put(packet, static_cast<std::uint16_t>(parts));
    }
    packet.insert(packet.end(), bytes.begin(), bytes.end());
    TANDEM_ASSERT(packet.size() <= most);
  }
  return packets_;
}

std::optional<Unpacked> Unpacker::take(const std::string& subject, std::span<const std::byte> packet) {
  ByteReader in(packet);
  const auto version = in.get<std::uint8_t>();
  const auto flags = in.get<std::uint8_t>();
  const auto sender = in.get<std::uint32_t>();
  if (!in.ok() || version != kRelayVersion || flags > kCut || in.remaining() == 0) {
    ++dropped_;
    if (!packet.empty() && version != kRelayVersion) foreign_version_ = version;
    return std::nullopt;
  }
  if (flags == 0) return Unpacked{sender, in.get_bytes(in.remaining())};
  const auto number = in.get<std::uint32_t>();
  const auto part = in.get<std::uint16_t>();
  const auto parts = in.get<std::uint16_t>();
  if (!in.ok() || part >= parts) {
    ++dropped_;
    return std::nullopt;
  }
  if (!open_.contains(subject) && open_.size() >= kMaxOpen) {
    ++dropped_;
    open_.erase(open_.begin());
  }
  Open& open = open_[subject];
  const bool follows =
      part > 0 && open.sender == sender && open.number == number && open.parts == parts && open.next == part;
  const bool fits = open.bytes.size() + in.remaining() <= most_bytes_;
  if (part == 0) open = {sender, number, parts, 0, {}};
  if (part > 0 && !(follows && fits)) {
    ++dropped_;
    open_.erase(subject);
    return std::nullopt;
  }
  const auto bytes = in.get_bytes(in.remaining());
  open.bytes.insert(open.bytes.end(), bytes.begin(), bytes.end());
  if (++open.next < parts) return std::nullopt;
  whole_ = std::move(open.bytes);
  open_.erase(subject);
  if (whole_.empty()) return std::nullopt;
  return Unpacked{sender, whole_};
}

}  // namespace tandem::transport::nats

namespace tandem::transport {

bool is_nats_url(std::string_view text) { return text.starts_with("nats://") || text.starts_with("tls://"); }

std::string without_password(std::string url) {
  for (std::size_t at = url.find('@'); at != std::string::npos; at = url.find('@', at + 1)) {
    const std::size_t host = url.rfind("//", at);
    if (host == std::string::npos) break;
    const std::size_t colon = url.find(':', host + 2);
    if (colon == std::string::npos || colon > at) continue;
    url.replace(colon + 1, at - colon - 1, "...");
    at = url.find('@', host);
  }
  return url;
}

}  // namespace tandem::transport
