#include "services/tandemd/configuration/form.hpp"

#include <fmt/format.h>

#include "sdk/core/tables/codec_table.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "server.pb.h"
#include "services/host/planning/wishes.hpp"

namespace tandem::daemon {

const configuration::Form& form() {
  static const configuration::Form all = [] {
    std::vector<std::string_view> keys;
    for (const planning::StreamOption& option : planning::kStreamOptions) keys.push_back(option.key);
    const PredictorTraits& best = predictors().front();
    return configuration::Form(*idl::ServerConfig::descriptor(),
                               {{"codecs", fmt::format("{}", fmt::join(codec_names(), ", "))},
                                {"predictors", fmt::format("{}", fmt::join(predictor_names(), ", "))},
                                {"stream_keys", fmt::format("{}", fmt::join(keys, ", "))},
                                {"basic", std::string(basic_predictor().name)},
                                {"best", std::string(best.name)},
                                {"most_bodies", fmt::format("{}", best.most_bodies)}});
  }();
  return all;
}

}  // namespace tandem::daemon
