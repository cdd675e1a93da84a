#include "services/relay/kept_state.hpp"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <system_error>
#include <utility>
#include <variant>

#include "sdk/transport/envelope.hpp"

namespace tandem::relay {

namespace {
constexpr std::size_t kSizeBytes = 4;
}  // namespace

std::vector<transport::SnapshotMessage> KeptState::read() const {
  std::error_code missing;
  const auto size_of_file = std::filesystem::file_size(path_, missing);
  if (missing || size_of_file > kMostBytes) return {};
  std::ifstream in(path_, std::ios::binary);
  const std::vector<char> chars{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  std::span<const std::byte> rest = std::as_bytes(std::span<const char>(chars));
  std::vector<transport::SnapshotMessage> snapshots;
  while (!rest.empty()) {
    if (rest.size() < kSizeBytes) return {};
    std::size_t size = 0;
    for (std::size_t i = 0; i < kSizeBytes; ++i) size |= std::to_integer<std::size_t>(rest[i]) << (8 * i);
    rest = rest.subspan(kSizeBytes);
    if (size == 0 || size > rest.size()) return {};
    auto message = transport::read_gateway_envelope(rest.first(size), {.max_snapshot_bytes = kMostBytes});
    auto* const snapshot = message ? std::get_if<transport::SnapshotMessage>(&*message) : nullptr;
    if (snapshot == nullptr || snapshot->parts != 1) return {};
    snapshots.push_back(std::move(*snapshot));
    rest = rest.subspan(size);
  }
  return snapshots;
}

Result<void> KeptState::write(const std::vector<transport::SnapshotMessage>& snapshots) const {
  transport::Bytes file;
  for (const transport::SnapshotMessage& snapshot : snapshots) {
    const std::size_t at = file.size();
    file.resize(at + kSizeBytes);
    write_envelope(snapshot, file);
    const std::size_t size = file.size() - at - kSizeBytes;
    for (std::size_t i = 0; i < kSizeBytes; ++i) file[at + i] = static_cast<std::byte>(size >> (8 * i));
  }
  if (file.size() > kMostBytes)
    return fail(ErrorCode::kCapacity, path_ + ": the session's state is too large to be kept");
  const std::string fresh = path_ + ".new";
  std::ofstream out(fresh, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(file.data()), static_cast<std::streamsize>(file.size()));
  out.close();
  if (!out || std::rename(fresh.c_str(), path_.c_str()) != 0)
    return fail(ErrorCode::kIo, path_ + ": cannot be written");
  return {};
}

}  // namespace tandem::relay
