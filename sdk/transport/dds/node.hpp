#pragma once
// A participant with its publisher, subscriber, readers and writers: the common part of the ports and the
// monitor.

#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/transport/dds/arrivals.hpp"
#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/dds/domain.hpp"
#include "sdk/transport/dds/lend.hpp"
#include "sdk/transport/dds/live_writers.hpp"
#include "sdk/transport/dds/security.hpp"
#include "sdk/transport/dds/topics.hpp"
#include "sdk/transport/network/wire_bytes.hpp"
#include "sdk/wire/cdr.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::transport::dds {

/// Writes one topic. A write that the middleware could not take in time reached no reader, so it is repeated.
template <class M>
class Writer {
 public:
  /// `publisher`: the writer's own, if it has one.
  Writer(Entity topic, Entity publisher, Entity entity, const DdsOptions& options)
      : topic_(std::move(topic)),
        publisher_(std::move(publisher)),
        entity_(std::move(entity)),
        timeout_(options.write_timeout),
        stop_(options.stop),
        wire_(options.wire) {}

  Result<void> write(const M& message) {
    const auto deadline = std::chrono::steady_clock::now() + timeout_;
    for (;;) {
      const dds_return_t code = write_sample(entity_.get(), message);
      if (code == DDS_RETCODE_OK) {
        if constexpr (Topic<M>::kQos.shows_life) shown_ns_ = steady_ns();
        if (wire_ != nullptr) count(message);
        return {};
      }
      const bool stopped = stop_ != nullptr && stop_->load();
      if (code != DDS_RETCODE_TIMEOUT || stopped || std::chrono::steady_clock::now() >= deadline) {
        return dds_failure(std::string("writing ") + M::kTopic, code);
      }
    }
  }
  /// Shows that this writer lives, if it has been silent for long enough. A reader then also asks for what it
  /// lacks.
  void show_life() requires(Topic<M>::kQos.shows_life) {
    const std::int64_t now_ns = steady_ns();
    if (now_ns - shown_ns_ < DdsWire::kShowsLifeNs) return;
    shown_ns_ = now_ns;
    static_cast<void>(dds_assert_liveliness(entity_.get()));
  }
  [[nodiscard]] dds_entity_t get() const { return entity_.get(); }
  /// Ends it before its time. Cyclone DDS waits up to a second for readers that do not answer.
  void end() { entity_.reset(); }

 private:
  void count(const M& message) {
    dds_publication_matched_status_t matched{};
    if (dds_get_publication_matched_status(entity_.get(), &matched) != DDS_RETCODE_OK ||
        matched.current_count == 0)
      return;
    bytes_.clear();
    write_cdr(message, bytes_);
    wire_->sample(bytes_.size(), Topic<M>::kQos.reliable, DdsWire::kClientAsksNs, steady_ns(), answered_ns_);
  }

  Entity topic_;
  Entity publisher_;
  Entity entity_;
  std::chrono::nanoseconds timeout_;
  const std::atomic<bool>* stop_;
  std::shared_ptr<DdsWireCount> wire_;
  std::int64_t answered_ns_ = 0;
  Bytes bytes_;  // kept to reuse its memory
  std::int64_t shown_ns_ = 0;
};

/// Reads one topic and knows the participants behind it.
template <class M>
class Reader {
 public:
  /// `subscriber`: the reader's own, if it has one. The entity calls `arrivals` and `writers`.
  Reader(std::unique_ptr<Arrivals<M>> arrivals, std::unique_ptr<LiveWriters> writers, Entity topic,
         Entity subscriber, Entity entity)
      : arrivals_(std::move(arrivals)),
        writers_(std::move(writers)),
        topic_(std::move(topic)),
        subscriber_(std::move(subscriber)),
        entity_(std::move(entity)) {}

  /// Sets the limits for samples that arrive from now on; at first they are the fixed maximum.
  void set_limits(const Limits& limits) { arrivals_->set_limits(limits); }

  /// Calls `sink(writer, Stamped<M>&&)` for each sample in order. Counts in `dropped` the samples that broke
  /// a limit. A sample whose writer has meanwhile left the participant's endpoints cannot be attributed and
  /// is skipped.
  template <class Sink>
  void take(std::atomic<std::uint64_t>& dropped, Sink&& sink) {
    std::uint64_t broke_limits = 0;
    arrivals_->take(taken_, broke_limits);
    for (auto& arrival : taken_) {
      const auto from = participants_.of_writer(entity_.get(), arrival.writer);
      if (from) sink(arrival.writer, Stamped<M>{{std::move(arrival.message), *from}, arrival.written_ns});
    }
    if (broke_limits != 0) dropped += broke_limits;
    taken_.clear();
  }
  template <class R>
  void take(std::atomic<std::uint64_t>& dropped, std::vector<R>& out) {
    take(dropped, [&out](dds_instance_handle_t, Stamped<M>&& r) { out.push_back(std::move(r)); });
  }

