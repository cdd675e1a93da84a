// Implements "Drawing" of tandem.h.
#include <cstddef>
#include <limits>

#include "sdk/client/api/clients.hpp"
#include "sdk/client/api/structs.hpp"

namespace tandem::api {
namespace {

static_assert(TANDEM_INTERPOLATE == static_cast<int>(SampleMode::kInterpolate) &&
              TANDEM_EXTRAPOLATE == static_cast<int>(SampleMode::kExtrapolate));
static_assert(TANDEM_CHANGE_NONE == static_cast<int>(BodyChange::kNone) &&
              TANDEM_CHANGE_NEW == static_cast<int>(BodyChange::kNew) &&
              TANDEM_CHANGE_GONE == static_cast<int>(BodyChange::kGone) &&
              TANDEM_CHANGE_JUMPED == static_cast<int>(BodyChange::kJumped));

constexpr double kLongestSmoothingS = 10;

tandem_result check(const tandem_sample_options& options) {
  if (options.mode != TANDEM_INTERPOLATE && options.mode != TANDEM_EXTRAPOLATE) {
    return refuse(TANDEM_INVALID_ARGUMENT, "a mode must be TANDEM_INTERPOLATE or TANDEM_EXTRAPOLATE");
  }
  if (!(options.smoothing_s <= kLongestSmoothingS)) {
    return refuse(TANDEM_INVALID_ARGUMENT, "smoothing_s must be at most 10");
  }
  return kOk;
}

tandem_result check(const tandem_columns& columns) {
  constexpr std::uint32_t kVector = 3 * sizeof(float);
  struct Stride {
    std::uint32_t bytes, least;
  };
  for (const Stride stride :
       {Stride{columns.position_stride, kVector}, Stride{columns.velocity_stride, kVector},
        Stride{columns.orientation_stride, 4 * sizeof(float)},
        Stride{columns.angular_velocity_stride, kVector},
        Stride{columns.type_stride, sizeof(std::uint16_t)}}) {
    if (stride.bytes != 0 && stride.bytes < stride.least) {
      return refuse(TANDEM_INVALID_ARGUMENT, "a stride is shorter than its element");
    }
  }
  return kOk;
}

}  // namespace
}  // namespace tandem::api

using namespace tandem;  // what follows is C
using namespace tandem::api;

tandem_result tandem_sample(tandem_client client, const tandem_sample_options* options,
                            const tandem_columns* columns, tandem_frame* frame) noexcept {
  return with_client(client, [&](RunningClient& running) {
    tandem_sample_options how = TANDEM_SAMPLE_OPTIONS_INIT;
    tandem_columns where = TANDEM_COLUMNS_INIT;
    tandem_frame what = TANDEM_FRAME_INIT;
    tandem_result result = TANDEM_OK;
    where.capacity = std::numeric_limits<std::uint32_t>::max();  // without columns any capacity is enough
    if (options != nullptr) result = read_struct(options, how);
    if (result == TANDEM_OK && columns != nullptr) result = read_struct(columns, where);
    if (result == TANDEM_OK && frame != nullptr) {
      result = check_struct(frame);
      if (result == TANDEM_OK) std::memcpy(&what, frame, std::min<std::size_t>(size_of(frame), sizeof what));
    }
    if (result == TANDEM_OK) result = check(how);
    if (result == TANDEM_OK) result = check(where);
    if (result != TANDEM_OK) return result;
    const auto sampled = running.sample(how, where, what);
    const bool filled = sampled || sampled.error().code == ErrorCode::kCapacity;
    if (filled && frame != nullptr) write_struct(what, frame);
    return sampled ? kOk : refuse(sampled.error());
  });
}
