#pragma once
// The two tables of `tandem top`: streams and clients, with their columns.

#include <algorithm>
#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "services/tool/top/model/diagnosis.hpp"
#include "services/tool/top/model/overview.hpp"
#include "services/tool/top/screen/page.hpp"
#include "services/tool/top/screen/text.hpp"

namespace tandem::top {

/// Pointers are into the overview.
struct StreamRow {
  const StreamKey* key = nullptr;
  const Stream* stream = nullptr;
  Diagnosis diagnosis;
};
struct ClientRow {
  const Client* client = nullptr;
  const Stream* stream = nullptr;  ///< that it plays; null: not heard of
  ClientFacts facts;
  Diagnosis diagnosis;
};

/// By which a table is sorted: numbers first, equal ones by text.
using SortKey = std::pair<double, std::string>;

template <class Row>
struct Column {
  std::string_view title;
  std::size_t width = 0;
  Align align = Align::kRight;
  int rank = 0;  ///< columns of a low rank are shown first, as far as there is room
  std::function<std::string(const Row&, Moment, Alphabet)> text;
  std::function<SortKey(const Row&)> key;
};

/// All columns, in their order on the screen. The last one takes the room that is left.
[[nodiscard]] const std::vector<Column<StreamRow>>& stream_columns();
[[nodiscard]] const std::vector<Column<ClientRow>>& client_columns();

struct Order {
  std::size_t column = 0;
  bool descending = false;
};
/// Streams by name, and the worst client first.
[[nodiscard]] Order first_stream_order();
[[nodiscard]] Order first_client_order();

[[nodiscard]] std::vector<StreamRow> stream_rows(const Overview& overview, Order order, Moment now);
/// `only`: the clients of this stream alone; null: all.
[[nodiscard]] std::vector<ClientRow> client_rows(const Overview& overview, const StreamKey* only, Order order,
                                                 Moment now);

/// A table as wide as the screen.
struct Sheet {
  std::size_t width = 100;
  Moment now;
  Alphabet alphabet = Alphabet::kAscii;
};
[[nodiscard]] Line stream_header(std::size_t sorted, const Sheet& sheet);
[[nodiscard]] Line client_header(std::size_t sorted, const Sheet& sheet);
[[nodiscard]] Line line_of(const StreamRow& row, bool chosen, const Sheet& sheet);
[[nodiscard]] Line line_of(const ClientRow& row, bool chosen, const Sheet& sheet);

/// "SESSION" or "SESSION/STREAM", where there are several.
[[nodiscard]] std::string name_of(const StreamKey& key, const Stream& stream);
/// What a client does, in one word.
[[nodiscard]] std::string_view state_word(const ClientRow& row);
/// The share of the raw rate, percent.
[[nodiscard]] double share_of_raw(const transport::ServerStatusMessage& status);

/// The largest value in each part of the last minute, oldest first; NaN where nothing came.
template <class Points, class Value>
[[nodiscard]] std::vector<double> spread(const Points& points, Moment now, std::size_t columns, Value value) {
  std::vector<double> out(columns, std::numeric_limits<double>::quiet_NaN());
  for (const auto& point : points) {
    const double age = static_cast<double>(now.steady_ns - point.at_ns) / static_cast<double>(kMinuteNs);
    if (age < 0 || age >= 1 || columns == 0) continue;
    const auto place = static_cast<std::size_t>((1 - age) * static_cast<double>(columns));
    double& slot = out[std::min(place, columns - 1)];
    const double now_is = sane(value(point));
    slot = slot >= now_is ? slot : now_is;
  }
  return out;
}
/// The largest of them; 0 if there is none.
[[nodiscard]] double largest(const std::vector<double>& values);

}  // namespace tandem::top
