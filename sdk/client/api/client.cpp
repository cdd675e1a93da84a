// Implements joining, events and input of tandem.h.
#include <cmath>
#include <string>
#include <type_traits>
#include <utility>

#include "sdk/client/api/clients.hpp"
#include "sdk/client/api/clock.hpp"
#include "sdk/client/api/join.hpp"
#include "sdk/client/api/ports.hpp"
#include "sdk/client/api/structs.hpp"
#include "sdk/client/session/reply_reason.hpp"
#include "sdk/core/timeline/timeline.hpp"
#include "sdk/wire/client_id.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/workers/block_threads.hpp"
#include "sdk/workers/workers.hpp"

namespace tandem::api {

Registry<RunningClient>& clients() {
  static auto* const all = new Registry<RunningClient>;
  return *all;
}

namespace {

constexpr double kMaxDelayS = 1e-3 * transport::kMaxDelayMs;

static_assert(TANDEM_SEARCHING == static_cast<int>(ClientPhase::kSearching) &&
              TANDEM_REFUSED == static_cast<int>(ClientPhase::kRefused) &&
              TANDEM_JOINING == static_cast<int>(ClientPhase::kJoining) &&
              TANDEM_PLAYING == static_cast<int>(ClientPhase::kPlaying));
static_assert(TANDEM_OBSERVER == static_cast<int>(ClientRole::kObserver) &&
              TANDEM_PARTICIPANT == static_cast<int>(ClientRole::kParticipant));
static_assert(TANDEM_LOG_INFO == static_cast<int>(LogLevel::kInfo) &&
              TANDEM_LOG_WARNING == static_cast<int>(LogLevel::kWarning) &&
              TANDEM_LOG_ERROR == static_cast<int>(LogLevel::kError));

// A gateway has one session, and any will do.
const char* session_of(const tandem_options& options) {
  if (options.session != nullptr) return options.session;
  return options.url != nullptr ? "" : "default";
}

tandem_result read_options(const tandem_options* theirs, tandem_options& ours) {
  if (theirs != nullptr) {
    if (const auto read = read_struct(theirs, ours); read != TANDEM_OK) return read;
  }
  if (ours.session != nullptr) {
    if (const auto named = transport::check_session_name(ours.session); !named) return refuse(named.error());
  }
  if (ours.domain > kMaxDomain) return refuse(TANDEM_INVALID_ARGUMENT, "a DDS domain must be 0 to 230");
  if (ours.role != TANDEM_OBSERVER && ours.role != TANDEM_PARTICIPANT) {
    return refuse(TANDEM_INVALID_ARGUMENT, "a role must be TANDEM_OBSERVER or TANDEM_PARTICIPANT");
  }
  if (ours.lead > kMaxLead) return refuse(TANDEM_INVALID_ARGUMENT, "a lead must be 0 or 1");
  if (ours.background > 1 || ours.echo > 1) {
    return refuse(TANDEM_INVALID_ARGUMENT, "background and echo must be 0 or 1");
  }
  if (ours.reserved != 0 || ours.reserved_too != 0)
    return refuse(TANDEM_UNSUPPORTED, "this library knows no option in `reserved`");
  if (ours.threads > kMaxThreads) return refuse(TANDEM_INVALID_ARGUMENT, "threads must be 1 to 64");
  if (!(ours.max_delay_s >= 0 && ours.max_delay_s <= kMaxDelayS))
    return refuse(TANDEM_INVALID_ARGUMENT, "max_delay_s must be 0 to 1");
  if (ours.max_kbit_s != 0 && !transport::is_cap(ours.max_kbit_s))
    return refuse(TANDEM_INVALID_ARGUMENT, "max_kbit_s must be 0, for no cap, or 16 to 10,000,000");
  return kOk;
}

client::CoreOptions core_options(const tandem_options& options) {
  client::CoreOptions core;
  core.session = session_of(options);
  core.id = transport::random_client_id();
  core.role = static_cast<transport::Role>(options.role);
  core.lead = options.lead;
  core.echo = options.echo != 0;
  core.run_blocks = blocks_on_threads(options.threads, Callers::kMany);
  if (options.prefer != nullptr) core.prefer = options.prefer;
  if (options.max_delay_s > 0)
    core.max_delay_ms = static_cast<std::uint32_t>(std::lround(options.max_delay_s * 1e3));
  core.cap_kbit_s = options.max_kbit_s;
  core.gateway_caps = options.url != nullptr;
  core.measure_ns = transport::steady_ns;
  if (options.log != nullptr) {
    core.log = [log = options.log, user = options.user](LogLevel level, std::string_view line) {
      const std::string text(line);
      const CallbackScope scope;
      log(user, static_cast<tandem_log_level>(level), text.c_str());
    };
  }
  return core;
}

tandem_result add_client(const tandem_options& options, client::CoreOptions core,
                         std::unique_ptr<transport::ClientPort> port, RunningClient::Clock clock,
                         tandem_client* client) {
  *client = clients().add(std::make_unique<RunningClient>(
      std::move(core), std::move(port), clock != nullptr ? clock : client::now, options.background != 0));
  return kOk;
}

tandem_result send(tandem_client handle, transport::InputKind kind, std::vector<double> values,
                   transport::Bytes bytes, std::uint64_t* number) {
  return with_client(handle, [&](RunningClient& client) {
    const auto sent = client.send(kind, std::move(values), std::move(bytes));
    if (!sent) return refuse(sent.error());
    if (number != nullptr) *number = *sent;
    return kOk;
  });
}

struct CopyFigure {
  template <class To, class From>
  void operator()(const char* /*name*/, To& to, const From& from) const {
    static_assert(std::is_same_v<To, From>, "tandem_status has a figure in another type than ClientFigures");
    to = from;
  }
};

struct CopyState {
  template <class To, class From>
  void operator()(const char* /*name*/, To& to, const From& from) const {
    if constexpr (std::is_array_v<To>) {
      write_text(from, to);
    } else {
      to = static_cast<To>(from);
    }
  }
};

// Size of the members of tandem_status that are in no list.
constexpr std::size_t kOtherStatusBytes = sizeof tandem_status::size + sizeof tandem_status::events_dropped;
constexpr std::size_t listed_status_bytes() {
  std::size_t bytes = kOtherStatusBytes;
  const tandem_status status = TANDEM_STATUS_INIT;
  const auto add = [&bytes](const char*, const auto& member) { bytes += sizeof member; };
  each_client_figure(add, status);
  each_client_state(add, status);
  return bytes;
}
static_assert(listed_status_bytes() == sizeof(tandem_status),
              "tandem_status has a member that is in no list: name it in tandem/client_figures.hpp");

}  // namespace

tandem_result join_over(std::unique_ptr<transport::ClientPort> port, RunningClient::Clock clock,
                        const tandem_options* options, tandem_client* client) noexcept {
  return call([&] {
    if (client == nullptr) return null_pointer("`client` is null");
    tandem_options ours = TANDEM_OPTIONS_INIT;
    if (const auto read = read_options(options, ours); read != TANDEM_OK) return read;
    return add_client(ours, core_options(ours), std::move(port), clock, client);
  });
}

}  // namespace tandem::api

