// Files of coordinates: .gro of GROMACS, .pdb, .xyz.
#include <fmt/format.h>

#include "services/adapters/imd/formats.hpp"
#include "services/adapters/imd/kinds.hpp"
#include "services/adapters/imd/text.hpp"

namespace tandem::imd {
namespace {

bool is_letter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

/// The columns of a line, counted from 1, without spaces around them.
std::string_view columns(std::string_view line, std::size_t first, std::size_t last) {
  if (line.size() < first) return {};
  std::string_view part = line.substr(first - 1, last - first + 1);
  while (!part.empty() && (part.front() == ' ' || part.front() == '\t')) part.remove_prefix(1);
  while (!part.empty() && (part.back() == ' ' || part.back() == '\t' || part.back() == '\r'))
    part.remove_suffix(1);
  return part;
}

/// The letters that a name begins with, behind its digits.
std::string_view letters_of(std::string_view name) {
  const auto begin = std::ranges::find_if(name, is_letter);
  const auto end = std::find_if_not(begin, name.end(), is_letter);
  return {begin, end};
}

/// Of an atom by its name and that of its residue: an ion has the name of its residue, while CA of a protein
/// is a carbon.
std::string_view element_of_gro(std::string_view name, std::string_view residue) {
  const std::string_view letters = letters_of(name);
  if (letters.empty()) return name;  // a number, of a model of its own
  const bool of_proteins = letters == "CA" || letters == "HE" || letters == "NA" || letters == "NE";
  const bool whole = letters == letters_of(residue) || !of_proteins;
  return whole && element_of(letters) != nullptr ? letters : letters.substr(0, 1);
}

}  // namespace

Result<Topology> parse_gro(std::string_view text, std::optional<double> radius) {
  Lines lines(text);
  std::string_view line;
  lines.next(line);  // the title
  std::size_t count = 0;
  if (lines.next(line)) {
    const Words words = words_of(line);
    count = words.size() == 1 ? number<std::size_t>(words[0]).value_or(0) : 0;
  }
  if (count == 0 || count > kMaxAtoms)
    return lines.refuse(fmt::format("the number of atoms is not 1 to {}", kMaxAtoms));
  Kinds kinds;
  for (std::size_t i = 0; i < count; ++i) {
    if (!lines.next(line))
      return fail(ErrorCode::kMalformed, fmt::format("it has {} of its {} atoms", i, count));
    const std::string_view name = line.size() < 20 ? std::string_view() : columns(line, 11, 15);
    if (name.empty()) return lines.refuse("an atom without a name");
    kinds.add_element(element_of_gro(name, columns(line, 6, 10)), radius);
  }
  std::optional<std::vector<double>> box;
  if (lines.next(line))
    if (const Words words = words_of(line); words.size() >= 3)
      box = box_of(positive(words[0]), positive(words[1]), positive(words[2]));
  if (box)
    for (double& side : *box) side *= 10;
  return kinds.finish(box);
}

Result<Topology> parse_pdb(std::string_view text, std::optional<double> radius) {
  Lines lines(text);
  std::optional<std::vector<double>> box;
  Kinds kinds;
  for (std::string_view line; lines.next(line);) {
    const std::string_view record = columns(line, 1, 6);
    if (record == "CRYST1")
      box = box_of(positive(columns(line, 7, 15)), positive(columns(line, 16, 24)),
                   positive(columns(line, 25, 33)));
    if (record == "ENDMDL") break;  // the next model has the same atoms
    if (record != "ATOM" && record != "HETATM") continue;
    if (!number<double>(columns(line, 31, 38)) || !number<double>(columns(line, 47, 54)))
      return lines.refuse("an atom without coordinates in columns 31 to 54");
    // The element is in its own columns, or in those of the name whose second one its last letter has.
    std::string_view element = letters_of(columns(line, 77, 78));
    if (element.empty()) {
      element = letters_of(columns(line, 13, 14));
      if (element.empty()) element = letters_of(columns(line, 13, 16));
      if (element_of(element) == nullptr) element = element.substr(0, 1);
    }
    if (element.empty()) return lines.refuse("an atom without a name");
    kinds.add_element(element, radius);
  }
  return kinds.finish(box);
}

Result<Topology> parse_xyz(std::string_view text, std::optional<double> radius) {
  Lines lines(text);
  std::string_view line;
  lines.next(line);
  const Words head = words_of(line);
  const std::size_t count = head.empty() ? 0 : number<std::size_t>(head[0]).value_or(0);
  if (count == 0 || count > kMaxAtoms)
    return lines.refuse(fmt::format("the number of atoms is not 1 to {}", kMaxAtoms));
  std::optional<std::vector<double>> box;
  lines.next(line);  // a comment; the extended form has the box there
  constexpr std::string_view kLattice = "Lattice=\"";
  if (const std::size_t at = line.find(kLattice); at != std::string_view::npos) {
    const std::string_view rest = line.substr(at + kLattice.size());
    if (const Words words = words_of(rest.substr(0, rest.find('"'))); words.size() == 9)
      box = box_of(positive(words[0]), positive(words[4]), positive(words[8]));
  }
  Kinds kinds;
  for (std::size_t i = 0; i < count; ++i) {
    if (!lines.next(line))
      return fail(ErrorCode::kMalformed, fmt::format("it has {} of its {} atoms", i, count));
    const Words words = words_of(line);
    if (words.size() < 4) return lines.refuse("expected ELEMENT X Y Z");
    const std::string_view letters = letters_of(words[0]);
    kinds.add_element(element_of(letters) != nullptr ? letters : words[0].substr(0, 24), radius);
  }
  return kinds.finish(box);
}

}  // namespace tandem::imd
