#include "services/tool/pki/pki.hpp"

#include <vector>

namespace tandem::tool {

void add_pki(commandline::Command app, Run& run) {
  static const std::vector<AddPkiCommand> commands = {
      // One line for each, in the order that --help shows.
      add_pki_init,       //
      add_pki_issue,      //
      add_pki_renew,      //
      add_pki_revoke,     //
      add_pki_show,       //
      add_pki_token_key,  //
      add_pki_token,      //
  };
  commandline::Command pki = app.add_subcommand("pki", "Makes and shows who may do what in a session.");
  for (const AddPkiCommand add : commands) add(pki, run);
  pki.require_subcommand();
}

}  // namespace tandem::tool
