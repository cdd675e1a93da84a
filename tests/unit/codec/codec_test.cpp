#include <gtest/gtest.h>

#include "tests/property/synthetic.hpp"

namespace tandem {
namespace {

using synthetic::make_delta;
using synthetic::Random;

constexpr CodecParameters kParameters{200, 16, 64};

TEST(DeltaCodec, EveryCodecLeavesBothSidesWithTheSameState) {
  for (const std::string_view name : codec_names()) {
    SCOPED_TRACE(name);
    Random random(1);
    DeltaCodec server = make_delta(name, 500, kParameters);
    DeltaCodec client = make_delta(name, 500, kParameters);
    std::vector<std::byte> out(server.bound());
    State agreed = synthetic::random_state(random, 500);
    State held = agreed;
    for (int frame = 0; frame < 20; ++frame) {
      State target = synthetic::random_target(random, agreed, 3);
      const auto lifecycle = synthetic::random_lifecycle(random, agreed, target, 40);
      const auto encoded = server.encode(agreed, target, lifecycle, kNoBudget, out);
      const auto decoded = client.decode(held, std::span(out).first(encoded.size_bytes));
      ASSERT_TRUE(decoded) << decoded.error().message;
      ASSERT_EQ(held, agreed);
    }
  }
}

}  // namespace
}  // namespace tandem
