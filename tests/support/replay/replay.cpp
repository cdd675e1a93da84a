// A main for fuzz targets without libFuzzer: runs every file of the folders and files named, and mutations of
// each.

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/property/synthetic.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Bytes = std::vector<std::byte>;
constexpr std::uint64_t kSeed = 77;
constexpr int kMutations = 300;

Bytes read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string content((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const auto bytes = std::as_bytes(std::span(content));
  return {bytes.begin(), bytes.end()};
}

void run(const Bytes& bytes) {
  // Exactly as large as its content, so that a sanitizer sees a read beyond it.
  std::vector<std::uint8_t> exact;
  exact.reserve(bytes.size());
  for (const std::byte byte : bytes) exact.push_back(std::to_integer<std::uint8_t>(byte));
  LLVMFuzzerTestOneInput(exact.data(), exact.size());
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::filesystem::path> paths;
  for (int i = 1; i < argc; ++i) {
    if (std::filesystem::is_directory(argv[i])) {
      for (const auto& entry : std::filesystem::directory_iterator(argv[i])) paths.push_back(entry.path());
    } else {
      paths.emplace_back(argv[i]);
    }
  }
  std::sort(paths.begin(), paths.end());
  tandem::synthetic::Random random(kSeed);
  for (const auto& path : paths) {
    const Bytes bytes = read_file(path);
    run(bytes);
    for (int i = 0; i < kMutations; ++i) {
      Bytes mutated = bytes;
      tandem::synthetic::mutate(random, mutated);
      run(mutated);
    }
  }
  std::printf("%zu files, %d mutations of each (seed %llu)\n", paths.size(), kMutations,
              static_cast<unsigned long long>(kSeed));
  return paths.empty() ? 1 : 0;
}
