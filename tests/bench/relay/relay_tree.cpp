// A tree of relays in simulated time: one hub, edges, and a large audience with churn
// (services/relay/README.md has the numbers).
//
// The server, the relay beside it, and each edge (a gateway that follows over NATS) are the real ones, on a
// NATS server in memory with delay and loss. Viewers are aggregated: whoever joins is a viewer of the real
// gateway until it has played for a second; after that it is a number, which gets each delta once. With a
// seed, all is the same again.

#include <cstdio>
#include <deque>
#include <string>
#include <vector>

#include "services/follow/following/session_client.hpp"
#include "services/gateway/gateway.hpp"
#include "services/program/commandline/commandline.hpp"
#include "tests/unit/relay/stage.hpp"

namespace tandem::relay {
namespace {

struct Options {
  std::uint32_t edges = 20, viewers = 100'000, seconds = 60, bodies = 200;
  double churn = 0.01;  ///< of the viewers, that leave and join in a second
  double loss = 0.01;
  std::uint64_t seed = 1;
};

/// A viewer that joins.
struct Joiner {
  gateway::ViewerId id = 0;
  transport::ClientId client = 0;
  std::int64_t since_ns = 0;
  std::optional<std::int64_t> plays_ns;
  bool told = false, has_snapshot = false;
};

/// A site without DDS: a gateway that follows over NATS.
class Edge {
 public:
  Edge(Stage& stage, std::uint32_t number, std::size_t viewers)
      : stage_(stage),
        bus_(make_bus()),
        port_(stage.nats_options("edge" + std::to_string(number), 10'000 + number), std::move(owned_)),
        client_(core_options(10'000 + number), port_),
        gateway_({.viewers = 20'000, .queue_bytes = 4U << 20U}, client_),
        settled_(viewers),
        next_client_(std::uint64_t{number + 1} << 32U) {}

  void poll() {
    const client::Now now{stage_.now_ns, stage_.now_ns + 1'700'000'000 * kSecond};
    const Frame before = gateway_.frame();
    client_.poll(gateway_, now);
    gateway_.poll(now.steady_ns);
    if (gateway_.frame() > before) frames_ += gateway_.frame() - before;
    gateway_.list_ready(now.steady_ns, ready_);
    for (const gateway::ViewerId id : ready_) serve(id);
    while (!joiners_.empty() && joiners_.front().plays_ns &&
           stage_.now_ns - *joiners_.front().plays_ns > kSecond) {
      gateway_.leave(joiners_.front().id);
      ++settled_;
      joiners_.pop_front();
    }
  }
  void join() {
    const auto id = gateway_.admit();
    if (!id) {
      ++refused_;
      return;
    }
    Joiner& joiner = joiners_.emplace_back();
    joiner.id = *id;
    joiner.client = ++next_client_;
    joiner.since_ns = stage_.now_ns;
  }
  void leave() {
    if (settled_ > 0) --settled_;
  }

  std::vector<double> join_ms;
  [[nodiscard]] transport::FakeNats::Bus& link() { return *bus_; }
  [[nodiscard]] std::uint64_t snapshots() const { return gateway_.counts().snapshots; }
  [[nodiscard]] std::uint64_t resyncs() const { return client_.core().statistics().resyncs; }
  [[nodiscard]] std::uint64_t mismatches() const { return client_.core().statistics().hash_mismatches; }
  [[nodiscard]] std::size_t viewers() const { return settled_ + joiners_.size(); }
  [[nodiscard]] std::size_t joining() const { return joiners_.size(); }
  [[nodiscard]] std::uint64_t frames() const { return frames_; }
  [[nodiscard]] Frame frame() const { return gateway_.frame(); }
  [[nodiscard]] std::uint64_t joiner_bytes() const { return joiner_bytes_; }
  [[nodiscard]] std::uint64_t refused() const { return refused_; }

 private:
  transport::FakeNats::Bus* make_bus() {
    owned_ = stage_.nats.connect();
    return owned_.get();
  }
  static client::CoreOptions core_options(transport::ClientId id) {
    client::CoreOptions core;
    core.session = "default";
    core.prefer = "0";
    core.id = id;
    return core;
  }
  void serve(gateway::ViewerId id) {
    const auto joiner = std::ranges::find(joiners_, id, &Joiner::id);
    if (joiner == joiners_.end()) return;
    for (;;) {
      const auto next = gateway_.next(id, stage_.now_ns);
      if (!next.message) return;
      const auto bytes = next.message->envelope();
      joiner_bytes_ += bytes.size();
      const auto kind = std::to_integer<std::uint8_t>(bytes[0]);
      if (kind == 1 && !joiner->told) {
        joiner->told = true;
        acknowledge(*joiner, transport::Phase::kJoining, 0, 0);
      } else if (kind == 4) {
        const auto message = transport::read_gateway_envelope(bytes);
        const auto& part = std::get<transport::SnapshotMessage>(*message);
        joiner->has_snapshot = part.part + 1 == part.parts;
        acknowledge(*joiner, transport::Phase::kJoining, part.frame, part.parts);
      } else if (kind == 2 && joiner->has_snapshot && !joiner->plays_ns) {
        joiner->plays_ns = stage_.now_ns;
        join_ms.push_back(static_cast<double>(stage_.now_ns - joiner->since_ns) / 1e6);
        acknowledge(*joiner, transport::Phase::kPlaying, 0, 0);
      }
    }
  }
  void acknowledge(const Joiner& joiner, transport::Phase phase, Frame frame, std::uint32_t parts) {
    transport::AckMessage ack;
    ack.client = joiner.client;
    ack.epoch = gateway_.session()->epoch;
    ack.phase = phase;
    ack.role_wanted = transport::Role::kObserver;
    ack.join_attempt = 1;
    ack.snapshot_frame = frame;
    ack.snapshot_parts = parts;
    if (phase == transport::Phase::kPlaying) ack.applied = gateway_.frame();
    transport::Bytes bytes;
    transport::write_envelope(ack, bytes);
    static_cast<void>(gateway_.receive(joiner.id, bytes, stage_.now_ns));
  }

  Stage& stage_;
  std::unique_ptr<transport::FakeNats::Bus> owned_;
  transport::FakeNats::Bus* bus_;
  transport::NatsClientPort port_;
  following::SessionClient client_;
  gateway::Gateway gateway_;
  std::size_t settled_;
  transport::ClientId next_client_;
  std::deque<Joiner> joiners_;
  std::vector<gateway::ViewerId> ready_;
  std::uint64_t frames_ = 0, joiner_bytes_ = 0, refused_ = 0;
};

double quantile(std::vector<double> all, double q) {
  if (all.empty()) return 0;
  std::sort(all.begin(), all.end());
  return all[static_cast<std::size_t>(q * static_cast<double>(all.size() - 1))];
}

int run(const Options& options) {
  Stage stage(options.seed);
  stage.bodies = options.bodies;
  stage.nats.delay_ns = 40 * kMillisecond;
  stage.start_server();
  stage.start_near();
  stage.run_ms(2000);
  std::vector<std::unique_ptr<Edge>> edges;
  for (std::uint32_t i = 0; i < options.edges; ++i)
    edges.push_back(std::make_unique<Edge>(stage, i, options.viewers / options.edges));
  Dice dice(options.seed);
  const double per_ms = options.churn * options.viewers / 1000 / options.edges;
  const auto run_ms = [&](std::int64_t ms, bool churn) {
    for (std::int64_t i = 0; i < ms; ++i) {
      stage.run_ms(1);
      for (auto& edge : edges) {
        if (churn && dice.chance(per_ms)) {
          edge->leave();
          edge->join();
        }
        edge->poll();
      }
    }
  };
  run_ms(3000, false);
  const std::uint64_t for_edges = stage.near->relay->host()->totals().snapshots;
  std::printf(
      "seed %llu: 1 hub, %u edges, %u viewers, %u bodies, churn %.1f %% a second, 80 ms, loss %.1f %%\n",
      static_cast<unsigned long long>(options.seed), options.edges, options.viewers, options.bodies,
      100 * options.churn, 100 * options.loss);
  std::printf("%u edges joined with %llu snapshots of the hub\n", options.edges,
              static_cast<unsigned long long>(for_edges));
  stage.nats.loss = options.loss;

  struct Sum {
    std::uint64_t packets = 0, bytes = 0, snapshots = 0, frames = 0, joiner_bytes = 0;
  };
  const auto sum = [&] {
    Sum all;
    for (auto& edge : edges) {
      all.packets += edge->link().received;
      all.bytes += edge->link().received_bytes;
      all.snapshots += edge->snapshots();
      all.frames += edge->frames();
      all.joiner_bytes += edge->joiner_bytes();
    }
    return all;
  };
  const auto published = [&] { return stage.published->counts(); };
  const Sum before = sum();
  const auto hub_before = published();
  run_ms(std::int64_t{options.seconds} * 1000, true);
  const Sum after = sum();
  const auto hub = published();
  const double links = static_cast<double>(options.edges) * options.seconds;
  std::vector<double> joins;
  std::uint64_t resyncs = 0, mismatches = 0, refused = 0;
  Frame behind = 0;
  for (auto& edge : edges) {
    joins.insert(joins.end(), edge->join_ms.begin(), edge->join_ms.end());
    resyncs += edge->resyncs();
    mismatches += edge->mismatches();
    refused += edge->refused();
    behind = std::max(behind, stage.server->frame() - edge->frame());
  }
  // What it sends to one on request is counted there, too.
  const double log_kb = static_cast<double>(hub.published_bytes - hub_before.published_bytes -
                                            (hub.repeated_bytes - hub_before.repeated_bytes)) /
                        options.seconds / 1e3;
  const double link_kb = static_cast<double>(after.bytes - before.bytes) / links / 1e3;
  std::printf(
      "the relay publishes %.2f kB/s once; a link to an edge carries %.2f kB/s in %.1f packets/s (%.2f times, with subjects and repairs)\n",
      log_kb, link_kb, static_cast<double>(after.packets - before.packets) / links, link_kb / log_kb);
  std::printf(
      "edges: %.1f frames/s each, %llu joins anew, %llu mismatches, at most %llu frames behind; snapshots of the hub meanwhile: %llu\n",
      static_cast<double>(after.frames - before.frames) / links, static_cast<unsigned long long>(resyncs),
      static_cast<unsigned long long>(mismatches), static_cast<unsigned long long>(behind),
      static_cast<unsigned long long>(stage.near->relay->host()->totals().snapshots - for_edges));
  std::printf(
      "viewers: %zu joined (%.0f a second), %llu refused; an edge made %.1f snapshots/s; to join took p50 %.0f, p99 %.0f, most %.0f ms\n",
      joins.size(), static_cast<double>(joins.size()) / options.seconds,
      static_cast<unsigned long long>(refused),
      static_cast<double>(after.snapshots - before.snapshots) / links, quantile(joins, 0.5),
      quantile(joins, 0.99), quantile(joins, 1));
  std::printf("a viewer's link while it joins and plays its first second: %.1f kB\n",
              static_cast<double>(after.joiner_bytes - before.joiner_bytes) /
                  static_cast<double>(std::max<std::size_t>(1, joins.size())) / 1e3);

  Edge& cut = *edges[0];
  Edge& other = *edges[1];
  const std::uint64_t other_frames = other.frames();
  cut.link().cut = true;
  run_ms(20'000, true);
  const std::uint64_t cut_bytes = cut.link().received_bytes;
  const auto repeated = published().repeated_bytes;
  const Frame at = stage.server->frame();
  const std::size_t waiting = cut.joining();
  cut.link().cut = false;
  std::int64_t took_ms = 0;
  while (cut.frame() < at && took_ms < 20'000) {
    run_ms(10, true);
    took_ms += 10;
  }
  std::printf(
      "a link cut for 20 s: its edge has all frames %lld ms after the repair, %.1f kB over its link, %.1f kB sent again in all, %llu joins anew; "
      "%zu viewers of it were joining; another edge had %.1f frames/s meanwhile\n",
      static_cast<long long>(took_ms), static_cast<double>(cut.link().received_bytes - cut_bytes) / 1e3,
      static_cast<double>(published().repeated_bytes - repeated) / 1e3,
      static_cast<unsigned long long>(cut.resyncs()), waiting,
      static_cast<double>(other.frames() - other_frames) / (20 + static_cast<double>(took_ms) / 1000));
  return mismatches == 0 && resyncs == 0 && took_ms < 20'000 ? 0 : 1;
}

}  // namespace
}  // namespace tandem::relay

int main(int argc, char** argv) {
  tandem::relay::Options options;
  tandem::commandline::Program app{"A tree of relays with a large audience, in simulated time.",
                                   "relay_tree"};
  app.add_option("--edges", options.edges, "Edges").range(2U, 200U).show_default();
  app.add_option("--viewers", options.viewers, "Viewers of all edges").show_default();
  app.add_option("--seconds", options.seconds, "Simulated seconds").range(1U, 3600U).show_default();
  app.add_option("--bodies", options.bodies, "Bodies").range(1U, 20'000U).show_default();
  app.add_option("--churn", options.churn, "Share of the viewers that leaves, and joins, in a second")
      .range(0.0, 0.1)
      .show_default();
  app.add_option("--loss", options.loss, "Share of packets that a link loses").range(0.0, 0.5).show_default();
  app.add_option("--seed", options.seed, "Of the world and of who comes and goes").show_default();
  if (const auto code = app.parse(argc, argv)) return *code;
  return tandem::relay::run(options);
}
