#include "sdk/transport/dds/security.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>
#include <string_view>
#include <vector>

#include "sdk/transport/dds/dds_ports.hpp"
#include "sdk/transport/secure/handshake_watch.hpp"
#include "sdk/wire/clock.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::transport::dds {
namespace {

struct Need {
  const char* doing;
  std::vector<std::string_view> roles;  // the first is the usual one; empty: all
};

Need need_of(Purpose purpose) {
  switch (purpose) {
    case Purpose::kServe:
      return {"a server", {"server"}};
    case Purpose::kAct:
      return {"a client that sends inputs", {"participant", "gateway"}};
    case Purpose::kObserve:
      return {"a client that only watches", {kObserverRole, "participant", "gateway"}};
    case Purpose::kWatch:
      break;
  }
  return {"", {}};
}

Result<void> check_role(const secure::Identity& identity, Purpose purpose) {
  const Need need = need_of(purpose);
  const auto is = [&](std::string_view role) { return role == identity.role; };
  if (identity.role.empty() || need.roles.empty() || std::ranges::any_of(need.roles, is)) return {};
  const bool watches = purpose == Purpose::kAct && identity.role == kObserverRole;
  return fail(ErrorCode::kInvalidArgument, identity.folder + " is the identity of role " + identity.role +
                                               ", and " + need.doing + " needs another: `tandem pki issue " +
                                               std::string(need.roles.front()) + " NAME`" +
                                               (watches ? ", or join as an observer" : ""));
}

}  // namespace

Result<secure::Identity> suitable_identity(const std::string& folder, Purpose purpose) {
  auto identity = secure::check_identity_folder(folder, wall_ns() / kSecond);
  if (!identity) return identity;
  if (auto suits = check_role(*identity, purpose); !suits) return tl::unexpected(suits.error());
  return identity;
}

Result<secure::Identity> use_identity(const std::string& folder, Purpose purpose, dds_qos_t* qos) {
  auto identity = suitable_identity(folder, purpose);
  if (!identity) return identity;

  constexpr std::array<std::array<const char*, 2>, 3> kPlugins = {{{"dds.sec.auth", "authentication"},
                                                                   {"dds.sec.access", "access_control"},
                                                                   {"dds.sec.crypto", "crypto"}}};
  constexpr std::array<const char*, 3> kLibraries = {"dds_security_auth", "dds_security_ac",
                                                     "dds_security_crypto"};
  for (std::size_t i = 0; i < kPlugins.size(); ++i) {
    const std::string library = std::string(kPlugins[i][0]) + ".library.";
    dds_qset_prop(qos, (library + "path").c_str(), kLibraries[i]);
    dds_qset_prop(qos, (library + "init").c_str(), (std::string("init_") + kPlugins[i][1]).c_str());
    dds_qset_prop(qos, (library + "finalize").c_str(), (std::string("finalize_") + kPlugins[i][1]).c_str());
  }
  const auto set_file = [&](const char* property, const char* name) {
    dds_qset_prop(qos, property, ("file:" + identity->folder + "/" + name).c_str());
  };
  set_file("dds.sec.auth.identity_ca", secure::kIdentityCa);
  set_file("dds.sec.auth.private_key", secure::kKey);
  set_file("dds.sec.auth.identity_certificate", secure::kCertificate);
  set_file("dds.sec.access.permissions_ca", secure::kPermissionsCa);
  set_file("dds.sec.access.governance", secure::kGovernance);
  set_file("dds.sec.access.permissions", secure::kPermissions);
  set_file("org.eclipse.cyclonedds.sec.auth.crl", secure::kRevoked);
  return identity;
}

}  // namespace tandem::transport::dds

namespace tandem::transport {
namespace {

class Fault {
 public:
  std::string look() {
    const std::int64_t now_ns = steady_ns();
    if (!found_ && now_ns >= next_ns_.load(std::memory_order_relaxed)) {
      const std::lock_guard lock(mutex_);
      next_ns_.store(now_ns + 2 * kSecond, std::memory_order_relaxed);
      if (watch_.stuck(secure::threads_of_this_process(), now_ns)) found_ = true;
    }
    if (!found_) return {};
    return "Cyclone DDS hears nothing any more: its handshakes of DDS Security spin, which only a new process mends";
  }

 private:
  std::mutex mutex_;
  secure::HandshakeWatch watch_;
  std::atomic<std::int64_t> next_ns_ = 0;
  std::atomic<bool> found_ = false;
};

}  // namespace

Result<void> check_dds_identity(const DdsOptions& options) {
  if (options.secure.empty()) return {};
  return dds::suitable_identity(options.secure, dds::Purpose::kServe)
      .map([](const secure::Identity& /*good*/) {});
}

std::string dds_fault() {
  static auto* const fault = new Fault;  // a program's guard may outlive static objects
  return fault->look();
}

}  // namespace tandem::transport
