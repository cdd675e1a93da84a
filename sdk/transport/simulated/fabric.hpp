#pragma once
// The inside of the simulated network: participants, endpoints, and samples on their way.

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <queue>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "sdk/transport/simulated/network.hpp"
#include "sdk/wire/session_book.hpp"

namespace tandem::transport::simulated {

/// Any message; its index() is the topic.
using AnyMessage =
    std::variant<SessionMessage, DeltaMessage, ScheduledInputMessage, SnapshotMessage, ReplyMessage,
                 InputMessage, AckMessage, ServerStatusMessage, ClientStatusMessage, JournalMessage,
                 CheckpointMessage, StandbyMessage, CommandMessage>;
template <class M, class... Messages>
[[nodiscard]] constexpr std::size_t topic_in(const std::variant<Messages...>* /*type*/) {
  std::size_t index = 0;
  (void)((std::is_same_v<M, Messages> || (++index, false)) || ...);
  return index;
}
template <class M>
inline constexpr std::size_t kTopic = topic_in<M>(static_cast<const AnyMessage*>(nullptr));

/// splitmix64 (Steele, Lea, Flood 2014): enough for choosing delays, and the same everywhere.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next();
  bool chance(double probability);
  std::int64_t between(std::int64_t low, std::int64_t high);

 private:
  std::uint64_t state_;
};

class Fabric {
 public:
  using Index = std::uint32_t;
  explicit Fabric(const NetworkOptions& options) : options_(options), random_(options.seed) {}

  // Functions for ports.
  Index add_participant(const std::string& session);
  /// `partition`: the writer's own within the session; empty: the session's, which readers read by default.
  Index add_writer(Index participant, std::size_t topic, std::uint32_t depth, std::string partition = {});
  Index add_reader(Index participant, std::size_t topic, std::uint32_t depth,
                   std::vector<std::string> partitions = {{}});
  void close_writer(Index writer);
  void close_reader(Index reader);
  void close_participant(Index participant);
  /// Drops the samples that a writer keeps for a key.
  void forget(Index writer, std::uint64_t key) { writers_[writer].history.erase(key); }
  [[nodiscard]] Result<void> write(Index writer, std::uint64_t key, AnyMessage message);
  /// Calls `sink(participant, message)` for all messages that arrived.
  template <class Sink>
  void take(Index reader, Sink&& sink) {
    for (const Arrived& arrived : std::exchange(readers_[reader].arrived, {})) {
      sink(arrived.from, *arrived.message);
    }
  }
  [[nodiscard]] const ParticipantId& id(Index participant) const { return participants_[participant].id; }
  [[nodiscard]] bool killed(Index participant) const {
    return participants_[participant].killed_ns != kNever;
  }
  /// The state of `other` as `observer` sees it.
  [[nodiscard]] WriterState state(Index observer, Index other) const;
  /// True if a reader in `participant` has been matched.
  [[nodiscard]] bool reaches(Index writer, const ParticipantId& participant) const {
    return has_met(writers_[writer], participant);
  }
  /// True if a live writer in `participant` has been matched.
  [[nodiscard]] bool hears(Index reader, const ParticipantId& participant) const {
    return has_met(readers_[reader], participant);
  }
  /// True if the participant ended properly; one that was killed is only silent.
  [[nodiscard]] bool ended(const ParticipantId& participant) const;

  // Functions for the network.
  [[nodiscard]] std::int64_t now_ns() const { return now_ns_; }
  void advance_to(std::int64_t now_ns);
  [[nodiscard]] std::optional<std::int64_t> next_event_ns() const;
  void set_link(const ParticipantId& from, const ParticipantId& to, const LinkModel& link);
  void set_all_links(const LinkModel& link);
  void set_cut(const ParticipantId& from, const ParticipantId& to, bool cut);
  void set_frozen(const ParticipantId& participant, bool frozen);
  void kill(const ParticipantId& participant);
  [[nodiscard]] const NetworkCounts& counts() const { return counts_; }
  [[nodiscard]] std::uint64_t delivered_to(const ParticipantId& participant) const;

 private:
  static constexpr std::int64_t kNever = INT64_MAX;

