#pragma once
// What a viewer's inputs were and became, for the log.

#include <cstdint>
#include <map>
#include <string_view>

#include "sdk/wire/messages.hpp"

namespace tandem::gateway {

/// `other` if there is no such kind.
[[nodiscard]] constexpr std::string_view input_kind_name(std::uint32_t kind) {
  switch (static_cast<transport::InputKind>(kind)) {
    case transport::InputKind::kGravity:
      return "gravity";
    case transport::InputKind::kPush:
      return "push";
    case transport::InputKind::kSeek:
      return "seek";
    case transport::InputKind::kApplication:
      return "application";
  }
  return "other";
}

struct InputCount {
  std::uint64_t acted = 0, refused = 0;
  transport::Reason reason = transport::Reason::kNone;  ///< of the last that was refused
};
/// By input_kind_name().
using InputTally = std::map<std::string_view, InputCount>;

}  // namespace tandem::gateway
