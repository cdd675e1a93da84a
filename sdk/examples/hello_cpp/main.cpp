// Joins the session "default" on DDS domain 0, tilts gravity and prints where body 0 is.
#include <cstdio>
#include <tandem/client.hpp>

int main() {
  auto client = tandem::Client::connect({});
  if (!client || !client->wait_until_playing(10)) return std::puts("no session to join"), 1;
  if (auto sent = client->send_gravity({3, -9, 0}); !sent) std::puts(sent.error().message.c_str());
  tandem::Sample bodies;
  for (int second = 0; second < 5; ++second) {
    client->run_for(1);
    client->sample(bodies);
    const float* p = bodies.positions.data();
    std::printf("frame %.1f: body 0 at %.2f %.2f %.2f\n", bodies.frame, p[0], p[1], p[2]);
  }
  return client->status()->hash_mismatches == 0 ? 0 : 1;
}
