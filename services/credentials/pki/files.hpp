#pragma once
// Files that are whole or not there, and never seen by others while they are written.

#include <string>
#include <vector>

#include "tandem/result.hpp"

namespace tandem::pki {

/// Who may read a file: 0600 or 0644, whatever the umask is.
enum class Readers : unsigned { kOwner = 0600, kAll = 0644 };

/// Writes `path` by way of a file beside it, which is on the disk before it gets the name. Errors: kIo.
[[nodiscard]] Result<void> write_file(const std::string& path, const std::string& text, Readers readers);

struct File {
  const char* name;
  std::string text;
  Readers readers = Readers::kAll;
};
/// Writes files of a folder one after the other, up to the first error.
[[nodiscard]] Result<void> write_files(const std::string& folder, const std::vector<File>& files);
/// A folder for its owner alone (0700). One that is there already is taken as it is, unless others can write
/// it. Errors: kIo, kInvalidArgument.
[[nodiscard]] Result<void> make_folder(const std::string& path);

}  // namespace tandem::pki
