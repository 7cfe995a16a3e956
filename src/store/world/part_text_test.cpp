#include "store/world/part_text.h"

#include <string>

#include <gtest/gtest.h>

namespace quoin::store {
namespace {

Result<SceneLayer> layer_from(const std::string& text) {
  return part_from<SceneLayer>(std::as_bytes(std::span(text)), "layer 1");
}

TEST(PartText, ReadsNamesWithManyBrackets) {
  SceneLayer layer;
  layer.name = std::string(100, '[') + std::string(200, '}');
  const auto read = layer_from(text_of(layer));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->name, layer.name);
}

TEST(PartText, RejectsDeepNestingBehindBracketsInStrings) {
  constexpr int kDepth = 100'000;
  const std::string text = R"({"name": ")" + std::string(kDepth, ']') + R"(", "nested": )" + std::string(kDepth, '[');
  const auto read = layer_from(text);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().message, "layer 1: nested too deeply");
}

}  // namespace
}  // namespace quoin::store