using namespace tandem;  // what follows is C
using namespace tandem::api;

tandem_result tandem_join(const tandem_options* options, tandem_client* client) noexcept {
  return call([&] {
    if (client == nullptr) return null_pointer("`client` is null");
    if (in_forked_child()) return forked_child();
    tandem_options ours = TANDEM_OPTIONS_INIT;
    if (const auto read = read_options(options, ours); read != TANDEM_OK) return read;
    auto core = core_options(ours);
    auto port = open_port(ours, core.session, core.id);
    if (!port) return refuse(port.error());
    return add_client(ours, std::move(core), std::move(*port), nullptr, client);
  });
}

tandem_result tandem_leave(tandem_client client) noexcept {
  return call([&] {
    const auto left = clients().remove(client, [](RunningClient& ending) { ending.end(); });
    if (left == nullptr) return refuse(TANDEM_INVALID_HANDLE, "no such client, or it was closed");
    return kOk;
  });
}

tandem_result tandem_update(tandem_client client, double wait_s) noexcept {
  return with_client(client, [&](RunningClient& running) {
    if (std::isnan(wait_s)) return refuse(TANDEM_INVALID_ARGUMENT, "a time to wait is a number");
    const auto updated = running.update(wait_s);
    return updated ? kOk : refuse(updated.error());
  });
}

