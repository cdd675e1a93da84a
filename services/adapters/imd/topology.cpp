#include "services/adapters/imd/topology.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <array>
#include <memory>

#include "services/adapters/imd/formats.hpp"
#include "services/adapters/imd/kinds.hpp"
#include "services/adapters/imd/text.hpp"

namespace tandem::imd {
namespace {

constexpr std::size_t kMaxNameBytes = 24;  // a HELLO has room for all
constexpr std::size_t kMaxTextBytes = std::size_t{1} << 30;

Words words_of_line(std::string_view text, std::size_t index) {
  Lines lines(text);
  std::string_view line;
  for (std::size_t i = 0; i <= index; ++i)
    if (!lines.next(line)) return {};
  return words_of(line);
}

bool is_count(const Words& words) { return words.size() == 1 && number<std::size_t>(words[0]).has_value(); }

/// A number of atoms alone, a comment, then ELEMENT X Y Z.
bool looks_like_xyz(std::string_view text) {
  const Words atom = words_of_line(text, 2);
  if (!is_count(words_of_line(text, 0)) || atom.size() < 4) return false;
  return std::ranges::all_of(atom.begin() + 1, atom.begin() + 4,
                             [](std::string_view word) { return number<double>(word).has_value(); });
}

/// A title, then a number of atoms alone.
bool looks_like_gro(std::string_view text) { return is_count(words_of_line(text, 1)); }

/// A comment, and a line `N atoms` in the head.
bool looks_like_lammps(std::string_view text) {
  Lines lines(text);
  std::string_view line;
  for (int i = 0; i < 40 && lines.next(line); ++i) {
    const Words words = words_of(line);
    if (words.size() == 2 && words[1] == "atoms" && number<std::size_t>(words[0])) return i > 0;
  }
  return false;
}

/// A record of an atom, or of the box, with its columns.
bool looks_like_pdb(std::string_view text) {
  Lines lines(text);
  for (std::string_view line; lines.next(line);)
    for (const std::string_view record : {"ATOM  ", "HETATM", "CRYST1"})
      if (line.starts_with(record)) return !text.starts_with("data_");  // that would be mmCIF
  return false;
}

}  // namespace

Result<Topology> parse_table(std::string_view text, std::optional<double> radius) {
  std::optional<std::vector<double>> box;
  Kinds kinds;
  Lines lines(text);
  for (std::string_view line; lines.next(line);) {
    const Words words = words_of(line);
    if (words.empty()) continue;
    if (words[0] == "box" && words.size() == 4) {
      box = box_of(positive(words[1]), positive(words[2]), positive(words[3]));
      if (!box) return lines.refuse("a box is three lengths above 0");
      continue;
    }
    const auto count = number<std::size_t>(words[0]);
    if (!count || words.size() < 2 || words.size() > 5)
      return lines.refuse(fmt::format("expected COUNT NAME [RADIUS [RRGGBBAA [MASS]]]{}",
                                      kinds.atoms() > 0
                                          ? ""
                                          : "; files that can be read are .gro, .pdb, .xyz and data "
                                            "files of LAMMPS, also as .gz"));
    if (words[1].size() > kMaxNameBytes)
      return lines.refuse(fmt::format("a name has at most {} bytes", kMaxNameBytes));
    double of_these = radius.value_or(0.5), mass = 1;
    std::optional<std::uint32_t> colour;
    if (words.size() > 2) {
      const auto value = positive(words[2]);
      if (!value) return lines.refuse("the radius is not above 0");
      of_these = *value;
    }
    if (words.size() > 3) {
      colour = text::number<std::uint32_t>(words[3], 16);
      if (!colour || words[3].size() != 8) return lines.refuse("the colour is not RRGGBBAA");
    }
    if (words.size() > 4) {
      const auto value = positive(words[4]);
      if (!value) return lines.refuse("the mass is not above 0");
      mass = *value;
    }
    if (*count > 0) kinds.add(kinds.group(words[1], mass, colour), of_these, *count);
  }
  return kinds.finish(std::move(box));
}

Result<Topology> parse_topology(std::string_view text, std::optional<double> radius) {
  if (looks_like_xyz(text)) return parse_xyz(text, radius);
  if (looks_like_gro(text)) return parse_gro(text, radius);
  if (looks_like_lammps(text)) return parse_lammps(text, radius);
  if (looks_like_pdb(text)) return parse_pdb(text, radius);
  return parse_table(text, radius);
}

Result<Topology> read_topology(const std::string& path, std::optional<double> radius) {
  // It reads what is not compressed as it is.
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(path.c_str(), "rb"), gzclose);
  std::string text;
  std::array<char, 1 << 16> bytes{};
  int got = file ? 1 : -1;
  while (got > 0 && text.size() <= kMaxTextBytes) {
    got = gzread(file.get(), bytes.data(), static_cast<unsigned>(bytes.size()));
    if (got > 0) text.append(bytes.data(), static_cast<std::size_t>(got));
  }
  if (got < 0) return fail(ErrorCode::kIo, fmt::format("{}: cannot be read", path));
  if (text.size() > kMaxTextBytes)
    return fail(ErrorCode::kCapacity, fmt::format("{}: longer than 1 GiB", path));
  auto topology = parse_topology(text, radius);
  if (!topology) return fail(topology.error().code, fmt::format("{}: {}", path, topology.error().message));
  return topology;
}

}  // namespace tandem::imd
