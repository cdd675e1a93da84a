#include "services/tool/top/screen/pages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ctime>

#include "services/tool/top/screen/details.hpp"

namespace tandem::top {
namespace {

constexpr std::size_t kExplanationLines = 4;

constexpr std::array<std::string_view, 18> kHelp{
    "Worst clients stand first. The line below the tables says why the chosen one lags.",
    "",
    "up, down, page up, page down, home, end   choose a client",
    "tab                                       the other table: sessions, clients",
    "enter                                     details of the chosen one, and back",
    "right, left (or s, S)                     sort by the next column, by the one before",
    "r                                         the other way round",
    "f                                         only clients of the chosen stream, or all",
    "l                                         what happened since the start of this program",
    "?  q                                      this help; end",
    "",
    "STATE   plays, observes; viewer: behind a gateway; demoted: the server waited for it too long;",
    "        joining: has no state yet; stranded: its server is gone; gone: nothing is heard of it",
    "LAG     from the publication of a frame until the client has applied it",
    "WORK    its own decoding, applying and simulating of a frame",
    "CLIENTS participants + observers + viewers behind gateways",
    "FRAME   the server's time for a frame (median) of what a frame has; | is the slowest",
    "% RAW   the stream's rate compared with all its channels uncompressed",
};

std::string clock_text(std::int64_t wall_ns) {
  const std::time_t seconds = static_cast<std::time_t>(wall_ns / 1'000'000'000);
  std::tm local{};
  localtime_r(&seconds, &local);
  return fmt::format("{:02}:{:02}:{:02}", local.tm_hour, local.tm_min, local.tm_sec);
}

std::string plural(std::size_t count, std::string_view what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

Line title(const Overview& overview, std::uint32_t domain, Size size, Moment now, Alphabet alphabet) {
  std::size_t sessions = 0, clients = 0, viewers = 0;
  for (const auto& [key, stream] : overview.streams())
    sessions += key.stream == 0 && key.standby == 0 ? 1 : 0;
  for (const auto& [id, client] : overview.clients()) {
    if (client.gone) continue;
    (client.gateway ? viewers : clients) += 1;
  }
  std::string left = fmt::format(" tandem top  domain {}  {}, {}", domain, plural(sessions, "session"),
                                 plural(clients, "client"));
  if (viewers > 0) left += ", " + plural(viewers, "viewer");
  const std::string right = clock_text(now.wall_ns) + "  ? help  q quit ";
  const std::size_t room = size.columns > right.size() + 20 ? size.columns - right.size() : size.columns;
  std::string text = cell(left, room, Align::kLeft, alphabet);
  if (room < size.columns) text += right;
  return {text, Style::kHeader};
}

/// The rows around the chosen one.
std::size_t first_shown(std::optional<std::size_t> chosen, std::size_t count, std::size_t lines) {
  if (!chosen || count <= lines) return 0;
  return std::min(*chosen - std::min(*chosen, lines / 2), count - lines);
}

template <class Row>
void add_rows(Page& page, const std::vector<Row>& rows, std::optional<std::size_t> chosen, bool marked,
              std::size_t lines, const Sheet& sheet) {
  const std::size_t first = first_shown(chosen, rows.size(), lines);
  for (std::size_t i = first; i < std::min(rows.size(), first + lines); ++i)
    page.push_back(line_of(rows[i], marked && chosen == i, sheet));
}

void add_wrapped(Page& page, std::string_view text, std::size_t columns, Style style, Alphabet alphabet) {
  for (std::string& line : wrap(text, columns, alphabet)) page.emplace_back(" " + std::move(line), style);
}

/// Why the chosen client, or the chosen session, is as it is.
Page explanation(const View& view, const Rows& rows, Size size, Alphabet alphabet) {
  Page page;
  std::string who;
  const Diagnosis* diagnosis = nullptr;
  if (view.focus() == Focus::kStreams) {
    if (const auto at = view.chosen_stream(rows)) {
      who = name_of(*rows.streams[*at].key, *rows.streams[*at].stream);
      diagnosis = &rows.streams[*at].diagnosis;
    }
  } else if (const auto at = view.chosen_client(rows)) {
    who = short_id(rows.clients[*at].client->status.client);
    diagnosis = &rows.clients[*at].diagnosis;
  }
  if (diagnosis == nullptr) return page;
  std::string text = who + ": ";
  if (diagnosis->facts.empty()) text += "nothing is wrong with it.";
  for (const std::string& fact : diagnosis->facts) text += fact + " ";
  add_wrapped(page, text, size.columns - std::min<std::size_t>(size.columns, 2), style_of(diagnosis->trouble),
              alphabet);
  return page;
}

Page tables(const Overview& overview, const View& view, const Rows& rows, std::uint32_t domain, Size size,
            Moment now, Alphabet alphabet) {
  const Sheet sheet{size.columns, now, alphabet};
  Page page;
  page.push_back(title(overview, domain, size, now, alphabet));
  if (rows.streams.empty() && rows.clients.empty()) {
    add_wrapped(page, fmt::format("No session is heard of on domain {}.", domain), size.columns,
                Style::kNormal, alphabet);
    return page;
  }
  Page foot = size.lines >= 16 ? explanation(view, rows, size, alphabet) : Page();
  if (foot.size() > kExplanationLines) foot.resize(kExplanationLines);
  const std::size_t foot_lines = size.lines >= 16 ? kExplanationLines + 1 : 0;
  // A quarter for the streams, the rest for the clients.
  const std::size_t room = size.lines - std::min(size.lines, page.size() + 3 + foot_lines);
  const std::size_t for_streams = std::min(rows.streams.size(), std::max<std::size_t>(room / 4, 1));
  page.push_back(stream_header(view.order(Focus::kStreams).column, sheet));
  add_rows(page, rows.streams, view.chosen_stream(rows), view.focus() == Focus::kStreams, for_streams, sheet);
  if (size.lines >= 16) page.emplace_back();
  page.push_back(client_header(view.order(Focus::kClients).column, sheet));
  const std::size_t for_clients = size.lines - std::min(size.lines, page.size() + foot_lines);
  add_rows(page, rows.clients, view.chosen_client(rows), view.focus() == Focus::kClients, for_clients, sheet);
  if (rows.clients.empty()) page.emplace_back(" no client", Style::kDim);
  if (foot_lines > 0 && !foot.empty()) {
    while (page.size() + foot_lines < size.lines) page.emplace_back();
    page.emplace_back();
    page.insert(page.end(), foot.begin(), foot.end());
  }
  return page;
}

Page events(const Overview& overview, std::uint32_t domain, Size size, Moment now, Alphabet alphabet) {
  Page page;
  page.push_back(title(overview, domain, size, now, alphabet));
  page.emplace_back(" WHAT HAPPENED SINCE THE START OF THIS PROGRAM", Style::kDim);
  const auto& events = overview.events();
  const std::size_t room = size.lines - std::min(size.lines, page.size());
  for (std::size_t i = events.size() - std::min(room, events.size()); i < events.size(); ++i) {
    const Event& event = events[i];
    page.emplace_back(fmt::format(" {} {}: {}", clock_text(event.wall_ns), shown(event.session, alphabet),
                                  shown(event.text, alphabet)),
                      style_of(event.trouble));
  }
  return page;
}

Page help(const Overview& overview, std::uint32_t domain, Size size, Moment now, Alphabet alphabet) {
  Page page;
  page.push_back(title(overview, domain, size, now, alphabet));
  page.emplace_back();
  for (const std::string_view line : kHelp) page.emplace_back(" " + std::string(line));
  return page;
}

}  // namespace

std::vector<std::string> wrap(std::string_view text, std::size_t columns, Alphabet alphabet) {
  const std::string safe = shown(text, alphabet);
  std::vector<std::string> lines;
  std::string line;
  std::size_t at = 0;
  while (at < safe.size() && columns > 0) {
    const std::size_t end = std::min(safe.find(' ', at), safe.size());
    std::string_view word = std::string_view(safe).substr(at, end - at);
    at = end + 1;
    if (word.empty()) continue;
    if (!line.empty() && columns_of(line) + 1 + columns_of(word) > columns)
      lines.push_back(std::exchange(line, {}));
    // A word that no line has room for goes on in the next ones.
    while (columns_of(word) > columns) {
      const std::size_t bytes = bytes_within(word, columns);
      if (bytes == 0) return lines;
      lines.emplace_back(word.substr(0, bytes));
      word.remove_prefix(bytes);
    }
    line += (line.empty() ? "" : " ") + std::string(word);
  }
  if (!line.empty()) lines.push_back(std::move(line));
  return lines;
}

Page compose(const Overview& overview, const View& view, const Rows& rows, std::uint32_t domain, Size size,
             Moment now, Alphabet alphabet) {
  Page page;
  switch (view.panel()) {
    case Panel::kTables:
      page = tables(overview, view, rows, domain, size, now, alphabet);
      break;
    case Panel::kDetails:
      page = details(overview, view, rows, size, now, alphabet);
      page.insert(page.begin(), title(overview, domain, size, now, alphabet));
      break;
    case Panel::kEvents:
      page = events(overview, domain, size, now, alphabet);
      break;
    case Panel::kHelp:
      page = help(overview, domain, size, now, alphabet);
      break;
  }
  if (page.size() > size.lines) page.resize(size.lines);
  for (Line& line : page) {
    std::size_t left = size.columns;
    for (Part& part : line.parts) {
      part.text = cut(part.text, left);
      left -= columns_of(part.text);
    }
  }
  return page;
}

std::string print(const Overview& overview, std::size_t columns, Moment now, Alphabet alphabet) {
  const View view;
  const Rows rows = view.rows(overview, now);
  if (rows.streams.empty() && rows.clients.empty()) return "no session heard of on this domain\n";
  const Sheet sheet{columns, now, alphabet};
  Page page;
  page.push_back(stream_header(view.order(Focus::kStreams).column, sheet));
  add_rows(page, rows.streams, {}, false, rows.streams.size(), sheet);
  page.emplace_back();
  page.push_back(client_header(view.order(Focus::kClients).column, sheet));
  add_rows(page, rows.clients, {}, false, rows.clients.size(), sheet);
  const auto explain = [&](const std::string& who, const Diagnosis& diagnosis) {
    if (diagnosis.trouble < Trouble::kWarning) return;
    page.emplace_back();
    std::string text = who + ": ";
    for (const std::string& fact : diagnosis.facts) text += fact + " ";
    add_wrapped(page, text, columns - std::min<std::size_t>(columns, 2), Style::kNormal, alphabet);
  };
  for (const StreamRow& row : rows.streams) explain(name_of(*row.key, *row.stream), row.diagnosis);
  for (const ClientRow& row : rows.clients) explain(short_id(row.client->status.client), row.diagnosis);
  std::string text;
  for (const Line& line : page) {
    std::string one = line.text();
    one.erase(one.find_last_not_of(' ') + 1);
    // The tables begin with a column for the mark of the chosen row.
    text += (one.empty() ? one : one.substr(1)) + '\n';
  }
  return text;
}

}  // namespace tandem::top
