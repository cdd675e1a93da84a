#include "services/program/json/json.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>

namespace tandem {
namespace {

TEST(Json, IsPrintedAsItsLibraryPrintsIt) {
  const Json ours{{"text", "a \"b\"\n"},
                  {"yes", true},
                  {"whole", std::numeric_limits<std::uint64_t>::max()},
                  {"below", std::numeric_limits<std::int64_t>::min()},
                  {"real", 0.1},
                  {"round", 5.0},
                  {"small", 1e-7F},
                  {"none", std::optional<double>()},
                  {"inner", {{"p50", 1.5}, {"p99", 2}}},
                  {"list", Json::array({1, "x", nullptr, Json::object()})}};
  const nlohmann::ordered_json theirs{{"text", "a \"b\"\n"},
                                      {"yes", true},
                                      {"whole", std::numeric_limits<std::uint64_t>::max()},
                                      {"below", std::numeric_limits<std::int64_t>::min()},
                                      {"real", 0.1},
                                      {"round", 5.0},
                                      {"small", 1e-7F},
                                      {"none", nullptr},
                                      {"inner", {{"p50", 1.5}, {"p99", 2}}},
                                      {"list", {1, "x", nullptr, nlohmann::ordered_json::object()}}};
  EXPECT_EQ(ours.dump(), theirs.dump());
}

TEST(Json, GrowsByNameAndByPlace) {
  Json out;
  out["b"]["inner"] = 1;
  out["a"].push_back({{"x", 2}});
  out["a"].push_back(Json());
  out["b"]["inner"] = 3;
  EXPECT_EQ(out.dump(), R"({"b":{"inner":3},"a":[{"x":2},null]})");
}

TEST(Json, PrintsWhatIsNoNumberAndNoTextStill) {
  EXPECT_EQ(Json(std::nan("")).dump(), "null");
  EXPECT_EQ(Json("a\xff").dump(), "\"a\xef\xbf\xbd\"");
}

TEST(Json, ReadsBackWhatItPrinted) {
  const std::string text = R"({"cost":{"receive":0.5,"hash":2},"list":[1,-1,true,null],"stream":"rich"})";
  const auto read = Json::parse(text);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->dump(), text);
  EXPECT_EQ((*read)["cost"]["hash"].number(), 2);
  EXPECT_EQ((*read)["stream"].text(), "rich");
  EXPECT_EQ((*read)["cost"].members().size(), 2U);
  EXPECT_TRUE((*read)["nothing"]["of it"].is_null());
  EXPECT_EQ((*read)["stream"].number(), 0);
  EXPECT_FALSE(Json::parse("{"));
  EXPECT_FALSE(Json::parse("1 2"));
}

}  // namespace
}  // namespace tandem
