#include "services/host/standby/assembly.hpp"

#include <gmock/gmock.h>

namespace tandem::standby {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

transport::CheckpointMessage part(Frame frame, std::uint32_t number, std::uint32_t parts = 3) {
  transport::CheckpointMessage message;
  message.frame = frame;
  message.journal = 7;
  message.part = number;
  message.parts = parts;
  message.total_bytes = 2 * parts;
  message.bytes.assign(2, static_cast<std::byte>(number));
  return message;
}

TEST(Assembly, PartsInAnyOrderMakeTheWhole) {
  Assembly assembly;
  EXPECT_FALSE(assembly.add(part(5, 2)));
  EXPECT_THAT(assembly.missing(), ElementsAre(0, 2));
  EXPECT_FALSE(assembly.add(part(5, 0)));
  EXPECT_FALSE(assembly.add(part(5, 0))) << "again";
  EXPECT_THAT(assembly.missing(), ElementsAre(1, 1));
  const auto whole = assembly.add(part(5, 1));
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->frame, 5U);
  EXPECT_EQ(whole->journal, 7U);
  EXPECT_EQ(whole->bytes, transport::Bytes({std::byte{0}, std::byte{0}, std::byte{1}, std::byte{1},
                                            std::byte{2}, std::byte{2}}));
  EXPECT_EQ(assembly.frame(), 0U) << "and the next one begins";
}

TEST(Assembly, ANewerFrameBeginsAnewAndAnOlderOneIsPassedOver) {
  Assembly assembly;
  EXPECT_FALSE(assembly.add(part(5, 0)));
  EXPECT_FALSE(assembly.add(part(6, 1)));
  EXPECT_EQ(assembly.frame(), 6U);
  EXPECT_FALSE(assembly.add(part(5, 2)));
  EXPECT_FALSE(assembly.add(part(6, 0)));
  EXPECT_TRUE(assembly.add(part(6, 2)));
}

TEST(Assembly, PartsThatDoNotFitAreNotTaken) {
  Assembly assembly;
  EXPECT_FALSE(assembly.add(part(5, 0)));
  EXPECT_FALSE(assembly.add(part(5, 1, 2)));
  auto long_part = part(5, 1);
  long_part.bytes.resize(7);
  EXPECT_FALSE(assembly.add(std::move(long_part))) << "more than the whole has";
  auto other = part(5, 1);
  other.journal = 8;
  EXPECT_FALSE(assembly.add(std::move(other)));
  EXPECT_THAT(assembly.missing(), ElementsAre(1, 2));
}

TEST(Assembly, AtMost32RunsAreTold) {
  Assembly assembly;
  for (std::uint32_t i = 0; i < 100; i += 2) EXPECT_FALSE(assembly.add(part(5, i, 100)));
  EXPECT_EQ(assembly.missing().size(), 64U);
  assembly.clear();
  EXPECT_THAT(assembly.missing(), IsEmpty());
}

}  // namespace
}  // namespace tandem::standby
