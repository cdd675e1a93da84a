#pragma once
// What the operator has chosen to see.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "services/tool/top/screen/tables.hpp"

namespace tandem::top {

enum class Panel : std::uint8_t { kTables, kDetails, kEvents, kHelp };
enum class Focus : std::uint8_t { kStreams, kClients };

/// Keys by what they are for; the terminal says which ones those are.
enum class Key : std::uint8_t {
  kNone,
  kUp,
  kDown,
  kPageUp,
  kPageDown,
  kFirst,
  kLast,
  kSortNext,
  kSortBefore,
  kReverse,
  kOther,  ///< the other table
  kFilter,
  kDetails,
  kEvents,
  kHelp,
  kBack,
  kQuit,
  kResize,
};

/// The rows that are on the screen, in their order.
struct Rows {
  std::vector<StreamRow> streams;
  std::vector<ClientRow> clients;
};

/// Not thread-safe.
class View {
 public:
  [[nodiscard]] Rows rows(const Overview& overview, Moment now) const;
  /// False if the program shall end. `rows`: what the operator sees. `page`: so many lines a page has.
  [[nodiscard]] bool press(Key key, const Rows& rows, std::size_t page);

  [[nodiscard]] Panel panel() const { return panel_; }
  [[nodiscard]] Focus focus() const { return focus_; }
  [[nodiscard]] const Order& order(Focus of) const { return of == Focus::kStreams ? streams_ : clients_; }
  /// The chosen row; the first one until another is chosen. Empty: there are no rows.
  [[nodiscard]] std::optional<std::size_t> chosen_stream(const Rows& rows) const;
  [[nodiscard]] std::optional<std::size_t> chosen_client(const Rows& rows) const;
  [[nodiscard]] bool filters() const { return filter_.has_value(); }

 private:
  void move(const Rows& rows, std::ptrdiff_t by);
  void sort(std::ptrdiff_t by);

  Panel panel_ = Panel::kTables;
  Focus focus_ = Focus::kClients;
  Order streams_ = first_stream_order(), clients_ = first_client_order();
  std::optional<StreamKey> stream_;
  std::optional<transport::ClientId> client_;
  std::optional<StreamKey> filter_;  ///< only clients of this stream
};

}  // namespace tandem::top
