#include "sdk/core/timeline/parts.hpp"

#include <utility>

#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/tables/predictor_table.hpp"

namespace tandem {

Result<TimelineParts> make_parts(const Layout& layout, const LocalOptions& local,
                                 std::unique_ptr<Predictor> predictor) {
  if (auto good = check_layout(layout); !good) return tl::unexpected<Error>(good.error());
  // Empty for a caller's own predictor.
  const auto traits = find_predictor(local.encodes_as.empty() ? layout.predictor : local.encodes_as);
  auto codec = make_codec({.name = layout.codec,
                           .capacity = layout.capacity,
                           .tables = layout.codec_tables,
                           .tracker = traits ? (*traits)->tracker : basic_predictor().tracker,
                           .groups = groups_of(layout),
                           .radii = layout.radii,
                           .run_blocks = local.run_blocks});
  if (!codec) return tl::unexpected<Error>(codec.error());
  const bool reads_turn_steps = groups_of(layout).orientation && codec_traits(layout.codec)->reads_steps;
  if (has_turn_steps(layout.parameters.codec) != reads_turn_steps)
    return fail(ErrorCode::kInvalidArgument,
                "steps of turns that nothing reads, or none where they are read");
  if (const auto own = find_predictor(layout.predictor);
      own && (*own)->hard_contacts != layout.parameters.step.contacts.listed)
    return fail(ErrorCode::kInvalidArgument,
                "parameters of contacts that the predictor does not read, or none where it does");
  if (traits && (*traits)->reads_shapes && !groups_of(layout).orientation)
    return fail(ErrorCode::kInvalidArgument, "this predictor is for bodies that turn");
  predictor->spread_by(local.run_blocks);
  return TimelineParts{
      std::move(predictor),
      DeltaCodec(std::move(*codec), layout.capacity, layout.parameters, layout.type_count, groups_of(layout),
                 layout.radii),
      local.run_blocks,
      StateHasher(),
      layout.world,
      layout.world.any() ? std::optional<SessionWorld>(SessionWorld()) : std::nullopt,
      layout.data.empty() ? std::nullopt : std::optional<BodyData>({layout.data, layout.capacity})};
}

}  // namespace tandem
