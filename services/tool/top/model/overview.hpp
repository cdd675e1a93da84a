#pragma once
// What `tandem top` knows: the sessions, streams and clients of a domain, with their last minute. Time and
// messages come in as arguments.

#include <compare>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/wire/messages.hpp"
#include "services/tool/top/model/trouble.hpp"

namespace tandem::top {

/// Both clocks of this machine at one moment.
struct Moment {
  std::int64_t steady_ns = 0;
  std::int64_t wall_ns = 0;
};

/// A server writes its status once a second, an observer every two seconds. Who is silent for this long is
/// gone; a client may lose one.
inline constexpr std::int64_t kServerSilenceNs = 3'000'000'000, kClientSilenceNs = 5'000'000'000;
/// Gone ones are shown for this long.
inline constexpr std::int64_t kGoneServerNs = 600'000'000'000, kGoneClientNs = 60'000'000'000;
/// A machine that floods the status topics must not fill this one's memory.
inline constexpr std::size_t kMaxShown = 4096;
inline constexpr std::int64_t kMinuteNs = 60'000'000'000;

/// One status of a stream, for its last minute.
struct StreamPoint {
  std::int64_t at_ns = 0;       ///< steady, when it came
  std::int64_t transit_ns = 0;  ///< from the writer's wall clock to this machine's
  double rate_hz = 0, frame_ms = 0, mbit_per_s = 0;
  std::uint64_t suspended_ms = 0;
};

/// One status of a client, for its last minute.
struct ClientPoint {
  std::int64_t at_ns = 0;
  std::int64_t transit_ns = 0;
  std::int64_t written_ns = 0;  ///< wall clock of the client's host
  double rate_hz = 0;           ///< frames applied, since the status before
  double lag_ms = 0, work_ms = 0, mbit_per_s = 0;
  std::uint64_t frames_applied = 0, resyncs = 0;
};

/// A stream of a live server; of a server that stands by with its epoch, because several may.
struct StreamKey {
  std::string session;
  Epoch standby = 0;
  std::uint32_t stream = 0;
  auto operator<=>(const StreamKey&) const = default;
};

struct Stream {
  transport::ServerStatusMessage status;
  transport::ParticipantId from;
  Moment heard;  ///< last
  bool gone = false;
  bool offered = true;        ///< false: the session does not list it, and the server only measures it
  std::string name;           ///< as the session announces it; empty: none
  std::uint32_t carries = 0;  ///< likewise: the number of the stream, whose offer it is
  std::uint32_t delay_ms = 0;
  double nominal_hz = 0;      ///< 0: not announced yet
  double usual_lag_ms = 0;    ///< median of its clients
  std::uint32_t viewers = 0;  ///< behind gateways
  std::deque<StreamPoint> minute;
};

struct Client {
  transport::ClientStatusMessage status;
  transport::ParticipantId from;
  std::optional<transport::Peer> peer;
  std::optional<transport::ClientId> gateway;  ///< it is a viewer of the gateway with this id
  std::uint32_t viewers = 0;                   ///< that it serves, as a gateway
  Moment heard;                                ///< last
  bool gone = false;
  std::optional<Moment> demoted, joining;  ///< since
  std::uint32_t seen_as_observer = 0;      ///< reports in a row
  std::deque<ClientPoint> minute;
};

/// Something that happened while `tandem top` was looking.
struct Event {
  std::int64_t wall_ns = 0;
  Trouble trouble = Trouble::kNone;
  std::string session, text;
};

/// Memory is bounded. Not thread-safe.
class Overview {
 public:
  /// Takes in only this session from now on.
  void only(std::string session) { only_ = std::move(session); }

  void update(const transport::Stamped<transport::ServerStatusMessage>& heard, Moment now);
  /// `peer`: who wrote it, if that is known.
  void update(const transport::Stamped<transport::ClientStatusMessage>& heard,
              const std::optional<transport::Peer>& peer, Moment now);
  /// What a session announces: its rate, and the names of its streams.
  void update(const transport::SessionMessage& session);
  /// Notes who has become silent, and forgets those who have been so for long.
  void age(Moment now);

  /// True if nobody is alive.
  [[nodiscard]] bool empty() const;
  [[nodiscard]] const std::map<StreamKey, Stream>& streams() const { return streams_; }
  [[nodiscard]] const std::map<transport::ClientId, Client>& clients() const { return clients_; }
  /// The stream that the client plays, if its status was heard.
  [[nodiscard]] const Stream* stream_of(const Client& client) const;
  /// True if this client is known with its describer, so that it need not be asked for again.
  [[nodiscard]] bool described(transport::ClientId client) const;
  [[nodiscard]] const std::deque<Event>& events() const { return events_; }  ///< oldest first

 private:
  [[nodiscard]] bool shown(const std::string& session) const { return !only_ || *only_ == session; }
  void note(Moment now, Trouble trouble, const std::string& session, std::string text);
  void note_changes(const Client& before, const transport::ClientStatusMessage& now_is, Moment now);
  void count_clients();

  std::optional<std::string> only_;
  std::map<StreamKey, Stream> streams_;
  std::map<transport::ClientId, Client> clients_;
  std::deque<Event> events_;
};

/// The name by which screens call a client: the first half of its id, which is random.
[[nodiscard]] std::string short_id(transport::ClientId client);

}  // namespace tandem::top
