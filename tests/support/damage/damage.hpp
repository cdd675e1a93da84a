#pragma once
// The ways in which a file that a program needs is not what it should be.

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

namespace tandem {

struct Damage {
  std::string name;
  std::function<void(const std::string& path)> put;  ///< in the place of what is there
};

/// What can happen to any file. Nothing is unreadable for root, who runs the tests in a container.
[[nodiscard]] inline std::vector<Damage> damages() {
  const auto remove = [](const std::string& path) { std::filesystem::remove_all(path); };
  std::vector<Damage> all{{"missing", remove},
                          {"empty", [](const std::string& path) { std::filesystem::resize_file(path, 0); }},
                          {"a folder",
                           [remove](const std::string& path) {
                             remove(path);
                             std::filesystem::create_directory(path);
                           }},
                          {"a link to nothing",
                           [remove](const std::string& path) {
                             remove(path);
                             std::filesystem::create_symlink(path + ".nowhere", path);
                           }},
                          {"a pipe that nobody writes",
                           [remove](const std::string& path) {
                             remove(path);
                             ::mkfifo(path.c_str(), 0600);
                           }},
                          {"cut short",
                           [](const std::string& path) {
                             std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
                           }},
                          {"of another kind", [](const std::string& path) {
                             std::ofstream(path, std::ios::trunc) << "hello\n";
                           }}};
  if (::geteuid() != 0)
    all.push_back({"unreadable", [](const std::string& path) { ::chmod(path.c_str(), 0); }});
  return all;
}

/// Damages each of `files` in each way, calls `told` for what the program says then, and mends it again.
inline void damage_each(const std::vector<std::string>& files,
                        const std::function<void(const std::string& file, const Damage& damage)>& told) {
  for (const std::string& file : files) {
    for (const Damage& damage : damages()) {
      const std::string kept = file + ".kept";
      std::filesystem::copy_file(file, kept);
      damage.put(file);
      told(file, damage);
      std::filesystem::remove_all(file);
      std::filesystem::rename(kept, file);
    }
  }
}

}  // namespace tandem