tandem_result tandem_wait_until_playing(tandem_client client, double timeout_s) noexcept {
  return with_client(client, [&](RunningClient& running) {
    if (std::isnan(timeout_s)) return refuse(TANDEM_INVALID_ARGUMENT, "a time to wait is a number");
    const auto played = running.wait_until_playing(timeout_s);
    return played ? kOk : refuse(played.error());
  });
}

tandem_result tandem_prefer(tandem_client client, const char* prefer) noexcept {
  return with_client(client, [&](RunningClient& running) {
    if (prefer == nullptr) return null_pointer("`prefer` is null");
    const auto preferred = running.prefer(prefer);
    return preferred ? kOk : refuse(preferred.error());
  });
}

tandem_result tandem_get_status(tandem_client client, tandem_status* status) noexcept {
  return with_client(client, [&](RunningClient& running) {
    if (const auto checked = check_struct(status); checked != TANDEM_OK) return checked;
    const auto known = running.status();
    if (!known) return refuse(known.error());
    const ClientStatus& s = *known;
    tandem_status out = TANDEM_STATUS_INIT;
    each_client_figure(CopyFigure{}, out, s);
    each_client_state(CopyState{}, out, s);
    out.events_dropped = running.events_dropped();
    write_struct(out, status);
    return kOk;
  });
}

tandem_result tandem_next_event(tandem_client client, tandem_event* event) noexcept {
  return with_client(client, [&](RunningClient& running) {
    if (const auto checked = check_struct(event); checked != TANDEM_OK) return checked;
    const auto next = running.next_event();
    if (!next) return refuse(TANDEM_NOT_READY, "no event");
    tandem_event out = TANDEM_EVENT_INIT;
    out.kind = next->kind;
    out.number = next->number;
    out.frame = next->frame;
    out.epoch = next->epoch;
    out.at_ns = next->at_ns;
    out.reason = next->reason;
    out.dropped = next->dropped;
    write_text(next->text.empty() ? client::describe(next->reason) : next->text, out.text);
    write_struct(out, event);
    return kOk;
  });
}

tandem_result tandem_send_gravity(tandem_client client, const double scene_units_per_s2[3],
                                  uint64_t* number) noexcept {
  if (scene_units_per_s2 == nullptr) return null_pointer("`scene_units_per_s2` is null");
  return call([&] {
    return send(client, transport::InputKind::kGravity, {scene_units_per_s2, scene_units_per_s2 + 3}, {},
                number);
  });
}

tandem_result tandem_send_push(tandem_client client, const double centre[3], double radius,
                               const double velocity[3], uint64_t* number) noexcept {
  if (centre == nullptr || velocity == nullptr) return null_pointer("`centre` or `velocity` is null");
  return call([&] {
    return send(client, transport::InputKind::kPush,
                {centre[0], centre[1], centre[2], radius, velocity[0], velocity[1], velocity[2]}, {}, number);
  });
}

tandem_result tandem_send_seek(tandem_client client, double seconds, uint64_t* number) noexcept {
  return call([&] { return send(client, transport::InputKind::kSeek, {seconds}, {}, number); });
}

tandem_result tandem_send_bytes(tandem_client client, const void* bytes, size_t count,
                                uint64_t* number) noexcept {
  if (bytes == nullptr && count != 0) return null_pointer("`bytes` is null");
  if (count > transport::kMaxInputBytes) {
    return refuse(TANDEM_INVALID_ARGUMENT, "an input holds at most 1,024 bytes");
  }
  return call([&] {
    const auto* first = static_cast<const std::byte*>(bytes);
    return send(client, transport::InputKind::kApplication, {},
                count == 0 ? transport::Bytes{} : transport::Bytes(first, first + count), number);
  });
}
