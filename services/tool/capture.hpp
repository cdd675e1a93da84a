#pragma once
// `tandem join --capture`: what a client received and applied, in a file (idl/CAPTURE.md).

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdk/client/client_core.hpp"
#include "services/tool/output_file.hpp"

namespace tandem::tool {

/// Writes sessions, snapshots, scheduled inputs and deltas in the order in which the client took them in. The
/// file is there under its name after commit(). Not thread-safe.
class CaptureFile {
 public:
  /// Errors: kIo.
  static Result<CaptureFile> create(const std::string& path);

  void add(const transport::SessionMessage& session);
  void add(const transport::SnapshotMessage& snapshot);
  void add(const transport::ScheduledInputMessage& input);
  void add(Epoch epoch, const client::CompleteDelta& delta);
  /// Errors: kIo, also of anything written before.
  [[nodiscard]] Result<void> commit();

 private:
  explicit CaptureFile(OutputFile file) : file_(std::move(file)) {}
  void write(std::uint32_t type);

  OutputFile file_;
  std::vector<std::byte> body_;
  std::optional<Error> failure_;
};

}  // namespace tandem::tool
