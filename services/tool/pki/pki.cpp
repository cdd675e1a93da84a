#include "services/tool/pki/pki.hpp"

void tandem::tool::add_pki(commandline::Command app, Run& run) {
  commandline::Command pki = app.add_subcommand("pki", "Makes and shows who may do what in a session.");
  pki.require_subcommand();
  add_pki_init(pki, run);
  add_pki_issue(pki, run);
  add_pki_renew(pki, run);
  add_pki_revoke(pki, run);
  add_pki_show(pki, run);
  add_pki_token_key(pki, run);
  add_pki_token(pki, run);
}
