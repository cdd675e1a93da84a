// Data files of LAMMPS (`read_data` in its manual).
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "services/adapters/imd/formats.hpp"
#include "services/adapters/imd/kinds.hpp"
#include "services/adapters/imd/text.hpp"
#include "services/adapters/lammps/radii.hpp"

namespace tandem::imd {
namespace {

/// Columns of a line of the section Atoms, by style. Three more may follow, the images.
struct AtomStyle {
  std::string_view name;
  std::size_t type, words;
  std::size_t molecule = 0, diameter = 0;  // 0: none
  bool guessed = false;                    // also without `# style`
};
constexpr std::array<AtomStyle, 14> kStyles{{{"atomic", 1, 5, 0, 0, true},
                                             {"charge", 1, 6, 0, 0, true},
                                             {"bond", 2, 6, 1, 0, false},
                                             {"angle", 2, 6, 1, 0, false},
                                             {"molecular", 2, 6, 1, 0, true},
                                             {"full", 2, 7, 1, 0, true},
                                             {"sphere", 1, 7, 0, 2, true},
                                             {"dipole", 1, 9},
                                             {"ellipsoid", 1, 7},
                                             {"body", 1, 7},
                                             {"peri", 1, 7},
                                             {"line", 2, 8},
                                             {"tri", 2, 8},
                                             {"hybrid", 1, 5}}};

struct AtomRow {
  std::size_t line = 0;
  Words words;
};

/// What a data file says before its atoms can be read.
struct DataFile {
  std::size_t promised = 0, types = 0;
  std::vector<double> masses, sides{0, 0, 0};
  std::map<std::string_view, std::uint32_t> labels;
  const AtomStyle* style = nullptr;  // of `Atoms # style`
  std::vector<AtomRow> rows;

