#pragma once
// The ports of a relay's sides: DDS or NATS, as its options say.

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "sdk/transport/nats/nats_split.hpp"
#include "sdk/wire/port.hpp"
#include "sdk/workers/doorbell.hpp"
#include "services/relay/options.hpp"

namespace tandem::relay {

/// Makes ports. The first two arguments must outlive it. Errors of its members: those of the ports.
class Sides {
 public:
  /// `bell`: of all ports together; null: each has its own.
  Sides(const RelayOptions& options, const std::atomic<bool>& stop,
        std::shared_ptr<transport::Doorbell> bell = nullptr);
  /// Looks at the files of both sides before anything is opened. Errors: kInvalidArgument, kIo.
  [[nodiscard]] Result<void> check() const;
  /// A client of the session that is passed on. Over NATS all have one connection.
  [[nodiscard]] Result<std::unique_ptr<transport::ClientPort>> follow(transport::ClientId id);
  /// The server of the session on the other side.
  [[nodiscard]] Result<std::unique_ptr<transport::ServerPort>> publish(
      const transport::SessionMessage& session) const;
  /// What followers of NATS go on from; see KeptState.
  void set_kept(std::vector<transport::SnapshotMessage> kept) { kept_ = std::move(kept); }
  /// Says in the log from where to where the session goes.
  void tell() const;

 private:
  const RelayOptions* options_;
  const std::atomic<bool>* stop_;
  std::shared_ptr<transport::Doorbell> bell_;
  std::vector<transport::SnapshotMessage> kept_;
  std::optional<transport::NatsSplit> from_nats_;
  std::uint32_t sender_;  ///< tells this process from others on NATS
};

}  // namespace tandem::relay
