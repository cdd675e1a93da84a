#include "services/host/checkpoint/folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string_view>
#include <utility>

#include "services/host/checkpoint/format.hpp"
#include "services/program/number.hpp"

namespace tandem::checkpoint {
namespace {

constexpr std::string_view kEnding = ".checkpoint";
constexpr std::string_view kUnfinished = ".part";  // behind the name
constexpr std::size_t kDigits = 20;                // those of 2^64
// In ms since 1970 the year 2983. A name beyond it is no server's, and what follows on it might not be read.
constexpr Epoch kLastNamedEpoch = 32'000'000'000'000;
static_assert(kLastNamedEpoch < kLastEpoch / 2);

bool is_unfinished(const std::string& name) {
  return name.ends_with(kUnfinished) && moment_of(name.substr(0, name.size() - kUnfinished.size()));
}

}  // namespace

std::string file_name(const Moment& moment) {
  return fmt::format("{:020}-{:020}{}", moment.epoch, moment.frame, kEnding);
}

std::optional<Moment> moment_of(const std::string& file_name) {
  const std::string_view name = file_name;
  if (name.size() != 2 * kDigits + 1 + kEnding.size() || !name.ends_with(kEnding) || name[kDigits] != '-')
    return std::nullopt;
  const auto epoch = text::number<std::uint64_t>(name.substr(0, kDigits));
  const auto frame = text::number<std::uint64_t>(name.substr(kDigits + 1, kDigits));
  if (!epoch || !frame) return std::nullopt;
  return Moment{*epoch, *frame};
}

Result<Folder::Found> Folder::newest(const Accept& accept) {
  auto names = disk_->list();
  if (!names) return fail(names.error().code, fmt::format("{}: {}", disk_->name(), names.error().message));
  Found found;
  std::map<Epoch, std::vector<std::string>> runs;  // of servers
  for (const std::string& name : *names) {
    if (is_unfinished(name)) static_cast<void>(disk_->remove(name));  // a read-only folder keeps it
    const auto moment = moment_of(name);
    if (!moment) continue;
    if (moment->epoch <= kLastNamedEpoch) found.newest_epoch = std::max(found.newest_epoch, moment->epoch);
    runs[moment->epoch].push_back(name);
  }
  // Older runs are asked, too: a file that this server would refuse must not be removed as one of its own. A
  // run is of one world, so one good file of it is enough. The newest is asked last, as `accept` may load it.
  for (auto& [epoch, files] : runs) {
    std::ranges::sort(files);
    std::vector<std::string> refused;
    for (; !files.empty(); files.pop_back()) {
      auto good = read_good(files.back(), accept);
      if (good) {
        found.checkpoint = std::move(*good);
        found.file = files.back();
        found.refused.clear();
        ours_.insert(ours_.end(), files.begin(), files.end());
        break;
      }
      refused.push_back(fmt::format("{}/{}: {}", disk_->name(), files.back(), good.error().message));
    }
    found.refused.insert(found.refused.begin(), refused.begin(), refused.end());
  }
  return found;
}

Result<Checkpoint> Folder::read_good(const std::string& file, const Accept& accept) {
  return disk_->read(file, kMaxFileBytes)
      .and_then([](const std::vector<std::byte>& bytes) { return decode(bytes); })
      .and_then([&](Checkpoint checkpoint) -> Result<Checkpoint> {
        if (file_name({checkpoint.epoch, checkpoint.frame}) != file)
          return fail(ErrorCode::kMalformed, "its name is that of another checkpoint");
        if (auto accepted = accept(checkpoint); !accepted) return tl::unexpected(accepted.error());
        return checkpoint;
      });
}

Result<void> Folder::write_whole(const std::string& file, std::span<const std::byte> bytes) {
  const std::string unfinished = file + std::string(kUnfinished);
  auto written = disk_->write(unfinished, bytes)
                     .and_then([&] { return disk_->sync(unfinished); })
                     .and_then([&] { return disk_->rename(unfinished, file); })
                     .and_then([&] { return disk_->sync_folder(); });
  if (!written) static_cast<void>(disk_->remove(unfinished));  // a full disk needs the room
  return written;
}

Result<void> Folder::store(const Moment& moment, std::span<const std::byte> file) {
  const std::string name = file_name(moment);
  auto written = disk_->reopen().and_then([&] { return write_whole(name, file); });
  if (!written) {
    return fail(written.error().code, fmt::format("{}/{}: {}", disk_->name(), name, written.error().message));
  }
  std::erase(ours_, name);
  ours_.push_back(name);
  while (ours_.size() > kKept) {
    static_cast<void>(disk_->remove(ours_.front()));  // one that is gone already is no loss
    ours_.erase(ours_.begin());
  }
  return {};
}

}  // namespace tandem::checkpoint
