// Samples session "default" 144 times a second, as a renderer does, and prints how long a sample takes, how
// evenly time passes on the screen, and how far bodies jump between pictures beyond their motion.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <tandem/client.hpp>
#include <thread>
#include <vector>

namespace {

constexpr double kRateHz = 144;
constexpr int kPictures = 5 * 144;

/// A body in the form that the graphics card needs.
struct Instance {
  std::array<float, 3> position;
  std::uint16_t type;
  std::uint8_t alive;
};

double quantile(std::vector<double>& values, double share) {
  if (values.empty()) return 0;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

int main() {
  auto client = tandem::Client::connect({.role = tandem::ClientRole::kObserver});
  if (!client || !client->wait_until_playing(10)) return std::puts("no session to join"), 1;
  const auto scene = client->scene();
  if (!scene) return std::puts(scene.error().message.c_str()), 1;
  std::vector<Instance> bodies(scene->capacity);
  const std::span<Instance> all(bodies);
  const tandem::Columns columns{.capacity = bodies.size(),
                                .positions = {all, &Instance::position},
                                .types = {all, &Instance::type},
                                .alive = {all, &Instance::alive}};
  std::vector<std::array<float, 3>> last(bodies.size()), before(bodies.size());
  std::vector<double> sample_us, steps, jumps;
  double frame = 0;
  const std::int64_t start_ns = tandem_clock_ns();
  for (int picture = 0; picture < kPictures; ++picture) {
    // The moment when this picture will be on the screen.
    const std::int64_t shown_ns = start_ns + static_cast<std::int64_t>((picture + 1) * 1e9 / kRateHz);
    const std::int64_t began_ns = tandem_clock_ns();
    const auto drawn = client->sample(columns, {.at_ns = shown_ns});
    sample_us.push_back(static_cast<double>(tandem_clock_ns() - began_ns) / 1e3);
    if (!drawn) return std::puts(drawn.error().message.c_str()), 1;
    if (picture > 0) steps.push_back(drawn->frame - frame);
    frame = drawn->frame;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const auto& p = bodies[i].position;
      double jump = 0;  // the second difference: 0 where a body moves evenly
      for (std::size_t axis = 0; axis < 3; ++axis)
        jump += std::pow(p[axis] - 2 * last[i][axis] + before[i][axis], 2);
      if (picture > 1 && bodies[i].alive != 0) jumps.push_back(std::sqrt(jump));
      before[i] = last[i];
      last[i] = p;
    }
    std::this_thread::sleep_for(std::chrono::nanoseconds(shown_ns - tandem_clock_ns()));
  }
  std::printf("%d pictures at %.0f Hz of a session at %.0f Hz, %zu bodies\n", kPictures, kRateHz,
              scene->frame_rate_hz, bodies.size());
  std::printf("a sample takes %.1f us (median), %.1f us (99 %%)\n", quantile(sample_us, 0.5),
              quantile(sample_us, 0.99));
  std::printf("frames from picture to picture: %.3f (median, even: %.3f), %.3f to %.3f (1 and 99 %%)\n",
              quantile(steps, 0.5), scene->frame_rate_hz / kRateHz, quantile(steps, 0.01),
              quantile(steps, 0.99));
  std::printf("jump of a body between pictures: %.6f (median), %.6f (99.9 %%) scene units\n",
              quantile(jumps, 0.5), quantile(jumps, 0.999));
  return 0;
}
