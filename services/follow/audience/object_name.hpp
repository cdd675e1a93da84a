#pragma once
// Objects of an audience's folder: named by what they hold, so that they never change.

#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace tandem::audience {

enum class ObjectKind : std::uint8_t {
  kMessages,  ///< sized messages: a session, a snapshot, a segment
  kChapter,   ///< JSON
};

/// The name of an object is the SHA-256 of its bytes.
struct Object {
  std::string sha256;  ///< 64 hex digits
  std::uint64_t size_bytes = 0;
  ObjectKind kind = ObjectKind::kMessages;

  /// Where it stands, from the folder of the manifest: objects/SHA256.bin, or .json.
  [[nodiscard]] std::string path() const;
  auto operator<=>(const Object&) const = default;
};

[[nodiscard]] Object name_of(std::span<const std::byte> bytes, ObjectKind kind);

/// True for the path of an object, in any spelling that Object::path() makes, and for that of one that was
/// not finished (.part behind it).
[[nodiscard]] bool is_object_file(const std::string& file_name);

}  // namespace tandem::audience
