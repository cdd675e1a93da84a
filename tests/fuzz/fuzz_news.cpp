// Any news in front of any payload, and any world of a snapshot: refused, or a world within its limits that
// is read as it was written.

#include <cstdlib>

#include "sdk/core/news/session_world.hpp"

namespace tandem {
namespace {

constexpr WorldFeatures kBoth{.keys = true, .events = true};
constexpr std::uint32_t kCapacity = 24;

void require(bool holds) {
  if (!holds) std::abort();
}

void check(const SessionWorld& world) {
  require(world.keys().size() <= kMaxKeys && world.keys_bytes() <= kMaxKeysBytes);
  std::vector<std::byte> bytes(SessionWorld::kMaxBytes);
  ByteWriter out(bytes);
  world.write(out);
  require(!out.overflow());
  const auto again = SessionWorld::read(out.written(), kBoth);
  require(again && again->hash() == world.hash() && again->keys() == world.keys());
}

}  // namespace
}  // namespace tandem

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tandem;
  const auto input = std::as_bytes(std::span(data, size));
  if (const auto world = SessionWorld::read(input, kBoth)) check(*world);
  SessionWorld world;
  News news;
  ByteReader in(input);
  while (in.remaining() > 0) {  // frames, each behind its length
    const auto payload = in.get_bytes(in.get<std::uint8_t>());
    const auto rest = read_news(payload, kBoth, kCapacity, news);
    if (!in.ok() || !rest || !world.check(news)) break;
    require(news.events.size() <= kMaxFrameEvents && rest->size() <= payload.size());
    world.apply(news);
    check(world);
  }
  return 0;
}
