#include "tests/bench/lab/scale/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

namespace tandem::lab {
namespace {

constexpr double kLeft = 70, kTop = 40, kWidth = 560, kHeight = 360, kLegend = 210;
constexpr const char* kColours[] = {"#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e",
                                    "#8c564b", "#17becf", "#7f7f7f", "#e377c2", "#bcbd22"};

/// The powers of ten around some values.
struct Axis {
  int from = 0, to = 1;

  static Axis around(const std::vector<double>& values) {
    if (values.empty()) return {};
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    Axis axis{static_cast<int>(std::floor(std::log10(*least))),
              static_cast<int>(std::ceil(std::log10(*most)))};
    if (axis.to == axis.from) ++axis.to;
    return axis;
  }
  [[nodiscard]] double share(double value) const { return (std::log10(value) - from) / (to - from); }
};

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '<') {
      out += "&lt;";
    } else if (c == '&') {
      out += "&amp;";
    } else {
      out += c;
    }
  }
  return out;
}

}  // namespace

double log_slope(const std::vector<std::pair<double, double>>& points) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const auto& [px, py] : points) {
    if (!(px > 0) || !(py > 0)) continue;
    const double lx = std::log(px), ly = std::log(py);
    n += 1, x += lx, y += ly, xx += lx * lx, xy += lx * ly;
  }
  const double spread = n * xx - x * x;
  return n < 2 || !(spread > 0) ? 0 : (n * xy - x * y) / spread;
}

Result<void> draw_chart(const std::string& path, const std::string& title, const std::string& x_name,
                        const std::string& y_name, const std::vector<ChartLine>& lines) {
  std::vector<double> xs, ys;
  for (const ChartLine& line : lines) {
    for (const auto& [x, y] : line.points) {
      if (!(x > 0) || !(y > 0)) continue;
      xs.push_back(x);
      ys.push_back(y);
    }
  }
  const Axis across = Axis::around(xs), up = Axis::around(ys);
  const auto at_x = [&](double x) { return kLeft + kWidth * across.share(x); };
  const auto at_y = [&](double y) { return kTop + kHeight * (1 - up.share(y)); };
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" font-family=\"sans-serif\" "
      "font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n<text x=\"{}\" y=\"20\" "
      "font-size=\"14\">{}</text>\n",
      kLeft + kWidth + kLegend, kTop + kHeight + 50, kLeft, escaped(title));
  for (int e = across.from; e <= across.to; ++e) {
    const double x = at_x(std::pow(10, e));
    out += fmt::format(
        "<line x1=\"{0:.1f}\" y1=\"{1}\" x2=\"{0:.1f}\" y2=\"{2}\" stroke=\"#ddd\"/><text x=\"{0:.1f}\" "
        "y=\"{3}\" text-anchor=\"middle\">{4:g}</text>\n",
        x, kTop, kTop + kHeight, kTop + kHeight + 16, std::pow(10, e));
  }
  for (int e = up.from; e <= up.to; ++e) {
    const double y = at_y(std::pow(10, e));
    out += fmt::format(
        "<line x1=\"{1}\" y1=\"{0:.1f}\" x2=\"{2}\" y2=\"{0:.1f}\" stroke=\"#ddd\"/><text x=\"{3}\" "
        "y=\"{4:.1f}\" text-anchor=\"end\">{5:g}</text>\n",
        y, kLeft, kLeft + kWidth, kLeft - 6, y + 4, std::pow(10, e));
  }
  out += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n", kLeft + kWidth / 2,
                     kTop + kHeight + 38, escaped(x_name));
  out += fmt::format(
      "<text x=\"16\" y=\"{0}\" text-anchor=\"middle\" transform=\"rotate(-90 16 {0})\">{1}</text>\n",
      kTop + kHeight / 2, escaped(y_name));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const char* const colour = kColours[i % std::size(kColours)];
    std::string path_text;
    for (const auto& [x, y] : lines[i].points) {
      if (!(x > 0) || !(y > 0)) continue;
      path_text += fmt::format("{}{:.1f},{:.1f}", path_text.empty() ? "" : " ", at_x(x), at_y(y));
      out += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>\n", at_x(x), at_y(y),
                         colour);
    }
    const double y = kTop + 14 + 18 * static_cast<double>(i);
    out += fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\"/>\n", path_text, colour);
    out += fmt::format("<text x=\"{}\" y=\"{}\" fill=\"{}\">{} (slope {:.2f})</text>\n", kLeft + kWidth + 10,
                       y, colour, escaped(lines[i].name), log_slope(lines[i].points));
  }
  out += "</svg>\n";
  std::ofstream file(path, std::ios::binary);
  file << out;
  file.close();
  if (!file) return fail(ErrorCode::kIo, "cannot write " + path);
  return {};
}

}  // namespace tandem::lab
