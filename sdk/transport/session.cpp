// What server and client must agree on about a session before a byte is read.

#include <algorithm>
#include <bit>
#include <string>

#include "sdk/core/lattice/hash.hpp"
#include "sdk/transport/limits.hpp"
#include "sdk/transport/port.hpp"

namespace tandem::transport {

Result<void> check_session_name(const std::string& name) {
  const auto allowed = [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
  };
  if (name.empty() || name.size() > kMaxNameBytes) {
    return fail(ErrorCode::kInvalidArgument, "a session name has 1 to 64 characters");
  }
  if (!std::all_of(name.begin(), name.end(), allowed)) {
    return fail(ErrorCode::kInvalidArgument,
                "a session name consists of letters, digits, '.', '_' and '-' only (wildcards are refused)");
  }
  return {};
}

std::uint64_t layout_hash(const SessionMessage& session) {
  // A text, so that a client in any language can build the same bytes; see idl/PROTOCOL.md, "Layout hash".
  std::string text = "tandem-layout " + std::to_string(session.protocol_version);
  text += "\ncapacity " + std::to_string(session.capacity);
  text += "\nlattice_unit " + to_hex(std::bit_cast<std::uint64_t>(session.lattice_unit));
  text += "\nlead " + std::to_string(session.lead);
  text += "\ncodec " + session.codec;
  text += "\ncodec_tables " + to_hex(hash_bytes(session.codec_tables));
  text += "\nparameters " + std::to_string(session.threshold) + ' ' + std::to_string(session.position_step) +
          ' ' + std::to_string(session.velocity_step);
  text += "\npredictor " + session.predictor;
  text += "\npredictor_constants";
  for (const std::int32_t constant : session.predictor_constants) text += ' ' + std::to_string(constant);
  text += "\ntypes " + std::to_string(session.types.size()) + '\n';
  return hash_bytes(std::as_bytes(std::span(text)));
}

}  // namespace tandem::transport
