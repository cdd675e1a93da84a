#pragma once
// Where the writer of an audience's files puts them.

#include <cstddef>
#include <span>
#include <string>

#include "tandem/result.hpp"

namespace tandem::audience {

/// Files by path. A reader of another process sees a file whole or not at all, and files in the order in
/// which they were put.
class Shelf {
 public:
  virtual ~Shelf() = default;
  /// Puts a file in the place of one of that name. Errors: kIo.
  [[nodiscard]] virtual Result<void> put(const std::string& path, std::span<const std::byte> bytes) = 0;
  /// No effect if there is none. What cannot be removed stays.
  virtual void remove(const std::string& path) = 0;
};

}  // namespace tandem::audience
