#include "tests/fault/world/actors/gateway.hpp"

#include <algorithm>
#include <utility>

namespace tandem::world {

GatewayActor::GatewayActor(Stage& stage, std::string name, const Service& server, std::uint64_t first_id)
    : Actor(stage, std::move(name)),
      server_(server),
      dice_(stage.settings.seed * 977 + first_id),
      next_id_(first_id) {}

GatewayActor::~GatewayActor() = default;

std::vector<transport::ParticipantId> GatewayActor::participants() const {
  if (!port_) return {};
  return {port_->self()};
}

void GatewayActor::on_start() {
  port_ = std::move(*stage_.network.make_client("default"));
  client::CoreOptions options;
  options.session = "default";
  options.id = next_id_++;
  options.role = transport::Role::kParticipant;
  options.prefer = "computing";
  client_ = std::make_unique<following::SessionClient>(std::move(options), *port_);
  gateway_ = std::make_unique<gateway::Gateway>(gateway::Limits{}, *client_);
  due_ns_ = 0;
  plays_since_ns_ = INT64_MAX;
}

void GatewayActor::drop() {
  for (const auto& [viewer, connection] : connections_) connection->open = false;
  connections_.clear();
  gateway_.reset();
  client_.reset();
  port_.reset();
  plays_since_ns_ = INT64_MAX;
}

void GatewayActor::on_crash(bool /*power_fails*/) { drop(); }
void GatewayActor::on_leave() { drop(); }

std::int64_t GatewayActor::plays_for_ns() const {
  if (plays_since_ns_ == INT64_MAX) return 0;
  return std::min({well_for_ns(), server_.serves_for_ns(), stage_.now_ns - plays_since_ns_});
}

std::shared_ptr<Connection> GatewayActor::connect() {
  if (!up() || paused()) return nullptr;
  const auto viewer = gateway_->admit();
  if (!viewer) return nullptr;
  auto connection = std::make_shared<Connection>();
  connection->viewer = *viewer;
  connections_.emplace(*viewer, connection);
  return connection;
}

std::int64_t GatewayActor::arrival_of(const std::deque<Connection::Message>& before) {
  const auto& link = stage_.settings.link;
  std::int64_t at_ns = stage_.now_ns + link.delay_ns +
                       static_cast<std::int64_t>(dice_.uniform(0, static_cast<double>(link.jitter_ns)));
  if (dice_.chance(link.loss)) at_ns += 200 * kMs;
  return before.empty() ? at_ns : std::max(at_ns, before.back().due_ns);
}

std::int64_t GatewayActor::arrival_ns() const {
  std::int64_t first_ns = INT64_MAX;
  for (const auto& [viewer, connection] : connections_)
    if (!connection->up.empty()) first_ns = std::min(first_ns, connection->up.front().due_ns);
  return first_ns;
}

void GatewayActor::close(gateway::ViewerId viewer, const char* why) {
  const auto connection = connections_.find(viewer);
  if (connection == connections_.end()) return;
  tell(std::string("ends a connection: ") + why);
  connection->second->open = false;
  connections_.erase(connection);
  gateway_->leave(viewer);
}

void GatewayActor::send(gateway::ViewerId viewer) {
  const auto found = connections_.find(viewer);
  if (found == connections_.end()) return;
  Connection& connection = *found->second;
  while (connection.down_bytes < Connection::kMaxFlying) {
    const gateway::Gateway::Next next = gateway_->next(viewer, steady_ns());
    if (next.message == nullptr) break;
    const auto envelope = next.message->envelope();
    connection.down.push_back({arrival_of(connection.down), {envelope.begin(), envelope.end()}});
    connection.down_bytes += envelope.size();
    if (!next.more) break;
  }
}

void GatewayActor::on_poll() {
  due_ns_ = std::min(client_->poll(*gateway_, {steady_ns(), wall_ns()}), steady_ns() + 100 * kMs);
  due_ns_ = std::min(due_ns_, gateway_->poll(steady_ns()));
  if (client_->core().phase() != ClientPhase::kPlaying) {
    plays_since_ns_ = INT64_MAX;
  } else if (plays_since_ns_ == INT64_MAX || stream_ != client_->core().stream()->id.id) {
    plays_since_ns_ = stage_.now_ns;  // with another stream, its viewers join anew
    stream_ = client_->core().stream()->id.id;
  }
  std::vector<gateway::ViewerId> gone;
  for (const auto& [viewer, connection] : connections_) {
    if (!connection->open) gone.push_back(viewer);
    while (connection->open && !connection->up.empty() && connection->up.front().due_ns <= stage_.now_ns) {
      const transport::Bytes message = std::move(connection->up.front().bytes);
      connection->up.pop_front();
      if (const auto refusal = gateway_->receive(viewer, message, steady_ns())) {
        tell("refuses a viewer: " + std::string(gateway::closing(*refusal).reason));
        connection->open = false;
        gone.push_back(viewer);
      }
    }
  }
  for (const gateway::ViewerId viewer : gone) close(viewer, "it is over");
  gateway_->list_ready(steady_ns(), ready_);
  for (const gateway::ViewerId viewer : std::vector(ready_)) send(viewer);
  gateway_->list_not_reading(steady_ns(), ready_);
  for (const gateway::ViewerId viewer : std::vector(ready_)) close(viewer, "nothing is read");
  gateway_->list_silent(steady_ns(), ready_);
  for (const gateway::ViewerId viewer : std::vector(ready_)) close(viewer, "nothing is acknowledged");
}

void GatewayActor::check() {
  if (!client_) return;
  const client::ClientCore& core = client_->core();
  if (const ClientTimeline* timeline = core.timeline(); timeline != nullptr && core.session() != nullptr) {
    if (const std::string wrong = stage_.truth.hold(core.session()->epoch, core.stream()->id.id,
                                                    timeline->applied(), timeline->hash());
        !wrong.empty())
      blame("same state", wrong);
  }
  if (gateway_->viewers() != connections_.size())
    blame("memory", std::to_string(gateway_->viewers()) + " viewers of " +
                        std::to_string(connections_.size()) + " connections");
  if (core.phase() == ClientPhase::kRefused && stage_.network.counts().damaged > 0) {
    drop();  // its operator starts it again
    return ended(stage_.now_ns + kSecond);
  }
  if (std::min(well_for_ns(), server_.serves_for_ns()) < Rules::kPlaysNs) return;
  if (core.phase() != ClientPhase::kPlaying) blame("getting in", "does not play: " + core.status().reason);
}

Browser::Browser(Stage& stage, std::string name, ClientSettings settings, GatewayActor& gateway,
                 std::uint64_t first_id)
    : Actor(stage, std::move(name)),
      settings_(std::move(settings)),
      gateway_(gateway),
      dice_(stage.settings.seed * 977 + first_id),
      next_id_(first_id) {}

Browser::~Browser() = default;

void Browser::on_start() {
  port_ = std::make_unique<transport::WebPort>();
  witness_ = std::make_unique<Witness>(stage_, name(), Witness::Of::kViewer);
  client::CoreOptions options;
  options.id = next_id_++;
  options.role = settings_.role;
  options.lead = settings_.lead;
  core_ = std::make_unique<client::ClientCore>(std::move(options), *port_, witness_.get());
  witness_->watch(*core_);
  connect_at_ns_ = stage_.now_ns;
  due_ns_ = 0;
  next_input_ns_ = steady_ns();
  told_phase_ = ClientPhase::kSearching;
}

void Browser::drop() {
  if (connection_) connection_->open = false;
  connection_.reset();
  core_.reset();
  witness_.reset();
  port_.reset();
}

void Browser::on_crash(bool /*power_fails*/) { drop(); }
void Browser::on_leave() { drop(); }

std::int64_t Browser::arrival_ns() const {
  if (!connection_) return connect_at_ns_;
  return connection_->down.empty() ? INT64_MAX : connection_->down.front().due_ns;
}

void Browser::on_poll() {
  if (connection_ && !connection_->open) {
    connection_.reset();
    port_->disconnected();
    connect_at_ns_ = stage_.now_ns + kSecond;
  }
  if (!connection_ && stage_.now_ns >= connect_at_ns_) {
    connection_ = gateway_.connect();
    connect_at_ns_ = stage_.now_ns + kSecond;
    connected_ns_ = stage_.now_ns;
    if (connection_) port_->connected();
  }
  while (connection_ && !connection_->down.empty() && connection_->down.front().due_ns <= stage_.now_ns) {
    const transport::Bytes message = std::move(connection_->down.front().bytes);
    connection_->down.pop_front();
    connection_->down_bytes -= message.size();
    if (const auto taken = port_->receive(message); !taken && taken.error().code != ErrorCode::kCapacity)
      blame("same state", "cannot read what the gateway sent: " + taken.error().message);
  }
  due_ns_ = std::min(core_->poll({steady_ns(), wall_ns()}), steady_ns() + 50 * kMs);
  if (core_->phase() != told_phase_) {
    told_phase_ = core_->phase();
    tell(told_phase_ == ClientPhase::kPlaying ? "plays" : "does not play");
  }
  if (settings_.inputs_per_s > 0 && steady_ns() >= next_input_ns_) {
    next_input_ns_ =
        steady_ns() + static_cast<std::int64_t>(dice_.uniform(0.2, 1.8) * 1e9 / settings_.inputs_per_s);
    send_input();
  }
  while (connection_) {
    auto message = port_->next_message();
    if (!message) break;
    connection_->up.push_back({gateway_.arrival_of(connection_->up), std::move(*message)});
  }
}

void Browser::send_input() {
  if (settings_.role != transport::Role::kParticipant || core_->phase() != ClientPhase::kPlaying) return;
  const double unique = stage_.unique();
  const std::uint64_t kind = dice_.below(10);
  const client::Now now{steady_ns(), wall_ns()};
  const auto number =
      kind < 7 ? core_->send(transport::InputKind::kGravity, {unique, -9, dice_.uniform(-3, 3)}, {}, now)
               : core_->send(transport::InputKind::kPush, {unique, 0, 0, 1.5, dice_.uniform(-2, 2), 1, 0}, {},
                             now);
  if (number) witness_->sent(*number, unique, false, kind < 7);
}

void Browser::burst(std::uint32_t inputs) {
  if (!up() || paused()) return;
  for (std::uint32_t i = 0; i < std::min(inputs, 20U); ++i) send_input();
}

void Browser::check() {
  if (!core_) return;
  const std::int64_t well_ns = std::min(well_for_ns(), gateway_.plays_for_ns());
  if (well_ns < Rules::kPlaysNs) return;
  if (core_->phase() != ClientPhase::kPlaying)
    return blame("getting in", "does not play " + std::to_string(well_ns / kMs) +
                                   " ms after the gateway: " + core_->status().reason);
  if (core_->status().frame + static_cast<Frame>(2 * stage_.settings.frame_rate_hz) < gateway_.frame())
    blame("getting in", "is at frame " + std::to_string(core_->status().frame) + ", the gateway at " +
                            std::to_string(gateway_.frame()));
}

}  // namespace tandem::world
