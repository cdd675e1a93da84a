#include "services/tool/top/screen/view.hpp"

#include <algorithm>

namespace tandem::top {
namespace {

constexpr std::ptrdiff_t kFar = 1 << 20;

template <class Row, class Is>
std::optional<std::size_t> place_of(const std::vector<Row>& rows, const Is& is) {
  if (rows.empty()) return std::nullopt;
  const auto found = std::ranges::find_if(rows, is);
  return found == rows.end() ? 0 : static_cast<std::size_t>(found - rows.begin());
}

std::size_t moved(std::size_t from, std::ptrdiff_t by, std::size_t count) {
  const std::ptrdiff_t to = static_cast<std::ptrdiff_t>(from) + by;
  return static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(to, 0, static_cast<std::ptrdiff_t>(count) - 1));
}

}  // namespace

Rows View::rows(const Overview& overview, Moment now) const {
  return {stream_rows(overview, streams_, now),
          client_rows(overview, filter_ ? &*filter_ : nullptr, clients_, now)};
}

std::optional<std::size_t> View::chosen_stream(const Rows& rows) const {
  return place_of(rows.streams, [this](const StreamRow& row) { return stream_ && *row.key == *stream_; });
}

std::optional<std::size_t> View::chosen_client(const Rows& rows) const {
  return place_of(rows.clients,
                  [this](const ClientRow& row) { return client_ && row.client->status.client == *client_; });
}

void View::move(const Rows& rows, std::ptrdiff_t by) {
  if (focus_ == Focus::kStreams) {
    if (const auto at = chosen_stream(rows)) stream_ = *rows.streams[moved(*at, by, rows.streams.size())].key;
  } else if (const auto at = chosen_client(rows)) {
    client_ = rows.clients[moved(*at, by, rows.clients.size())].client->status.client;
  }
}

void View::sort(std::ptrdiff_t by) {
  const bool streams = focus_ == Focus::kStreams;
  Order& order = streams ? streams_ : clients_;
  const auto count = static_cast<std::ptrdiff_t>(streams ? stream_columns().size() : client_columns().size());
  order.column = static_cast<std::size_t>((static_cast<std::ptrdiff_t>(order.column) + by + count) % count);
  // Numbers are looked at from the largest, names from the first.
  order.descending = (streams ? stream_columns()[order.column].align
                              : client_columns()[order.column].align) == Align::kRight ||
                     static_cast<std::ptrdiff_t>(order.column) + 1 == count;
}

bool View::press(Key key, const Rows& rows, std::size_t page) {
  const auto lines = static_cast<std::ptrdiff_t>(std::max<std::size_t>(page, 1));
  switch (key) {
    case Key::kNone:
    case Key::kResize:
      break;
    case Key::kUp:
      move(rows, -1);
      break;
    case Key::kDown:
      move(rows, 1);
      break;
    case Key::kPageUp:
      move(rows, -lines);
      break;
    case Key::kPageDown:
      move(rows, lines);
      break;
    case Key::kFirst:
      move(rows, -kFar);
      break;
    case Key::kLast:
      move(rows, kFar);
      break;
    case Key::kSortNext:
      sort(1);
      break;
    case Key::kSortBefore:
      sort(-1);
      break;
    case Key::kReverse: {
      Order& order = focus_ == Focus::kStreams ? streams_ : clients_;
      order.descending = !order.descending;
      break;
    }
    case Key::kOther:
      focus_ = focus_ == Focus::kStreams ? Focus::kClients : Focus::kStreams;
      break;
    case Key::kFilter:
      if (filter_) {
        filter_.reset();
      } else if (const auto at = chosen_stream(rows)) {
        filter_ = *rows.streams[*at].key;
      }
      break;
    case Key::kDetails:
      panel_ = panel_ == Panel::kTables ? Panel::kDetails : Panel::kTables;
      break;
    case Key::kEvents:
      panel_ = panel_ == Panel::kEvents ? Panel::kTables : Panel::kEvents;
      break;
    case Key::kHelp:
      panel_ = panel_ == Panel::kHelp ? Panel::kTables : Panel::kHelp;
      break;
    case Key::kBack:
      panel_ = Panel::kTables;
      break;
    case Key::kQuit:
      return false;
  }
  return true;
}

}  // namespace tandem::top
