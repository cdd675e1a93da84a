#include "services/lab/bandwidth/bandwidth_report.hpp"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "services/follow/recording/output_file.hpp"
#include "services/lab/bandwidth/bandwidth_columns.hpp"

namespace tandem::lab {
namespace {

using RowList = std::span<const BandwidthRow>;

// Frames that one point of a figure averages. With fewer, single frames show as noise; with more, impacts
// vanish.
constexpr std::size_t kFramesAPoint = 10;

Result<void> write_file(const std::string& path, std::string_view text) {
  return recording::OutputFile::create(path, recording::Existing::kReplaced)
      .and_then([&](recording::OutputFile&& file) {
        return file.write(std::as_bytes(std::span(text))).and_then([&] { return file.commit(); });
      });
}

/// Makes a file name of a row's name, because a trajectory's name is a path.
std::string file_name(const BandwidthRow& row) {
  return fmt::format("{}-{}", std::filesystem::path(row.scene).stem().string(), row.bodies);
}

/// The rate of `count` frames from `first` on.
double mbit_per_s(const BandwidthRow& row, std::size_t first, std::size_t count) {
  return lab::mbit_per_s(std::span(row.bytes).subspan(first, count), row.dt_s);
}

std::string series_csv(RowList rows) {
  std::string text = "frame,colliding";
  for (const BandwidthRow& row : rows) text += row.missing.empty() ? "," + row.codec : "";
  text += '\n';
  const BandwidthRow& any = rows.front();
  for (std::size_t i = 0; i < any.frames; ++i) {
    text += fmt::format("{},{}", i + 1, any.colliding_per_frame ? fmt::format("{}", any.colliding[i]) : "");
    for (const BandwidthRow& row : rows) {
      if (row.missing.empty()) text += fmt::format(",{:.6g}", mbit_per_s(row, i, 1));
    }
    text += '\n';
  }
  return text;
}

/// `none` is left out as in the thesis, because it is constant and far above the others; peers have their own
/// table.
bool drawn(const BandwidthRow& row) {
  return row.missing.empty() && !row.predictor.empty() && row.traits.reads_threshold;
}

/// The script holds its data, so that a figure can be drawn again with other settings.
std::string gnuplot_script(RowList rows, const std::string& svg) {
  std::string script, curves;
  std::size_t curve = 0;
  for (const BandwidthRow& row : rows) {
    if (!drawn(row)) continue;
    script += fmt::format("$c{} << EOD\n", curve);
    for (std::size_t first = 0; first < row.bytes.size(); first += kFramesAPoint) {
      const std::size_t count = std::min(kFramesAPoint, row.bytes.size() - first);
      const double middle_s = (static_cast<double>(first) + 0.5 * static_cast<double>(count)) * row.dt_s;
      script += fmt::format("{:.4g} {:.6g}\n", middle_s, mbit_per_s(row, first, count));
    }
    script += "EOD\n";
    curves += fmt::format("{}$c{} with lines lw 1.5 title \"{}\"", curve == 0 ? "" : ", ", curve, row.codec);
    ++curve;
  }
  const BandwidthRow& any = rows.front();
  if (curve == 0) curves = "NaN notitle";
  return script +
         fmt::format(
             "set terminal svg size 900,480 background \"white\" noenhanced\n"
             "set output \"{}\"\n"
             "set title \"{}, {} bodies\" noenhanced\n"
             "set xlabel \"simulated seconds\"\nset ylabel \"Mbit/s, mean of {} frames\"\n"
             "set xrange [0:{:.6g}]\nset yrange [0:*]\nset grid\nset key outside right top noenhanced\n"
             "plot {}\n",
             svg, std::filesystem::path(any.scene).stem().string(), any.bodies, kFramesAPoint,
             static_cast<double>(any.frames) * any.dt_s, curves);
}

/// Runs gnuplot on a script. Errors: kIo.
Result<void> run_gnuplot(const std::string& script) {
  std::string program = "gnuplot", argument = script;
  const std::array<char*, 3> arguments{program.data(), argument.data(), nullptr};
  ::pid_t child = 0;
  const int refused = ::posix_spawnp(&child, "gnuplot", nullptr, nullptr, arguments.data(), environ);
  if (refused != 0)
    return fail(ErrorCode::kIo,
                fmt::format("cannot run gnuplot (Debian package gnuplot-nox): {}", std::strerror(refused)));
  int status = 0;
  while (::waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return fail(ErrorCode::kIo, fmt::format("gnuplot: {}", std::strerror(errno)));
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    return fail(ErrorCode::kIo, fmt::format("{}: gnuplot cannot draw it", script));
  return {};
}

/// gnuplot does not report a full disk, so this checks that its file is whole.
Result<void> keep_figure(const std::string& part, const std::string& svg) {
  std::ifstream in(part, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  in.close();
  std::error_code ignored;
  std::filesystem::remove(part, ignored);
  if (text.find("</svg>") == std::string::npos)
    return fail(ErrorCode::kIo, svg + ": gnuplot left it unfinished; is the disk full?");
  return write_file(svg, text);
}

Result<void> write_series(const std::string& directory, RowList rows) {
  const std::string base = directory + "/" + file_name(rows.front());
  const std::string svg = base + ".svg", drawing = svg + ".drawing", script = base + ".gnuplot";
  return write_file(base + ".csv", series_csv(rows))
      .and_then([&] { return write_file(script, gnuplot_script(rows, drawing)); })
      .and_then([&] { return run_gnuplot(script); })
      .and_then([&] { return keep_figure(drawing, svg); });
}

}  // namespace

Result<void> write_report(const std::string& directory, std::span<const BandwidthRow> rows) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (error) return fail(ErrorCode::kIo, fmt::format("{}: cannot create: {}", directory, error.message()));
  const std::string whole = directory + "/report.json";
  std::filesystem::remove(whole, error);
  if (error) return fail(ErrorCode::kIo, fmt::format("{}: cannot remove: {}", whole, error.message()));
  if (auto written = write_file(directory + "/rows.csv", to_csv(rows)); !written) return written;
  for (std::size_t first = 0; first < rows.size();) {
    const BandwidthRow& start = rows[first];
    const auto last = std::find_if(
        rows.begin() + static_cast<std::ptrdiff_t>(first), rows.end(),
        [&](const BandwidthRow& row) { return row.scene != start.scene || row.bodies != start.bodies; });
    const auto end = static_cast<std::size_t>(last - rows.begin());
    if (auto written = write_series(directory, rows.subspan(first, end - first)); !written) return written;
    first = end;
  }
  return write_file(whole, to_json(rows) + "\n");
}

}  // namespace tandem::lab
