#include "services/host/planning/wishes.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "sdk/core/lattice/assert.hpp"
#include "sdk/core/tables/predictor_table.hpp"
#include "sdk/workers/workers.hpp"
#include "services/host/frames/configuration.hpp"
#include "services/program/number.hpp"

namespace tandem::planning {
namespace {

const StreamOption* find_option(std::string_view key) {
  const auto* const found = std::ranges::find(kStreamOptions, key, &StreamOption::key);
  return found == kStreamOptions.end() ? nullptr : found;
}

std::string known_keys() {
  std::string keys;
  for (const StreamOption& option : kStreamOptions) {
    if (!keys.empty()) keys += ", ";
    keys += option.key;
  }
  return keys;
}

/// Stores a value in its field; returns false for an invalid one.
struct Set {
  std::string_view value;
  Wishes* wishes;

  bool operator()(std::string Wishes::*field) const {
    wishes->*field = std::string(value);
    return !value.empty();
  }
  bool operator()(double Wishes::*field) const {
    const auto read = text::number<double>(value);
    if (read) wishes->*field = *read;
    return read.has_value();
  }
  template <class T>
  bool operator()(std::optional<T> Wishes::*field) const {
    const auto read = text::number<T>(value);
    if (read) wishes->*field = *read;
    return read.has_value();
  }
  bool operator()(std::vector<double> Wishes::*field) const {
    auto read = read_numbers(value);
    if (read) wishes->*field = std::move(*read);
    return read.has_value();
  }
};

Result<void> set(std::string_view key, std::string_view value, Wishes& wishes) {
  const auto wrong = [](std::string what) { return fail(ErrorCode::kInvalidArgument, std::move(what)); };
  const StreamOption* const option = find_option(key);
  if (option == nullptr) return wrong(fmt::format("unknown key '{}'; known are {}", key, known_keys()));
  if (!std::visit(Set{value, &wishes}, option->field))
    return wrong(fmt::format("'{}' cannot be read as {}", value, key));
  if (option->automatic) wishes.automatic = *option->automatic;
  return {};
}

bool says(const StreamWishes& stream, std::string_view key) {
  return std::ranges::any_of(stream.settings, [key](const auto& setting) { return setting.first == key; });
}

// What is wrong with the delays of a stream; empty: nothing.
std::string_view wrong_with_delays(const std::vector<double>& delays_s) {
  const auto in_range = [](double delay_s) { return delay_s >= 0 && delay_s <= kMaxDelayS; };
  const auto ms = [](double delay_s) { return std::lround(delay_s * 1e3); };
  if (delays_s.size() > host::kMaxDelays) return "must be at most two times";
  if (!std::ranges::all_of(delays_s, in_range)) return "must be a time from 0 to 1 second";
  if (delays_s.size() == 2 && ms(delays_s[0]) == ms(delays_s[1])) return "must be two different times";
  return {};
}

bool in_range(const StreamOption& option, std::string_view value) {
  if (option.most == 0) return true;
  const auto read = text::number<double>(value);
  return read && *read >= option.least && *read <= option.most;
}

// Checks a stream's own settings against `wishes`, which has them and the common ones.
Result<void> check_settings(const StreamWishes& stream, const Wishes& wishes, const CodecTraits& traits) {
  const auto wrong = [](const std::string& what) { return fail(ErrorCode::kInvalidArgument, what); };
  for (const auto& [key, value] : stream.settings) {
    const StreamOption* const option = find_option(key);
    TANDEM_ASSERT(option != nullptr);  // set() knew it
    if (!in_range(*option, value)) return wrong(fmt::format("{} must be {}", key, option->takes));
  }
  if (const auto what = wrong_with_delays(wishes.delays_s); !what.empty() && says(stream, "delay"))
    return wrong(fmt::format("delay {}", what));
  for (const StreamOption& option : kStreamOptions) {
    if (!option.steers || !says(stream, option.key)) continue;
    if (option.key == "max-error" && wishes.cap_kbit_s) continue;
    if (says(stream, "threshold"))
      return wrong(fmt::format("threshold cannot be combined with {}, which needs an automatic threshold",
                               option.key));
    if (!traits.reads_threshold)
      return wrong(fmt::format("codec {} has no threshold, and so takes no {}", wishes.codec, option.key));
    if (!wishes.automatic)
      return wrong(fmt::format("{} needs target-bandwidth, or an automatic threshold", option.key));
  }
  if (wishes.data != "yes" && wishes.data != "no") return wrong("data must be yes or no");
  if (says(stream, "budget") && !traits.takes_budget) return wrong("a budget needs codec limited or tracker");
  if (says(stream, "cap") && !traits.takes_budget) return wrong("a cap needs codec limited or tracker");
  if (says(stream, "cap") && wishes.target_mbit_per_s != 0)
    return wrong("a cap cannot be combined with target-bandwidth");
  return {};
}

}  // namespace

Result<StreamWishes> read_stream(const std::string& text) {
  const auto wrong = [&text](const std::string& what) {
    return fail(ErrorCode::kInvalidArgument, fmt::format("'{}': {}", text, what));
  };
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos || colon + 1 == text.size())
    return wrong("must be NAME:PREDICTOR, or NAME:key=value,...");
  StreamWishes stream{.name = text.substr(0, colon)};
  Wishes ignored;
  for (std::size_t begin = colon + 1; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string item = text.substr(begin, end - begin);
    begin = end + 1;
    const std::size_t equals = item.find('=');
    if (equals == std::string::npos && text::number<double>(item) && !stream.settings.empty()) {
      auto& [before, values] = stream.settings.back();
      values += "," + item;
      if (const auto good = set(before, values, ignored); !good) return wrong(good.error().message);
      continue;
    }
    const std::string key = equals == std::string::npos ? "predictor" : item.substr(0, equals);
    const std::string value = equals == std::string::npos ? item : item.substr(equals + 1);
    if (const auto good = set(key, value, ignored); !good) return wrong(good.error().message);
    if (says(stream, key)) return wrong(fmt::format("{} is set twice", key));
    stream.settings.emplace_back(key, value);
  }
  return stream;
}

