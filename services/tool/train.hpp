#pragma once
// Training of the paper's codecs: quantisation ranges and Huffman code lengths from one run of a scene.

#include <functional>

#include "services/scenes/trained.hpp"
#include "services/tool/scene_source.hpp"

namespace tandem::tool {

/// Runs the source that `make` makes twice: for the largest residuals with `selective`, then for the symbol
/// counts with `quantized` and 1.1 x those residuals as ranges (paper, 3.3.2). `progress` gets the frame out
/// of 2 x frames. Errors: what the source and the timeline refuse.
[[nodiscard]] Result<scenes::TrainedTable> train(const std::function<Result<Source>()>& make,
                                                 const std::string& predictor, std::uint64_t frames,
                                                 const std::function<void(Frame)>& progress);

}  // namespace tandem::tool
