#pragma once
// Reads and writes structs of tandem.h whose `size` may be that of an older or a newer header.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "sdk/client/api/boundary.hpp"

namespace tandem::api {

/// The size of a struct when it was first released, without padding at its end. A smaller size was never
/// valid. Members that are added later do not change it.
template <class T>
inline constexpr std::size_t kFirstSize = 0;
template <>
inline constexpr std::size_t kFirstSize<tandem_options> = offsetof(tandem_options, prefer) + sizeof(char*);
template <>
inline constexpr std::size_t kFirstSize<tandem_status> = offsetof(tandem_status, stream_changes) + 8;
template <>
inline constexpr std::size_t kFirstSize<tandem_sample_options> = offsetof(tandem_sample_options,
                                                                          smoothing_s) +
                                                                 8;
template <>
inline constexpr std::size_t kFirstSize<tandem_columns> = offsetof(tandem_columns, change_stride) + 4;
template <>
inline constexpr std::size_t kFirstSize<tandem_frame> = offsetof(tandem_frame, phase) + 4;
template <>
inline constexpr std::size_t kFirstSize<tandem_event> = offsetof(tandem_event, text) + 256;
template <>
inline constexpr std::size_t kFirstSize<tandem_news> = offsetof(tandem_news, bytes) + 1024;
template <>
inline constexpr std::size_t kFirstSize<tandem_data_field> = offsetof(tandem_data_field, name) + 40;
template <>
inline constexpr std::size_t kFirstSize<tandem_scene> = offsetof(tandem_scene, name) + 72;
template <>
inline constexpr std::size_t kFirstSize<tandem_solid> = offsetof(tandem_solid, radius) + 4;
template <>
inline constexpr std::size_t kFirstSize<tandem_body_type> = offsetof(tandem_body_type, name) + 72;
template <>
inline constexpr std::size_t kFirstSize<tandem_session_info> = offsetof(tandem_session_info, predictor) + 72;

/// No struct will ever be larger; a larger size is garbage.
inline constexpr std::uint32_t kLargestStruct = 4096;

[[nodiscard]] inline std::uint32_t size_of(const void* theirs) {
  std::uint32_t size = 0;
  std::memcpy(&size, theirs, sizeof size);
  return size;
}

/// Checks a struct's pointer and size. Errors: TANDEM_INVALID_ARGUMENT (null, or a size that no header has).
template <class T>
[[nodiscard]] tandem_result check_struct(const T* theirs) {
  if (theirs == nullptr) return refuse(TANDEM_INVALID_ARGUMENT, "a pointer to a struct is null");
  static_assert(kFirstSize<T> > 0, "give above the size of the struct when it was first released");
  const std::uint32_t size = size_of(theirs);
  if (size < kFirstSize<T> || size > kLargestStruct) {
    return refuse(TANDEM_INVALID_ARGUMENT, "a struct's size is not set: initialise it with its ..._INIT");
  }
  return kOk;
}

/// Reads a struct into `ours`, which holds the defaults of fields that their struct does not have. Errors:
/// also TANDEM_UNSUPPORTED (a field is set that this library does not know).
template <class T>
[[nodiscard]] tandem_result read_struct(const T* theirs, T& ours) {
  if (const tandem_result checked = check_struct(theirs); checked != TANDEM_OK) return checked;
  const std::size_t size = size_of(theirs);
  const void* const whole = theirs;
  const auto* const bytes = static_cast<const std::byte*>(whole);
  for (std::size_t i = sizeof(T); i < size; ++i) {
    if (bytes[i] != std::byte{0}) {
      return refuse(TANDEM_UNSUPPORTED,
                    "a struct from a newer header sets a field that this library does not know");
    }
  }
  std::memcpy(&ours, whole, std::min(size, sizeof(T)));
  return kOk;
}

/// Writes the fields that fit into their struct, which was checked; the rest of it becomes 0. `size`: their
/// size. It is not changed, because it is the stride of an array that the caller may pass again.
template <class T>
void write_struct(const T& ours, void* theirs, std::size_t size) {
  std::memset(theirs, 0, size);
  std::memcpy(theirs, &ours, std::min(size, sizeof(T)));
  const auto same = static_cast<std::uint32_t>(size);
  std::memcpy(theirs, &same, sizeof same);
}
template <class T>
void write_struct(const T& ours, T* theirs) {
  write_struct(ours, theirs, size_of(theirs));
}

/// Copies a text. A text that is too long is cut at the end of a character.
inline void write_text(std::string_view text, char* to, std::size_t size) {
  std::size_t length = std::min(text.size(), size - 1);
  while (length < text.size() && length > 0 && (static_cast<unsigned char>(text[length]) & 0xC0U) == 0x80U) {
    --length;
  }
  std::memset(to, 0, size);
  text.copy(to, length);
}
template <std::size_t kSize>
void write_text(std::string_view text, char (&to)[kSize]) {  // NOLINT(*-avoid-c-arrays): C's
  write_text(text, to, kSize);
}

}  // namespace tandem::api
