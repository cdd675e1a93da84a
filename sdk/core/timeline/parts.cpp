#include "sdk/core/timeline/parts.hpp"

#include <utility>

namespace tandem {

Result<TimelineParts> make_parts(const Layout& layout, const LocalOptions& local,
                                 std::unique_ptr<Predictor> predictor) {
  if (auto good = check_layout(layout); !good) return tl::unexpected<Error>(good.error());
  auto codec = make_codec(layout.codec, layout.capacity, layout.codec_tables);
  if (!codec) return tl::unexpected<Error>(codec.error());
  (*codec)->predicted_by(predictor->name());
  (*codec)->run_blocks_on(local.run_blocks);
  (*codec)->account_to(local.account);
  return TimelineParts{std::move(predictor),
                       DeltaCodec(std::move(*codec), layout.capacity, layout.parameters, layout.type_count)};
}

}  // namespace tandem
