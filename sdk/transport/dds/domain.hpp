#pragma once
// A DDS domain with Tandem's defaults, shared by all ports of a process.

#include <cstdint>
#include <string>

#include "tandem/result.hpp"

namespace tandem::transport::dds {

/// Keeps a domain alive. The first use in a process creates it from our defaults and then CYCLONEDDS_URI, so
/// that the user's settings win; the last one ends it. A domain that the application created itself is used
/// as it is. Thread-safe.
class DomainUse {
 public:
  /// Errors: kTransport when no domain can be made, as when an interface that CYCLONEDDS_URI names is not
  /// there (yet).
  static Result<DomainUse> acquire(std::uint32_t domain);
  DomainUse(DomainUse&& other) noexcept;
  DomainUse& operator=(DomainUse&&) = delete;
  DomainUse(const DomainUse&) = delete;
  DomainUse& operator=(const DomainUse&) = delete;
  ~DomainUse();

 private:
  explicit DomainUse(std::uint32_t domain) : domain_(domain), held_(true) {}
  std::uint32_t domain_;
  bool held_;
};

/// The configuration that acquire() hands to Cyclone DDS.
[[nodiscard]] std::string domain_configuration();

}  // namespace tandem::transport::dds
