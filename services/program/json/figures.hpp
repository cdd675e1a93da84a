#pragma once
// Figures as JSON.

#include <string_view>

#include "services/program/json/json.hpp"

namespace tandem {

/// Adds a member with this name; a percentile such as `frame_ms_p50` becomes the member `p50` of `frame_ms`.
inline void put_figure(Json& object, std::string_view name, const Json& value) {
  const std::string_view percentile = name.substr(name.rfind('_') + 1);
  if (percentile == "p50" || percentile == "p99") {
    object[name.substr(0, name.size() - percentile.size() - 1)][percentile] = value;
  } else {
    object[name] = value;
  }
}

}  // namespace tandem
