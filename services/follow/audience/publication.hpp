#pragma once
// A session that a client follows, as files in a folder: what a program with `--to http DIR` needs.

#include <memory>
#include <optional>
#include <string>

#include "sdk/client/core_options.hpp"
#include "services/follow/audience/folder.hpp"
#include "services/follow/audience/writer.hpp"

namespace tandem::audience {

/// Folder and writer. Not thread-safe.
class Publication {
 public:
  /// Goes on behind what an older publication left there; `anew`: begins another time line, and removes what
  /// was there once a manifest has taken the place of the older one. Errors: those of Folder::open();
  /// kUnsupported, if a program of another version wrote there.
  [[nodiscard]] static Result<std::unique_ptr<Publication>> open(const std::string& folder,
                                                                 const Writer::Options& options, bool anew);
  /// What becomes of an older publication, in one line; empty if there is none.
  [[nodiscard]] const std::string& told() const { return told_; }

  [[nodiscard]] const Writer& writer() const { return writer_; }
  [[nodiscard]] Writer& writer() { return writer_; }
  /// Call after each poll of the client.
  void turned(client::Now now);
  /// Ends the publication. Errors: kIo, also of anything before.
  [[nodiscard]] Result<void> finish(client::Now now);

 private:
  Publication(Folder folder, const Writer::Options& options)
      : folder_(std::move(folder)), writer_(folder_, options) {}
  [[nodiscard]] Result<void> go_on(const std::string& path, bool removes_old);

  std::string told_;
  Folder folder_;
  Writer writer_;
  std::optional<std::int64_t> leftovers_due_ns_;
};

}  // namespace tandem::audience
