#pragma once
// Subjects and bytes of a session on NATS: idl/RELAY.md.

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/wire/messages.hpp"
#include "tandem/result.hpp"

namespace tandem::transport::nats {

/// Version of the relay protocol; the first byte of each packet.
inline constexpr std::uint8_t kRelayVersion = 2;
/// Maximum size of a packet that this writer makes; a NATS server may demand smaller ones.
inline constexpr std::size_t kPacketBytes = 64'000;
/// Maximum size of a message that is put together of packets.
inline constexpr std::size_t kMaxMessageBytes = 64U << 20U;
/// The kinds of messages that only relays have, beside those of MessageKind.
inline constexpr std::uint8_t kBeatKind = 32, kAskKind = 33, kByeKind = 34, kHelloKind = 35, kProofKind = 36;

/// What a relay says a few times a second of the session that it publishes.
struct Beat {
  struct Range {  ///< of numbers that can be asked for; nothing if `newest` < `oldest`
    std::uint64_t oldest = 1, newest = 0;
    bool operator==(const Range&) const = default;
  };
  struct OfStream {
    StreamId stream;
    Range frames;
    bool operator==(const OfStream&) const = default;
  };
  Epoch epoch = 0;
  std::uint64_t announcement = 0;  ///< another value: the announcement changed
  bool leaving = false;            ///< the last one: the relay ends
  Range inputs;                    ///< scheduled inputs
  std::vector<OfStream> streams;   ///< at most kMaxStreams
  bool operator==(const Beat&) const = default;
};

/// A request for what was published before, or for the announcement.
struct Ask {
  enum class For : std::uint32_t { kSession = 0, kDeltas = 1, kInputs = 2 };
  Epoch epoch = 0;
  For what = For::kSession;
  StreamId stream = {};
  std::uint64_t first = 0;
  std::uint32_t count = 0;
  bool operator==(const Ask&) const = default;
};
inline constexpr std::uint32_t kMaxAsked = 1024;  ///< frames or inputs in one request

/// A site makes itself known, so that relays listen to it.
struct Hello {
  std::string site;
  std::uint64_t proof = 0;  ///< that the relay told the site; 0: none yet
  bool operator==(const Hello&) const = default;
};

void write(const Beat& beat, Bytes& out);
void write(const Ask& ask, Bytes& out);
void write(const Hello& hello, Bytes& out);
void write_proof(std::uint64_t proof, Bytes& out);
/// Untrusted. `message` begins with its kind. Errors: kMalformed.
[[nodiscard]] Result<Beat> read_beat(std::span<const std::byte> message);
[[nodiscard]] Result<Ask> read_ask(std::span<const std::byte> message);
[[nodiscard]] Result<Hello> read_hello(std::span<const std::byte> message);
[[nodiscard]] Result<std::uint64_t> read_proof(std::span<const std::byte> message);

/// The subjects of a session. `site`: the name under which a site may publish and be answered.
[[nodiscard]] std::string subject(const std::string& session, std::string_view what);
[[nodiscard]] std::string delta_subject(const std::string& session, std::uint32_t stream);
/// Everything that the site says.
[[nodiscard]] std::string site_subject(const std::string& session, const std::string& site);
[[nodiscard]] std::string from_subject(const std::string& session, const std::string& site, ClientId client);
[[nodiscard]] std::string to_subject(const std::string& session, const std::string& site, ClientId client);
/// Where a relay tells a site its proof.
[[nodiscard]] std::string proof_subject(const std::string& session, const std::string& site);
/// Site and client of a from_subject() of the session; empty if it is none.
struct Sender {
  std::string site;
  ClientId client = 0;
};
[[nodiscard]] std::optional<Sender> read_from_subject(const std::string& session, std::string_view text);
/// 1 to 32 characters of [A-Za-z0-9_-].
[[nodiscard]] bool is_site_name(std::string_view text);

/// Cuts messages into packets that fit. `sender` tells the packets of one process from another's. Not
/// thread-safe.
class Packer {
 public:
  explicit Packer(std::uint32_t sender) : sender_(sender) {}
  /// The packets of a message, none larger than `most_bytes`. Valid until the next call.
  [[nodiscard]] const std::vector<Bytes>& pack(std::span<const std::byte> message, std::size_t most_bytes);

 private:
  std::uint32_t sender_;
  std::uint32_t number_ = 0;
  std::vector<Bytes> packets_;
};

/// A message that is whole.
struct Unpacked {
  std::uint32_t sender = 0;
  std::span<const std::byte> message;  ///< kind and body; valid until the next call and while `packet` lives
};

/// Puts messages together again. The packets of a sender keep their order on a subject; where one is missing,
/// the message is dropped. Memory is bounded. Not thread-safe.
class Unpacker {
 public:
  /// `most_bytes`: maximum size of a message.
  explicit Unpacker(std::size_t most_bytes = kMaxMessageBytes) : most_bytes_(most_bytes) {}

  /// Takes one packet. Untrusted. Empty: more are to come, or it is dropped.
  [[nodiscard]] std::optional<Unpacked> take(const std::string& subject, std::span<const std::byte> packet);
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }  ///< messages and packets
  /// The version of a relay that speaks another one; 0: none was heard.
  [[nodiscard]] std::uint8_t foreign_version() const { return foreign_version_; }

 private:
  static constexpr std::size_t kMaxOpen = 64;  ///< messages that are put together at once
  struct Open {
    std::uint32_t sender = 0, number = 0;
    std::uint16_t parts = 0, next = 0;
    Bytes bytes;
  };
  std::size_t most_bytes_;
  std::map<std::string, Open, std::less<>> open_;  // by subject
  Bytes whole_;
  std::uint64_t dropped_ = 0;
  std::uint8_t foreign_version_ = 0;
};

}  // namespace tandem::transport::nats
