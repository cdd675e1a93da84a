#pragma once
// A folder on the disk that a web server serves to an audience.

#include <optional>
#include <set>
#include <string>

#include "services/follow/audience/shelf.hpp"
#include "services/program/system/descriptor.hpp"
#include "tandem/result.hpp"

namespace tandem::audience {

/// Writes each file beside its place and renames it. Holds a lock of the folder (flock), so that only one
/// process writes there. Touches nothing in the folder but `manifest.json` and files in `objects/` that have
/// names of objects. Not thread-safe.
class Folder final : public Shelf {
 public:
  /// Makes the folder and `objects/` if they are missing. What an earlier writer left stays until
  /// remove_leftovers(). Errors, naming the folder: kIo; kConflict if another process writes there.
  [[nodiscard]] static Result<Folder> open(const std::string& path);

  [[nodiscard]] Result<void> put(const std::string& path, std::span<const std::byte> bytes) override;
  void remove(const std::string& path) override;
  /// A file as it stands there; empty if there is none. Errors: kIo, also if it is larger than
  /// kMaxReadBytes.
  [[nodiscard]] Result<std::optional<std::string>> read(const std::string& path) const;
  static constexpr std::size_t kMaxReadBytes = std::size_t{256} << 20U;
  /// An object that was there before belongs to this writer too.
  void keep(const std::string& path) { leftovers_.erase(path); }
  void keep_all() { leftovers_.clear(); }
  /// Removes the objects that were there before this writer, and that it has not put again. Call it after a
  /// manifest of this writer has been there for a while.
  void remove_leftovers();
  /// Brings everything to the disk. Errors: kIo.
  [[nodiscard]] Result<void> sync();

 private:
  Folder(std::string path, system::Descriptor folder) : path_(std::move(path)), folder_(std::move(folder)) {}
  [[nodiscard]] tl::unexpected<Error> failure(const std::string& file, const char* what) const;

  std::string path_;
  system::Descriptor folder_;        ///< locked
  std::set<std::string> leftovers_;  ///< paths from the folder
};

}  // namespace tandem::audience
