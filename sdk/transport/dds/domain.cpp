#include "sdk/transport/dds/domain.hpp"

#include <dds/dds.h>
#include <dds/ddsrt/log.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <map>
#include <mutex>
#include <string_view>
#include <utility>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/network/bound_network.hpp"
#include "sdk/transport/network/profile.hpp"
#include "sdk/transport/network/wire_bytes.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/wire/limits.hpp"
#include "sdk/wire/plain_text.hpp"

namespace tandem::transport::dds {
namespace {

struct Domains {
  struct Use {
    dds_entity_t handle = 0;  // 0: created by others, so not deleted here
    unsigned users = 0;
    std::string profile = {};
    Side side = Side::kClient;
    BoundNetwork network = {};
    bool told_gone = false;  // that its network is
  };
  std::mutex mutex;
  std::map<std::uint32_t, Use> uses;
};

// Cyclone keeps one table of domains per process; this counts the uses of it here. It is never destroyed, so
// that a static object can still close its port.
Domains& domains() {
  static auto* const all = new Domains;
  return *all;
}

// Reasons and effects: idl/PROTOCOL.md, "Cyclone DDS configuration".
std::string defaults(Repeat repeat) {
  const bool serves = repeat == Repeat::kSoon;
  return "<CycloneDDS><Domain id=\"any\"><Discovery>"
         "<LeaseDuration>45s</LeaseDuration>"
         "<SPDPInterval>" +
         std::to_string(DdsWire::kAnnouncedS) +
         "s</SPDPInterval>"
         "<MaxAutoParticipantIndex>100</MaxAutoParticipantIndex>"
         "</Discovery>"
         "<Sizing><ReceiveBufferSize>256 KiB</ReceiveBufferSize></Sizing>"
         "<Internal>"
         "<HeartbeatInterval>" +
         std::to_string(serves ? DdsWire::kServerHeartbeatMs : DdsWire::kClientHeartbeatMs) +
         "ms</HeartbeatInterval>"
         "<NackDelay>" +
         std::string(serves ? "10" : "100") +
         "ms</NackDelay>"
         "<MaxSampleSize>" +
         std::to_string(kMaxSampleBytes + (1U << 20U)) +
         " B</MaxSampleSize></Internal></Domain></CycloneDDS>";
}

Side side_of(Repeat repeat) { return repeat == Repeat::kSoon ? Side::kServer : Side::kClient; }

Result<Profile> profile_here(std::uint32_t domain, Side side, const std::string& text,
                             const Surroundings& machine) {
  auto profile = parse_profile(text, side);
  if (!profile) return fail(profile.error().code, "profile: " + profile.error().message);
  return resolve_profile(std::move(*profile), side, domain, machine);
}

/// Whether a further port may use a domain that this process has opened before.
Result<void> check_same(const Domains::Use& before, const std::string& profile, Side side,
                        std::uint32_t domain) {
  const std::string opened = "this process has opened DDS domain " + std::to_string(domain);
  if (before.profile != profile) {
    return fail(ErrorCode::kInvalidArgument,
                opened + " with " +
                    (before.profile.empty() ? "no profile" : "the profile " + before.profile) +
                    "; it can have one only");
  }
  if (!profile.empty() && side == Side::kServer && before.side == Side::kClient) {
    return fail(ErrorCode::kInvalidArgument,
                opened + " for a client, with the profile " + profile + ": start its server first");
  }
  return {};
}

std::string cannot_open(std::uint32_t domain, dds_return_t why, const std::string& profile) {
  std::string text =
      "DDS domain " + std::to_string(domain) + " cannot be opened (" + dds_strretcode(why) + "): ";
  if (profile.empty()) return text + "check CYCLONEDDS_URI, the interfaces it names and the number";
  return text + "Cyclone DDS refuses the profile " + profile;
}

/// What acquire() passes to Cyclone DDS.
struct Configuration {
  std::string xml;
  Binding binding;
};

Result<Configuration> configuration_of(std::uint32_t domain, Repeat repeat, const std::string& profile) {
  Configuration configuration{.xml = defaults(repeat), .binding = {}};
  if (!profile.empty()) {
    const auto here = profile_here(domain, side_of(repeat), profile, surroundings());
    if (!here) return tl::unexpected(here.error());
    configuration.xml += ',' + profile_xml(*here, side_of(repeat));
    configuration.binding.interfaces = here->interfaces;
    const auto wish = parse_profile(profile, side_of(repeat));
    configuration.binding.chosen_by_user = wish->name == "loopback" || !wish->interfaces.empty();
  } else if (const char* theirs = std::getenv("CYCLONEDDS_URI"); theirs != nullptr && *theirs != '\0') {
    configuration.xml += ',';
    configuration.xml += theirs;
    configuration.binding.chosen_by_user = true;
  } else if (only_v6(interfaces())) {  // Cyclone DDS itself would stay on loopback
    configuration.xml +=
        ",<CycloneDDS><Domain id=\"any\"><General><Transport>udp6</Transport></General></Domain></CycloneDDS>";
  }
  return configuration;
}

}  // namespace

Result<DomainUse> DomainUse::acquire(std::uint32_t domain, Repeat repeat, const std::string& profile) {
  const Side side = side_of(repeat);
  const std::lock_guard lock(domains().mutex);
  if (const auto known = domains().uses.find(domain); known != domains().uses.end()) {
    if (auto same = check_same(known->second, profile, side, domain); !same)
      return tl::unexpected(same.error());
    if (known->second.network.look(steady_ns()) == NetworkState::kMoved)
      return fail(ErrorCode::kTransport,
                  known->second.network.line() + "; others in this process still use it");
    ++known->second.users;
    if (side == Side::kServer) known->second.side = side;
    return DomainUse(domain);
  }
  const auto configuration = configuration_of(domain, repeat, profile);
  if (!configuration) return tl::unexpected(configuration.error());
  BoundNetwork network;
  const dds_entity_t handle = dds_create_domain(domain, configuration->xml.c_str());
  const bool of_others = handle == DDS_RETCODE_PRECONDITION_NOT_MET;
  if (handle < 0 && !of_others) {
    return fail(ErrorCode::kTransport, cannot_open(domain, handle, profile));
  }
  if (of_others && !profile.empty()) {
    return fail(ErrorCode::kInvalidArgument,
                "profile: this process has DDS domain " + std::to_string(domain) +
                    " open already, not by Tandem, so that the profile " + profile + " would have no effect");
  }
  if (!of_others) network.opened(configuration->binding);
  domains().uses.emplace(domain, Domains::Use{of_others ? 0 : handle, 1, profile, side, std::move(network)});
  return DomainUse(domain);
}

DomainUse::DomainUse(DomainUse&& other) noexcept
    : domain_(other.domain_), held_(std::exchange(other.held_, false)) {}

DomainUse::~DomainUse() {
  if (!held_) return;
  const std::lock_guard lock(domains().mutex);
  const auto use = domains().uses.find(domain_);
  if (--use->second.users > 0) return;
  // Another library of this process, or the application itself, may have participants in it.
  if (use->second.handle > 0 && dds_lookup_participant(domain_, nullptr, 0) == 0) {
    const Knocking knocking(use->second.network.ports());
    dds_delete(use->second.handle);
  }
  domains().uses.erase(use);
}

NetworkState DomainUse::network() const {
  const std::lock_guard lock(domains().mutex);
  return domains().uses.at(domain_).network.look(steady_ns());
}

std::string DomainUse::network_line() const {
  const std::lock_guard lock(domains().mutex);
  return domains().uses.at(domain_).network.line();
}

}  // namespace tandem::transport::dds

