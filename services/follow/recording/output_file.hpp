#pragma once
// A file that takes its name when it is worth having: complete, or readable as far as it goes.

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>

#include "tandem/result.hpp"

namespace tandem::recording {

/// What becomes of a file of that name that holds something.
enum class Existing : std::uint8_t {
  kStays,     ///< the new file is called NAME-2.ENDING, or by the next number that is free
  kReplaced,  ///< the new file takes its place
};

/// Refuses a name that a file with something in it has: what may take long is not begun in vain. Errors:
/// kConflict, in words for --overwrite.
[[nodiscard]] Result<void> check_free(const std::string& path);

/// Writes to `path`.part, a new file, and renames it. A process that has an older file of that name open
/// keeps it as it was. An object that is destroyed before the renaming leaves nothing behind. A process that
/// is killed leaves the .part, which the next run replaces. Not thread-safe.
///
/// The file is locked (flock) under both of its names for as long as it is open, so that only one of several
/// writers writes. The lock belongs to the file and not to its name, so that a path in another
/// spelling finds it. On a file system without locks, only the comparison before the renaming protects the
/// file.
class OutputFile {
 public:
  /// Follows symbolic links, so that they stay. Errors: kIo, naming the file and the reason; also if `path`
  /// exists and may not be written, or is no regular file. kConflict: another process writes it, and the
  /// message names that process if the system does.
  static Result<OutputFile> create(const std::string& path, Existing existing);
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();

  /// Hands the bytes to the system at once. Errors: kIo, as when the disk is full.
  Result<void> write(std::span<const std::byte> bytes);
  /// Overwrites bytes at the start, as for a header that is known only afterwards.
  Result<void> rewrite_start(std::span<const std::byte> bytes);
  /// Takes its name, or the next that is free (kStays) if another file has it by now; more may be written
  /// afterwards. No effect if it has one. Errors: kIo, also if the .part is another file by now; kConflict if
  /// another process writes a file of its name.
  Result<void> take_name();
  /// Closes and removes a file that has no name.
  void discard();
  [[nodiscard]] bool has_name() const { return !unnamed_; }
  /// Brings everything to the disk, under whichever name. Errors: kIo, also if the file was removed.
  Result<void> sync();
  /// sync(); nothing may be written afterwards.
  Result<void> close();
  /// sync(), take_name(), close(): nobody else has the name in between.
  Result<void> commit();
  [[nodiscard]] const std::string& path() const { return path_; }
  /// True if it has a number, because a file of the wanted name stays.
  [[nodiscard]] bool is_numbered() const { return number_ > 1; }
  /// The bytes that write() handed over, including the part of a failed write that the system took.
  [[nodiscard]] std::uint64_t written_bytes() const { return written_bytes_; }

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  OutputFile(std::string wanted, unsigned number, Existing existing, std::FILE* file);
  [[nodiscard]] tl::unexpected<Error> failure(const char* what) const;
  [[nodiscard]] bool has_part() const;

  std::string wanted_, path_, part_;  // without and with the number
  unsigned number_ = 1;
  Existing existing_ = Existing::kStays;
  bool unnamed_ = true;  // the .part is there and ours to remove
  std::uint64_t written_bytes_ = 0;
  std::unique_ptr<std::FILE, Closer> file_;
};

/// Refuses to write a file that is being read. Errors: kInvalidArgument if `output`, or the .part that
/// becomes it, is the file `input`.
[[nodiscard]] Result<void> check_distinct(const std::string& input, const std::string& output);

}  // namespace tandem::recording
