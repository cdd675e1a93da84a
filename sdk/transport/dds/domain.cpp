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
#include "sdk/transport/limits.hpp"
#include "sdk/transport/plain_text.hpp"

namespace tandem::transport::dds {
namespace {

struct Domains {
  struct Use {
    dds_entity_t handle = 0;  // 0: created by others, so not deleted here
    unsigned users = 0;
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
  return "<CycloneDDS><Domain id=\"any\"><Discovery>"
         "<LeaseDuration>45s</LeaseDuration>"
         "<SPDPInterval>5s</SPDPInterval>"
         "<MaxAutoParticipantIndex>100</MaxAutoParticipantIndex>"
         "</Discovery>"
         "<Sizing><ReceiveBufferSize>256 KiB</ReceiveBufferSize></Sizing>"
         "<Internal>"
         "<NackDelay>" +
         std::string(repeat == Repeat::kSoon ? "10" : "100") +
         "ms</NackDelay>"
         "<MaxSampleSize>" +
         std::to_string(kMaxSampleBytes + (1U << 20U)) +
         " B</MaxSampleSize></Internal></Domain></CycloneDDS>";
}

}  // namespace

std::string domain_configuration(Repeat repeat) {
  std::string configuration = defaults(repeat);
  if (const char* theirs = std::getenv("CYCLONEDDS_URI"); theirs != nullptr && *theirs != '\0') {
    configuration += ',';
    configuration += theirs;
  }
  return configuration;
}

Result<DomainUse> DomainUse::acquire(std::uint32_t domain, Repeat repeat) {
  const std::lock_guard lock(domains().mutex);
  if (const auto known = domains().uses.find(domain); known != domains().uses.end()) {
    ++known->second.users;
    return DomainUse(domain);
  }
  const dds_entity_t handle = dds_create_domain(domain, domain_configuration(repeat).c_str());
  if (handle < 0 && handle != DDS_RETCODE_PRECONDITION_NOT_MET) {
    return fail(ErrorCode::kTransport, "DDS domain " + std::to_string(domain) + " cannot be opened (" +
                                           dds_strretcode(handle) +
                                           "): check CYCLONEDDS_URI, the interfaces it names and the number");
  }
  domains().uses.emplace(domain, Domains::Use{handle > 0 ? handle : 0, 1});
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
  if (use->second.handle > 0 && dds_lookup_participant(domain_, nullptr, 0) == 0)
    dds_delete(use->second.handle);
  domains().uses.erase(use);
}

}  // namespace tandem::transport::dds

namespace tandem::transport {

namespace {

using WriteLine = void (*)(std::string_view line, bool error);
// Cyclone gives back only an address of data, and a function is none.
WriteLine write_line = nullptr;

// Anybody can make Cyclone complain of packets as fast as he sends them, in his own bytes.
class Complaints {
 public:
  void take(std::string_view line) {
    const std::lock_guard lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    const double passed_s = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    allowed_ = std::min(kBurst, allowed_ + passed_s * kPerSecond);
    if (allowed_ < 1) {
      ++left_out_;
      return;
    }
    allowed_ -= 1;
    std::string text = plain_text(line, kMostBytes);
    if (left_out_ > 0) text += " (" + std::to_string(left_out_) + " lines before it were left out)";
    left_out_ = 0;
    write_line(text, false);
  }

 private:
  static constexpr double kPerSecond = 1, kBurst = 50;
  static constexpr std::size_t kMostBytes = 240;

  std::mutex mutex_;
  double allowed_ = kBurst;
  std::uint64_t left_out_ = 0;
  std::chrono::steady_clock::time_point last_;
};

void on_line(void* /*argument*/, const dds_log_data_t* data) {
  static auto* const complaints = new Complaints;  // Cyclone's threads may outlive static objects
  std::string_view line(data->message);
  while (!line.empty() && line.back() == '\n') line.remove_suffix(1);
  if ((data->priority & DDS_LC_FATAL) != 0) return write_line(line, true);
  complaints->take(line);
}

}  // namespace

void set_dds_log(WriteLine write) {
  write_line = write;
  dds_set_log_sink(&on_line, nullptr);
}

Result<void> check_dds_domain(std::uint32_t domain, const std::function<void()>& while_open) {
  return dds::DomainUse::acquire(domain, dds::Repeat::kSeldom).map([&](const dds::DomainUse&) {
    if (while_open) while_open();
  });
}

}  // namespace tandem::transport
