#pragma once
// The reasons of refusals, as values of a label.

#include <string_view>

#include "sdk/wire/messages.hpp"

namespace tandem::metrics {

/// In lower case, as in idl/PROTOCOL.md. Every reason has one; none means that nothing was refused.
[[nodiscard]] constexpr std::string_view reason_label(transport::Reason reason) {
  switch (reason) {
    case transport::Reason::kNone:
      return "none";
    case transport::Reason::kObserver:
      return "observer";
    case transport::Reason::kDemoted:
      return "demoted";
    case transport::Reason::kInvalid:
      return "invalid";
    case transport::Reason::kRateLimited:
      return "rate_limited";
    case transport::Reason::kStaleEpoch:
      return "stale_epoch";
    case transport::Reason::kDuplicate:
      return "duplicate";
    case transport::Reason::kNotPlaying:
      return "not_playing";
    case transport::Reason::kForeignClient:
      return "foreign_client";
    case transport::Reason::kProtocolVersion:
      return "protocol_version";
    case transport::Reason::kFull:
      return "full";
    case transport::Reason::kNoStream:
      return "no_stream";
    case transport::Reason::kRecording:
      return "recording";
    case transport::Reason::kCap:
      return "cap";
  }
  return "other";
}

}  // namespace tandem::metrics
