// tandem pki token-key, tandem pki token: the key of tokens for a gateway's viewers, and the tokens.

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "sdk/wire/clock.hpp"
#include "services/credentials/tokens/token.hpp"
#include "services/program/number.hpp"
#include "services/tool/pki/pki.hpp"
#include "services/tool/print_error.hpp"

namespace tandem::tool {
namespace {

struct TokenOptions {
  std::string key, role, lasts, name, session;
  std::string starts = "0s";
};

/// A number with s, m, h or d behind it, as seconds.
std::optional<std::int64_t> read_time(std::string_view text) {
  if (text.empty()) return std::nullopt;
  const auto number = text::number<std::int64_t>(text.substr(0, text.size() - 1));
  if (!number || *number < 0 || *number > tokens::kLongestS) return std::nullopt;
  switch (text.back()) {
    case 's':
      return number;
    case 'm':
      return *number * 60;
    case 'h':
      return *number * 3600;
    case 'd':
      return *number * 86'400;
    default:
      return std::nullopt;
  }
}

std::string expects_time(const std::string& text) {
  return read_time(text) ? "" : "a time as 90s, 30m, 8h or 7d";
}

int refused(const Error& error) {
  print_error(fmt::format("tandem: {}\n", error.message));
  return 1;
}

int make_key(const std::string& path) {
  const auto made =
      tokens::SecretKey::make().and_then([&](const tokens::SecretKey& key) { return key.write(path); });
  if (!made) return refused(made.error());
  std::fputs(fmt::format("{}: makes tokens (tandem pki token --key {}); keep it secret\n{}.pub: checks them "
                         "(tandem-gateway --token-key {}.pub)\n",
                         path, path, path, path)
                 .c_str(),
             stdout);
  return 0;
}

int make_token(const TokenOptions& options) {
  tokens::Claims claims;
  claims.role = *tokens::read_role(options.role);
  claims.not_before_s = transport::wall_s() + *read_time(options.starts);
  claims.expires_s = claims.not_before_s + *read_time(options.lasts);
  claims.name = options.name;
  claims.session = options.session;
  const auto token = tokens::SecretKey::read(options.key).and_then([&](const tokens::SecretKey& key) {
    return tokens::sign(claims, key);
  });
  if (!token) return refused(token.error());
  std::fputs((*token + '\n').c_str(), stdout);
  return 0;
}

}  // namespace

void add_pki_token_key(commandline::Command pki, Run& run) {
  const auto path = std::make_shared<std::string>();
  commandline::Command command = pki.add_subcommand(
      "token-key", "Makes the pair of keys with which tokens for a gateway's viewers are made and checked.");
  command.add_option("FILE", *path, "The secret key is written here, the public one to FILE.pub").required();
  command.on_chosen([path, &run] { run = [path] { return make_key(*path); }; });
}

void add_pki_token(commandline::Command pki, Run& run) {
  const auto options = std::make_shared<TokenOptions>();
  commandline::Command command =
      pki.add_subcommand("token", "Prints a token that lets a viewer in at tandem-gateway --token-key.");
  command.add_option("--key", options->key, "The secret key, made by `tandem pki token-key`").required();
  command.add_option("--role", options->role, "What the holder may do: watch the session, or also act on it")
      .one_of({"watch", "act"})
      .required();
  command.add_option("--expires", options->lasts, "How long it lasts: 90s, 30m, 8h or 7d; at most 366d")
      .check(expects_time)
      .required();
  command.add_option("--from", options->starts, "When it begins to count, as a time from now")
      .check(expects_time)
      .show_default();
  command.add_option("--name", options->name, "Whom it is for; the gateway's log says so");
  command.add_option("--session", options->session, "The only session that it is for; without it, any");
  command.on_chosen([options, &run] { run = [options] { return make_token(*options); }; });
}

}  // namespace tandem::tool
