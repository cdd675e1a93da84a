#include "sdk/transport/simulated/fabric.hpp"

#include <algorithm>
#include <array>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::transport::simulated {
namespace {

struct TopicRules {
  bool reliable = true;
  bool transient_local = false;
  std::size_t durable_depth = SIZE_MAX;  // part of each key's history that late readers get
  bool parts = false;                    // of something large: NetworkOptions::part_lifespan_ns
};
// In the order of AnyMessage; the same QoS as in dds/topics.hpp.
constexpr std::array<TopicRules, std::variant_size_v<AnyMessage>> kRules{{
    {true, true},                   // session
    {true, false},                  // delta
    {true, true, 256},              // scheduled input
    {true, false, SIZE_MAX, true},  // snapshot
    {true, true},                   // reply
    {true, false},                  // input
    {true, false},                  // acknowledgement
    {false, false},                 // server status
    {false, false},                 // client status
    {true, false},                  // journal
    {true, false, SIZE_MAX, true},  // checkpoint
    {true, false},                  // standby
    {true, false},                  // command
}};

// The approximate overhead of DDS for a sample: headers of IP, UDP and RTPS, and fields besides the payload.
constexpr std::size_t kOverheadBytes = 150;

struct PayloadBytes {
  std::size_t operator()(const DeltaMessage& m) const { return m.payload.size(); }
  std::size_t operator()(const SnapshotMessage& m) const { return m.bytes.size(); }
  std::size_t operator()(const SessionMessage& m) const {
    std::size_t bytes = 0;
    for (const StreamMessage& stream : m.streams) bytes += stream.layout.codec_tables.size();
    return bytes;
  }
  std::size_t operator()(const InputMessage& m) const { return 8 * m.values.size() + m.bytes.size(); }
  std::size_t operator()(const ReplyMessage& m) const { return 20 * m.entries.size(); }
  template <class Small>
  std::size_t operator()(const Small& /*m*/) const {
    return 0;
  }
};

std::size_t wire_bytes(const AnyMessage& message) {
  return kOverheadBytes + std::visit(PayloadBytes{}, message);
}

}  // namespace

std::uint64_t Random::next() {
  std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ULL);
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31U);
}

bool Random::chance(double probability) {
  return probability > 0 && static_cast<double>(next() >> 11U) * 0x1.0p-53 < probability;
}

std::int64_t Random::between(std::int64_t low, std::int64_t high) {
  if (high <= low) return low;
  const auto span = static_cast<std::uint64_t>(high - low) + 1;
  return low + static_cast<std::int64_t>(next() % span);
}

Fabric::Index Fabric::add_participant(const std::string& session) {
  const auto index = static_cast<Index>(participants_.size());
  Participant participant;
  participant.session = session;
  // The random part comes first, so that the seed decides which of two servers has the lower id. The index
  // makes it unique.
  const std::uint64_t high = random_.next();
  for (std::size_t i = 0; i < 8; ++i) participant.id.bytes[i] = static_cast<std::uint8_t>(high >> (8U * i));
  for (std::size_t i = 0; i < 4; ++i)
    participant.id.bytes[8 + i] = static_cast<std::uint8_t>(index >> (8U * i));
  participants_.push_back(std::move(participant));
  return index;
}

Fabric::Index Fabric::add_writer(Index participant, std::size_t topic, std::uint32_t depth,
                                 std::string partition) {
  TANDEM_ASSERT(participant < participants_.size() && depth > 0);
  const auto index = static_cast<Index>(writers_.size());
  Writer& writer = writers_.emplace_back();
  writer.participant = participant;
  writer.topic = topic;
  writer.depth = depth;
  writer.partition = std::move(partition);
  participants_[participant].writers.push_back(index);
  for (Index to = 0; to < readers_.size(); ++to) add_pair(index, to);
  return index;
}

