#include "services/program/metrics/figure_series.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <type_traits>

namespace tandem::metrics {
namespace {

// As a part of a name, with "_" on both sides or at an end.
bool take_out(std::string& name, std::string_view part) {
  const std::size_t at = ("_" + name + "_").find("_" + std::string(part) + "_");
  if (at == std::string::npos) return false;
  name.erase(at == 0 ? 0 : at - 1, part.size() + 1);
  if (name.ends_with('_')) name.pop_back();
  return true;
}

std::string join(std::string_view prefix, const std::string& name, std::string_view unit) {
  std::string whole(prefix);
  whole += name;
  if (!unit.empty() && !whole.ends_with('_')) whole += '_';
  return whole += unit;
}

}  // namespace

FigureSeries series_of(std::string_view prefix, std::string_view figure, bool is_count) {
  std::string name(figure);
  FigureSeries series;
  std::string_view unit;
  if (take_out(name, "mbit_per_s")) {
    unit = name == "wire" ? "bytes_per_second" : "payload_bytes_per_second";
    series.scale = 1048576.0 / 8;
  } else if (take_out(name, "ms")) {
    unit = "seconds";
    series.scale = 1e-3;
  }
  series.name = join(prefix, name, unit);
  if (is_count) series.name += "_total";
  return series;
}

void describe(Page& page, const ServerCounts& counts) {
  static constexpr std::array<std::string_view, 4> kInDetail{"refused_inputs", "refused_messages",
                                                             "snapshots", "snapshot_bytes"};
  each_server_count(
      [&page](const char* figure, std::uint64_t count) {
        if (std::ranges::find(kInDetail, std::string_view(figure)) != kInDetail.end()) return;
        const FigureSeries series = series_of("tandem_", figure, true);
        page.count(series.name, std::string("The server's count ") + figure + " (tandem/server_figures.hpp)",
                   static_cast<double>(count) * series.scale);
      },
      counts);
}

void describe(Page& page, const ClientFigures& figures) {
  each_client_figure(
      [&page](const char* figure, auto value) {
        // Counts since the start are the only figures of 64 bits.
        constexpr bool kCounts = std::is_same_v<decltype(value), std::uint64_t>;
        const FigureSeries series = series_of("tandem_client_", figure, kCounts);
        const std::string help =
            std::string("This client's figure ") + figure + " (tandem/client_figures.hpp)";
        const double scaled = static_cast<double>(value) * series.scale;
        if (kCounts) {
          page.count(series.name, help, scaled);
        } else {
          page.gauge(series.name, help, scaled);
        }
      },
      figures);
}

}  // namespace tandem::metrics
