#include "services/gateway/entrance/guest_book.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace tandem::gateway {
namespace {

// In quotes, with nothing in it that could look like another key or another line.
std::string in_quotes(std::string_view text) {
  constexpr std::size_t kMaxShown = 100;
  std::string out(text.substr(0, kMaxShown));
  std::ranges::replace_if(
      out, [](char c) { return c < ' ' || c > '~' || c == '"' || c == '\\'; }, '?');
  return '"' + out + '"';
}

std::string who(std::uint64_t viewer, const Guest& guest) {
  return fmt::format("viewer={} from={} name={}", viewer, guest.address, in_quotes(guest.pass.name));
}

}  // namespace

GuestBook::Line GuestBook::limited(Kind& kind, std::string line, std::int64_t now_ns) {
  if (!kind.rate.take(now_ns)) {
    ++kind.left_out;
    return std::nullopt;
  }
  if (const auto left_out = std::exchange(kind.left_out, 0); left_out > 0)
    line += fmt::format(" left_out={}", left_out);
  return line;
}

GuestBook::Line GuestBook::came(std::uint64_t viewer, Guest guest, std::int64_t now_ns) {
  guest.since_ns = now_ns;
  const Guest& in = guests_.insert_or_assign(viewer, std::move(guest)).first->second;
  return limited(comings_,
                 fmt::format("audit: joined {} role={} origin={}", who(viewer, in),
                             in.pass.may_act ? "act" : "watch", in_quotes(in.origin)),
                 now_ns);
}

GuestBook::Line GuestBook::refused(std::string_view address, std::string_view origin, std::string_view reason,
                                   std::int64_t now_ns) {
  return limited(refusals_,
                 fmt::format("audit: refused from={} origin={} reason={}", address, in_quotes(origin),
                             in_quotes(reason)),
                 now_ns);
}

GuestBook::Line GuestBook::did(std::uint64_t viewer, std::string_view deeds, std::int64_t now_ns) {
  const auto found = guests_.find(viewer);
  if (found == guests_.end()) return std::nullopt;
  return limited(deeds_, fmt::format("audit: inputs {} {}", who(viewer, found->second), deeds), now_ns);
}

GuestBook::Line GuestBook::left(std::uint64_t viewer, std::int64_t now_ns) {
  const auto found = guests_.find(viewer);
  if (found == guests_.end()) return std::nullopt;
  const Guest guest = std::move(found->second);
  guests_.erase(found);
  const double seconds = static_cast<double>(now_ns - guest.since_ns) / 1e9;
  return limited(comings_, fmt::format("audit: left {} after_s={:.1f}", who(viewer, guest), seconds), now_ns);
}

}  // namespace tandem::gateway
