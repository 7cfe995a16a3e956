#include "core/bytes/text.h"

#include <string>

#include <gtest/gtest.h>

namespace quoin {
namespace {

TEST(JsonExtent, CountsNestedBrackets) {
  EXPECT_EQ(json_extent("").depth, 0);
  EXPECT_EQ(json_extent("12").depth, 0);
  EXPECT_EQ(json_extent(R"({"a": [1, {"b": []}], "c": [2]})").depth, 4);
  EXPECT_EQ(json_extent("{} // [[", JsonComments::Allowed).depth, 1);
  EXPECT_EQ(json_extent("{} // [[").depth, 2) << "not a comment";
  EXPECT_EQ(json_extent("/* \" */ [[]] /* [", JsonComments::Allowed).depth, 2);
  EXPECT_EQ(json_extent("\"// [\" [", JsonComments::Allowed).depth, 1) << "in a string";
  EXPECT_EQ(json_extent("[/", JsonComments::Allowed).depth, 1);
  EXPECT_EQ(json_extent(std::string(1000, '[')).depth, 1000);
}

TEST(JsonExtent, IgnoresBracketsInStrings) {
  EXPECT_EQ(json_extent(R"({"[[[[": "{{{{"})").depth, 1);
  EXPECT_EQ(json_extent(R"({"a\"[[[": "\\", "b": "]]]]", "c": [[1]]})").depth, 3);
}

TEST(JsonExtent, CountsStringsAsOneByte) {
  EXPECT_EQ(json_extent("[1, 2]").bytes_outside_strings, 6);
  EXPECT_EQ(json_extent(R"(["abc\"def"])").bytes_outside_strings, 3);
}

}  // namespace
}  // namespace quoin
