#pragma once
// What becomes of an input.

#include <cstdint>
#include <string>

#include "sdk/wire/messages.hpp"

namespace tandem::accounts {

/// Identifies an input of a sender: a client of a host or a relay, a viewer of a gateway.
struct InputClaim {
  std::uint64_t sender = 0;
  std::uint64_t number = 0;
  std::uint32_t kind = 0;  ///< as in the message
};

struct InputVerdict {
  enum class Fate : std::uint8_t {
    kDecided,  ///< by `reason`
    kLater,    ///< not decided yet
    kUnknown,  ///< nobody can say
    kLost,     ///< it did not act, even if it was told that it did
  };
  transport::Reason reason = transport::Reason::kNone;  ///< kNone: it acts
  Frame acts_on = 0;                                    ///< the frame that it acts on
  std::string text = {};                                ///< the words of a simulation that refuses it
  std::uint64_t scheduled = 0;                          ///< number of its scheduled input; 0: none
  Fate fate = Fate::kDecided;
  InputClaim claim = {};  ///< whose it is; not needed where the caller knows
};

}  // namespace tandem::accounts
