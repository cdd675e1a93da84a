#include "sdk/core/layout/layout.hpp"

#include "sdk/core/lattice/hash.hpp"

namespace tandem {

Result<void> check_layout(const Layout& layout) {
  const auto refuse = [](std::string reason) { return fail(ErrorCode::kInvalidArgument, std::move(reason)); };
  if (layout.capacity == 0 || layout.capacity > kMaxCapacity) {
    return refuse("capacity " + std::to_string(layout.capacity) + " is not in 1 .. " +
                  std::to_string(kMaxCapacity));
  }
  if (layout.type_count == 0) return refuse("a session has at least one type");
  if (!valid_parameters(layout.parameters.codec)) return refuse("codec parameters out of range");
  if (layout.lead > kMaxLead)
    return refuse("lead " + std::to_string(layout.lead) + " is above " + std::to_string(kMaxLead));
  return {};
}

std::uint64_t layout_hash(const Layout& layout, std::uint32_t protocol_version,
                          std::uint64_t lattice_unit_bits) {
  // A text, so that a client in any language can build the same bytes.
  const CodecParameters& first = layout.parameters.codec;
  std::string text = "tandem-layout " + std::to_string(protocol_version);
  text += "\ncapacity " + std::to_string(layout.capacity);
  text += "\nlattice_unit " + to_hex(lattice_unit_bits);
  text += "\nlead " + std::to_string(layout.lead);
  text += "\ncodec " + layout.codec;
  text += "\ncodec_tables " + to_hex(hash_bytes(layout.codec_tables));
  text += "\nparameters " + std::to_string(first.threshold) + ' ' + std::to_string(first.position_step) +
          ' ' + std::to_string(first.velocity_step);
  text += "\npredictor " + layout.predictor;
  text += "\npredictor_constants";
  for (const std::int32_t constant : layout.predictor_constants) text += ' ' + std::to_string(constant);
  text += "\ntypes " + std::to_string(layout.type_count) + '\n';
  return hash_bytes(std::as_bytes(std::span(text)));
}

}  // namespace tandem
