#pragma once
// Announces a participant again, out of turn.

#include <dds/dds.h>

#include <cstdint>

#include "sdk/transport/dds/entity.hpp"
#include "sdk/wire/units.hpp"

namespace tandem::transport::dds {

/// A participant is announced when it begins, which every peer that hears it answers, and then only each
/// DdsWire::kAnnouncedNs. Who lost the first announcement, or a peer, needs it sooner.
class CallOut {
 public:
  /// `participant` is not owned and outlives this. `now_ns`: the steady clock when it began.
  CallOut(dds_entity_t participant, std::int64_t now_ns)
      : participant_(participant), due_ns_(now_ns + kSpacingNs), began_ns_(now_ns) {}

  /// Call it as often as you like: it announces after each of the first seconds, and then every 5 s.
  void again(std::int64_t now_ns) {
    if (now_ns < due_ns_) return;
    due_ns_ = now_ns + (began_lately(now_ns) ? kSpacingNs : kRareNs);
    ++number_;
    const Qos changed(dds_create_qos());
    dds_qset_userdata(changed.get(), &number_, sizeof number_);
    static_cast<void>(dds_set_qos(participant_, changed.get()));  // the next makes up for one that fails
  }
  /// True for those first seconds.
  [[nodiscard]] bool began_lately(std::int64_t now_ns) const { return now_ns - began_ns_ <= kSoonNs; }

 private:
  static constexpr std::int64_t kSpacingNs = kSecond, kSoonNs = 5 * kSecond, kRareNs = 5 * kSecond;

  dds_entity_t participant_;
  std::int64_t due_ns_;
  std::int64_t began_ns_;
  std::uint8_t number_ = 0;  // the participant's user data, which only has to change
};

}  // namespace tandem::transport::dds
