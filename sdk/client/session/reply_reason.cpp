#include "sdk/client/session/reply_reason.hpp"

#include "sdk/wire/messages.hpp"

namespace tandem::client {

std::string describe(std::uint32_t reason) {
  switch (static_cast<transport::Reason>(reason)) {
    case transport::Reason::kNone:
      return "";
    case transport::Reason::kObserver:
      return "observers may not send input";
    case transport::Reason::kDemoted:
      return "this client delayed the others for too long, and so became an observer";
    case transport::Reason::kInvalid:
      return "input refused: it is not finite, out of range or of an unknown kind";
    case transport::Reason::kRateLimited:
      return "input refused: there were too many per second";
    case transport::Reason::kStaleEpoch:
      return "input refused: it was meant for an earlier run of the server";
    case transport::Reason::kDuplicate:
      return "input refused: an input with this number was already handled";
    case transport::Reason::kNotPlaying:
      return "input refused: this client was still joining";
    case transport::Reason::kForeignClient:
      return "the client id belongs to another participant";
    case transport::Reason::kProtocolVersion:
      return "the server speaks another protocol version";
    case transport::Reason::kFull:
      return "the server is full";
    case transport::Reason::kNoStream:
      return "the server does not play this stream any more";
    case transport::Reason::kRecording:
      return "input refused: the session is a recording";
    case transport::Reason::kCap:
      return "the stream takes more than this client's cap";
  }
  return "the server refused it for reason " + std::to_string(reason);
}

}  // namespace tandem::client
