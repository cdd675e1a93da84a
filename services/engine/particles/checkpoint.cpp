#include "services/engine/common/checkpoint_bytes.hpp"
#include "services/engine/particles/columns.hpp"

namespace tandem::engine {
namespace {

constexpr std::uint64_t kMagic = 0x31545250444E4154;  // "TANDPRT1"

using Reader = CheckpointReader;
using Writer = CheckpointWriter;

// One list for both directions, so that they cannot differ.
template <class Io, class C>
void each_fixed(Io& io, C& columns) {
  for (auto& column : columns.position) io.column(column);
  for (auto& column : columns.velocity) io.column(column);
  io.column(columns.alive);
  io.column(columns.type);
  for (auto& contact : columns.contact) {
    io.value(contact.force);
    io.value(contact.touching);
  }
  io.value(columns.frame);
  io.value(columns.spawned);
  io.value(columns.gravity);
  io.column(columns.due);
}

}  // namespace

void save_columns(const Columns& columns, std::uint64_t world_fingerprint, std::vector<std::byte>& out) {
  const std::size_t begin = out.size();
  Writer writer(out);
  writer.value(CheckpointHead{kMagic, world_fingerprint, columns.pushes.size()});
  each_fixed(writer, columns);
  writer.column(columns.pushes);
  seal(out, begin);
}

bool load_columns(std::span<const std::byte> bytes, std::uint64_t world_fingerprint, Columns& columns) {
  const auto body = unsealed(bytes);
  if (!body) return false;
  Reader reader(*body);
  CheckpointHead head{};
  reader.value(head);
  if (head.magic != kMagic || head.world != world_fingerprint || head.waiting > kMaxPushes) return false;
  Columns loaded(static_cast<std::uint32_t>(columns.alive.size()));
  loaded.due.resize(columns.due.size());
  loaded.pushes.resize(head.waiting);
  each_fixed(reader, loaded);
  reader.column(loaded.pushes);
  if (!reader.at_end()) return false;
  columns = std::move(loaded);
  return true;
}

}  // namespace tandem::engine
