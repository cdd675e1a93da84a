#include "sdk/core/layout/layout.hpp"

#include <algorithm>

#include "sdk/core/lattice/hash.hpp"

namespace tandem {

namespace {

Result<void> check_groups(const Layout& layout) {
  const auto refuse = [](std::string reason) { return fail(ErrorCode::kInvalidArgument, std::move(reason)); };
  bool complete = true, needs_radii = false;
  auto name = layout.groups.begin();
  for (const ChannelGroup& each : kChannelGroups) {
    const bool listed = name != layout.groups.end() && *name == each.name;
    complete &= listed || each.listed != nullptr;
    if (listed) ++name;
    needs_radii |= listed && each.needs_radii;
  }
  if (!layout.data.empty() && name != layout.groups.end() && *name == kDataGroup) {
    ++name;
  } else if (!layout.data.empty()) {
    return refuse("fields of data without the group");
  }
  if (name != layout.groups.end())
    return fail(ErrorCode::kUnsupported,
                "unknown channel group '" + *name + "', or one that is repeated or out of order");
  if (!complete) return refuse("channel groups without position");
  if (!needs_radii && !layout.radii.empty()) return refuse("radii that no channel group needs");
  if (!needs_radii) return {};
  if (layout.radii.size() != layout.type_count) return refuse("orientations need a radius for each type");
  for (const std::int32_t radius : layout.radii) {
    if (radius < 1 || radius > kPositionLimit)
      return refuse("a radius that is not in 1 .. 2^30 lattice units");
  }
  return {};
}

}  // namespace

Result<void> check_layout(const Layout& layout) {
  const auto refuse = [](std::string reason) { return fail(ErrorCode::kInvalidArgument, std::move(reason)); };
  if (layout.capacity == 0 || layout.capacity > kMaxCapacity) {
    return refuse("capacity " + std::to_string(layout.capacity) + " is not in 1 .. " +
                  std::to_string(kMaxCapacity));
  }
  if (layout.type_count == 0) return refuse("a session has at least one type");
  if (!valid_parameters(layout.parameters.codec)) return refuse("parameters unknown or out of range");
  if (layout.lead > kMaxLead)
    return refuse("lead " + std::to_string(layout.lead) + " is above " + std::to_string(kMaxLead));
  if (auto good = check_data_fields(layout.data); !good) return good;
  return check_groups(layout);
}

Groups groups_of(const Layout& layout) {
  Groups groups;
  for (const ChannelGroup& each : kChannelGroups) {
    if (each.listed == nullptr) continue;
    groups.*each.listed =
        std::find(layout.groups.begin(), layout.groups.end(), each.name) != layout.groups.end();
  }
  return groups;
}

std::uint64_t layout_hash(const Layout& layout, std::uint32_t protocol_version,
                          std::uint64_t lattice_unit_bits) {
  // The hash is of a text, so that a client in any language can build the same bytes.
  std::string text = "tandem-layout " + std::to_string(protocol_version);
  const auto append = [&text](const auto& values) {
    for (const std::int32_t value : values) text += ' ' + std::to_string(value);
  };
  text += "\ncapacity " + std::to_string(layout.capacity);
  text += "\ntypes " + std::to_string(layout.type_count);
  text += "\nlattice_unit " + to_hex(lattice_unit_bits);
  text += "\nlead " + std::to_string(layout.lead);
  if (layout.world.any()) text += "\nfeatures";
  if (layout.world.events) text += " events";
  if (layout.world.keys) text += " keys";
  if (!layout.data.empty()) text += "\ndata";
  for (const DataField& field : layout.data)
    text.append(" ").append(field.name).append(":").append(kDataKinds.at(field.kind));
  text += "\ngroups";
  for (const std::string& group : layout.groups) text += ' ' + group;
  text += "\nradii";
  append(layout.radii);
  text += "\ncodec " + layout.codec;
  text += "\ncodec_tables " + to_hex(hash_bytes(layout.codec_tables));
  text += "\npredictor " + layout.predictor;
  text += "\npredictor_constants";
  append(layout.predictor_constants);
  text += "\nparameters";
  for (const auto& [id, value] : list_parameters(layout.parameters)) {
    text += ' ' + std::to_string(id) + '=' + std::to_string(value);
  }
  text += '\n';
  return hash_bytes(std::as_bytes(std::span(text)));
}

}  // namespace tandem