Fabric::Index Fabric::add_reader(Index participant, std::size_t topic, std::uint32_t depth,
                                 std::vector<std::string> partitions) {
  TANDEM_ASSERT(participant < participants_.size() && depth > 0);
  const auto index = static_cast<Index>(readers_.size());
  Reader& reader = readers_.emplace_back();
  reader.participant = participant;
  reader.topic = topic;
  reader.depth = depth;
  reader.partitions = std::move(partitions);
  participants_[participant].readers.push_back(index);
  for (Index from = 0; from < writers_.size(); ++from) add_pair(from, index);
  return index;
}

void Fabric::add_pair(Index writer, Index reader) {
  const Writer& from = writers_[writer];
  const Reader& to = readers_[reader];
  const bool fits = from.topic == to.topic && from.participant != to.participant &&
                    participants_[from.participant].session == participants_[to.participant].session &&
                    std::ranges::find(to.partitions, from.partition) != to.partitions.end();
  if (!fits || from.closed || to.closed || gone(from.participant) || gone(to.participant)) return;
  const auto index = static_cast<Index>(pairs_.size());
  Pair& pair = pairs_.emplace_back();
  pair.writer = writer;
  pair.reader = reader;
  writers_[writer].pairs.push_back(index);
  readers_[reader].pairs.push_back(index);
  schedule(index, now_ns_ + match_ns(from.participant, to.participant));
}

std::int64_t Fabric::match_ns(Index writer, Index reader) {
  const std::int64_t own_ns = random_.between(options_.match_min_ns, options_.match_max_ns);
  if (!options_.match_over_links) return own_ns;
  const auto [met, is_new] = met_ns_.try_emplace(std::minmax({writer, reader}), now_ns_);
  if (is_new) met->second += told_ns(writer, reader) + told_ns(reader, writer);
  return own_ns + std::max<std::int64_t>(0, met->second - now_ns_) +
         std::max(told_ns(writer, reader), told_ns(reader, writer));
}

std::int64_t Fabric::told_ns(Index from, Index to) {
  const LinkModel& model = link(from, to);
  std::int64_t takes_ns = model.delay_ns + random_.between(0, model.jitter_ns);
  while (loses(from, to) && takes_ns < options_.lease_ns) takes_ns += repair_ns(from, to);
  return takes_ns;
}

void Fabric::close_reader(Index reader) {
  readers_[reader].arrived.clear();
  close(readers_[reader]);
}

void Fabric::close_writer(Index writer) {
  writers_[writer].history.clear();
  close(writers_[writer]);
}

void Fabric::close(Endpoint& endpoint) {
  endpoint.closed = true;
  for (const Index index : std::exchange(endpoint.pairs, {})) {
    Pair& pair = pairs_[index];
    pair.matched = false;
    pair.travelling.clear();
    std::erase(writers_[pair.writer].pairs, index);
    std::erase(readers_[pair.reader].pairs, index);
  }
}

void Fabric::close_participant(Index participant) {
  participants_[participant].closed = true;
  for (const Index reader : participants_[participant].readers) close_reader(reader);
  for (const Index writer : participants_[participant].writers) close_writer(writer);
}

Result<void> Fabric::write(Index writer, std::uint64_t key, AnyMessage message) {
  Writer& from = writers_[writer];
  if (gone(from.participant)) return fail(ErrorCode::kTransport, "this participant was killed");
  TANDEM_ASSERT(message.index() == from.topic);
  const Sample sample{from.next_sequence++, key, now_ns_,
                      std::make_shared<const AnyMessage>(std::move(message))};
  if (kRules[from.topic].reliable) {
    std::deque<Sample>& kept = from.history[key];
    kept.push_back(sample);
    if (kept.size() > from.depth) kept.pop_front();
  }
  for (const Index pair : from.pairs) {
    if (pairs_[pair].matched) send(pair, sample);
  }
  return {};
}

bool Fabric::loses(Index from, Index to) {
  const LinkModel& model = link(from, to);
  bool lost = random_.chance(model.loss);
  if (model.burst_loss > 0) {  // Gilbert and Elliott: all is lost in one state, nothing in the other
    bool& in_burst = bursts_[{from, to}];
    TANDEM_ASSERT(model.burst_loss < 1 && model.burst_samples >= 1);
    const double leave = 1 / model.burst_samples;
    in_burst =
        in_burst ? !random_.chance(leave) : random_.chance(leave * model.burst_loss / (1 - model.burst_loss));
    lost = lost || in_burst;
  }
  return lost;
}