  struct Participant {
    ParticipantId id;
    std::string session;
    bool closed = false;
    std::int64_t killed_ns = kNever;
    std::int64_t frozen_ns = kNever;
    std::uint64_t delivered = 0;
    std::vector<Index> writers;
    std::vector<Index> readers;
  };
  struct Sample {
    std::uint64_t sequence = 0;
    std::uint64_t key = 0;
    std::int64_t written_ns = 0;
    std::shared_ptr<const AnyMessage> message;
  };
  struct Endpoint {
    Index participant = 0;
    std::size_t topic = 0;
    std::uint32_t depth = 1;
    bool closed = false;
    std::vector<Index> pairs;
  };
  struct Writer : Endpoint {
    std::string partition;
    std::uint64_t next_sequence = 1;
    std::map<std::uint64_t, std::deque<Sample>> history;  // by key, each ascending by sequence
  };
  struct Arrived {
    Index from = 0;
    std::uint64_t key = 0;
    std::shared_ptr<const AnyMessage> message;
  };
  struct Reader : Endpoint {
    std::vector<std::string> partitions;
    std::deque<Arrived> arrived;
  };
  struct Travelling {
    Sample sample;
    std::int64_t due_ns = 0;
    bool to_repair = false;
  };
  /// A writer and a reader of one topic in one session.
  struct Pair {
    Index writer = 0;
    Index reader = 0;
    bool matched = false;
    std::deque<Travelling> travelling;  // in the order of writing
  };
  struct Event {
    std::int64_t at_ns = 0;
    std::uint64_t order = 0;
    Index pair = 0;
    bool operator>(const Event& other) const {
      return at_ns != other.at_ns ? at_ns > other.at_ns : order > other.order;
    }
  };

  [[nodiscard]] Index find(const ParticipantId& participant) const;
  void add_pair(Index writer, Index reader);
  void close(Endpoint& endpoint);
  /// True if the endpoint is matched with one of `participant`, which is alive.
  [[nodiscard]] bool has_met(const Endpoint& endpoint, const ParticipantId& participant) const;
  void schedule(Index pair, std::int64_t at_ns);
  /// Draws how long endpoints take to find each other.
  [[nodiscard]] std::int64_t match_ns(Index writer, Index reader);
  /// Draws how long a message takes if DDS repeats it until it arrives.
  [[nodiscard]] std::int64_t told_ns(Index from, Index to);
  void send(Index pair, const Sample& sample);
  void process(Index pair);
  /// False while the front of the pair has to wait.
  bool settle_front(Pair& pair, Index index);
  void deliver(const Pair& pair, const Sample& sample);
  [[nodiscard]] bool keeps(const Writer& writer, const Sample& sample) const;
  [[nodiscard]] const LinkModel& link(Index from, Index to) const;
  /// Draws whether a transmission is lost.
  [[nodiscard]] bool loses(Index from, Index to);
  /// Draws how long it takes until a lost sample comes again.
  [[nodiscard]] std::int64_t repair_ns(Index from, Index to);
  /// Sends a message and perhaps a duplicate through the path's bottleneck. Returns how long that takes from
  /// now; empty if the message is dropped there.
  [[nodiscard]] std::optional<std::int64_t> squeeze_ns(const LinkModel& model, const AnyMessage& message);
  /// Nothing comes through on this way. What asks for something needs the way back, too.
  [[nodiscard]] bool is_cut(Index from, Index to) const;
  [[nodiscard]] bool is_cut_either_way(Index a, Index b) const { return is_cut(a, b) || is_cut(b, a); }
  /// The message as it arrives: perhaps with damaged bytes.
  [[nodiscard]] std::shared_ptr<const AnyMessage> arriving(const LinkModel& model, const Sample& sample);
  [[nodiscard]] bool gone(Index participant) const;

  NetworkOptions options_;
  Random random_;
  std::int64_t now_ns_ = 0;
  std::uint64_t next_order_ = 0;
  std::vector<Participant> participants_;
  std::vector<Writer> writers_;
  std::vector<Reader> readers_;
  std::vector<Pair> pairs_;
  std::map<std::pair<Index, Index>, LinkModel> links_;
  std::map<std::pair<Index, Index>, std::int64_t> cuts_;    // by way: since when it is cut
  std::map<std::pair<Index, Index>, std::int64_t> met_ns_;  // lower index first
  std::map<std::pair<Index, Index>, bool> bursts_;          // whether everything is lost on this way at
                                                            // present
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
  NetworkCounts counts_;
};

}  // namespace tandem::transport::simulated
