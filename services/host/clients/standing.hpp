#pragma once
// What an acknowledgement makes of a client: a table.

#include <array>
#include <cstddef>
#include <cstdint>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::host {

/// What is known of a client before an acknowledgement of it. Served: it was sent the snapshot that it asked
/// for, so it may play what it joined, and its word that it does may have been overwritten by the next.
enum class Standing : std::uint8_t {
  kUnknown,         ///< it has no account
  kJoining,         ///< it joins a stream
  kServed,          ///< the same, and it was served
  kPlaying,         ///< it plays a stream
  kFetching,        ///< and asks for a state of that stream, which it lacks
  kChanging,        ///< and joins another one, the next
  kChangingServed,  ///< the same, and it was served
};
inline constexpr std::size_t kStandings = 7;

/// What it says.
enum class Said : std::uint8_t {
  kJoins,      ///< it joins, and plays nothing
  kChanges,    ///< it joins, and plays another stream, or the same without a state
  kPlays,      ///< it plays, since the join that is known
  kPlaysAnew,  ///< it plays, since another join
};
inline constexpr std::size_t kSaid = 4;

/// Of which stream it says so.
enum class Named : std::uint8_t {
  kOwn,    ///< the one that it is known to play or join
  kNext,   ///< the next one; only of a client that is changing
  kOther,  ///< another one, or any of a client that is unknown
};
inline constexpr std::size_t kNamed = 3;

/// What follows. Own, next and named stream: as they were before.
enum class Action : std::uint8_t {
  kJoin,            ///< it joins the named stream
  kEnter,           ///< it plays the named stream, anew
  kEnterAndChange,  ///< it plays its own, anew, and joins the named one
  kGoOn,            ///< it plays its own stream as before
  kChange,          ///< the same, and joins the named one
  kMoveOver,        ///< it plays the next one
  kMoveAndChange,   ///< the same, and joins the named one: its way back
};

[[nodiscard]] constexpr Action action_of(Standing standing, Said said, Named named) {
  using enum Action;
  using OfStreams = std::array<Action, kNamed>;
  using OfSaid = std::array<OfStreams, kSaid>;
  constexpr OfStreams kJoins{kJoin, kJoin, kJoin}, kEnters{kEnter, kEnter, kEnter},
      kStays{kGoOn, kMoveOver, kEnter};
  constexpr std::array<OfSaid, kStandings> kTable{{
      // joins, changes, plays, plays anew
      {kJoins, kJoins, kEnters, kEnters},                                               // unknown
      {kJoins, kJoins, kEnters, kEnters},                                               // joining
      {kJoins, {kEnterAndChange, kEnterAndChange, kEnterAndChange}, kEnters, kEnters},  // served
      {kJoins, {kChange, kChange, kChange}, kStays, kEnters},                           // playing
      {kJoins, {kChange, kChange, kChange}, kStays, kStays},                            // fetching
      {kJoins, {kJoin, kChange, kChange}, kStays, kStays},                              // changing
      {kJoins, {kMoveAndChange, kChange, kChange}, kStays, kStays},                     // and served
  }};
  const bool has_next = standing == Standing::kChanging || standing == Standing::kChangingServed;
  TANDEM_ASSERT(named != Named::kNext || has_next);
  return kTable[static_cast<std::size_t>(standing)][static_cast<std::size_t>(said)]
               [static_cast<std::size_t>(named)];
}

/// It plays a stream.
[[nodiscard]] constexpr bool plays(Action action) { return action != Action::kJoin; }
/// It begins to play: what was measured of it before counts no more.
[[nodiscard]] constexpr bool enters(Action action) {
  return action == Action::kEnter || action == Action::kEnterAndChange;
}
/// It plays the next stream from now on.
[[nodiscard]] constexpr bool moves(Action action) {
  return action == Action::kMoveOver || action == Action::kMoveAndChange;
}
/// It joins the named stream while it plays.
[[nodiscard]] constexpr bool changes(Action action) {
  return action == Action::kEnterAndChange || action == Action::kChange || action == Action::kMoveAndChange;
}

}  // namespace tandem::host