std::int64_t Fabric::repair_ns(Index from, Index to) {
  const LinkModel& there = link(from, to);
  const LinkModel& back = link(to, from);
  if (there.repair_ns) return std::max<std::int64_t>(1, *there.repair_ns);
  return kNackNs + back.delay_ns + random_.between(0, back.jitter_ns) + there.delay_ns +
         random_.between(0, there.jitter_ns);
}

std::optional<std::int64_t> Fabric::squeeze_ns(const LinkModel& model, const AnyMessage& message) {
  const bool twice = random_.chance(model.duplicates);
  if (twice) ++counts_.duplicated;
  if (!model.bottleneck) return 0;
  const auto arrives_ns = model.bottleneck->offer(now_ns_, wire_bytes(message));
  if (twice) static_cast<void>(model.bottleneck->offer(now_ns_, wire_bytes(message)));
  return arrives_ns ? std::optional(*arrives_ns - now_ns_) : std::nullopt;
}

void Fabric::send(Index pair, const Sample& sample) {
  Pair& way = pairs_[pair];
  const Writer& writer = writers_[way.writer];
  const Index to = readers_[way.reader].participant;
  const LinkModel& model = link(writer.participant, to);
  Travelling travelling{sample, now_ns_ + model.delay_ns + random_.between(0, model.jitter_ns), false};
  const bool lost = is_cut(writer.participant, to) || loses(writer.participant, to);
  const auto squeezed_ns = lost ? std::nullopt : squeeze_ns(model, *sample.message);
  travelling.due_ns += squeezed_ns.value_or(0);
  if (!squeezed_ns) {
    if (!kRules[writer.topic].reliable) return;
    const bool given_up = writer.topic != kTopic<SessionMessage> && random_.chance(model.lost_for_good);
    if (given_up) {
      ++counts_.lost_for_good;
      return;
    }
    travelling.to_repair = true;
    travelling.due_ns += repair_ns(writer.participant, to);
  }
  schedule(pair, travelling.due_ns);
  while (!kRules[writer.topic].reliable && !way.travelling.empty() &&
         way.travelling.back().due_ns > travelling.due_ns) {
    way.travelling.pop_back();
    ++counts_.overtaken;
  }
  way.travelling.push_back(std::move(travelling));
}

void Fabric::schedule(Index pair, std::int64_t at_ns) {
  TANDEM_ASSERT(at_ns >= now_ns_);
  events_.push(Event{at_ns, next_order_++, pair});
}

void Fabric::advance_to(std::int64_t now_ns) {
  while (!events_.empty() && events_.top().at_ns <= now_ns) {
    const Event event = events_.top();
    events_.pop();
    now_ns_ = std::max(now_ns_, event.at_ns);
    process(event.pair);
  }
  now_ns_ = std::max(now_ns_, now_ns);
}

std::optional<std::int64_t> Fabric::next_event_ns() const {
  if (events_.empty()) return std::nullopt;
  return events_.top().at_ns;
}

void Fabric::process(Index pair) {
  Pair& way = pairs_[pair];
  const Writer& writer = writers_[way.writer];
  const Reader& reader = readers_[way.reader];
  if (reader.closed || writer.closed || gone(reader.participant)) return;
  const bool unreachable = participants_[reader.participant].frozen_ns != kNever ||
                           participants_[writer.participant].frozen_ns != kNever ||
                           is_cut_either_way(writer.participant, reader.participant);
  if (!way.matched) {
    if (gone(writer.participant)) return;
    if (unreachable) {  // discovery is repeated until it succeeds
      schedule(pair, now_ns_ + random_.between(options_.match_min_ns, options_.match_max_ns));
      return;
    }
    way.matched = true;
    if (!kRules[writer.topic].transient_local) return;
    std::vector<Sample> kept;
    for (const auto& [key, samples] : writer.history) {
      const auto late = std::min(samples.size(), kRules[writer.topic].durable_depth);
      kept.insert(kept.end(), samples.end() - static_cast<std::ptrdiff_t>(late), samples.end());
    }
    std::sort(kept.begin(), kept.end(),
              [](const Sample& a, const Sample& b) { return a.sequence < b.sequence; });
    for (const Sample& sample : kept) send(pair, sample);
    return;
  }
  while (!way.travelling.empty() && way.travelling.front().due_ns <= now_ns_ && settle_front(way, pair)) {
  }
}

