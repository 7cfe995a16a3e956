#include "core/bytes/text.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace quoin {
namespace {

std::string text_of(std::string_view bytes) {
  return to_base64(std::as_bytes(std::span(bytes)));
}

TEST(Base64, EncodesRfc4648Examples) {  // RFC 4648, section 10
  EXPECT_EQ(text_of(""), "");
  EXPECT_EQ(text_of("f"), "Zg==");
  EXPECT_EQ(text_of("fo"), "Zm8=");
  EXPECT_EQ(text_of("foo"), "Zm9v");
  EXPECT_EQ(text_of("foob"), "Zm9vYg==");
  EXPECT_EQ(text_of("fooba"), "Zm9vYmE=");
  EXPECT_EQ(text_of("foobar"), "Zm9vYmFy");
}

TEST(Base64, RoundTripsAnyBytes) {
  std::mt19937 random(3);
  for (std::size_t size = 0; size < 300; ++size) {
    std::vector<std::byte> bytes(size);
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
    const auto back = from_base64(to_base64(bytes));
    ASSERT_TRUE(back);
    EXPECT_EQ(*back, bytes);
  }
}

TEST(Base64, ReportsPositionOfDamage) {
  const auto fault = [](std::string_view text) {
    const auto bytes = from_base64(text);
    return bytes ? std::string("none") : to_string(bytes.error());
  };
  EXPECT_EQ(fault("Zm9"), "byte 3: the base64 text is cut off: its length is not a multiple of 4");
  EXPECT_EQ(fault("Zm9vZm-v"), "byte 6: not a base64 character");
  EXPECT_EQ(fault("Zg==Zm9v"), "byte 2: not a base64 character");
  EXPECT_EQ(fault("Z==="), "byte 1: not a base64 character");
  EXPECT_EQ(fault("Zm9="), "byte 0: the last base64 character has bits beyond the last byte");
  EXPECT_EQ(fault("Zm9v\xC3\xA9=="), "byte 4: not a base64 character");
}

}  // namespace
}  // namespace quoin
