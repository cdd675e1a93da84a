#pragma once
// Training of the thesis's codecs: quantisation ranges and Huffman code lengths from one run of a scene.

#include <functional>

#include "services/engines/scenes/trained.hpp"
#include "services/engines/sessions/session_plan.hpp"
#include "services/lab/measures/scene_source.hpp"
#include "tandem/result.hpp"

namespace tandem::lab {

/// Passes of train() over its source.
inline constexpr std::uint64_t kTrainingPasses = 2;

/// Runs the source that `make` makes of `scene`: with `selective` for the maximum residuals, then for the
/// symbol counts with `quantized` and 1.1 x those residuals as ranges (thesis, section 3.3.2). Codec,
/// predictor and automatic quality of `choice` are not used; `progress` gets the frame out of kTrainingPasses
/// x frames. Errors: what the source, the session and the stream refuse.
[[nodiscard]] Result<scenes::TrainedTable> train(scenes::Scene scene, sessions::SessionChoice choice,
                                                 const std::function<Result<Source>()>& make,
                                                 std::uint64_t frames,
                                                 const std::function<void(Frame)>& progress);

}  // namespace tandem::lab
