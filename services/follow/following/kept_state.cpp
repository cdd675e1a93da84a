#include "services/follow/following/kept_state.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <system_error>
#include <utility>
#include <variant>

#include "sdk/core/lattice/bytes.hpp"
#include "sdk/wire/envelope.hpp"

namespace tandem::following {

KeptState::States KeptState::read() const {
  std::error_code missing;
  const auto size_of_file = std::filesystem::file_size(path_, missing);
  if (missing || size_of_file > kMaxBytes) return {};
  std::ifstream in(path_, std::ios::binary);
  const std::vector<char> chars{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  ByteReader file(std::as_bytes(std::span<const char>(chars)));
  States snapshots;
  while (file.remaining() > 0) {
    const auto envelope = file.get_bytes(file.get<std::uint32_t>());
    if (envelope.empty()) return {};
    auto message = transport::read_gateway_envelope(envelope, {.max_snapshot_bytes = kMaxBytes});
    auto* const snapshot = message ? std::get_if<transport::SnapshotMessage>(&*message) : nullptr;
    if (snapshot == nullptr || snapshot->parts != 1) return {};
    snapshots.push_back(std::move(*snapshot));
  }
  return snapshots;
}

Result<void> KeptState::write(const States& states) const {
  transport::Bytes file;
  for (const transport::SnapshotMessage& snapshot : states) {
    const std::size_t at = file.size();
    file.resize(at + sizeof(std::uint32_t));
    write_envelope(snapshot, file);
    const auto size = static_cast<std::uint32_t>(file.size() - at - sizeof(std::uint32_t));
    ByteWriter(std::span(file).subspan(at)).put(size);
  }
  if (file.size() > kMaxBytes)
    return fail(ErrorCode::kCapacity, path_ + ": the session's state is too large to be kept");
  const std::string fresh = path_ + ".new";
  std::ofstream out(fresh, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(file.data()), static_cast<std::streamsize>(file.size()));
  out.close();
  if (!out || std::rename(fresh.c_str(), path_.c_str()) != 0)
    return fail(ErrorCode::kIo, path_ + ": cannot be written");
  return {};
}

transport::SnapshotMessage KeptState::state(FollowedWorld::Cut&& cut, Epoch epoch) {
  transport::SnapshotMessage state;
  state.epoch = epoch;
  state.stream = cut.stream;
  state.frame = cut.frame;
  state.total_bytes = static_cast<std::uint32_t>(cut.bytes.size());
  state.bytes = std::move(cut.bytes);
  return state;
}

std::optional<transport::SnapshotMessage> KeptState::find(const States& states, Epoch epoch,
                                                          const StreamId& stream) {
  const auto found = std::ranges::find_if(states, [&](const transport::SnapshotMessage& state) {
    return state.epoch == epoch && state.stream == stream;
  });
  return found == states.end() ? std::nullopt : std::optional(*found);
}

}  // namespace tandem::following
