#include "sdk/client/session/history.hpp"

#include <algorithm>

namespace tandem::client {

std::optional<Frame> shared_history(const transport::SessionMessage& left,
                                    const transport::SessionMessage& entered) {
  if (entered.continues_epoch == left.epoch) return entered.continues_frame;
  if (left.continues_epoch == entered.epoch) return left.continues_frame;
  if (left.continues_epoch != 0 && left.continues_epoch == entered.continues_epoch)
    return std::min(left.continues_frame, entered.continues_frame);
  return std::nullopt;
}

}  // namespace tandem::client
