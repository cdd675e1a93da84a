#include "services/host/waiting.hpp"

#include <poll.h>

#include <algorithm>
#include <ctime>

namespace tandem::host {

void wait_for_work(const Host& host, transport::ServerPort& port, std::chrono::nanoseconds longest) {
  if (longest <= std::chrono::nanoseconds{0}) return;
  const int descriptor = host.descriptor();
  if (descriptor < 0) return port.wait(longest);
  // DDS has no descriptor to wait for beside this one. Clients can wait this long, the frame cannot.
  const auto slice = std::min(longest, std::chrono::nanoseconds{2'000'000});
  pollfd awaited{.fd = descriptor, .events = POLLIN, .revents = 0};
  const timespec timeout{.tv_sec = 0, .tv_nsec = static_cast<long>(slice.count())};
  ::ppoll(&awaited, 1, &timeout, nullptr);
}

}  // namespace tandem::host
