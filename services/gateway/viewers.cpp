// Handles the messages of viewers.
#include <algorithm>
#include <utility>
#include <variant>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/transport/network/wire_bytes.hpp"
#include "sdk/wire/envelope.hpp"
#include "services/gateway/gateway.hpp"

namespace tandem::gateway {

using transport::InputKind;
using transport::Phase;
using transport::Reason;
using transport::Role;

namespace {

bool is_gravity(const transport::InputMessage& input) {
  return input.kind == static_cast<std::uint32_t>(InputKind::kGravity);
}

constexpr std::size_t kMaskBytes = 4;  // of a message from a viewer

}  // namespace

std::optional<Refusal> Gateway::receive(ViewerId id, std::span<const std::byte> message,
                                        std::int64_t now_ns) {
  const auto found = viewers_.find(id);
  if (found == viewers_.end()) return std::nullopt;
  Viewer& viewer = found->second;
  viewer.cap.took(transport::websocket_wire_bytes(message.size() + kMaskBytes), now_ns);
  std::optional<Refusal> refusal;
  if (message.size() > kMaxViewerBytes) {
    refusal = Refusal::kTooLarge;
  } else if (!viewer.messages.take(now_ns)) {
    refusal = Refusal::kTooManyMessages;
  } else if (auto read = transport::read_viewer_envelope(message); !read) {
    refusal = Refusal::kMalformed;
  } else {
    refusal = take(viewer, std::move(*read), now_ns);
  }
  if (refusal) ++counts_.of(*refusal);
  return refusal;
}

std::optional<Refusal> Gateway::take(Viewer& viewer, transport::ViewerMessage&& message,
                                     std::int64_t now_ns) {
  const auto client = std::visit([](const auto& body) { return body.client; }, message);
  if (client == 0) return Refusal::kMalformed;
  if (viewer.client == 0) viewer.client = client;
  if (viewer.client != client) return Refusal::kForeignClient;
  if (const auto* ack = std::get_if<transport::AckMessage>(&message)) return take(viewer, *ack, now_ns);
  if (auto* input = std::get_if<transport::InputMessage>(&message)) take(viewer, std::move(*input), now_ns);
  if (auto* status = std::get_if<transport::ClientStatusMessage>(&message))
    report(viewer, std::move(*status), now_ns);
  return std::nullopt;
}

std::optional<Refusal> Gateway::take(Viewer& viewer, const transport::AckMessage& ack, std::int64_t now_ns) {
  if (ack.protocol_version != transport::kProtocolVersion) return Refusal::kProtocolVersion;
  viewer.silent_since_ns.reset();
  viewer.wanted_delay_steps = ack.max_delay_ms / transport::kDelayStepMs;
  viewer.adopt_delay(now_ns);
  if (ack.cap_kbit_s != 0 && !transport::is_cap(ack.cap_kbit_s)) return Refusal::kMalformed;
  viewer.cap.want(ack.cap_kbit_s, now_ns);
  // Under way while the session changed.
  const bool of_this = session_ && !session_->streams.empty() && ack.epoch == session_->epoch &&
                       ack.stream == session_->streams.front().id;
  const bool plays = ack.phase == Phase::kPlaying;
  Viewer::InEpoch& state = viewer.now;
  // One that played over another connection may be ahead of a gateway that was restarted.
  const bool resumes = plays && state.flow == Viewer::Flow::kSilent;
  if (!of_this || (plays && !resumes && ack.applied > frame_)) {
    ++counts_.stale;
    return std::nullopt;
  }
  if (!state.heard || state.phase != ack.phase || state.wanted != ack.role_wanted) state.reply.on_change();
  state.heard = true;
  state.phase = ack.phase;
  state.wanted = ack.role_wanted;
  state.clock_ns = ack.clock_ns;
  state.reply.on_clock();
  if (!plays) {
    state.holds.reset();
    on_joining(viewer, ack, now_ns);
  } else if (resumes) {
    state.holds = ack.applied;
    resume(viewer);
  }
  return std::nullopt;
}

// A viewer's figures are its own word; where and what it plays is not, nor is an id under which another one
// came before.
void Gateway::report(Viewer& viewer, transport::ClientStatusMessage&& status, std::int64_t now_ns) {
  const bool taken = std::ranges::any_of(viewers_, [&viewer](const auto& other) {
    return other.first < viewer.id && other.second.client == viewer.client;
  });
  if (taken || !session_ || session_->streams.empty() || !alive_ || status.epoch != session_->epoch ||
      !viewer.reports.take(now_ns))
    return;
  status.session = session_->session;
  status.stream = session_->streams.front().id;
  status.role = static_cast<std::uint32_t>(role_of(viewer));
  status.phase = static_cast<std::uint32_t>(viewer.now.phase);
  world_.report(status);
}

void Gateway::on_joining(Viewer& viewer, const transport::AckMessage& ack, std::int64_t now_ns) {
  Viewer::InEpoch& state = viewer.now;
  state.attempt = ack.join_attempt;
  state.passage.acknowledged(ack, now_ns);
  if (state.flow == Viewer::Flow::kWaiting || state.served_attempt == state.attempt) return;
  // The snapshot that is on its way also answers a repeated request.
  if (state.passage.unfinished()) {
    state.served_attempt = state.attempt;
    return;
  }
  if (state.served_attempt && !viewer.snapshots_again.take(now_ns)) return;
  state.flow = Viewer::Flow::kWaiting;
  if (!collecting_since_ns_) collecting_since_ns_ = now_ns;
}

void Gateway::take(Viewer& viewer, transport::InputMessage&& input, std::int64_t now_ns) {
  ++counts_.inputs;
  Viewer::InEpoch& state = viewer.now;
  const accounts::InputClaim claim{viewer.id, input.number, input.kind};
  if (!session_ || input.epoch != session_->epoch) {
    ++counts_.inputs_refused;
    state.once = Reason::kStaleEpoch;
    state.reply.on_outcome();
    return;
  }
  if (input.number <= state.highest) {
    // The first outcome of a number is the one that counts.
    const bool first =
        !state.outcomes.has(input.number) && !std::ranges::binary_search(state.undecided, input.number);
    if (first) refuse_input(viewer, {.reason = Reason::kDuplicate, .claim = claim}, now_ns);
    return;
  }
  state.highest = input.number;
  if (const Reason reason = check(viewer, input, now_ns); reason != Reason::kNone) {
    accounts::InputVerdict verdict{.reason = reason, .claim = claim};
    if (reason == Reason::kObserver && !viewer.may_act)
      verdict.text =
          "the token's role is watch, so no " + std::string(input_kind_name(input.kind)) + " is taken";
    return refuse_input(viewer, verdict, now_ns);
  }
  TANDEM_ASSERT(state.undecided.empty() || state.undecided.back() < input.number);
  state.undecided.push_back(input.number);
  merger_.add(viewer.id, std::move(input), world_, now_ns, verdicts_);
  tell(verdicts_, now_ns);
}

Reason Gateway::check(Viewer& viewer, const transport::InputMessage& input, std::int64_t now_ns) const {
  const Viewer::InEpoch& state = viewer.now;
  if (!viewer.inputs.take(now_ns)) return Reason::kRateLimited;
  if (viewer.address_inputs && !viewer.address_inputs->take(now_ns)) return Reason::kRateLimited;
  if (!viewer.may_act) return Reason::kObserver;
  if (state.phase != Phase::kPlaying || !world_.playing()) return Reason::kNotPlaying;
  if (state.wanted == Role::kObserver) return Reason::kObserver;
  if (world_.role() == Role::kObserver) return Reason::kDemoted;
  if (!following::InputMerger::well_formed(input)) return Reason::kInvalid;
  if (!is_gravity(input) && !viewer.other_inputs.take(now_ns)) return Reason::kRateLimited;
  if (state.undecided.size() >= kMaxUndecided) return Reason::kRateLimited;
  return Reason::kNone;
}

Role Gateway::role_of(const Viewer& viewer) const {
  return world_.role() == Role::kObserver || !viewer.may_act ? Role::kObserver : viewer.now.wanted;
}

void Gateway::refuse_input(Viewer& viewer, const accounts::InputVerdict& verdict, std::int64_t now_ns) {
  ++counts_.inputs_refused;
  InputCount& count = viewer.tally[input_kind_name(verdict.claim.kind)];
  ++count.refused;
  count.reason = verdict.reason;
  viewer.now.outcomes.add(
      {.number = verdict.claim.number, .frame = 0, .code = static_cast<std::uint32_t>(verdict.reason)},
      now_ns, verdict.text);
  viewer.now.reply.on_outcome();
}

void Gateway::tell(std::vector<accounts::InputVerdict>& verdicts, std::int64_t now_ns) {
  using Fate = accounts::InputVerdict::Fate;
  for (const accounts::InputVerdict& verdict : verdicts) {
    const auto found = viewers_.find(verdict.claim.sender);
    if (found == viewers_.end()) continue;
    Viewer& viewer = found->second;
    std::erase(viewer.now.undecided, verdict.claim.number);
    viewer.now.reply.on_outcome();
    if (verdict.fate == Fate::kLost) {
      viewer.now.outcomes.take_back(verdict.claim.number);
      viewer.now.lost.push_back(verdict.claim.number);
    }
    if (verdict.fate != Fate::kDecided) continue;
    if (verdict.reason != Reason::kNone) {
      refuse_input(viewer, verdict, now_ns);
    } else {
      ++viewer.tally[input_kind_name(verdict.claim.kind)].acted;
      viewer.now.hurries = true;
      viewer.now.outcomes.add({.number = verdict.claim.number, .frame = verdict.acts_on, .code = 0}, now_ns);
    }
  }
  verdicts.clear();
}

}  // namespace tandem::gateway
