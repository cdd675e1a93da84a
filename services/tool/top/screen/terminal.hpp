#pragma once
// The terminal: draws pages, and reads keys.

#include <memory>
#include <optional>

#include "services/tool/top/screen/page.hpp"
#include "services/tool/top/screen/pages.hpp"

namespace tandem::top {

/// Takes over the terminal of this process, and gives it back when it is destroyed. At most one at a time.
/// Not thread-safe. The process must have set LC_CTYPE before.
class Terminal {
 public:
  /// Empty if stdout is no terminal that can be drawn on (or the build has no ncurses).
  [[nodiscard]] static std::optional<Terminal> open();
  Terminal(Terminal&&) noexcept;
  Terminal& operator=(Terminal&&) noexcept;
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  ~Terminal();

  [[nodiscard]] Size size() const;
  void draw(const Page& page);
  /// The next key that was pressed; kNone if there is none. Does not wait.
  [[nodiscard]] Key key();
  /// False if the terminal has gone.
  [[nodiscard]] bool there() const;

 private:
  struct Screen;
  explicit Terminal(std::unique_ptr<Screen> screen);
  std::unique_ptr<Screen> screen_;
};

}  // namespace tandem::top
