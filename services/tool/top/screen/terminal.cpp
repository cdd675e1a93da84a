#include "services/tool/top/screen/terminal.hpp"

// The macros of ncurses would rename members of the standard library.
#define NCURSES_NOMACROS 1
#define NCURSES_WIDECHAR 1
#include <curses.h>
#include <poll.h>
#include <term.h>
#include <unistd.h>
// Macros of term.h.
#undef columns
#undef lines

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace tandem::top {
namespace {

constexpr short kWarningPair = 1, kBadPair = 2;
constexpr int kEscape = 27, kEscapeDelayMs = 25;

attr_t attributes(Style style, bool colours) {
  switch (style) {
    case Style::kNormal:
      return A_NORMAL;
    case Style::kDim:
      return A_DIM;
    case Style::kStrong:
      return A_BOLD;
    case Style::kHeader:
    case Style::kChosen:
      return A_REVERSE;
    case Style::kWarning:
      return colours ? static_cast<attr_t>(COLOR_PAIR(kWarningPair)) : A_BOLD;
    case Style::kBad:
      return A_BOLD | (colours ? static_cast<attr_t>(COLOR_PAIR(kBadPair)) : A_NORMAL);
  }
  return A_NORMAL;
}

struct Binding {
  int pressed;
  Key key;
};
constexpr std::array kBindings{
    Binding{KEY_UP, Key::kUp},
    Binding{'k', Key::kUp},
    Binding{KEY_DOWN, Key::kDown},
    Binding{'j', Key::kDown},
    Binding{KEY_PPAGE, Key::kPageUp},
    Binding{KEY_NPAGE, Key::kPageDown},
    Binding{KEY_HOME, Key::kFirst},
    Binding{KEY_END, Key::kLast},
    Binding{KEY_RIGHT, Key::kSortNext},
    Binding{'s', Key::kSortNext},
    Binding{KEY_LEFT, Key::kSortBefore},
    Binding{'S', Key::kSortBefore},
    Binding{'r', Key::kReverse},
    Binding{'\t', Key::kOther},
    Binding{'f', Key::kFilter},
    Binding{'\n', Key::kDetails},
    Binding{'\r', Key::kDetails},
    Binding{KEY_ENTER, Key::kDetails},
    Binding{'d', Key::kDetails},
    Binding{'l', Key::kEvents},
    Binding{'?', Key::kHelp},
    Binding{'h', Key::kHelp},
    Binding{KEY_BACKSPACE, Key::kBack},
    Binding{kEscape, Key::kBack},
    Binding{'q', Key::kQuit},
    Binding{'Q', Key::kQuit},
    Binding{KEY_RESIZE, Key::kResize},
};

}  // namespace

struct Terminal::Screen {
  SCREEN* screen = nullptr;
  bool colours = false;

  Screen() = default;
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  Screen(Screen&&) = delete;
  Screen& operator=(Screen&&) = delete;
  ~Screen() {
    ::endwin();
    ::delscreen(screen);
  }
};

Terminal::Terminal(std::unique_ptr<Screen> screen) : screen_(std::move(screen)) {}
Terminal::Terminal(Terminal&&) noexcept = default;
Terminal& Terminal::operator=(Terminal&&) noexcept = default;
Terminal::~Terminal() = default;

std::optional<Terminal> Terminal::open() {
  if (::isatty(STDOUT_FILENO) == 0) return std::nullopt;
  // newterm() ends the process for a terminal of an unknown type.
  int error = 0;
  if (::setupterm(nullptr, STDOUT_FILENO, &error) != OK) return std::nullopt;
  char place[] = "cup", erase_all[] = "clear";
  if (::tigetstr(place) == nullptr || ::tigetstr(erase_all) == nullptr) return std::nullopt;
  SCREEN* const screen = ::newterm(nullptr, stdout, stdin);
  if (screen == nullptr) return std::nullopt;
  auto owner = std::make_unique<Screen>();
  owner->screen = screen;
  ::cbreak();
  ::noecho();
  ::nodelay(stdscr, TRUE);
  ::keypad(stdscr, TRUE);
  ::set_escdelay(kEscapeDelayMs);
  ::curs_set(0);
  ::scrollok(stdscr, FALSE);
  if (::has_colors() && std::getenv("NO_COLOR") == nullptr && ::start_color() == OK) {
    ::use_default_colors();
    ::init_pair(kWarningPair, COLOR_YELLOW, -1);
    ::init_pair(kBadPair, COLOR_RED, -1);
    owner->colours = true;
  }
  return Terminal(std::move(owner));
}

Size Terminal::size() const {
  int lines = 0, columns = 0;
  getmaxyx(stdscr, lines, columns);
  return {static_cast<std::size_t>(std::max(columns, 1)), static_cast<std::size_t>(std::max(lines, 1))};
}

void Terminal::draw(const Page& page) {
  ::werase(stdscr);
  int y = 0;
  for (const Line& line : page) {
    ::wmove(stdscr, y++, 0);
    for (const Part& part : line.parts) {
      ::wattrset(stdscr, static_cast<int>(attributes(part.style, screen_->colours)));
      // The last place of the screen is refused, and stays blank.
      ::waddnstr(stdscr, part.text.data(), static_cast<int>(part.text.size()));
    }
  }
  ::wattrset(stdscr, A_NORMAL);
  ::wrefresh(stdscr);
}

Key Terminal::key() {
  for (;;) {
    const int pressed = ::wgetch(stdscr);
    if (pressed == ERR) return Key::kNone;
    for (const Binding& binding : kBindings)
      if (binding.pressed == pressed) return binding.key;
  }
}

bool Terminal::there() const {
  pollfd out{STDOUT_FILENO, 0, 0};
  return ::poll(&out, 1, 0) <= 0 || (out.revents & (POLLHUP | POLLERR | POLLNVAL)) == 0;
}

}  // namespace tandem::top