  [[nodiscard]] dds_entity_t get() const { return entity_.get(); }
  [[nodiscard]] WriterState state(dds_instance_handle_t writer) const { return writers_->state(writer); }
  /// The state of that participant's writers together: live if one of them is, gone if none is matched.
  [[nodiscard]] WriterState state_of(const ParticipantId& participant) {
    WriterState state = WriterState::kGone;
    for (const auto& [writer, life] : writers_->matched()) {
      if (participants_.of_writer(entity_.get(), writer) != participant) continue;
      if (life.is_live) return WriterState::kLive;
      state = WriterState::kSilent;
    }
    return state;
  }
  [[nodiscard]] bool alive(const ParticipantId& participant) {
    return state_of(participant) == WriterState::kLive;
  }
  /// Whether that participant's writer shows life; empty if it never did.
  [[nodiscard]] std::optional<bool> shows_life(const ParticipantId& participant) requires(
      Topic<M>::kQos.shows_life) {
    std::optional<bool> shows;
    for (const auto& [writer, life] : writers_->matched())
      if (life.was_live && participants_.of_writer(entity_.get(), writer) == participant)
        shows = shows.value_or(false) || life.is_live;
    return shows;
  }

 private:
  // The entity calls these until it is gone.
  std::unique_ptr<Arrivals<M>> arrivals_;
  std::unique_ptr<LiveWriters> writers_;
  Entity topic_;
  Entity subscriber_;
  Entity entity_;
  Participants participants_;
  std::deque<typename Arrivals<M>::Arrival> taken_;  // kept to reuse its memory
};

/// Ends many writers in the time of a few.
class WriterEnds {
 public:
  template <class M>
  void add(Writer<M>& writer) {
    ends_.emplace_back([&writer] { writer.end(); });
  }
  void run();

 private:
  std::vector<std::function<void()>> ends_;
};

/// How a reader differs from the defaults of its topic.
struct ReaderOptions {
  std::optional<std::int32_t> depth = {};    ///< depth of its history, and number of samples kept of each
                                             ///< writer
  bool ignore_own = false;                   ///< ignores what its own participant writes
  bool watched = true;                       ///< arrivals end Node::wait()
  std::vector<std::string> partitions = {};  ///< uses a subscriber of its own for them; empty: the node's
};

/// A participant is announced when it begins, which every peer that hears it answers, and then only each
/// DdsWire::kAnnouncedNs. Who lost the first announcement, or a peer, needs it sooner.
class CallOut {
 public:
  /// `participant` is not owned and outlives this. `now_ns`: the steady clock when it began.
  CallOut(dds_entity_t participant, std::int64_t now_ns)
      : participant_(participant), due_ns_(now_ns + kSpacingNs), began_ns_(now_ns) {}

  /// Call it as often as you like: it announces after each of the first seconds, and then every 5 s.
  void again(std::int64_t now_ns) {
    if (now_ns < due_ns_) return;
    due_ns_ = now_ns + (began_lately(now_ns) ? kSpacingNs : kRareNs);
    ++number_;
    const Qos changed(dds_create_qos());
    dds_qset_userdata(changed.get(), &number_, sizeof number_);
    static_cast<void>(dds_set_qos(participant_, changed.get()));  // the next makes up for one that fails
  }
  /// True for those first seconds.
  [[nodiscard]] bool began_lately(std::int64_t now_ns) const { return now_ns - began_ns_ <= kSoonNs; }

 private:
  static constexpr std::int64_t kSpacingNs = kSecond, kSoonNs = 5 * kSecond, kRareNs = 5 * kSecond;

  dds_entity_t participant_;
  std::int64_t due_ns_;
  std::int64_t began_ns_;
  std::uint8_t number_ = 0;  // the participant's user data, which only has to change
};

class Node {
 public:
  /// `name` is what DDS tools show. `partition` may be "*". `purpose`: what it needs an identity for, if it
  /// has one.
  static Result<Node> create(const DdsOptions& options, const std::string& name, const std::string& partition,
                             Purpose purpose, Repeat repeat = Repeat::kSeldom);

