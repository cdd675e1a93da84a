#pragma once
// `tandem pki`: what belongs to who may do what. Each of its subcommands has one function here, and a line in
// the table of pki.cpp.

#include "services/tool/commands.hpp"

namespace tandem::tool {

/// Adds one subcommand to `tandem pki`; when the command line chooses it, its callback sets `run`.
using AddPkiCommand = void (*)(commandline::Command pki, Run& run);

// authority.cpp
void add_pki_init(commandline::Command pki, Run& run);
void add_pki_issue(commandline::Command pki, Run& run);
void add_pki_renew(commandline::Command pki, Run& run);
void add_pki_revoke(commandline::Command pki, Run& run);
void add_pki_show(commandline::Command pki, Run& run);
// token.cpp
void add_pki_token_key(commandline::Command pki, Run& run);
void add_pki_token(commandline::Command pki, Run& run);

}  // namespace tandem::tool
