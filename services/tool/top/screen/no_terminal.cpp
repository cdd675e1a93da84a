// A build without ncurses: `tandem top` prints tables.
#include "services/tool/top/screen/terminal.hpp"

namespace tandem::top {

struct Terminal::Screen {};

Terminal::Terminal(std::unique_ptr<Screen> screen) : screen_(std::move(screen)) {}
Terminal::Terminal(Terminal&&) noexcept = default;
Terminal& Terminal::operator=(Terminal&&) noexcept = default;
Terminal::~Terminal() = default;

std::optional<Terminal> Terminal::open() { return std::nullopt; }
Size Terminal::size() const { return {}; }
void Terminal::draw(const Page& /*page*/) {}
Key Terminal::key() { return Key::kNone; }
bool Terminal::there() const { return false; }

}  // namespace tandem::top
