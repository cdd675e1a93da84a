#pragma once
// An operator's wishes for a server: its streams, and how it serves them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "sdk/core/tables/codec_table.hpp"
#include "sdk/wire/limits.hpp"
#include "services/host/streams/stream.hpp"
#include "tandem/result.hpp"

namespace tandem::planning {

/// This name stands for the first of predictors() that suits codec and world.
inline constexpr std::string_view kAutomaticPredictor = "auto";
/// A frame with a smaller budget has hardly room for one body.
inline constexpr std::size_t kLeastBudgetBytes = 64;
inline constexpr double kLeastLength = 1e-9, kMaxLength = 1e9;
inline constexpr double kMaxDelayS = 1e-3 * transport::kMaxDelayMs;
inline constexpr std::string_view kCap = "16 to 10,000,000 kbit/s";
inline constexpr std::string_view kDelay = "a time from 0 to 1 second, or two";
/// The delays in which a server offers each stream, while that is not too many offers.
inline constexpr std::array kUsualDelaysS{0.0, 0.2};
inline constexpr std::string_view kLength = "a length from 1e-9 to 1e9 metres";

/// The settings of one of several streams; the others come from Wishes.
struct StreamWishes {
  std::string name = {};  ///< see host::check_stream_names()
  /// Pairs of a key of kStreamOptions and its value.
  std::vector<std::pair<std::string, std::string>> settings = {};
  host::Offered offered = host::Offered::kAlways;
};

/// The wishes of an operator for a world's streams.
struct Wishes {
  std::string codec = "tracker";
  std::string predictor{kAutomaticPredictor};
  std::optional<double> threshold_m = {};  ///< empty: the world's, times threshold_scale
  double threshold_scale = 1;
  bool automatic = false;        ///< choose the threshold at run time, from a quarter of the first one
  double target_mbit_per_s = 0;  ///< with `automatic`; 0: the threshold stays
  std::optional<double> max_error_m = {};  ///< with `automatic`; empty: four times the threshold
  /// Maximum size of the corrections of a frame, for codecs that take a budget; empty:
  /// CodecTraits::usual_budget.
  std::optional<std::size_t> budget_bytes = {};
  /// Maximum times for which frames are collected for a delta, up to 1 s: a stream is offered in each.
  /// Empty: plan_server() chooses, else 0.
  std::vector<double> delays_s = {};
  /// Maximum on the wire for one client, for codecs that take a budget; empty: none.
  std::optional<std::size_t> cap_kbit_s = {};
  std::string data = "yes";                ///< or no: without the bodies' own data
  double data_kbit_s = 0;                  ///< rate of that data, above which changes wait; 0: none waits
  std::uint32_t threads = 1;               ///< threads of the codec, if a session has several blocks
  std::vector<StreamWishes> streams = {};  ///< empty: one stream without a name, as wished above
};

/// A key of `--stream NAME:key=value,...`, of a stream in a configuration file, and of
/// ServerOptions::streams.
struct StreamOption {
  std::string_view key;
  std::string_view file_field;  ///< in idl/server.proto, Stream
  std::variant<std::string Wishes::*, double Wishes::*, std::optional<double> Wishes::*,
               std::optional<std::size_t> Wishes::*, std::vector<double> Wishes::*>
      field;
  double least = 0, most = 0;          ///< range of a number
  std::string_view takes = {};         ///< describes the allowed values in errors
  std::optional<bool> automatic = {};  ///< the value it sets Wishes::automatic to
  bool steers = false;                 ///< needs an automatic threshold
};

/// A new option needs a field above and in idl/server.proto, a line here, and its use in plan.cpp.
inline constexpr std::array kStreamOptions{
    StreamOption{.key = "codec", .file_field = "codec", .field = &Wishes::codec},
    StreamOption{.key = "predictor", .file_field = "predictor", .field = &Wishes::predictor},
    StreamOption{.key = "threshold",
                 .file_field = "threshold",
                 .field = &Wishes::threshold_m,
                 .least = kLeastLength,
                 .most = kMaxLength,
                 .takes = kLength,
                 .automatic = false},
    StreamOption{.key = "target-bandwidth",
                 .file_field = "target_bandwidth",
                 .field = &Wishes::target_mbit_per_s,
                 .least = 0.001,
                 .most = 1e6,
                 .takes = "a rate in Mbit/s, at least 0.001",
                 .automatic = true,
                 .steers = true},
    StreamOption{.key = "max-error",
                 .file_field = "max_error",
                 .field = &Wishes::max_error_m,
                 .least = kLeastLength,
                 .most = kMaxLength,
                 .takes = kLength,
                 .steers = true},
    StreamOption{.key = "budget",
                 .file_field = "budget_bytes",
                 .field = &Wishes::budget_bytes,
                 .least = double{kLeastBudgetBytes},
                 .most = 4294967295.0,
                 .takes = "at least 64 bytes"},
    StreamOption{.key = "delay", .file_field = "delivery_delay", .field = &Wishes::delays_s, .takes = kDelay},
    StreamOption{.key = "cap",
                 .file_field = "cap",
                 .field = &Wishes::cap_kbit_s,
                 .least = double{transport::kLeastCapKbitS},
                 .most = double{transport::kMaxCapKbitS},
                 .takes = kCap},
    StreamOption{.key = "data", .file_field = "data", .field = &Wishes::data},
    StreamOption{.key = "data_kbit_s",
                 .file_field = "data_kbit_s",
                 .field = &Wishes::data_kbit_s,
                 .least = 1,
                 .most = 1e6,
                 .takes = "a rate in kbit/s, 1 to 1,000,000"},
};

/// Reads NAME:ITEM,ITEM..., in which an item is key=value, a number that is one more value of the key before,
/// or a predictor. Errors: kInvalidArgument, in one line, for unknown keys and values that are not numbers.
[[nodiscard]] Result<StreamWishes> read_stream(const std::string& text);

/// Merges the common wishes and a stream's own. Errors: kInvalidArgument for a setting that cannot be read,
/// is out of range, or conflicts with another one.
[[nodiscard]] Result<Wishes> wishes_of(const Wishes& common, const StreamWishes& stream);

/// Numbers with commas between them; empty: the text is something else.
[[nodiscard]] std::optional<std::vector<double>> read_numbers(std::string_view text);

/// A predictor's name, or auto. Errors: kUnsupported, naming those that are known.
[[nodiscard]] Result<void> check_known_predictor(const std::string& name);

/// Checks the wishes that are common to all streams. Errors: kInvalidArgument, which begins with the option's
/// key and a colon.
[[nodiscard]] Result<void> check_wishes(const Wishes& wishes);

/// The traits of a codec. Those of an unknown codec exclude nothing, because planning the session refuses it.
[[nodiscard]] CodecTraits traits_of(const std::string& codec);

inline constexpr std::uint32_t kMaxClients = 65'536;

/// How the session is served, whatever its streams.
struct ServiceWishes {
  std::string session = "default";
  std::uint32_t lead = 1;  ///< frames that clients may simulate beyond the last delta, 0 or 1
  std::uint32_t client_limit = 256;
  std::uint32_t wait_for = 0;                   ///< participants that must play before frame 1
  std::optional<std::uint32_t> window = {};     ///< empty: chosen at run time
  std::optional<double> rate_hz = {};           ///< empty: the rate of the world
  bool free_rate = false;                       ///< as fast as window and queue allow
  std::optional<double> stall_timeout_s = 0.5;  ///< empty: no limit
};

/// Checks all but the session's name. Errors: as check_wishes().
[[nodiscard]] Result<void> check_service(const ServiceWishes& service);

}  // namespace tandem::planning
