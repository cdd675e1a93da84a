#include "services/credentials/pki/authority.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <set>
#include <utility>

#include "sdk/transport/secure/identity_folder.hpp"
#include "services/credentials/pki/files.hpp"
#include "services/credentials/tokens/secret_file.hpp"
#include "services/program/json/json.hpp"
#include "services/program/system/file_lock.hpp"

namespace tandem::pki {
namespace {

namespace secure = transport::secure;

constexpr const char* kIdentityKey = "identity_ca.key";
constexpr const char* kPermissionsKey = "permissions_ca.key";
constexpr const char* kRegister = "register.json";
constexpr std::size_t kMaxRegisterBytes = 1U << 20U;
constexpr const char* kFolder = "authority";

bool exists(const std::string& path) {
  struct stat about {};
  return ::stat(path.c_str(), &about) == 0;
}

Result<system::Descriptor> lock(const std::string& folder) {
  system::Descriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!opened.is_open())
    return fail(ErrorCode::kIo, folder + ": is no folder that can be read: `tandem pki init` makes it");
  if (const auto holder = system::lock_or_holder(opened.get(), system::LockKind::kExclusive))
    return fail(ErrorCode::kConflict, folder + ": " + *holder + " works with it");
  return opened;
}

Result<Signer> read_signer(const std::string& certificate_file, const std::string& key_file) {
  const auto certificate = tokens::read_file(certificate_file, tokens::Others::kAnything);
  if (!certificate) return tl::unexpected(certificate.error());
  const auto key = tokens::read_file(key_file, tokens::Others::kNorTheirGroup);
  if (!key && key.error().code == ErrorCode::kInvalidArgument)
    return fail(key.error().code,
                key.error().message + ", and make new authorities if somebody may have read it");
  if (!key) return tl::unexpected(key.error());
  Signer signer{secure::read_certificate(*certificate), secure::read_key(*key)};
  if (signer.certificate == nullptr)
    return fail(ErrorCode::kInvalidArgument,
                certificate_file + ": is no whole certificate: restore it from a copy");
  if (signer.key == nullptr || X509_check_private_key(signer.certificate.get(), signer.key.get()) != 1)
    return fail(ErrorCode::kInvalidArgument,
                key_file + ": is not the key of its certificate: restore it from a copy");
  return signer;
}

}  // namespace

std::int64_t usual_days(Role role) { return role == Role::kServer || role == Role::kGateway ? 365 : 90; }

Result<void> check_identity_name(const std::string& name) {
  const auto good = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
  };
  if (name.empty() || name.size() > 64 || !std::ranges::all_of(name, good) || name[0] == '.' ||
      name[0] == '-' || name == kFolder)
    return fail(
        ErrorCode::kInvalidArgument,
        "a name is 1 to 64 of A-Z, a-z, 0-9, '.', '_' and '-', does not begin with '.' or '-', and is not "
        "'authority'");
  return {};
}

Result<Authority> Authority::init(const std::string& folder, std::int64_t now_s) {
  if (auto made = make_folder(folder); !made) return tl::unexpected(made.error());
  auto locked = lock(folder);
  if (!locked) return tl::unexpected(locked.error());
  Authority authority(folder, std::move(*locked));
  // The register is written last, so without it nothing was ever issued.
  if (exists(authority.own(kRegister)))
    return fail(ErrorCode::kConflict,
                folder + ": has authorities already, and what they issued would be void");
  if (auto made = authority.make(now_s); !made) return tl::unexpected(made.error());
  if (auto loaded = authority.load(); !loaded) return tl::unexpected(loaded.error());
  return authority;
}

Result<void> Authority::make(std::int64_t now_s) {
  const Validity valid{now_s - kBackdated, now_s + kAuthorityDays * kDay};
  auto identities = make_authority("tandem identity authority", valid);
  if (!identities) return tl::unexpected(identities.error());
  auto permissions = make_authority("tandem permissions authority", valid);
  if (!permissions) return tl::unexpected(permissions.error());
  const auto governance = sign_document(*permissions, governance_xml());
  if (!governance) return tl::unexpected(governance.error());
  const std::string folder = folder_ + "/" + kFolder;
  return make_folder(folder)
      .and_then([&] {
        return write_files(folder, {{kIdentityKey, key_pem(identities->key.get()), Readers::kOwner},
                                    {kPermissionsKey, key_pem(permissions->key.get()), Readers::kOwner},
                                    {secure::kIdentityCa, certificate_pem(identities->certificate.get())},
                                    {secure::kPermissionsCa, certificate_pem(permissions->certificate.get())},
                                    {secure::kGovernance, *governance}});
      })
      .and_then([&] { return write_register(); });
}

Result<Authority> Authority::open(const std::string& folder) {
  auto locked = lock(folder);
  if (!locked) return tl::unexpected(locked.error());
  Authority authority(folder, std::move(*locked));
  if (!exists(authority.own(kRegister)))
    return fail(ErrorCode::kIo, folder + ": has no authorities: `tandem pki init` makes them");
  if (auto loaded = authority.load(); !loaded) return tl::unexpected(loaded.error());
  return authority;
}

