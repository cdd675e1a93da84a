#include "sdk/core/timeline/parts.hpp"

#include <string>
#include <utility>

namespace tandem {

Result<TimelineParts> make_parts(const TimelineConfig& config, std::unique_ptr<Predictor> predictor) {
  if (config.capacity == 0 || config.capacity > kMaxCapacity) {
    return fail(ErrorCode::kInvalidArgument, "capacity " + std::to_string(config.capacity) +
                                                 " is not in 1 .. " + std::to_string(kMaxCapacity));
  }
  if (config.type_count == 0) return fail(ErrorCode::kInvalidArgument, "a session has at least one type");
  if (!valid_parameters(config.parameters))
    return fail(ErrorCode::kInvalidArgument, "codec parameters out of range");
  if (config.max_lead > kMaxLead) {
    return fail(ErrorCode::kInvalidArgument,
                "lead " + std::to_string(config.max_lead) + " is above " + std::to_string(kMaxLead));
  }
  auto codec = make_codec(config.codec, config.capacity, config.codec_tables);
  if (!codec) return tl::unexpected<Error>(codec.error());
  (*codec)->predicted_by(predictor->name());
  (*codec)->run_blocks_on(config.run_blocks);
  (*codec)->account_to(config.account);
  return TimelineParts{std::move(predictor),
                       DeltaCodec(std::move(*codec), config.capacity, config.parameters, config.type_count)};
}

}  // namespace tandem
