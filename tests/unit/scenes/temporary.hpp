#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace tandem::scenes {

/// A folder that disappears with the test.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "tandem_scenes_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("mkdtemp");
    path_ = pattern;
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  TemporaryFolder(TemporaryFolder&&) = delete;
  TemporaryFolder& operator=(TemporaryFolder&&) = delete;
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }

  [[nodiscard]] std::string path() const { return path_.string(); }
  [[nodiscard]] std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name) << text;
    return (path_ / name).string();
  }

 private:
  std::filesystem::path path_;
};

/// A scene that is as small as a scene may be; line 1 is `extra`.
inline std::string small_scene(const std::string& extra = "") {
  return extra + R"(
dt_s: 0.04
gravity { y: -5 }
threshold_radii: 0.2
bounds { low { x: -20 y: -20 z: -20 } high { x: 20 y: 40 z: 20 } }
pair { spring: 100 damping: 1 shear: 1 }
types { name: "ball" radius_m: 0.5 mass_kg: 1 }
start { base { y: 1 } proportions { x: 1 y: 1 z: 1 } spacing: 1.1 }
)";
}

}  // namespace tandem::scenes
