// `tandem pki init, issue, renew, revoke, show`: identities for DDS Security.

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>

#include "sdk/transport/secure/identity_folder.hpp"
#include "sdk/transport/secure/openssl.hpp"
#include "sdk/wire/clock.hpp"
#include "services/credentials/pki/authority.hpp"
#include "services/program/json/json.hpp"
#include "services/tool/pki/pki.hpp"
#include "services/tool/print_error.hpp"

namespace tandem::tool {
namespace {

using pki::Authority;
using pki::Issued;
using transport::secure::date_text;

struct PkiOptions {
  std::string folder = "tandem-pki";
  std::string role, name;
  std::uint32_t days = 0;  // 0: the usual ones
  bool json = false;
};

int failed(const Error& error) {
  print_error(fmt::format("tandem pki: {}\n", error.message));
  return 1;
}

std::shared_ptr<PkiOptions> add_folder(commandline::Command command) {
  auto options = std::make_shared<PkiOptions>();
  command.add_option("--dir", options->folder, "Folder of the authorities").show_default();
  return options;
}

void add_name(commandline::Command command, PkiOptions& options) {
  command.add_option("NAME", options.name, "Name of the identity")
      .required()
      .check([](const std::string& name) {
        const auto good = pki::check_identity_name(name);
        return good ? std::string() : good.error().message;
      });
}

void add_days(commandline::Command command, PkiOptions& options) {
  command
      .add_option("--days", options.days,
                  "Days that it is valid, [365 for servers and gateways, 90 for others]")
      .range(1U, static_cast<std::uint32_t>(pki::kMaxDays));
}

void tell(const Authority& authority, const Issued& issued, const char* what) {
  fmt::print("{} {} {} until {}: {}\n", what, pki::role_name(issued.role), issued.name,
             date_text(issued.until_s), authority.folder_of(issued.name));
}

int init(const PkiOptions& options) {
  const auto authority = Authority::init(options.folder, transport::wall_s());
  if (!authority) return failed(authority.error());
  fmt::print("made two authorities until {}: {}\n", date_text(authority->until_s()), options.folder);
  fmt::print("keep {}/authority where nobody else can read it, and a copy\n", options.folder);
  return 0;
}

int issue(const PkiOptions& options) {
  auto authority = Authority::open(options.folder);
  if (!authority) return failed(authority.error());
  const pki::Role role = *pki::read_role(options.role);
  const std::int64_t days = options.days != 0 ? std::int64_t{options.days} : pki::usual_days(role);
  const auto issued = authority->issue(role, options.name, days * pki::kDay, transport::wall_s());
  if (!issued) return failed(issued.error());
  tell(*authority, *issued, "issued");
  return 0;
}

int renew(const PkiOptions& options) {
  auto authority = Authority::open(options.folder);
  if (!authority) return failed(authority.error());
  std::optional<std::int64_t> valid_s;
  if (options.days != 0) valid_s = options.days * pki::kDay;
  const auto issued = authority->renew(options.name, valid_s, transport::wall_s());
  if (!issued) return failed(issued.error());
  tell(*authority, *issued, "renewed");
  fmt::print("copy the folder to where it is used, and restart the program there\n");
  return 0;
}

int revoke(const PkiOptions& options) {
  auto authority = Authority::open(options.folder);
  if (!authority) return failed(authority.error());
  if (const auto revoked = authority->revoke(options.name, transport::wall_s()); !revoked) return failed(revoked.error());
  fmt::print(
      "revoked {}: copy {}/authority/{} into the folder of every identity that is in use, and restart those programs\n",
      options.name, options.folder, transport::secure::kRevoked);
  return 0;
}

const char* state_of(const Issued& issued) {
  if (issued.revoked_s) return "revoked";
  return issued.until_s < transport::wall_s() ? "expired" : "good";
}

int show(const PkiOptions& options) {
  const auto authority = Authority::open(options.folder);
  if (!authority) return failed(authority.error());
  Json rows = Json::array();
  if (!options.json)
    fmt::print("{:<10} {:<12} {:<8} {:<24} {}\n", "name", "role", "state", "until", "serial");
  for (const Issued& one : authority->register_of()) {
    if (options.json) {
      rows.push_back({{"name", one.name},
                      {"role", pki::role_name(one.role)},
                      {"state", state_of(one)},
                      {"until_s", one.until_s},
                      {"serial", one.serial}});
    } else {
      fmt::print("{:<10} {:<12} {:<8} {:<24} {}\n", one.name, pki::role_name(one.role), state_of(one),
                 date_text(one.until_s), one.serial);
    }
  }
  if (options.json) {
    fmt::print("{}\n", Json{{"until_s", authority->until_s()}, {"identities", rows}}.dump());
  } else {
    fmt::print("the authorities expire on {}\n", date_text(authority->until_s()));
  }
  return 0;
}

}  // namespace

void add_pki_init(commandline::Command pki, Run& run) {
  commandline::Command command =
      pki.add_subcommand("init", "Makes the authorities that sign identities and permissions.");
  const auto options = add_folder(command);
  command.footer("They are valid for ten years. Exits with 1 if the folder has some already.");
  command.on_chosen([options, &run] { run = [options] { return init(*options); }; });
}

void add_pki_issue(commandline::Command pki, Run& run) {
  commandline::Command command =
      pki.add_subcommand("issue", "Makes an identity, and the folder that --secure takes.");
  const auto options = add_folder(command);
  command.add_option("ROLE", options->role, "What it may do")
      .required()
      .one_of({"server", "participant", "observer", "gateway", "operator"});
  add_name(command, *options);
  add_days(command, *options);
  command.footer("An operator may ask for a handover and nothing else. A server that stands by is a server.");
  command.on_chosen([options, &run] { run = [options] { return issue(*options); }; });
}

void add_pki_renew(commandline::Command pki, Run& run) {
  commandline::Command command =
      pki.add_subcommand("renew", "Makes a new key, certificate and permissions for an identity.");
  const auto options = add_folder(command);
  add_name(command, *options);
  add_days(command, *options);
  command.footer("What was issued before stays good until it expires, or until `revoke` before `renew`.");
  command.on_chosen([options, &run] { run = [options] { return renew(*options); }; });
}

void add_pki_revoke(commandline::Command pki, Run& run) {
  commandline::Command command =
      pki.add_subcommand("revoke", "Makes everything void that was issued to a name.");
  const auto options = add_folder(command);
  add_name(command, *options);
  command.footer("It holds where the list, crl.pem, is copied to, from the next start of a program on.");
  command.on_chosen([options, &run] { run = [options] { return revoke(*options); }; });
}

void add_pki_show(commandline::Command pki, Run& run) {
  commandline::Command command =
      pki.add_subcommand("show", "Lists all identities, and whether they are good.");
  const auto options = add_folder(command);
  command.add_flag("--json", options->json, "Print one JSON object");
  command.on_chosen([options, &run] { run = [options] { return show(*options); }; });
}

}  // namespace tandem::tool
