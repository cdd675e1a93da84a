#include "services/follow/audience/publication.hpp"

#include <string>
#include <utility>
#include <vector>

namespace tandem::audience {
namespace {

constexpr std::uint64_t kMillisecondsASecond = 1000;

}  // namespace

Result<std::unique_ptr<Publication>> Publication::open(const std::string& folder,
                                                       const Writer::Options& options, bool anew) {
  auto opened = Folder::open(folder);
  if (!opened) return tl::unexpected(opened.error());
  std::unique_ptr<Publication> made(new Publication(std::move(*opened), options));
  if (anew) return made;
  if (auto gone_on = made->go_on(folder, options.keep_ns > 0 || options.keep_bytes > 0); !gone_on)
    return tl::unexpected(gone_on.error());
  return made;
}

Result<void> Publication::go_on(const std::string& path, bool removes_old) {
  const std::string name = path + "/" + kManifestName;
  auto text = folder_.read(kManifestName);
  if (!text) return tl::unexpected(text.error());
  if (!*text) return {};
  auto before = read_manifest(**text);
  if (!before && before.error().code == ErrorCode::kUnsupported)
    return fail(before.error().code,
                name + ": " + before.error().message + "; choose another folder, or empty this one");
  if (!before) {
    folder_.keep_all();  // somebody may know how to mend it
    told_ = name + " cannot be read, and another takes its place: " + before.error().message;
    return {};
  }
  std::vector<std::vector<Passage>> chapters;
  if (removes_old) {
    std::erase_if(before->chapters, [&](const Chapter& chapter) {
      const auto bytes = folder_.read(chapter.object.path());
      auto passages = bytes && *bytes ? read_chapter(**bytes) : Result<std::vector<Passage>>();
      if (!passages || passages->empty()) return true;  // nobody can play it
      chapters.push_back(std::move(*passages));
      return false;
    });
  }
  told_ = path + ": goes on behind the " +
          std::to_string(before->passages.back().to_ms() / kMillisecondsASecond) + " s that are there";
  writer_.go_on(std::move(*before), std::move(chapters));
  // Without the chapters' own objects it is not known which are left over.
  if (!removes_old) folder_.keep_all();
  writer_.each_object([this](const std::string& object) { folder_.keep(object); });
  return {};
}

void Publication::turned(client::Now now) {
  writer_.turned(now.steady_ns);
  if (writer_.manifest().number == 0) return;
  if (!leftovers_due_ns_) leftovers_due_ns_ = now.steady_ns + Writer::kGraceNs;
  if (now.steady_ns >= *leftovers_due_ns_) folder_.remove_leftovers();
}

Result<void> Publication::finish(client::Now now) {
  auto written = writer_.finish(now.steady_ns);
  // Nobody is left to do it later.
  if (writer_.manifest().number > 0) folder_.remove_leftovers();
  if (!written) return written;
  return folder_.sync();
}

}  // namespace tandem::audience