bool Fabric::settle_front(Pair& pair, Index index) {
  const Writer& writer = writers_[pair.writer];
  const Index to = readers_[pair.reader].participant;
  Travelling& front = pair.travelling.front();
  const LinkModel& model = link(writer.participant, to);
  if (participants_[to].frozen_ns != kNever) return false;  // set_frozen() resumes it
  if (front.to_repair) {
    if (gone(writer.participant) || !keeps(writer, front.sample)) {
      ++counts_.overwritten;
      pair.travelling.pop_front();
      return true;
    }
    const bool lost = participants_[writer.participant].frozen_ns != kNever ||
                      is_cut_either_way(writer.participant, to) || loses(writer.participant, to);
    const auto squeezed_ns = lost ? std::nullopt : squeeze_ns(model, *front.sample.message);
    if (squeezed_ns) ++counts_.repaired;
    if (!squeezed_ns || *squeezed_ns > 0) {
      front.to_repair = !squeezed_ns;
      front.due_ns = now_ns_ + (squeezed_ns ? *squeezed_ns : repair_ns(writer.participant, to));
      schedule(index, front.due_ns);
      return false;
    }
  }
  deliver(pair, front.sample);
  pair.travelling.pop_front();
  return true;
}

void Fabric::deliver(const Pair& pair, const Sample& sample) {
  Reader& reader = readers_[pair.reader];
  // Kept by writer, as in the DDS port, so that no writer displaces the samples of others.
  const Index from = writers_[pair.writer].participant;
  const auto same_key = [&](const Arrived& arrived) {
    return arrived.from == from && arrived.key == sample.key;
  };
  if (reader.arrived.size() >= reader.depth &&
      std::count_if(reader.arrived.begin(), reader.arrived.end(), same_key) >=
          static_cast<std::ptrdiff_t>(reader.depth)) {
    reader.arrived.erase(std::find_if(reader.arrived.begin(), reader.arrived.end(), same_key));
    ++counts_.pushed_out;
  }
  reader.arrived.push_back(Arrived{from, sample.key, arriving(link(from, reader.participant), sample)});
  ++counts_.delivered;
  ++participants_[reader.participant].delivered;
}

std::shared_ptr<const AnyMessage> Fabric::arriving(const LinkModel& model, const Sample& sample) {
  const bool flips = random_.chance(model.flipped);
  const bool truncates = random_.chance(model.truncated);
  if (!flips && !truncates) return sample.message;
  AnyMessage message = *sample.message;
  Bytes* bytes = nullptr;
  if (auto* delta = std::get_if<DeltaMessage>(&message)) bytes = &delta->payload;
  if (auto* snapshot = std::get_if<SnapshotMessage>(&message)) bytes = &snapshot->bytes;
  if (bytes == nullptr || bytes->empty()) return sample.message;
  const std::size_t at = random_.next() % bytes->size();
  if (flips) (*bytes)[at] ^= std::byte{1} << (random_.next() % 8);
  if (truncates) bytes->resize(at);
  ++counts_.damaged;
  return std::make_shared<const AnyMessage>(std::move(message));
}

bool Fabric::keeps(const Writer& writer, const Sample& sample) const {
  if (kRules[writer.topic].parts && now_ns_ - sample.written_ns > options_.part_lifespan_ns) return false;
  const auto kept = writer.history.find(sample.key);
  return kept != writer.history.end() && !kept->second.empty() &&
         kept->second.front().sequence <= sample.sequence;
}