  [[nodiscard]] std::optional<std::uint32_t> type_of(std::string_view word) const {
    if (const auto label = labels.find(word); label != labels.end()) return label->second;
    const auto type = number<std::uint32_t>(word);
    return type && *type >= 1 && *type <= types ? type : std::nullopt;
  }
};

bool is_name_of_section(const Words& words) {
  const char c = words[0][0];
  return ((c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z')) &&
         std::ranges::none_of(words, [](std::string_view word) { return number<double>(word).has_value(); });
}

Result<DataFile> read(std::string_view text) {
  DataFile file;
  Lines lines(text);
  std::string_view line, section;
  lines.next(line);  // the first line is a comment
  while (lines.next(line)) {
    const Words words = words_of(line);
    if (words.empty()) continue;
    if (is_name_of_section(words)) {
      section = words[0];
      if (words.size() > 1) section = words[0] == "Atom" && words[1] == "Type" ? "Labels" : "";
      if (words.size() > 1 && section.empty()) section = "other";
      if (const std::size_t hint = line.find('#'); section == "Atoms" && hint != std::string_view::npos)
        if (const Words hints = words_of(line.substr(hint + 1)); !hints.empty()) {
          file.style = std::ranges::find(kStyles, hints[0], &AtomStyle::name);
          if (file.style == kStyles.end())
            return lines.refuse(fmt::format("atom style {} is not known here", hints[0]));
        }
    } else if (section.empty()) {
      if (words.size() == 2 && words[1] == "atoms") file.promised = number<std::size_t>(words[0]).value_or(0);
      if (words.size() == 3 && words[1] == "atom" && words[2] == "types")
        file.types = number<std::size_t>(words[0]).value_or(0);
      for (std::size_t axis = 0; axis < 3 && words.size() == 4; ++axis) {
        const auto low = number<double>(words[0]), high = number<double>(words[1]);
        if (words[2].size() == 3 && words[2][0] == "xyz"[axis] && words[2].substr(1) == "lo" && low && high)
          file.sides[axis] = *high - *low;
      }
      if (file.promised > kMaxAtoms)
        return fail(ErrorCode::kCapacity, fmt::format("more than {} atoms", kMaxAtoms));
      if (file.types > tandem_lammps::kMaxTypes)
        return fail(ErrorCode::kCapacity, fmt::format("more than {} atom types", tandem_lammps::kMaxTypes));
    } else if (section == "Labels" && words.size() >= 2) {
      if (const auto type = file.type_of(words[0])) file.labels[words[1]] = *type;
    } else if (section == "Masses" && words.size() >= 2) {
      const auto type = file.type_of(words[0]);
      if (!type) return lines.refuse("a mass of a type that is not there");
      file.masses.resize(file.types + 1, 1.0);
      file.masses[*type] = positive(words[1]).value_or(1);
    } else if (section == "Atoms") {
      if (file.rows.size() == file.promised)
        return lines.refuse(fmt::format("more than the {} atoms of the head", file.promised));
      file.rows.push_back({lines.number(), words});
    }
  }
  if (file.rows.empty() || file.rows.size() != file.promised)
    return fail(ErrorCode::kMalformed,
                fmt::format("it has {} of its {} atoms", file.rows.size(), file.promised));
  return file;
}

bool fits(const DataFile& file, const AtomStyle& style, const AtomRow& row) {
  const Words& words = row.words;
  return words.size() >= style.words && number<std::int64_t>(words[0]) && file.type_of(words[style.type]);
}

/// Stricter, for a guess: no word is left over, and what has to be whole is.
bool looks_alike(const DataFile& file, const AtomStyle& style, const AtomRow& row) {
  const Words& words = row.words;
  const bool images = words.size() == style.words + 3;
  if (!fits(file, style, row) || (words.size() != style.words && !images)) return false;
  if (style.molecule > 0 && !number<std::int64_t>(words[style.molecule])) return false;
  for (std::size_t i = style.words; i < words.size(); ++i)
    if (!number<std::int64_t>(words[i])) return false;
  return style.diameter == 0 || number<double>(words[style.diameter]).value_or(-1) >= 0;
}

Result<AtomStyle> style_of(const DataFile& file) {
  if (file.style != nullptr) return *file.style;
  std::vector<AtomStyle> possible;
  std::vector<std::string_view> names;
  for (const AtomStyle& style : kStyles) {
    if (!style.guessed) continue;
    if (!std::ranges::all_of(file.rows, [&](const AtomRow& row) { return looks_alike(file, style, row); }))
      continue;
    possible.push_back(style);
    names.push_back(style.name);
  }
  if (possible.size() == 1) return possible[0];
  return fail(
      ErrorCode::kMalformed,
      fmt::format("line {}: which atom style? {}: write it behind the word Atoms, as in `Atoms # full`",
                  file.rows[0].line,
                  names.empty() ? std::string("none that is known here has such lines")
                                : fmt::format("it may be {}", fmt::join(names, " or "))));
}

}  // namespace

Result<Topology> parse_lammps(std::string_view text, std::optional<double> radius) {
  auto file = read(text);
  if (!file) return tl::unexpected(file.error());
  const auto style = style_of(*file);
  if (!style) return tl::unexpected(style.error());
  struct Atom {
    std::int64_t id = 0;
    std::uint32_t type = 0;
    double diameter = 0;
  };
  std::vector<Atom> atoms;
  atoms.reserve(file->rows.size());
  for (const AtomRow& row : file->rows) {
    if (!fits(*file, *style, row))
      return fail(ErrorCode::kMalformed, fmt::format("line {}: no atom of style {} with a type of 1 to {}",
                                                     row.line, style->name, file->types));
    Atom atom{.id = number<std::int64_t>(row.words[0]).value_or(0),
              .type = file->type_of(row.words[style->type]).value_or(1)};
    if (style->diameter > 0) atom.diameter = number<double>(row.words[style->diameter]).value_or(0);
    atoms.push_back(atom);
  }
  std::ranges::stable_sort(atoms, {}, &Atom::id);
  const auto box = box_of(file->sides[0], file->sides[1], file->sides[2]);
  const double volume = box ? (*box)[0] * (*box)[1] * (*box)[2] : 1;
  const double other = radius.value_or(box ? std::cbrt(volume / static_cast<double>(atoms.size())) / 2 : 0.5);
  Kinds kinds;
  std::vector<std::uint32_t> groups;
  for (std::uint32_t type = 1; type <= file->types; ++type) {
    const auto label = std::ranges::find(file->labels, type, [](const auto& entry) { return entry.second; });
    const std::string name =
        label == file->labels.end() ? fmt::format("type{}", type) : std::string(label->first);
    groups.push_back(kinds.group(name, type < file->masses.size() ? file->masses[type] : 1));
  }
  for (const Atom& atom : atoms)
    kinds.add(groups[atom.type - 1], atom.diameter > 0 ? atom.diameter / 2 : other);
  return kinds.finish(box);
}

}  // namespace tandem::imd
