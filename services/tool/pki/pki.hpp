#pragma once
// The subcommands of `tandem pki`: what belongs to who may do what.

#include "services/tool/commands.hpp"

namespace tandem::tool {

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
