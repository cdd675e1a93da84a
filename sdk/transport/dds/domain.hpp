#pragma once
// A DDS domain with Tandem's defaults, shared by all ports of a process.

#include <cstdint>
#include <string>

#include "sdk/transport/network/address_watch.hpp"
#include "tandem/result.hpp"

namespace tandem::transport::dds {

/// How soon a reader repeats a request for missing samples. The first request is always sent at once.
enum class Repeat : std::uint8_t {
  kSoon,    ///< 10 ms: for a server's readers of inputs and acknowledgements, which are small
  kSeldom,  ///< 100 ms: for a client's readers; each request brings all missing samples again, and a thin
            ///< link has no room for that
};

/// Keeps a domain alive. The first use in a process creates the domain from Tandem's defaults and then the
/// profile (DdsOptions::profile) or, without one, CYCLONEDDS_URI. The last use ends it. A domain that the
/// application created itself is used as it is. Thread-safe.
class DomainUse {
 public:
  /// `repeat` also says the side: servers repeat soon. Errors: kInvalidArgument for a profile that is none,
  /// that differs from the one with which the process opened the domain, or that cannot have an effect;
  /// kTransport if no domain can be made, for example if an interface that profile or CYCLONEDDS_URI name
  /// does not exist (yet), or while others in this process use the domain on a network that is gone.
  static Result<DomainUse> acquire(std::uint32_t domain, Repeat repeat, const std::string& profile);
  DomainUse(DomainUse&& other) noexcept;
  DomainUse(const DomainUse&) = delete;
  DomainUse& operator=(const DomainUse&) = delete;
  ~DomainUse();

  /// What has become of the network of the domain. After kMoved it is opened anew once all its users have
  /// left it. May be called often.
  [[nodiscard]] NetworkState network() const;
  /// The same in a line for people; empty for kThere.
  [[nodiscard]] std::string network_line() const;

 private:
  explicit DomainUse(std::uint32_t domain) : domain_(domain), held_(true) {}
  std::uint32_t domain_;
  bool held_;
};

}  // namespace tandem::transport::dds