WriterState Fabric::state(Index observer, Index other) const {
  const Participant& subject = participants_[other];
  if (subject.closed) return WriterState::kGone;
  std::int64_t silent_ns = std::min(subject.killed_ns, subject.frozen_ns);
  if (const auto cut = cuts_.find({other, observer}); cut != cuts_.end()) {
    silent_ns = std::min(silent_ns, cut->second);
  }
  const bool expired = silent_ns != kNever && now_ns_ - silent_ns >= options_.lease_ns;
  return expired ? WriterState::kSilent : WriterState::kLive;
}

bool Fabric::has_met(const Endpoint& endpoint, const ParticipantId& participant) const {
  return std::ranges::any_of(endpoint.pairs, [&](Index index) {
    const Pair& pair = pairs_[index];
    const Index writer = writers_[pair.writer].participant, reader = readers_[pair.reader].participant;
    const Index other = writer == endpoint.participant ? reader : writer;
    return pair.matched && id(other) == participant &&
           state(endpoint.participant, other) == WriterState::kLive;
  });
}

bool Fabric::ended(const ParticipantId& participant) const {
  const Index subject = find(participant);
  return subject == participants_.size() || participants_[subject].closed;
}

Fabric::Index Fabric::find(const ParticipantId& participant) const {
  const auto found = std::find_if(participants_.begin(), participants_.end(),
                                  [&](const Participant& other) { return other.id == participant; });
  return static_cast<Index>(found - participants_.begin());
}

const LinkModel& Fabric::link(Index from, Index to) const {
  const auto own = links_.find({from, to});
  return own == links_.end() ? options_.link : own->second;
}

bool Fabric::is_cut(Index from, Index to) const { return !cuts_.empty() && cuts_.contains({from, to}); }

std::uint64_t Fabric::delivered_to(const ParticipantId& participant) const {
  const Index index = find(participant);
  return index == participants_.size() ? 0 : participants_[index].delivered;
}

bool Fabric::gone(Index participant) const {
  return participants_[participant].closed || participants_[participant].killed_ns != kNever;
}

void Fabric::set_link(const ParticipantId& from, const ParticipantId& to, const LinkModel& link) {
  TANDEM_ASSERT(find(from) < participants_.size() && find(to) < participants_.size());
  links_[{find(from), find(to)}] = link;
}

void Fabric::set_all_links(const LinkModel& link) {
  options_.link = link;
  links_.clear();
}

void Fabric::set_cut(const ParticipantId& from, const ParticipantId& to, bool cut) {
  const std::pair<Index, Index> way{find(from), find(to)};
  TANDEM_ASSERT(way.first < participants_.size() && way.second < participants_.size());
  if (cut) {
    cuts_.emplace(way, now_ns_);
  } else {
    cuts_.erase(way);
  }
}

void Fabric::set_frozen(const ParticipantId& participant, bool frozen) {
  const Index index = find(participant);
  TANDEM_ASSERT(index < participants_.size());
  Participant& subject = participants_[index];
  if (frozen) {
    subject.frozen_ns = std::min(subject.frozen_ns, now_ns_);
    return;
  }
  subject.frozen_ns = kNever;
  // Samples that came while it was frozen overran its socket; it asks for them again.
  for (const Index reader : subject.readers) {
    for (const Index index_of_pair : readers_[reader].pairs) {
      Pair& pair = pairs_[index_of_pair];
      const Writer& writer = writers_[pair.writer];
      if (!kRules[writer.topic].reliable) pair.travelling.clear();
      for (Travelling& travelling : pair.travelling) {
        if (travelling.due_ns > now_ns_) continue;
        travelling.to_repair = true;
        travelling.due_ns = now_ns_ + repair_ns(writer.participant, index);
        schedule(index_of_pair, travelling.due_ns);
      }
    }
  }
}

void Fabric::kill(const ParticipantId& participant) {
  TANDEM_ASSERT(find(participant) < participants_.size());
  Participant& subject = participants_[find(participant)];
  subject.killed_ns = std::min(subject.killed_ns, now_ns_);
}

}  // namespace tandem::transport::simulated
