#pragma once
// Who owns a session name.

#include <cstdint>
#include <optional>
#include <vector>

#include "sdk/transport/port.hpp"
#include "tandem/result.hpp"

namespace tandem::host {

/// Looks for other servers of the same session. Before announcing, any live one wins. Afterwards, when two
/// started at once, the lower GUID stays; one whose epoch is older by more than 2 s always stays.
class Claim {
 public:
  static constexpr std::int64_t kOlderMs = 2000;

  Claim(Epoch epoch, const transport::ParticipantId& self) : epoch_(epoch), self_(self) {}

  /// kConflict, naming the other server, when this one has to give way.
  [[nodiscard]] std::optional<Error> check(transport::ServerPort& port, bool announced);

 private:
  [[nodiscard]] bool stays(const transport::Received<transport::SessionMessage>& other) const;

  Epoch epoch_;
  transport::ParticipantId self_;
  std::vector<transport::Received<transport::SessionMessage>> others_;
};

}  // namespace tandem::host
