#pragma once
// Who follows a relay over NATS: sites, their processes, and the clients of those.

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "sdk/wire/messages.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::transport::nats {

/// What may be spent: `rate` a second, at most `burst` at once.
struct Allowance {
  double rate, burst, left = burst;
  std::int64_t at_ns = INT64_MIN;
  bool spend(double amount, std::int64_t now_ns);
};

/// The tables of a relay that are keyed by what followers say. The NATS server vouches for a site's name; the
/// site makes up its processes and clients. So a site is taken in only while it has fewer than it leaves free
/// for all others, and pays for all its processes together. Who is silent for kForgottenNs is forgotten;
/// where a site has no place left, its own of kSilentNs. Without a clock. Not thread-safe.
class Followers {
 public:
  /// A client that says nothing for so long is not there now, and is forgotten after the second time. The
  /// second outlasts the cut of a link that it can catch up with.
  static constexpr std::int64_t kSilentNs = 8 * kSecond, kForgottenNs = 60 * kSecond;
  static constexpr std::size_t kMaxSites = 512, kMaxProcesses = 4096;
  /// Bytes a second that one process, and all of a site together, are sent on request, and at once.
  static constexpr double kProcessBytes = 4e6, kProcessBurst = 16e6, kSiteBytes = 8e6, kSiteBurst = 32e6;
  /// Requests of a process that are answered in a second.
  static constexpr double kAsksPerSecond = 40;

  struct Process {
    std::int64_t heard_ns = 0;
    Allowance bytes{kProcessBytes, kProcessBurst};
    Allowance asks{kAsksPerSecond, kAsksPerSecond};
  };
  /// Whoever sent a message. Valid until the next call.
  struct Heard {
    ParticipantId from;
    Process* process = nullptr;
    Allowance* site_bytes = nullptr;
  };

  explicit Followers(std::size_t most_clients) : most_clients_(most_clients) {}

  /// Notes a message of a client. Empty: there is no place for it.
  std::optional<Heard> heard(const std::string& site, std::uint32_t process, ClientId client,
                             std::int64_t now_ns);
  /// The client leaves; its process, too, if that was the last one.
  void left(const std::string& site, std::uint32_t process, ClientId client);
  void forget_silent(std::int64_t now_ns);

  [[nodiscard]] bool alive(const ParticipantId& client, std::int64_t now_ns) const;
  [[nodiscard]] bool knows(const ParticipantId& client) const { return find(client) != nullptr; }
  /// The site whose client has that id: the one that used it first. Empty: none.
  [[nodiscard]] std::string site_of(ClientId client) const;
  [[nodiscard]] std::size_t sites() const { return sites_.size(); }
  [[nodiscard]] std::size_t processes() const { return processes_; }
  [[nodiscard]] std::size_t clients() const { return clients_; }

 private:
  struct Client {
    ClientId id = 0;
    std::uint32_t process = 0;
    std::int64_t heard_ns = 0;
  };
  struct Site {
    std::string name;
    std::int64_t heard_ns = 0, swept_ns = 0;
    std::map<std::uint32_t, Process> processes;
    std::map<ParticipantId, Client> clients;
    Allowance bytes{kSiteBytes, kSiteBurst};
  };
  [[nodiscard]] const Client* find(const ParticipantId& client) const;
  [[nodiscard]] bool has_room(const Site* site, std::uint32_t process, const ParticipantId& client) const;
  void disown(const ParticipantId& from, const Client& client);
  void sweep(Site& site, std::int64_t silent_ns, std::int64_t now_ns);
  void count();

  std::size_t most_clients_;
  std::map<std::uint64_t, Site> sites_;       // by the hash in their clients' ParticipantId
  std::map<ClientId, ParticipantId> owners_;  // of those in sites_
  std::size_t processes_ = 0, clients_ = 0;   // of all sites
};

/// Of the client of a process of a site. Client 0: the process itself.
[[nodiscard]] ParticipantId participant(const std::string& site, std::uint32_t process, ClientId client = 0);
[[nodiscard]] std::uint64_t fnv1a(std::string_view text);

}  // namespace tandem::transport::nats
