#include "sdk/client/session/resync_reason.hpp"

namespace tandem::client {

const char* describe(ResyncReason reason) {
  switch (reason) {
    case ResyncReason::kGap:
      return "a frame was missing";
    case ResyncReason::kLostPart:
      return "a part of a frame was missing";
    case ResyncReason::kMissingInput:
      return "a scheduled input did not come in time";
    case ResyncReason::kMismatch:
      return "the state differed from the server's";
    case ResyncReason::kRefused:
      return "a message broke a rule of the protocol";
    case ResyncReason::kOverflow:
      return "there were more waiting frames than there is room for";
    case ResyncReason::kLag:
      return "this client was too far behind for too long";
  }
  return "";
}

}  // namespace tandem::client
