#include "services/program/metrics/request.hpp"

#include <gtest/gtest.h>

#include <string>

namespace tandem::metrics {
namespace {

TEST(MetricsRequest, IsCompleteWithItsHeaders) {
  const std::string whole = "GET /metrics?a=b HTTP/1.1\r\nHost: here\r\n\r\n";
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(read_request(whole.substr(0, size)).complete) << size;
  const Reading reading = read_request(whole);
  ASSERT_TRUE(reading.complete && reading.request);
  EXPECT_EQ(reading.request->method, Request::Method::kGet);
  EXPECT_EQ(reading.request->path, "/metrics");
}

TEST(MetricsRequest, KnowsTheMethodsThatItServes) {
  EXPECT_EQ(read_request("HEAD / HTTP/1.0\n\n").request->method, Request::Method::kHead);
  EXPECT_EQ(read_request("DELETE / HTTP/1.1\r\n\r\n").request->method, Request::Method::kOther);
  EXPECT_EQ(read_request("get / HTTP/1.1\r\n\r\n").request->method, Request::Method::kOther);
}

TEST(MetricsRequest, WhatIsNotHttpIsTold) {
  for (const char* text : {"\r\n\r\n", "\n\n", "GET\r\n\r\n", "GET /\r\n\r\n", "GET / FTP/1.1\r\n\r\n",
                           "GET  HTTP/1.1\r\n\r\n", "GET metrics HTTP/1.1\r\n\r\n",
                           "GET /a b HTTP/1.1\r\n\r\n", " / HTTP/1.1\r\n\r\n", "GET / HTTP/2\r\n\r\n"}) {
    const Reading reading = read_request(text);
    EXPECT_TRUE(reading.complete) << text;
    EXPECT_FALSE(reading.request) << text;
  }
  EXPECT_FALSE(read_request(std::string(100, '\0')).complete);
}

TEST(MetricsResponse, HasItsLengthAndEndsTheConnection) {
  const std::string whole = response(200, "text/plain", "four", false);
  EXPECT_TRUE(whole.starts_with("HTTP/1.1 200 OK\r\n"));
  EXPECT_NE(whole.find("Content-Length: 4\r\n"), std::string::npos);
  EXPECT_NE(whole.find("Connection: close\r\n"), std::string::npos);
  EXPECT_TRUE(whole.ends_with("\r\n\r\nfour"));
  const std::string head = response(503, "text/plain", "four", true);
  EXPECT_NE(head.find("Content-Length: 4\r\n"), std::string::npos);
  EXPECT_TRUE(head.ends_with("\r\n\r\n"));
}

}  // namespace
}  // namespace tandem::metrics