Result<void> Authority::load() {
  auto identities = read_signer(own(secure::kIdentityCa), own(kIdentityKey));
  if (!identities) return tl::unexpected(identities.error());
  auto permissions = read_signer(own(secure::kPermissionsCa), own(kPermissionsKey));
  if (!permissions) return tl::unexpected(permissions.error());
  auto governance = tokens::read_file(own(secure::kGovernance), tokens::Others::kAnything);
  if (!governance) return tl::unexpected(governance.error());
  const auto text = tokens::read_file(own(kRegister), tokens::Others::kAnything, kMaxRegisterBytes);
  if (!text) return tl::unexpected(text.error());
  const auto entries = Json::parse(*text);
  if (!entries)
    return fail(ErrorCode::kInvalidArgument, own(kRegister) + ": is not whole: restore it from a copy");
  identities_ = std::move(*identities);
  permissions_ = std::move(*permissions);
  governance_ = std::move(*governance);
  issued_.clear();
  for (const auto& [serial, entry] : entries->members()) {
    const auto role = read_role(entry["role"].text());
    if (!role) return fail(ErrorCode::kInvalidArgument, own(kRegister) + ": has a role that is not known");
    Issued one{entry["name"].text(), *role, serial, static_cast<std::int64_t>(entry["until_s"].number()), {}};
    if (!entry["revoked_s"].is_null()) one.revoked_s = static_cast<std::int64_t>(entry["revoked_s"].number());
    issued_.push_back(std::move(one));
  }
  return {};
}

Result<void> Authority::write_register() const {
  Json entries = Json::object();
  for (const Issued& one : issued_) {
    entries[one.serial] = Json{{"name", one.name},
                               {"role", role_name(one.role)},
                               {"until_s", one.until_s},
                               {"revoked_s", Json(one.revoked_s)}};
  }
  return write_file(own(kRegister), entries.dump() + "\n", Readers::kOwner);
}

std::int64_t Authority::until_s() const {
  return std::min(secure::seconds_of(X509_get0_notAfter(identities_.certificate.get())),
                  secure::seconds_of(X509_get0_notAfter(permissions_.certificate.get())));
}

Result<Issued> Authority::issue(Role role, const std::string& name, std::int64_t valid_s,
                                std::int64_t now_s) {
  if (auto good = check_identity_name(name); !good) return tl::unexpected(good.error());
  const auto has_name = [&](const Issued& one) { return one.name == name; };
  if (std::ranges::any_of(issued_, has_name) || exists(folder_of(name)))
    return fail(
        ErrorCode::kConflict,
        folder_of(name) + ": there is one of that name already: `tandem pki renew " + name + "` renews it");
  return write_identity(role, name, valid_s, now_s);
}

Result<Issued> Authority::renew(const std::string& name, std::optional<std::int64_t> valid_s,
                                std::int64_t now_s) {
  const auto last =
      std::find_if(issued_.rbegin(), issued_.rend(), [&](const Issued& one) { return one.name == name; });
  if (last == issued_.rend())
    return fail(ErrorCode::kInvalidArgument,
                folder_ + ": has issued nothing to " + name + ": `tandem pki show` lists all");
  const Role role = last->role;
  return write_identity(role, name, valid_s.value_or(usual_days(role) * kDay), now_s);
}

Result<Issued> Authority::write_identity(Role role, const std::string& name, std::int64_t valid_s,
                                         std::int64_t now_s) {
  const Validity valid{now_s - kBackdated, std::min(now_s + valid_s, until_s())};
  if (valid.until_s <= now_s)
    return fail(ErrorCode::kInvalidArgument,
                own(secure::kIdentityCa) + ": has expired: `tandem pki init` in another folder");
  auto identity = make_identity(identities_, std::string(role_name(role)), name, valid);
  if (!identity) return tl::unexpected(identity.error());
  const auto permissions = sign_document(
      permissions_,
      permissions_xml(role, secure::subject_of(identity->certificate.get()), valid.from_s, valid.until_s));
  if (!permissions) return tl::unexpected(permissions.error());
  const Issued issued{name, role, serial_of(identity->certificate.get()), valid.until_s, {}};
  // First, so that whatever a cut leaves behind can be revoked.
  issued_.push_back(issued);
  auto written =
      write_register()
          .and_then([&] { return make_folder(folder_of(name)); })
          .and_then([&] {
            return write_files(folder_of(name),
                               {{secure::kKey, key_pem(identity->key.get()), Readers::kOwner},
                                {secure::kCertificate, certificate_pem(identity->certificate.get())},
                                {secure::kPermissions, *permissions},
                                {secure::kGovernance, governance_},
                                {secure::kIdentityCa, certificate_pem(identities_.certificate.get())},
                                {secure::kPermissionsCa, certificate_pem(permissions_.certificate.get())}});
          })
          .and_then([&] { return write_revoked_list(now_s); });
  if (!written) return tl::unexpected(written.error());
  return issued;
}

Result<void> Authority::revoke(const std::string& name, std::int64_t now_s) {
  bool any = false;
  for (Issued& one : issued_) {
    if (one.name != name) continue;
    any = true;
    if (!one.revoked_s) one.revoked_s = now_s;
  }
  if (!any)
    return fail(ErrorCode::kInvalidArgument,
                folder_ + ": has issued nothing to " + name + ": `tandem pki show` lists all");
  return write_register().and_then([&] { return write_revoked_list(now_s); });
}

Result<void> Authority::write_revoked_list(std::int64_t now_s) const {
  std::vector<Revocation> revoked;
  std::set<std::string> names;
  for (const Issued& one : issued_) {
    names.insert(one.name);
    if (one.revoked_s) revoked.push_back({one.serial, *one.revoked_s});
  }
  const auto list = make_revoked_list(
      identities_, revoked, {now_s - kBackdated, std::min(now_s + kRevokedListDays * kDay, until_s())});
  if (!list) return tl::unexpected(list.error());
  auto written = write_file(own(secure::kRevoked), *list, Readers::kAll);
  for (const std::string& name : names) {
    if (!written) break;
    if (exists(folder_of(name)))
      written = write_file(folder_of(name) + "/" + secure::kRevoked, *list, Readers::kAll);
  }
  return written;
}

}  // namespace tandem::pki
