#include "services/audience/publication.hpp"

namespace tandem::audience {

Result<std::unique_ptr<Publication>> Publication::open(const std::string& folder,
                                                       const Writer::Options& options) {
  auto opened = Folder::open(folder);
  if (!opened) return tl::unexpected(opened.error());
  return std::unique_ptr<Publication>(new Publication(std::move(*opened), options));
}

void Publication::turned(client::Now now) {
  capture_.turned(now);
  if (writer_.manifest().number == 0) return;
  if (!leftovers_due_ns_) leftovers_due_ns_ = now.steady_ns + Writer::kGraceNs;
  if (now.steady_ns >= *leftovers_due_ns_) folder_.remove_leftovers();
}

Result<void> Publication::finish(client::Now now) {
  capture_.turned(now);
  auto written = writer_.finish(now.steady_ns);
  // Nobody is left to do it later.
  if (writer_.manifest().number > 0) folder_.remove_leftovers();
  if (!written) return written;
  return folder_.sync();
}

}  // namespace tandem::audience
