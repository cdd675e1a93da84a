#include "services/imd/topology.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>

namespace tandem::imd {
namespace {

constexpr std::size_t kMostAtoms = 4'194'304, kMostKinds = 65'535;
// Okabe and Ito's colours, which most people can tell apart.
constexpr std::array<std::uint32_t, 7> kColours{0xE69F00FF, 0x56B4E9FF, 0x009E73FF, 0xF0E442FF,
                                                0x0072B2FF, 0xD55E00FF, 0xCC79A7FF};

/// Van der Waals radii (A. Bondi, 1964) and the usual colours of elements.
struct Element {
  char letter;
  double radius;
  std::uint32_t colour;
  double mass;
};
constexpr std::array<Element, 6> kElements{{{'H', 1.2, 0xF0F0F0FF, 1.008},
                                            {'C', 1.7, 0x707070FF, 12.011},
                                            {'N', 1.55, 0x3050F8FF, 14.007},
                                            {'O', 1.52, 0xE03020FF, 15.999},
                                            {'S', 1.8, 0xE0C030FF, 32.06},
                                            {'P', 1.8, 0xF08000FF, 30.974}}};

using Words = std::vector<std::string_view>;

Words words_of(std::string_view line) {
  Words words;
  line = line.substr(0, line.find('#'));
  for (std::size_t at = 0; (at = line.find_first_not_of(" \t\r", at)) != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(" \t\r", at), line.size());
    words.push_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

template <class T>
std::optional<T> number(std::string_view word) {
  T value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  if constexpr (std::is_floating_point_v<T>)
    if (!std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<double> positive(std::string_view word) {
  const auto value = number<double>(word);
  return value && *value > 0 ? value : std::nullopt;
}

/// The lines of a text, with their numbers.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}
  bool next(std::string_view& line) {
    if (at_ >= text_.size()) return false;
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    line = text_.substr(at_, end - at_);
    at_ = end + 1;
    ++number_;
    return true;
  }
  [[nodiscard]] tl::unexpected<Error> refuse(const std::string& why) const {
    return fail(ErrorCode::kMalformed, fmt::format("line {}: {}", number_, why));
  }

 private:
  std::string_view text_;
  std::size_t at_ = 0, number_ = 0;
};

double radius_by_number(const std::optional<std::vector<double>>& box, std::size_t atoms) {
  if (!box || atoms == 0) return 0.5;
  return std::cbrt((*box)[0] * (*box)[1] * (*box)[2] / static_cast<double>(atoms)) / 2;
}

Result<Topology> parse_table(std::string_view text, std::optional<double> radius) {
  Topology topology;
  Lines lines(text);
  for (std::string_view line; lines.next(line);) {
    const Words words = words_of(line);
    if (words.empty()) continue;
    if (words[0] == "box" && words.size() == 4) {
      const auto x = positive(words[1]), y = positive(words[2]), z = positive(words[3]);
      if (!x || !y || !z) return lines.refuse("a box is three lengths above 0");
      topology.box = {*x, *y, *z};
      continue;
    }
    const auto count = number<std::size_t>(words[0]);
    if (!count || words.size() < 2 || words.size() > 5)
      return lines.refuse("expected COUNT NAME [RADIUS [RRGGBBAA [MASS]]]");
    if (*count > kMostAtoms - topology.kind_of.size())
      return fail(ErrorCode::kCapacity, fmt::format("more than {} atoms", kMostAtoms));
    if (topology.kinds.size() == kMostKinds)
      return fail(ErrorCode::kCapacity, fmt::format("more than {} kinds", kMostKinds));
    Kind kind{.name = std::string(words[1]), .radius = radius.value_or(0.5)};
    kind.colour_rgba = kColours[topology.kinds.size() % kColours.size()];
    if (words.size() > 2) {
      const auto value = positive(words[2]);
      if (!value) return lines.refuse("the radius is not above 0");
      kind.radius = *value;
    }
    if (words.size() > 3) {
      const auto [end, error] =
          std::from_chars(words[3].data(), words[3].data() + words[3].size(), kind.colour_rgba, 16);
      if (error != std::errc() || words[3].size() != 8 || end != words[3].data() + 8)
        return lines.refuse("the colour is not RRGGBBAA");
    }
    if (words.size() > 4) {
      const auto value = positive(words[4]);
      if (!value) return lines.refuse("the mass is not above 0");
      kind.mass = *value;
    }
    topology.kind_of.insert(topology.kind_of.end(), *count,
                            static_cast<std::uint16_t>(topology.kinds.size()));
    topology.kinds.push_back(std::move(kind));
  }
  if (topology.kind_of.empty()) return fail(ErrorCode::kMalformed, "it has no atoms");
  return topology;
}

Result<Topology> parse_gro(std::string_view text, std::optional<double> radius) {
  Topology topology;
  Lines lines(text);
  std::string_view line;
  lines.next(line);  // the title
  std::size_t count = 0;
  if (lines.next(line)) {
    const Words words = words_of(line);
    count = words.size() == 1 ? number<std::size_t>(words[0]).value_or(0) : 0;
  }
  if (count == 0 || count > kMostAtoms)
    return lines.refuse(fmt::format("the number of atoms is not 1 to {}", kMostAtoms));
  std::map<char, std::uint16_t> known;
  for (std::size_t i = 0; i < count; ++i) {
    if (!lines.next(line))
      return fail(ErrorCode::kMalformed, fmt::format("it has {} of its {} atoms", i, count));
    // Fixed columns: the name is in 11 to 15.
    const std::string_view name = line.size() < 20 ? std::string_view() : line.substr(10, 5);
    const auto letter =
        std::ranges::find_if(name, [](char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); });
    if (letter == name.end()) return lines.refuse("an atom without a name");
    const char initial = static_cast<char>(*letter >= 'a' ? *letter - 32 : *letter);
    const auto [at, is_new] = known.try_emplace(initial, static_cast<std::uint16_t>(topology.kinds.size()));
    if (is_new) {
      const auto element = std::ranges::find(kElements, initial, &Element::letter);
      Kind kind{.name = std::string(1, initial),
                .radius = radius.value_or(1.5),
                .colour_rgba = 0xC060C0FF,
                .mass = 20};
      if (element != kElements.end()) {
        kind.radius = radius.value_or(element->radius);
        kind.colour_rgba = element->colour;
        kind.mass = element->mass;
      }
      topology.kinds.push_back(std::move(kind));
    }
    topology.kind_of.push_back(at->second);
  }
  if (lines.next(line)) {
    const Words words = words_of(line);
    if (words.size() >= 3) {
      const auto x = positive(words[0]), y = positive(words[1]), z = positive(words[2]);
      if (x && y && z) topology.box = {*x * 10, *y * 10, *z * 10};
    }
  }
  return topology;
}

/// Columns of a line of the section Atoms, by style.
struct AtomStyle {
  std::string_view name;
  std::size_t type, words;
  std::size_t diameter;  // 0: none
};
constexpr std::array<AtomStyle, 7> kStyles{{{"atomic", 1, 5, 0},
                                            {"charge", 1, 6, 0},
                                            {"bond", 2, 6, 0},
                                            {"angle", 2, 6, 0},
                                            {"molecular", 2, 6, 0},
                                            {"full", 2, 7, 0},
                                            {"sphere", 1, 7, 2}}};

Result<Topology> parse_lammps(std::string_view text, std::optional<double> radius) {
  struct Atom {
    std::int64_t id = 0;
    std::uint32_t type = 0;
    double diameter = 0;
  };
  Topology topology;
  Lines lines(text);
  std::string_view line, section;
  AtomStyle style = kStyles[0];
  std::vector<Atom> atoms;
  std::size_t promised = 0, types = 0;
  std::vector<double> masses, sides(3, 0.0);
  lines.next(line);  // the first line is a comment
  while (lines.next(line)) {
    const Words words = words_of(line);
    if (words.empty()) continue;
    if (words[0][0] >= 'A' && words[0][0] <= 'Z') {
      section = words[0];
      const std::size_t hint = line.find('#');
      if (section != "Atoms" || hint == std::string_view::npos) continue;
      const Words hints = words_of(line.substr(hint + 1));
      const auto found =
          hints.empty() ? kStyles.begin() : std::ranges::find(kStyles, hints[0], &AtomStyle::name);
      if (found == kStyles.end())
        return lines.refuse(fmt::format("atom style {} is not known here", hints[0]));
      style = *found;
    } else if (section.empty()) {
      if (words.size() == 2 && words[1] == "atoms") promised = number<std::size_t>(words[0]).value_or(0);
      if (words.size() == 3 && words[1] == "atom" && words[2] == "types")
        types = number<std::size_t>(words[0]).value_or(0);
      for (std::size_t axis = 0; axis < 3 && words.size() == 4; ++axis) {
        const auto low = number<double>(words[0]), high = number<double>(words[1]);
        if (words[2].size() == 3 && words[2][0] == "xyz"[axis] && words[2].substr(1) == "lo" && low && high)
          sides[axis] = *high - *low;
      }
      if (promised > kMostAtoms)
        return fail(ErrorCode::kCapacity, fmt::format("more than {} atoms", kMostAtoms));
      if (types >= kMostKinds)
        return fail(ErrorCode::kCapacity, fmt::format("more than {} kinds", kMostKinds));
    } else if (section == "Masses" && words.size() >= 2) {
      const auto type = number<std::size_t>(words[0]);
      if (!type || *type < 1 || *type > types) return lines.refuse("a mass of a type that is not there");
      masses.resize(types + 1, 1.0);
      masses[*type] = positive(words[1]).value_or(1);
    } else if (section == "Atoms") {
      const auto id = number<std::int64_t>(words[0]);
      const auto type = words.size() < style.words ? std::nullopt : number<std::uint32_t>(words[style.type]);
      if (!id || !type || *type < 1 || *type > types)
        return lines.refuse(fmt::format("no atom of style {} with a type of 1 to {}", style.name, types));
      Atom atom{.id = *id, .type = *type};
      if (style.diameter > 0) atom.diameter = number<double>(words[style.diameter]).value_or(0);
      if (atoms.size() == promised)
        return lines.refuse(fmt::format("more than the {} atoms of the head", promised));
      atoms.push_back(atom);
    }
  }
  if (atoms.empty() || atoms.size() != promised)
    return fail(ErrorCode::kMalformed, fmt::format("it has {} of its {} atoms", atoms.size(), promised));
  std::ranges::sort(atoms, {}, &Atom::id);
  if (sides[0] > 0 && sides[1] > 0 && sides[2] > 0) topology.box = sides;
  const double other = radius.value_or(radius_by_number(topology.box, atoms.size()));
  std::map<std::pair<std::uint32_t, double>, std::uint16_t> known;
  for (const Atom& atom : atoms) {
    const auto [at, is_new] =
        known.try_emplace({atom.type, atom.diameter}, static_cast<std::uint16_t>(topology.kinds.size()));
    if (is_new) {
      if (topology.kinds.size() == kMostKinds)
        return fail(ErrorCode::kCapacity, "more than 65535 pairs of type and diameter");
      topology.kinds.push_back({.name = fmt::format("type{}", atom.type),
                                .radius = atom.diameter > 0 ? atom.diameter / 2 : other,
                                .colour_rgba = kColours[(atom.type - 1) % kColours.size()],
                                .mass = atom.type < masses.size() ? masses[atom.type] : 1});
    }
    topology.kind_of.push_back(at->second);
  }
  return topology;
}

/// A .gro has its number of atoms alone in the second line; a data file has a line `N atoms`.
bool looks_like_gro(std::string_view text) {
  const std::size_t first = text.find('\n');
  if (first == std::string_view::npos) return false;
  const Words words = words_of(text.substr(first + 1, text.find('\n', first + 1) - first - 1));
  return words.size() == 1 && number<std::size_t>(words[0]).has_value();
}

bool looks_like_lammps(std::string_view text) {
  Lines lines(text);
  std::string_view line;
  for (int i = 0; i < 40 && lines.next(line); ++i) {
    const Words words = words_of(line);
    if (words.size() == 2 && words[1] == "atoms" && number<std::size_t>(words[0])) return i > 0;
  }
  return false;
}

}  // namespace

Result<Topology> parse_topology(std::string_view text, std::optional<double> radius) {
  if (looks_like_gro(text)) return parse_gro(text, radius);
  if (looks_like_lammps(text)) return parse_lammps(text, radius);
  return parse_table(text, radius);
}

Result<Topology> read_topology(const std::string& path, std::optional<double> radius) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return fail(ErrorCode::kIo, fmt::format("{}: cannot be read", path));
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  auto topology = parse_topology(text, radius);
  if (!topology) return fail(topology.error().code, fmt::format("{}: {}", path, topology.error().message));
  return topology;
}

}  // namespace tandem::imd
