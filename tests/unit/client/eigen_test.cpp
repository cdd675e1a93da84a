#include "tandem/eigen.hpp"

#include <gtest/gtest.h>

namespace tandem {
namespace {

TEST(EigenViews, ASampleIsAMatrixWithAColumnASlot) {
  Sample sample;
  sample.capacity = 3;
  sample.positions = {1, 2, 3, 40, 50, 60, 5, 6, 7};
  sample.alive = {1, 0, 1};
  EXPECT_EQ(positions(sample).col(2), Eigen::Vector3f(5, 6, 7));
  const Eigen::RowVectorXf weights = alive(sample).cast<float>().transpose();
  const Eigen::Vector3f mean = positions(sample) * weights.transpose() / weights.sum();
  EXPECT_EQ(mean, Eigen::Vector3f(3, 4, 5));
  EXPECT_EQ(positions(sample).data(), sample.positions.data()) << "a view, not a copy";
}

TEST(EigenViews, AnEmptySampleIsAnEmptyMatrix) { EXPECT_EQ(positions(Sample{}).cols(), 0); }

}  // namespace
}  // namespace tandem