  /// Makes a writer in `partition`, with a publisher of its own; if `partition` is empty, with the node's
  /// publisher.
  template <class M>
  Result<Writer<M>> writer(const std::string& name, std::int32_t depth = Topic<M>::kQos.writer_depth,
                           const std::string& partition = {}) {
    auto topic = make_topic(Topic<M>::descriptor(), M::kTopic);
    if (!topic) return tl::unexpected(topic.error());
    auto publisher = partition.empty() ? Result<Entity>() : make_publisher({partition});
    if (!publisher) return tl::unexpected(publisher.error());
    const Entity& parent = *publisher ? *publisher : publisher_;
    // The status writer's short lease only sets the interval of its participant's liveliness messages, which
    // is 0.8 of the lease. So one of them may be lost before the lease of the other writers ends.
    const dds_duration_t automatic = Topic<M>::kQos.reliable ? lease_ : lease_ / 2;
    const Qos qos = make_qos(Topic<M>::kQos, depth, Topic<M>::kQos.shows_life ? own_lease_ : automatic);
    dds_qset_entity_name(qos.get(), name.c_str());
    auto entity = own(dds_create_writer(parent.get(), topic->get(), qos.get(), nullptr),
                      std::string("the writer of ") + M::kTopic);
    if (!entity) return tl::unexpected(entity.error());
    return Writer<M>(std::move(*topic), std::move(*publisher), std::move(*entity), options_);
  }

  template <class M>
  Result<Reader<M>> reader(const std::string& name, const ReaderOptions& options = {}) {
    auto topic = make_topic(Topic<M>::descriptor(), M::kTopic);
    if (!topic) return tl::unexpected(topic.error());
    auto subscriber = options.partitions.empty() ? Result<Entity>() : make_subscriber(options.partitions);
    if (!subscriber) return tl::unexpected(subscriber.error());
    const Entity& parent = *subscriber ? *subscriber : subscriber_;
    const Qos qos =
        make_qos(Topic<M>::kQos, options.depth.value_or(Topic<M>::kQos.reader_depth), DDS_INFINITY);
    dds_qset_entity_name(qos.get(), name.c_str());
    if (options.ignore_own) dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
    const auto kept = static_cast<std::size_t>(options.depth.value_or(Topic<M>::kQos.kept));
    Doorbell* const bell = options.watched ? bell_.get() : nullptr;
    auto arrivals = std::make_unique<Arrivals<M>>(
        kept, bell, ArrivalCount{options_.wire, Topic<M>::kQos.reliable, Topic<M>::kQos.shows_life});
    auto writers = std::make_unique<LiveWriters>(bell);
    auto entity = own(
        dds_create_reader_rhc(parent.get(), topic->get(), qos.get(), writers->listener(), arrivals->cache()),
        std::string("the reader of ") + M::kTopic);
    if (!entity) return tl::unexpected(entity.error());
    return Reader<M>(std::move(arrivals), std::move(writers), std::move(*topic), std::move(*subscriber),
                     std::move(*entity));
  }

  [[nodiscard]] const ParticipantId& self() const { return self_; }
  [[nodiscard]] const Entity& participant() const { return participant_; }
  [[nodiscard]] const DomainUse& domain() const { return domain_; }
  [[nodiscard]] CallOut& call_out() { return *call_out_; }
  /// With DDS Security its permissions may forbid to write inputs.
  [[nodiscard]] bool may_act() const { return may_act_; }
  /// Waits until something arrives at a watched reader created here, one of its writers comes to life or
  /// dies, wake() is called, or the timeout passes.
  void wait(std::chrono::nanoseconds timeout) { bell_->wait(timeout); }
  void wake() { bell_->ring(); }

 private:
  Node(DomainUse domain, const DdsOptions& options);
  [[nodiscard]] Result<Entity> make_publisher(const std::vector<std::string>& partitions) const;
  [[nodiscard]] Result<Entity> make_subscriber(const std::vector<std::string>& partitions) const;
  Result<Entity> make_topic(const dds_topic_descriptor_t& descriptor, const char* name);

  // Destroyed in reverse: children before the participant, the participant before the domain.
  std::shared_ptr<Doorbell> bell_;  // arrivals and wake() ring it
  DomainUse domain_;
  DdsOptions options_;
  dds_duration_t own_lease_;  // of writers that show life themselves
  dds_duration_t lease_;      // of all others
  Entity participant_;
  std::optional<CallOut> call_out_;  // set together with it
  Entity publisher_;
  Entity subscriber_;
  ParticipantId self_;
  bool may_act_ = true;
};

}  // namespace tandem::transport::dds
