#include <algorithm>
#include <cstring>

#include "services/engine/common/checkpoint_bytes.hpp"
#include "services/engine/particles/columns.hpp"

namespace tandem::engine {
namespace {

constexpr std::uint64_t kMagic = 0x31545250444E4154;  // "TANDPRT1"

using Reader = CheckpointReader;
using Writer = CheckpointWriter;

// A contact without its padding. Whole runs of them are handed over, as one by one takes ten times as long.
struct PackedContact {
  std::array<std::byte, sizeof(Float3) + 1> bytes;
};
constexpr std::size_t kRun = 1024;

void each_contact(Writer& io, const std::vector<Contact>& contacts) {
  std::vector<PackedContact> run;
  run.reserve(kRun);
  for (std::size_t begin = 0; begin < contacts.size(); begin += kRun) {
    run.resize(std::min(kRun, contacts.size() - begin));
    for (std::size_t i = 0; i < run.size(); ++i) {
      const Contact& contact = contacts[begin + i];
      std::memcpy(run[i].bytes.data(), &contact.force, sizeof contact.force);
      run[i].bytes.back() = contact.touching ? std::byte{1} : std::byte{0};
    }
    io.column(run);
  }
}

void each_contact(Reader& io, std::vector<Contact>& contacts) {
  for (Contact& contact : contacts) {
    std::uint8_t touching = 0;
    io.value(contact.force);
    io.value(touching);
    contact.touching = touching != 0;
  }
}

// One list for both directions, so that they cannot differ.
template <class Io, class C>
void each_fixed(Io& io, C& columns) {
  for (auto& column : columns.position) io.column(column);
  for (auto& column : columns.velocity) io.column(column);
  io.column(columns.alive);
  io.column(columns.type);
  each_contact(io, columns.contact);
  io.value(columns.frame);
  io.value(columns.spawned);
  io.value(columns.gravity);
  io.column(columns.due);
}

}  // namespace

void save_columns(const Columns& columns, std::uint64_t world_fingerprint, std::vector<std::byte>& out) {
  constexpr std::size_t kBytesPerSlot = 6 * sizeof(float) + sizeof(PackedContact) + 3;
  const std::size_t begin = out.size();
  out.reserve(begin + kBytesPerSlot * columns.alive.size() + columns.pushes.size() * sizeof(Push) + 4096);
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
