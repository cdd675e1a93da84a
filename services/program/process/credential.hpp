#pragma once
// Files that systemd hands over to a service (LoadCredential= in its unit).

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

namespace tandem {

/// The path of the credential of that name; empty if there is none. One that cannot be read is there, so that
/// who uses it says so.
[[nodiscard]] inline std::string credential(const char* name) {
  const char* const folder = std::getenv("CREDENTIALS_DIRECTORY");
  if (folder == nullptr) return {};
  std::error_code error;
  const std::filesystem::path path = std::filesystem::path(folder) / name;
  const auto type = std::filesystem::symlink_status(path, error).type();
  return type == std::filesystem::file_type::not_found ? std::string() : path.string();
}

}  // namespace tandem
