// Prints centre and principal axes of the bodies of session "default", once a second. The samples are viewed
// as matrices, not copied into them.
#include <Eigen/Eigenvalues>
#include <cstdio>
#include <tandem/client.hpp>
#include <tandem/eigen.hpp>

int main() {
  auto client = tandem::Client::connect({.role = tandem::ClientRole::kObserver});
  if (!client || !client->wait_until_playing(10)) return std::puts("no session to join"), 1;
  tandem::Sample sample;
  for (int second = 0; second < 5; ++second) {
    client->run_for(1);
    if (!client->sample(sample)) return std::puts("nothing to draw"), 1;
    // 1 for a body, 0 for an empty slot, whose position says nothing.
    const Eigen::RowVectorXf there = tandem::alive(sample).cast<float>().matrix().transpose();
    const float count = there.sum();
    if (count == 0) continue;
    const Eigen::Matrix3Xf p =
        (there.array() > 0)
            .replicate(3, 1)
            .select(tandem::positions(sample), Eigen::Matrix3Xf::Zero(3, there.size()));
    const Eigen::Vector3f centre = p.rowwise().sum() / count;
    const Eigen::Matrix3Xf offset = (p - centre * there);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> axes(offset * offset.transpose() / count);
    const Eigen::Vector3f spread = axes.eigenvalues().cwiseMax(0).cwiseSqrt();
    std::printf("frame %.1f: %.0f bodies, centre %.2f %.2f %.2f, spread along their axes %.2f %.2f %.2f\n",
                sample.frame, static_cast<double>(count), static_cast<double>(centre.x()),
                static_cast<double>(centre.y()), static_cast<double>(centre.z()),
                static_cast<double>(spread.x()), static_cast<double>(spread.y()),
                static_cast<double>(spread.z()));
  }
  return 0;
}
