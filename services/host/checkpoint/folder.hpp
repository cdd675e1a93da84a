#pragma once
// The checkpoints of one folder: the newest that is good, and a new one that is there whole or not at all.

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "services/host/checkpoint/checkpoint.hpp"
#include "services/host/checkpoint/disk.hpp"
#include "tandem/result.hpp"

namespace tandem::checkpoint {

/// Where in the history of a world a file stands; its name says so.
struct Moment {
  Epoch epoch = 0;
  Frame frame = 0;
  friend auto operator<=>(const Moment&, const Moment&) = default;
};

/// "EPOCH-FRAME.checkpoint", so that names sort as moments do.
[[nodiscard]] std::string file_name(const Moment& moment);
[[nodiscard]] std::optional<Moment> moment_of(const std::string& file_name);

/// Not thread-safe.
class Folder {
 public:
  static constexpr std::size_t kKept = 3;  ///< checkpoints; older ones are removed

  /// `disk` must outlive the folder.
  explicit Folder(Disk& disk) : disk_(&disk) {}

  /// What a search found.
  struct Found {
    std::optional<Checkpoint> checkpoint;
    std::string file;                  ///< its name
    std::vector<std::string> refused;  ///< newer files that are no good, each in one line with the reason
    Epoch newest_epoch = 0;            ///< the highest that a clock can have and any name has; 0: none
  };
  using Accept = std::function<Result<void>(const Checkpoint&)>;
  /// Searches for the newest checkpoint that can be read and that `accept` accepts. Older ones are asked,
  /// too; of all that are accepted, it is the last that is asked. Removes what unfinished writes left.
  /// Errors: kIo, if the folder cannot be listed.
  [[nodiscard]] Result<Found> newest(const Accept& accept);

  /// Stores a file under the name of its moment. When it returns without an error, the file survives a loss
  /// of power. Then older files that newest() accepted are removed, up to kKept; one that it refused stays
  /// where it is, as another build may be able to read it. Errors: kIo, naming the file. The files of before
  /// are still there then.
  [[nodiscard]] Result<void> store(const Moment& moment, std::span<const std::byte> file);

 private:
  [[nodiscard]] Result<Checkpoint> read_good(const std::string& file, const Accept& accept);
  [[nodiscard]] Result<void> write_whole(const std::string& file, std::span<const std::byte> bytes);

  Disk* disk_;
  std::vector<std::string> ours_;  // what may be removed, ascending
};

}  // namespace tandem::checkpoint