namespace tandem::transport {

namespace {

using WriteLine = void (*)(std::string_view line, bool error);
// Cyclone gives back only an address of data, and a function is none.
WriteLine write_line = nullptr;

}  // namespace

NetworkState dds_server_network(std::string* line) {
  NetworkState worst = NetworkState::kThere;
  // A program's guard must not wait for a domain that is being opened or ended.
  const std::unique_lock lock(dds::domains().mutex, std::try_to_lock);
  if (!lock) return worst;
  for (auto& [domain, use] : dds::domains().uses) {
    if (use.side != Side::kServer) continue;
    const NetworkState state = use.network.look(steady_ns());
    const bool gone = state == NetworkState::kGone;
    if (state != NetworkState::kMoved && gone != std::exchange(use.told_gone, gone) && write_line != nullptr)
      write_line(gone ? use.network.line() + ", and nobody can join"
                      : "the network address that DDS is bound to is back",
                 false);
    if (state <= worst) continue;
    worst = state;
    if (line != nullptr) *line = use.network.line();
  }
  return worst;
}

std::string dds_start_notice() {
  const std::lock_guard lock(dds::domains().mutex);
  for (const auto& [domain, use] : dds::domains().uses)
    if (use.side == Side::kServer && use.network.awaits_network())
      return "there is no network yet, so DDS uses loopback alone until there is one (--profile loopback: always)";
  return {};
}

std::string dds_outdated() {
  std::string why;
  if (dds_server_network(&why) != NetworkState::kMoved) return {};
  return why + ": this program ends, to be started again";
}

namespace {

/// The line that Cyclone DDS has for each datagram that cannot be sent, as the same words for all datagrams
/// to one address, with what it may mean; empty for any other line.
std::string unsendable(std::string_view line) {
  constexpr std::string_view kBefore = "ddsi_udp_conn_write to udp/", kBehind = " failed with retcode";
  const std::size_t begin = line.find(kBefore), end = line.find(kBehind);
  if (begin == std::string_view::npos || end == std::string_view::npos || end < begin + kBefore.size())
    return {};
  const std::string to(line.substr(begin + kBefore.size(), end - begin - kBefore.size()));
  std::string text = "datagrams to " + to + " cannot be sent";
  if (is_private(to.substr(0, to.find(':'))))
    text += "; if that is a client behind NAT, it needs external=ADDRESS in its --profile wan";
  return text;
}

// Anybody can make Cyclone complain of packets as fast as he sends them, in his own bytes; a neighbour with
// another authority's identity makes it say the same each second, for as long as he stays; and of datagrams
// that cannot be sent there can be a hundred a second.
class Complaints {
 public:
  void take(std::string_view line) {
    const std::lock_guard lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    const double passed_s = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    const std::string known = unsendable(line);
    std::uint64_t& left_out = known.empty() ? left_out_ : unsent_;
    allowed_ = std::min(kBurst, allowed_ + passed_s * kPerSecond);
    if (allowed_ < 1) {
      ++left_out;
      return;
    }
    std::string text = plain_text(known.empty() ? line : known, kMaxBytes);
    if (const auto told = told_.find(text); told != told_.end() && now - told->second < kInterval) {
      ++left_out;
      return;
    }
    if (told_.size() >= kMaxTold) told_.clear();
    told_[text] = now;
    allowed_ -= 1;
    if (left_out > 0) {
      text += " (" + std::to_string(left_out) +
              (known.empty() ? " lines before it were left out)" : " lines like it were left out)");
    }
    left_out = 0;
    write_line(text, false);
  }

