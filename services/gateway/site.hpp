#pragma once
// The files of the viewer.

#include <cstddef>
#include <map>
#include <string>
#include <string_view>

#include "tandem/result.hpp"

namespace tandem::gateway {

/// What a gateway without a page says.
inline constexpr std::string_view kNoPage =
    "this gateway has no page for browsers: `deploy/build-viewer WASM FOLDER` makes one, --viewer FOLDER "
    "serves it";

/// A folder that is read once and held in memory. Requests never reach the file system, so no path can leave
/// it. Thread-safe.
class Site {
 public:
  static constexpr std::size_t kMaxFiles = 4096;
  static constexpr std::size_t kMaxBytes = 64U << 20U;

  struct File {
    std::string bytes;
    std::string gzip;  ///< the same, compressed; empty if that is not smaller
    std::string_view type;
    bool immutable = false;  ///< its name has a hash of its content
  };

  /// A site without files.
  Site() = default;
  [[nodiscard]] bool empty() const { return files_.empty(); }
  /// Reads `folder`, which must hold an index.html. Skips names that begin with a dot, and all but regular
  /// files. Errors: kIo, kCapacity.
  [[nodiscard]] static Result<Site> load(const std::string& folder);

  /// The file at the path of a request, as "/assets/x.js"; "/" is index.html. Null if there is none.
  [[nodiscard]] const File* find(std::string_view path) const;

 private:
  std::map<std::string, File, std::less<>> files_;  // by path, with the slash in front
};

/// The media type by a name's extension; unknown ones are octet streams.
[[nodiscard]] std::string_view media_type(std::string_view name);

}  // namespace tandem::gateway
