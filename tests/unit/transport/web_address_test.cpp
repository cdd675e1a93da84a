#include "sdk/transport/websocket/web_address.hpp"

#include <gtest/gtest.h>

namespace tandem::transport {
namespace {

TEST(WebAddress, TakesWhatPeopleCopy) {
  struct Case {
    const char* url;
    const char* text;
    const char* token;
  };
  for (const Case& c : {Case{"wss://sim.example/", "wss://sim.example:443/tandem", ""},
                        Case{"ws://sim.example", "ws://sim.example:80/tandem", ""},
                        Case{"https://sim.example:8443", "wss://sim.example:8443/tandem", ""},
                        Case{"http://127.0.0.1:8080/#t0ken", "ws://127.0.0.1:8080/tandem", "t0ken"},
                        Case{"wss://sim.example/arena/tandem", "wss://sim.example:443/arena/tandem", ""},
                        Case{"wss://sim.example/arena", "wss://sim.example:443/arena/tandem", ""},
                        Case{"wss://sim.example/notandem", "wss://sim.example:443/notandem/tandem", ""},
                        Case{"ws://[fd00::1]:8080/", "ws://[fd00::1]:8080/tandem", ""},
                        Case{"ws://host#a/b?c", "ws://host:80/tandem", "a/b?c"}}) {
    const auto address = read_web_address(c.url);
    ASSERT_TRUE(address) << c.url << ": " << address.error().message;
    EXPECT_EQ(address->text(), c.text);
    EXPECT_EQ(address->token, c.token);
  }
}

TEST(WebAddress, SaysWhatIsWrong) {
  struct Case {
    std::string url, reason;
  };
  for (const Case& c :
       {Case{"", "it begins with"}, Case{"sim.example:80", "it begins with"},
        Case{"ftp://sim.example/", "it begins with"}, Case{"://sim.example/", "it begins with"},
        Case{"ws:///", "host is missing"}, Case{"ws://:80/", "host is missing"},
        Case{"ws://h:0/", "from 1 to 65535"}, Case{"ws://h:65536/", "from 1 to 65535"},
        Case{"ws://h:8o/", "from 1 to 65535"}, Case{"ws://h:/", "from 1 to 65535"}, Case{"ws://[::1/", "[ ]"},
        Case{"ws://[::1]x/", "behind the host"}, Case{"ws://me:secret@h/", "names a user"},
        Case{"ws://h/?token=secret", "behind '?'"}, Case{"ws://h /", "character"},
        Case{"ws://h\r\nX: y/", "character"}, Case{"ws://h\xc3\xa4/", "character"},
        Case{"ws://" + std::string(5000, 'h') + "/", "longer than"}}) {
    const auto address = read_web_address(c.url);
    ASSERT_FALSE(address) << c.url;
    EXPECT_EQ(address.error().code, ErrorCode::kInvalidArgument);
    EXPECT_NE(address.error().message.find(c.reason), std::string::npos)
        << c.url << ": " << address.error().message;
    EXPECT_EQ(address.error().message.find("secret"), std::string::npos);
  }
}

}  // namespace
}  // namespace tandem::transport
