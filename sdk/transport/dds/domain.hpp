#pragma once
// A DDS domain with Tandem's defaults, shared by all ports of a process.

#include <cstdint>
#include <string>

#include "tandem/result.hpp"

namespace tandem::transport::dds {

/// How soon a reader asks again for what it asked for already. What is missing is asked for at once either
/// way.
enum class Repeat : std::uint8_t {
  kSoon,    ///< 10 ms: a server's readers, of inputs and acknowledgements, which are small
  kSeldom,  ///< 100 ms: a client's; each question brings all of it again, which a thin link has no room for
};

/// Keeps a domain alive. The first use in a process creates it from our defaults and then CYCLONEDDS_URI, so
/// that the user's settings win; the last one ends it. A domain that the application created itself is used
/// as it is. Thread-safe.
class DomainUse {
 public:
  /// Errors: kTransport when no domain can be made, as when an interface that CYCLONEDDS_URI names is not
  /// there (yet).
  static Result<DomainUse> acquire(std::uint32_t domain, Repeat repeat);
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
[[nodiscard]] std::string domain_configuration(Repeat repeat);

}  // namespace tandem::transport::dds