std::optional<std::vector<double>> read_numbers(std::string_view text) {
  std::vector<double> numbers;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const auto read = text::number<double>(text.substr(begin, end - begin));
    if (!read) return std::nullopt;
    numbers.push_back(*read);
    begin = end + 1;
  }
  return numbers;
}

CodecTraits traits_of(const std::string& codec) {
  const auto traits = codec_traits(codec);
  return traits ? *traits : CodecTraits{.reads_threshold = true, .takes_budget = true};
}

Result<Wishes> wishes_of(const Wishes& common, const StreamWishes& stream) {
  Wishes wishes = common;
  wishes.streams.clear();
  for (const auto& [key, value] : stream.settings)
    if (auto good = set(key, value, wishes); !good) return tl::unexpected(good.error());
  const CodecTraits traits = traits_of(wishes.codec);
  if (!traits.reads_threshold) wishes.automatic = false;
  if (auto good = check_settings(stream, wishes, traits); !good) return tl::unexpected(good.error());
  return wishes;
}

Result<void> check_known_predictor(const std::string& name) {
  if (name == kAutomaticPredictor || find_predictor(name)) return {};
  return fail(ErrorCode::kUnsupported, fmt::format("unknown predictor '{}' (known: {} and {})", name,
                                                   fmt::join(predictor_names(), ", "), kAutomaticPredictor));
}

Result<void> check_wishes(const Wishes& wishes) {
  const auto wrong = [](std::string_view key, std::string_view what) {
    return fail(ErrorCode::kInvalidArgument, fmt::format("{}: {}", key, what));
  };
  const auto is_length = [](double metres) { return metres >= kLeastLength && metres <= kMaxLength; };
  const CodecTraits traits = traits_of(wishes.codec);
  if (wishes.threshold_m && !is_length(*wishes.threshold_m))
    return wrong("threshold", fmt::format("must be {}", kLength));
  if (!(wishes.threshold_scale >= 1e-6 && wishes.threshold_scale <= 1e6))
    return wrong("threshold-scale", "must be from 1e-6 to 1e6");
  if (wishes.automatic && !traits.reads_threshold) {
    return wrong("threshold",
                 fmt::format("auto cannot be combined with codec {}, which has no threshold", wishes.codec));
  }
  if (wishes.automatic && wishes.threshold_m) return wrong("threshold", "must be a length or auto, not both");
  const bool steered = wishes.target_mbit_per_s != 0;
  if (!wishes.automatic && steered) return wrong("target-bandwidth", "needs --threshold auto");
  if (!wishes.automatic && wishes.max_error_m && !wishes.cap_kbit_s)
    return wrong("max-error", "needs --threshold auto, or a cap");
  if (steered && !(wishes.target_mbit_per_s >= 0.001 && wishes.target_mbit_per_s <= 1e6))
    return wrong("target-bandwidth", "must be from 0.001 to 1e6 Mbit/s");
  if (wishes.max_error_m && !is_length(*wishes.max_error_m))
    return wrong("max-error", fmt::format("must be {}", kLength));
  if (wishes.budget_bytes && !traits.takes_budget) return wrong("budget", "needs codec limited or tracker");
  if (wishes.budget_bytes && *wishes.budget_bytes < kLeastBudgetBytes)
    return wrong("budget", fmt::format("must be at least {} bytes", kLeastBudgetBytes));
  if (const auto what = wrong_with_delays(wishes.delays_s); !what.empty())
    return wrong("delivery-delay", what);
  if (wishes.cap_kbit_s && !traits.takes_budget) return wrong("cap", "needs codec limited or tracker");
  if (wishes.cap_kbit_s && !transport::is_cap(*wishes.cap_kbit_s))
    return wrong("cap", fmt::format("must be {}", kCap));
  if (wishes.cap_kbit_s && steered) return wrong("cap", "cannot be combined with target-bandwidth");
  if (wishes.threads < 1 || wishes.threads > kMaxThreads)
    return wrong("threads", fmt::format("must be 1 to {}", kMaxThreads));
  return {};
}

Result<void> check_service(const ServiceWishes& service) {
  const auto wrong = [](const std::string& what) { return fail(ErrorCode::kInvalidArgument, what); };
  const std::uint32_t most_ahead = host::ServiceConfig().window_ceiling;
  if (service.lead > 1) return wrong("lead: must be 0 or 1");
  if (service.client_limit < 1 || service.client_limit > kMaxClients)
    return wrong(fmt::format("client-limit: must be 1 to {}", kMaxClients));
  if (service.wait_for > service.client_limit)
    return wrong(fmt::format("wait-for: must be 0 to {}, as no more clients may come", service.client_limit));
  if (service.window && (*service.window < 1 || *service.window > most_ahead))
    return wrong(fmt::format("window: must be 1 to {} frames, or auto", most_ahead));
  if (service.rate_hz && !(*service.rate_hz >= 1 && *service.rate_hz <= 1000))
    return wrong("rate: must be 1 to 1000 Hz, or max");
  if (service.stall_timeout_s && !(*service.stall_timeout_s >= 0.01 && *service.stall_timeout_s <= 10))
    return wrong("stall-timeout: must be 0.01 to 10 seconds, or off");
  return {};
}

}  // namespace tandem::planning
