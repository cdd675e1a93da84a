#include "tests/fault/world/journal.hpp"

#include <cinttypes>
#include <cstdio>
#include <utility>

namespace tandem::world {

void Journal::fold(std::uint64_t value) {
  for (int byte = 0; byte < 8; ++byte) {  // FNV-1a
    digest_ ^= (value >> (8 * byte)) & 0xFFU;
    digest_ *= 1099511628211ULL;
  }
}

void Journal::add(std::int64_t at_ns, std::string who, std::string what) {
  fold(static_cast<std::uint64_t>(at_ns));
  for (const char c : who + what) fold(static_cast<unsigned char>(c));
  events_.push_back({at_ns, std::move(who), std::move(what)});
}

std::string Journal::text(std::size_t most) const {
  std::string lines;
  for (std::size_t i = events_.size() > most ? events_.size() - most : 0; i < events_.size(); ++i) {
    char begin[64];
    std::snprintf(begin, sizeof begin, "%9.3f  %-14s ", static_cast<double>(events_[i].at_ns) / 1e9,
                  events_[i].who.c_str());
    lines += begin + events_[i].what + '\n';
  }
  return lines;
}

}  // namespace tandem::world
