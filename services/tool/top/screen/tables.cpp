#include "services/tool/top/screen/tables.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numeric>
#include <type_traits>

namespace tandem::top {
namespace {

// Columns for the words at the end of a row, at least.
constexpr std::size_t kStreamWords = 22, kClientWords = 30;
constexpr std::size_t kBar = 8, kSpark = 12;

template <class Row>
std::vector<std::size_t> fitting(const std::vector<Column<Row>>& columns, std::size_t width) {
  constexpr std::size_t kLeastLast = std::is_same_v<Row, StreamRow> ? kStreamWords : kClientWords;
  std::vector<std::size_t> by_rank(columns.size() - 1), shown_ones;
  std::iota(by_rank.begin(), by_rank.end(), std::size_t{0});
  std::ranges::stable_sort(by_rank, {}, [&columns](std::size_t i) { return columns[i].rank; });
  std::size_t used = 1 + kLeastLast;
  for (const std::size_t i : by_rank) {
    if (used + columns[i].width + 1 > width && columns[i].rank > 0) break;
    used += columns[i].width + 1;
    shown_ones.push_back(i);
  }
  std::ranges::sort(shown_ones);
  return shown_ones;
}

template <class Row, class Text>
Line line(const std::vector<Column<Row>>& columns, const Sheet& sheet, const Text& add_cell) {
  Line out(" ");
  std::size_t used = 1;
  for (const std::size_t i : fitting(columns, sheet.width)) {
    add_cell(out, i, columns[i].width);
    out.add(" ");
    used += columns[i].width + 1;
  }
  add_cell(out, columns.size() - 1, sheet.width - std::min(used, sheet.width));
  return out;
}

template <class Row>
Line header(const std::vector<Column<Row>>& columns, std::size_t sorted, const Sheet& sheet) {
  return line(columns, sheet, [&](Line& out, std::size_t i, std::size_t width) {
    const Align align = i + 1 == columns.size() ? Align::kLeft : columns[i].align;
    out.add(cell(columns[i].title, width, align, sheet.alphabet), i == sorted ? Style::kStrong : Style::kDim);
  });
}

template <class Row>
Line row_line(const std::vector<Column<Row>>& columns, const Row& row, bool chosen, bool gone,
              const Sheet& sheet) {
  const Style style = gone ? Style::kDim : Style::kNormal;
  Line out = line(columns, sheet, [&](Line& to, std::size_t i, std::size_t width) {
    const bool is_last = i + 1 == columns.size();
    const bool words = is_last && row.diagnosis.trouble >= Trouble::kWarning;
    to.add(cell(columns[i].text(row, sheet.now, sheet.alphabet), width,
                is_last ? Align::kLeft : columns[i].align, sheet.alphabet),
           words ? style_of(row.diagnosis.trouble) : style);
  });
  if (chosen) {
    out.parts.front().text = ">";
    for (Part& part : out.parts) part.style = Style::kChosen;
  }
  return out;
}

SortKey by(double value) { return {sane(value), {}}; }
SortKey by(std::string text) { return {0, std::move(text)}; }

template <class Row>
void sort(std::vector<Row>& rows, const std::vector<Column<Row>>& columns, Order order) {
  const auto& key = columns.at(std::min(order.column, columns.size() - 1)).key;
  std::vector<std::pair<SortKey, std::size_t>> keys;
  for (std::size_t i = 0; i < rows.size(); ++i) keys.emplace_back(key(rows[i]), i);
  std::ranges::stable_sort(keys, [&order](const auto& a, const auto& b) {
    return order.descending ? b.first < a.first : a.first < b.first;
  });
  std::vector<Row> sorted;
  sorted.reserve(rows.size());
  for (const auto& [unused, i] : keys) sorted.push_back(std::move(rows[i]));
  rows = std::move(sorted);
}

double budget_ms(const Stream& stream) { return stream.nominal_hz > 0 ? 1e3 / stream.nominal_hz : 0; }

std::string frame_text(const Stream& stream, std::size_t columns, Alphabet alphabet) {
  const double budget = budget_ms(stream), frame = sane(stream.status.frame_ms_p50);
  if (budget <= 0) return number(frame, 1, 8) + " ms";
  return bar(frame / budget, sane(stream.status.frame_ms_p99) / budget, columns, alphabet) + ' ' +
         cell(number(frame, 1, 5), 5, Align::kRight, alphabet) + '/' + number(budget, 0, 4);
}

bool is_gone(const StreamRow& row) { return row.stream->gone; }
bool is_gone(const ClientRow& row) { return row.client->gone; }
const std::deque<StreamPoint>& minute(const StreamRow& row) { return row.stream->minute; }
const std::deque<ClientPoint>& minute(const ClientRow& row) { return row.client->minute; }

template <class Row, class Of>
Column<Row> value_column(std::string_view title, std::size_t width, int rank, int decimals, Of of) {
  return {title,
          width,
          Align::kRight,
          rank,
          [=](const Row& row, Moment, Alphabet) {
            return is_gone(row) ? std::string("-") : number(static_cast<double>(of(row)), decimals, width);
          },
          [=](const Row& row) { return by(static_cast<double>(of(row))); }};
}

template <class Row, class Of>
Column<Row> text_column(std::string_view title, std::size_t width, int rank, Of of) {
  return {title,
          width,
          Align::kLeft,
          rank,
          [=](const Row& row, Moment, Alphabet) { return std::string(of(row)); },
          [=](const Row& row) { return by(std::string(of(row))); }};
}

/// `least`: what is less than this looks small, whatever the other values are.
template <class Row, class Of>
Column<Row> minute_column(std::string_view title, int rank, double least, Of of) {
  return {title,
          kSpark,
          Align::kLeft,
          rank,
          [=](const Row& row, Moment now, Alphabet alphabet) {
            const auto values = spread(minute(row), now, kSpark, of);
            return sparkline(values, std::max(least, largest(values)), alphabet);
          },
          [=](const Row& row) { return by(minute(row).empty() ? 0 : of(minute(row).back())); }};
}

std::string clients_text(const Stream& stream) {
  if (stream.gone) return "-";
  std::string text = fmt::format("{}+{}", stream.status.participants, stream.status.observers);
  if (stream.viewers > 0) text += fmt::format("+{}v", stream.viewers);
  return text;
}

std::vector<Column<StreamRow>> make_stream_columns() {
  using R = StreamRow;
  const auto value = [](std::string_view title, std::size_t width, int rank, int decimals, auto of) {
    return value_column<R>(title, width, rank, decimals,
                           [of](const R& row) { return of(row.stream->status); });
  };
  using Status = transport::ServerStatusMessage;
  return {
      text_column<R>("SESSION", 16, 0, [](const R& row) { return name_of(*row.key, *row.stream); }),
      value("HZ", 5, 1, 1, [](const Status& s) { return s.frame_rate_hz; }),
      {"FRAME MS, OF BUDGET", kBar + 12, Align::kLeft, 2,
       [](const R& row, Moment, Alphabet alphabet) {
         return row.stream->gone ? std::string() : frame_text(*row.stream, kBar, alphabet);
       },
       [](const R& row) { return by(row.stream->status.frame_ms_p50); }},
      value("BODIES", 7, 5, 0, [](const Status& s) { return s.bodies; }),
      value("MBIT/S", 6, 3, 2, [](const Status& s) { return s.mbit_per_s; }),
      value("% RAW", 6, 4, 1, [](const Status& s) { return share_of_raw(s); }),
      {"CLIENTS", 9, Align::kRight, 1,
       [](const R& row, Moment, Alphabet) { return clients_text(*row.stream); },
       [](const R& row) {
         const Status& s = row.stream->status;
         return by(double{1} * s.participants + s.observers + row.stream->viewers);
       }},
      value("AT REST", 7, 12, 0, [](const Status& s) { return s.at_rest; }),
      value("CORRECTED", 9, 11, 0, [](const Status& s) { return s.corrected_per_frame; }),
      value("STALLS", 6, 13, 0, [](const Status& s) { return s.stalls; }),
      minute_column<R>("RATE, 1 MIN", 9, 0, [](const StreamPoint& p) { return p.rate_hz; }),
      minute_column<R>("MBIT/S,1 MIN", 10, 0, [](const StreamPoint& p) { return p.mbit_per_s; }),
      {"PREDICTOR, THRESHOLD", 0, Align::kLeft, 0,
       [](const R& row, Moment, Alphabet) {
         const Status& s = row.stream->status;
         if (!row.stream->offered) return fmt::format("{}: only measured", s.predictor);
         if (!row.diagnosis.why.empty()) return row.diagnosis.why;
         return fmt::format("{}, {}", s.predictor, number(s.threshold, 3, 6));
       },
       [](const R& row) {
         return SortKey{static_cast<int>(row.diagnosis.trouble), row.stream->status.predictor};
       }},
  };
}

/// Of an offer that carries the frames of another one of the same name.
std::string delay_text(std::uint32_t id, const Stream& stream) {
  return stream.carries == id ? std::string() : fmt::format("@{:g}", 1e-3 * stream.delay_ms);
}

std::string stream_text(const ClientRow& row) {
  const std::uint32_t id = row.client->status.stream.id;
  if (row.stream == nullptr) return fmt::format("{}", id);
  const std::string& name = row.stream->name.empty() ? row.stream->status.predictor : row.stream->name;
  return fmt::format("{} {}", id, name + delay_text(id, *row.stream));
}

std::vector<Column<ClientRow>> make_client_columns() {
  using R = ClientRow;
  return {
      text_column<R>("CLIENT", 8, 0, [](const R& row) { return short_id(row.client->status.client); }),
      text_column<R>("SESSION", 12, 8, [](const R& row) { return row.client->status.session; }),
      text_column<R>("STATE", 8, 1, [](const R& row) { return state_word(row); }),
      value_column<R>("LAG MS", 7, 2, 1, [](const R& row) { return row.facts.lag_ms; }),
      value_column<R>("HZ", 5, 4, 1, [](const R& row) { return row.facts.rate_hz; }),
      value_column<R>("WORK MS", 7, 5, 1, [](const R& row) { return row.facts.work_ms; }),
      value_column<R>("MBIT/S", 6, 3, 2, [](const R& row) { return row.client->status.mbit_per_s; }),
      {"STREAM", 12, Align::kLeft, 7, [](const R& row, Moment, Alphabet) { return stream_text(row); },
       [](const R& row) { return by(row.client->status.stream.id); }},
      text_column<R>("HOST", 10, 6,
                     [](const R& row) { return row.client->peer ? row.client->peer->host : std::string(); }),
      minute_column<R>("LAG, 1 MIN", 9, 100, [](const ClientPoint& p) { return p.lag_ms; }),
      minute_column<R>("RATE, 1 MIN", 10, 0, [](const ClientPoint& p) { return p.rate_hz; }),
      minute_column<R>("MBIT/S,1 MIN", 11, 0, [](const ClientPoint& p) { return p.mbit_per_s; }),
      value_column<R>("REJOINS", 7, 12, 0, [](const R& row) { return row.client->status.resyncs; }),
      value_column<R>("REFUSED", 7, 13, 0, [](const R& row) { return row.client->status.inputs_refused; }),
      {"WHY IT LAGS, OR WHY THIS STREAM", 0, Align::kLeft, 0,
       [](const R& row, Moment, Alphabet) {
         return row.diagnosis.why.empty() ? row.client->status.stream_reason : row.diagnosis.why;
       },
       // The worst first; those that are gone say less than those that lag.
       [](const R& row) {
         return SortKey{1e12 * static_cast<int>(row.diagnosis.trouble) + row.facts.lag_ms,
                        row.client->status.stream_reason};
       }},
  };
}

}  // namespace

const std::vector<Column<StreamRow>>& stream_columns() {
  static const auto columns = make_stream_columns();
  return columns;
}

const std::vector<Column<ClientRow>>& client_columns() {
  static const auto columns = make_client_columns();
  return columns;
}

Order first_stream_order() { return {}; }
Order first_client_order() { return {client_columns().size() - 1, true}; }

std::vector<StreamRow> stream_rows(const Overview& overview, Order order, Moment now) {
  std::vector<StreamRow> rows;
  for (const auto& [key, stream] : overview.streams())
    rows.push_back({&key, &stream, diagnose(overview, key, stream, now)});
  sort(rows, stream_columns(), order);
  return rows;
}

std::vector<ClientRow> client_rows(const Overview& overview, const StreamKey* only, Order order, Moment now) {
  std::vector<ClientRow> rows;
  for (const auto& [id, client] : overview.clients()) {
    if (only != nullptr &&
        (client.status.session != only->session || client.status.stream.id != only->stream))
      continue;
    rows.push_back(
        {&client, overview.stream_of(client), facts_of(overview, client), diagnose(overview, client, now)});
  }
  sort(rows, client_columns(), order);
  return rows;
}

Line stream_header(std::size_t sorted, const Sheet& sheet) { return header(stream_columns(), sorted, sheet); }
Line client_header(std::size_t sorted, const Sheet& sheet) { return header(client_columns(), sorted, sheet); }
Line line_of(const StreamRow& row, bool chosen, const Sheet& sheet) {
  return row_line(stream_columns(), row, chosen, row.stream->gone, sheet);
}
Line line_of(const ClientRow& row, bool chosen, const Sheet& sheet) {
  return row_line(client_columns(), row, chosen, row.client->gone, sheet);
}

std::string name_of(const StreamKey& key, const Stream& stream) {
  std::string name = key.session;
  if (!stream.name.empty()) {
    name += "/" + stream.name;
  } else if (key.stream != 0 && stream.carries != 0) {
    name += fmt::format("/{}", key.stream);
  }
  return name + delay_text(key.stream, stream);
}

std::string_view state_word(const ClientRow& row) {
  const Client& client = *row.client;
  if (client.gone) return "gone";
  if (row.stream != nullptr && row.stream->gone) return "stranded";
  if (client.joining) return "joining";
  if (client.demoted) return "demoted";
  if (client.gateway) return "viewer";
  return client.status.role == static_cast<std::uint32_t>(transport::Role::kParticipant) ? "plays"
                                                                                         : "observes";
}

double share_of_raw(const transport::ServerStatusMessage& status) {
  return status.raw_mbit_per_s > 0 ? 100 * status.mbit_per_s / status.raw_mbit_per_s : 0;
}

double largest(const std::vector<double>& values) {
  double most = 0;
  for (const double value : values)
    if (value > most) most = value;
  return most;
}

}  // namespace tandem::top
