#include "sdk/core/layout/layout.hpp"

#include <gtest/gtest.h>

namespace tandem {
namespace {

Layout with_groups(std::vector<std::string> groups, std::vector<std::int32_t> radii) {
  Layout layout;
  layout.capacity = 10;
  layout.type_count = 2;
  layout.parameters = {{100, 1, 1}};
  layout.groups = std::move(groups);
  layout.radii = std::move(radii);
  return layout;
}

const std::vector<std::string> kPositions{kPositionGroup}, kBoth{kPositionGroup, kOrientationGroup};

TEST(Layout, ListsPositionAndOrientationInThatOrder) {
  EXPECT_TRUE(check_layout(with_groups(kPositions, {})));
  EXPECT_FALSE(groups_of(with_groups(kPositions, {})).orientation);
  EXPECT_TRUE(check_layout(with_groups(kBoth, {1, 2})));
  EXPECT_TRUE(groups_of(with_groups(kBoth, {1, 2})).orientation);
  EXPECT_FALSE(check_layout(with_groups({}, {})));
  EXPECT_FALSE(check_layout(with_groups({kOrientationGroup}, {1, 2})));
  EXPECT_FALSE(check_layout(with_groups({kOrientationGroup, kPositionGroup}, {1, 2})));
  EXPECT_FALSE(check_layout(with_groups({kPositionGroup, kPositionGroup}, {1, 2})));
  EXPECT_FALSE(check_layout(with_groups({kPositionGroup, kOrientationGroup, kOrientationGroup}, {1, 2})));
  EXPECT_EQ(check_layout(with_groups({kPositionGroup, "colour"}, {})).error().code, ErrorCode::kUnsupported);
}

TEST(Layout, OrientationsNeedARadiusOfEachType) {
  EXPECT_FALSE(check_layout(with_groups(kPositions, {1, 2}))) << "needed by no group";
  EXPECT_FALSE(check_layout(with_groups(kBoth, {})));
  EXPECT_FALSE(check_layout(with_groups(kBoth, {1})));
  EXPECT_FALSE(check_layout(with_groups(kBoth, {1, 2, 3})));
  EXPECT_FALSE(check_layout(with_groups(kBoth, {1, 0})));
  EXPECT_FALSE(check_layout(with_groups(kBoth, {-1, 1})));
  EXPECT_FALSE(check_layout(with_groups(kBoth, {1, kPositionLimit + 1})));
  EXPECT_TRUE(check_layout(with_groups(kBoth, {1, kPositionLimit})));
}

TEST(Layout, TheHashKnowsGroupsAndRadii) {
  const auto hash = [](const Layout& layout) { return layout_hash(layout, 1, 0); };
  EXPECT_NE(hash(with_groups(kPositions, {})), hash(with_groups(kBoth, {1, 2})));
  EXPECT_NE(hash(with_groups(kBoth, {1, 2})), hash(with_groups(kBoth, {2, 1})));
}

}  // namespace
}  // namespace tandem
