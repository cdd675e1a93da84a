#include "services/follow/audience/object_name.hpp"

#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <string_view>

namespace tandem::audience {
namespace {

constexpr std::size_t kHexDigits = 64;
constexpr std::string_view kDigits = "0123456789abcdef";

constexpr const char* suffix_of(ObjectKind kind) { return kind == ObjectKind::kChapter ? ".json" : ".bin"; }

}  // namespace

std::string Object::path() const { return "objects/" + sha256 + suffix_of(kind); }

Object name_of(std::span<const std::byte> bytes, ObjectKind kind) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  // It fails only if memory runs out or the library lacks SHA-256; a name of zeros is refused by each reader.
  if (EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, EVP_sha256(), nullptr) != 1)
    digest.fill(0);
  Object object{.sha256 = {}, .size_bytes = bytes.size(), .kind = kind};
  for (std::size_t i = 0; i < kHexDigits / 2; ++i) {
    object.sha256 += kDigits[digest[i] >> 4U];
    object.sha256 += kDigits[digest[i] & 15U];
  }
  return object;
}

bool is_object_file(const std::string& file_name) {
  if (file_name.size() < kHexDigits) return false;
  const std::string_view name(file_name);
  if (!std::ranges::all_of(name.substr(0, kHexDigits),
                           [](char c) { return kDigits.find(c) != std::string_view::npos; })) {
    return false;
  }
  constexpr std::array<std::string_view, 4> kEnds{".bin", ".json", ".bin.part", ".json.part"};
  return std::ranges::find(kEnds, name.substr(kHexDigits)) != kEnds.end();
}

}  // namespace tandem::audience
