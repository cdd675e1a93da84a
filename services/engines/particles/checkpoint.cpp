#include "services/engines/common/checkpoint_bytes.hpp"
#include "services/engines/particles/columns.hpp"

namespace tandem::engine {
namespace {

constexpr std::uint64_t kMagic = 0x32545250444E4154;  // "TANDPRT2"

using Reader = CheckpointReader;
using Writer = CheckpointWriter;

// One list for both directions, so that they cannot differ.
template <class Io, class C>
void each_column(Io& io, C& columns) {
  for (auto& column : columns.position) io.column(column);
  for (auto& column : columns.velocity) io.column(column);
  io.column(columns.alive);
  io.column(columns.type);
}

template <class Io, class C>
void each_value(Io& io, C& columns) {
  io.value(columns.frame);
  io.value(columns.spawned);
  io.value(columns.gravity);
  io.column(columns.due);
}

template <class Io, class I>
void each_place(Io& io, I& image) {
  io.column(image.slot);
  for (auto& column : image.anchor) io.column(column);
  for (auto& column : image.force) io.column(column);
  io.column(image.state);
  io.value(image.felt_gravity);
  io.value(image.skin);
  io.value(image.sleep_speed);
  io.value(image.drift);
  io.value(image.mean_velocity);
  io.value(image.sorted);
  io.value(image.crowded);
}

}  // namespace

void save_checkpoint(const Columns& columns, const PileImage& image, std::uint64_t world_fingerprint,
                     std::vector<std::byte>& out) {
  constexpr std::size_t kBytesPerSlot = 6 * sizeof(float) + 3, kBytesPerPlace = 7 * sizeof(float) + 1;
  const std::size_t begin = out.size();
  out.reserve(begin + kBytesPerSlot * columns.alive.size() + kBytesPerPlace * image.slot.size() +
              columns.pushes.size() * sizeof(Push) + 4096);
  Writer writer(out);
  writer.value(CheckpointHead{kMagic, world_fingerprint, columns.pushes.size()});
  each_column(writer, columns);
  each_value(writer, columns);
  writer.value(static_cast<std::uint32_t>(image.slot.size()));
  each_place(writer, image);
  writer.column(columns.pushes);
  seal(out, begin);
}

bool load_checkpoint(std::span<const std::byte> bytes, std::uint64_t world_fingerprint, std::size_t emitters,
                     Checkpoint& out) {
  const auto body = unsealed(bytes);
  if (!body) return false;
  Reader reader(*body);
  CheckpointHead head{};
  reader.value(head);
  if (head.magic != kMagic || head.world != world_fingerprint || head.waiting > kMaxPushes) return false;
  out.columns.due.resize(emitters);
  out.columns.pushes.resize(head.waiting);
  each_column(reader, out.columns);
  each_value(reader, out.columns);
  std::uint32_t places = 0;
  reader.value(places);
  if (places > bytes.size() / sizeof(Float3)) return false;
  out.image.slot.resize(places);
  for (auto& column : out.image.anchor) column.resize(places);
  for (auto& column : out.image.force) column.resize(places);
  out.image.state.resize(places);
  each_place(reader, out.image);
  reader.column(out.columns.pushes);
  return reader.at_end();
}

}  // namespace tandem::engine