 private:
  static constexpr double kPerSecond = 1, kBurst = 50;
  static constexpr std::size_t kMaxBytes = 240, kMaxTold = 256;
  static constexpr auto kInterval = std::chrono::minutes(1);  // before a line is repeated

  std::mutex mutex_;
  double allowed_ = kBurst;
  std::uint64_t left_out_ = 0, unsent_ = 0;  // so many unsendable datagrams hide no flood of other lines
  std::map<std::string, std::chrono::steady_clock::time_point> told_;
  std::chrono::steady_clock::time_point last_;
};

void on_line(void* complaints, const dds_log_data_t* data) {
  std::string_view line(data->message);
  while (!line.empty() && line.back() == '\n') line.remove_suffix(1);
  if ((data->priority & DDS_LC_FATAL) != 0) return write_line(line, true);
  static_cast<Complaints*>(complaints)->take(line);
}

}  // namespace

void set_dds_log(WriteLine write) {
  write_line = write;
  dds_set_log_sink(&on_line, new Complaints);  // for as long as the process lives, as the sink
}

std::string refusal_of_profile(const std::string& text, Side side) {
  const auto profile = parse_profile(text, side);
  return profile ? std::string() : profile.error().message;
}

Result<void> check_dds_profile(const DdsOptions& options) {
  if (options.profile.empty()) return {};
  Surroundings machine = surroundings();
  machine.port_taken = [](std::uint32_t /*port*/) { return false; };  // by the server that runs, perhaps
  return dds::profile_here(options.domain, Side::kServer, options.profile, machine)
      .map([](const Profile& /*here*/) {});
}

std::string describe_dds_profile(std::uint32_t domain, const std::string& profile, Side side) {
  if (profile.empty()) return {};
  Surroundings machine = surroundings();
  machine.port_taken = [](std::uint32_t /*port*/) { return false; };  // by the caller itself, perhaps
  const auto here = dds::profile_here(domain, side, profile, machine);
  if (!here) return {};
  std::string text = describe(*here, side, domain, machine);
  const char* const theirs = std::getenv("CYCLONEDDS_URI");
  if (theirs != nullptr && *theirs != '\0') text += "; CYCLONEDDS_URI is set too, and not used";
  return text;
}

}  // namespace tandem::transport
