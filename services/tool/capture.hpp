#pragma once
// `tandem join --capture`: what a client received and applied, in an MCAP file (idl/PROTOCOL.md, "Captures").

#include <cstdint>
#include <memory>
#include <string>

#include "sdk/client/client_core.hpp"
#include "sdk/transport/mcap.hpp"
#include "services/tool/output_file.hpp"

namespace tandem::tool {

/// Writes sessions, snapshots, scheduled inputs and deltas in the order in which the client took them in. The
/// file is there under its name after commit(). Times are wall clock in ns. Not thread-safe.
class CaptureFile {
 public:
  /// Errors: kIo.
  static Result<CaptureFile> create(const std::string& path);

  void add(const transport::SessionMessage& session, std::int64_t wall_ns);
  void add(const transport::SnapshotMessage& snapshot, std::int64_t wall_ns);
  void add(const transport::ScheduledInputMessage& input, std::int64_t wall_ns);
  /// Of the stream of the snapshot before; as one part, whatever it came in.
  void add(Epoch epoch, const client::CompleteDelta& delta, std::int64_t wall_ns);
  /// Errors: kIo, also of anything written before.
  [[nodiscard]] Result<void> commit();

 private:
  explicit CaptureFile(OutputFile file);

  std::unique_ptr<OutputFile> file_;  // stays where it is, for the writer
  transport::McapWriter writer_;
  StreamId stream_;
};

}  // namespace tandem::tool
