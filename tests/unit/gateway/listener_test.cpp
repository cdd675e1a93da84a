#include "services/gateway/entrance/listener.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <unistd.h>

#include <vector>

namespace tandem::gateway {
namespace {

int connect_to(const Listener& listener) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(listener.port());
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  EXPECT_EQ(connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  return fd;
}

TEST(Listener, SaysWhyItCannotListen) {
  EXPECT_FALSE(Listener::open("nonsense", 0));
  EXPECT_FALSE(Listener::open("192.0.2.1", 0));
  const auto first = Listener::open("127.0.0.1", 0);
  ASSERT_TRUE(first);
  EXPECT_FALSE(Listener::open("127.0.0.1", first->port()));
}

TEST(Listener, ClosesConnectionsForWhichThereIsNoDescriptor) {
  auto listener = Listener::open("127.0.0.1", 0);
  ASSERT_TRUE(listener);
  EXPECT_EQ(listener->accept().outcome, Listener::Outcome::kNothing);
  const int client = connect_to(*listener);
  std::vector<int> all;
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  const rlimit few{.rlim_cur = 64, .rlim_max = before.rlim_max};
  setrlimit(RLIMIT_NOFILE, &few);
  for (int fd = open("/dev/null", O_RDONLY); fd >= 0; fd = open("/dev/null", O_RDONLY)) all.push_back(fd);
  EXPECT_EQ(listener->accept().outcome, Listener::Outcome::kNoDescriptor);
  EXPECT_EQ(listener->accept().outcome, Listener::Outcome::kNothing) << "it does not wait any more";
  char byte = 0;
  EXPECT_EQ(read(client, &byte, 1), 0) << "closed";
  for (const int fd : all) close(fd);
  setrlimit(RLIMIT_NOFILE, &before);
  const int second = connect_to(*listener);
  const auto got = listener->accept();
  EXPECT_EQ(got.outcome, Listener::Outcome::kConnection);
  for (const int fd : {client, second}) close(fd);
}

}  // namespace
}  // namespace tandem::gateway
