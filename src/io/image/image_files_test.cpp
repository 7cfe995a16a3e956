#include <quoin/io/image_files.h>

#include <bit>
#include <cstring>
#include <filesystem>
#include <limits>
#include <random>
#include <string>

#include <gtest/gtest.h>
#include <quoin/io/file.h>

#include "core/death_for_tests.h"
#include "io/gltf/glb_for_tests.h"
#include "io/image/image_codecs.h"

namespace quoin {
namespace {

std::vector<std::byte> bytes_of(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
  return {bytes.begin(), bytes.end()};
}

Image noise(int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  Image image{width, height, {}};
  for (int i = 0; i < 3 * width * height; ++i) image.rgb.push_back(static_cast<std::uint8_t>(random()));
  return image;
}

class ImageFiles : public ::testing::Test {
 protected:
  std::filesystem::path file(const std::string& name) { return folder_.file(name); }
  TestFolder folder_{std::string("images_") + ::testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(ImageFiles, RoundTripsPng) {
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 3}, {1, 100}, {640, 2}}) {
    const Image image = noise(width, height, 5);
    const auto size = write_png(image, file("a.png"));
    ASSERT_TRUE(size);
    EXPECT_EQ(*size, std::filesystem::file_size(file("a.png")));
    const auto again = read_png(file("a.png"));
    ASSERT_TRUE(again);
    EXPECT_EQ(again->width, width);
    EXPECT_EQ(again->height, height);
    EXPECT_EQ(again->rgb, image.rgb);
  }
  const auto once = read_file(file("a.png"));
  ASSERT_TRUE(write_png(noise(640, 2, 5), file("b.png")));
  EXPECT_EQ(*once, *read_file(file("b.png"))) << "the same bytes on every run";
}

TEST_F(ImageFiles, RoundTripsPfmFromBottomRow) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const FloatImage image{3, 2, {1.5F, kInfinity, -0.0F, 1e-45F, 3e38F, 2.0F}};
  const auto size = write_pfm(image, file("a.pfm"));
  ASSERT_TRUE(size);
  const auto bytes = read_file(file("a.pfm"));
  ASSERT_TRUE(bytes);
  EXPECT_EQ(*size, bytes->size());
  const std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  ASSERT_EQ(text.substr(0, 12), "Pf\n3 2\n-1.0\n");
  EXPECT_EQ(text.size(), 12U + 24U);
  float first = 0;
  std::memcpy(&first, text.data() + 12, 4);
  EXPECT_EQ(first, 1e-45F) << "the lower row comes first";
  const auto again = read_pfm(file("a.pfm"));
  ASSERT_TRUE(again);
  EXPECT_EQ(again->width, 3);
  EXPECT_EQ(again->height, 2);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(std::bit_cast<std::uint32_t>(again->values[i]), std::bit_cast<std::uint32_t>(image.values[i])) << i;
  }
}

TEST_F(ImageFiles, ReadsPfmOfOtherByteOrder) {
  const auto image = read_pfm(bytes_of(std::string("Pf 2 1 1.0\n\x3F\x80\0\0\x40\0\0\0", 19)));
  ASSERT_TRUE(image);
  EXPECT_EQ(image->values, (std::vector<float>{1.0F, 2.0F}));
}

TEST_F(ImageFiles, ReportsPositionOfPfmErrors) {
  const auto error = [](const std::string& text) {
    const auto image = read_pfm(bytes_of(text));
    return image ? "none" : to_string(image.error());
  };
  EXPECT_EQ(error(""), "byte 0: not a PFM: it does not begin with \"Pf\"");
  EXPECT_EQ(error(" Pf\n1 1\n-1\n0000"), "byte 0: not a PFM: it does not begin with \"Pf\"");
  EXPECT_EQ(error("PF\n1 1\n-1\n0000"), "byte 0: a colour PFM; only greyscale PFM is supported");
  EXPECT_EQ(error("Pf\n"), "byte 3: the width is \"\"");
  EXPECT_EQ(error("Pf\n0 1\n-1\n"), "byte 3: the width is \"0\"");
  EXPECT_EQ(error("Pf\n2 -1\n-1\n"), "byte 5: the height is \"-1\"");
  EXPECT_EQ(error("Pf\n2 99999999999\n-1\n"), "byte 5: the height is \"99999999999\"");
  EXPECT_EQ(error("Pf\n2 1\n0\n"), "byte 7: the scale is \"0\"");
  EXPECT_EQ(error("Pf\n2 1\nnan\n"), "byte 7: the scale is \"nan\"");
  EXPECT_EQ(error("Pf\n2 1\n-1\n1234567"), "byte 10: it claims 2 x 1 pixels but holds 1");
  EXPECT_EQ(error("Pf\n268435456 268435456\n-1\n"), "byte 26: it claims 268435456 x 268435456 pixels but holds 0");
}

TEST_F(ImageFiles, ReadsOrRefusesPngCorpus) {
  int inputs = 0;
  int images = 0;
  for (const auto& entry : std::filesystem::directory_iterator(QUOIN_SOURCE_DIR "/tests/corpus/png")) {
    const auto bytes = read_file(entry.path());
    ASSERT_TRUE(bytes);
    ++inputs;
    const auto image = read_png(*bytes);
    if (!image) continue;
    ++images;
    EXPECT_EQ(image->rgb.size(), static_cast<std::size_t>(3 * image->width * image->height)) << entry.path();
  }
  EXPECT_GT(inputs, 6);
  EXPECT_GT(images, 4);
}

TEST_F(ImageFiles, ReadsOrRefusesPfmCorpus) {
  int inputs = 0;
  for (const auto& entry : std::filesystem::directory_iterator(QUOIN_SOURCE_DIR "/tests/corpus/pfm")) {
    const auto bytes = read_file(entry.path());
    ASSERT_TRUE(bytes);
    const auto image = read_pfm(*bytes);
    EXPECT_TRUE(!image || 4 * image->values.size() <= bytes->size()) << entry.path();
    ++inputs;
  }
  EXPECT_GT(inputs, 3);
}

TEST_F(ImageFiles, RefusesOversizedPng) {
  auto bytes = *encode_png({1, 1, 3, {1, 2, 3}});
  // Width and height lie at 16 and 20, their checksum at 29.
  const auto put = [&](std::size_t at, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::byte>(value >> (24 - 8 * i) & 0xFFU);
  };
  put(16, 16'000);
  put(20, 16'000);
  std::uint32_t crc = 0xFFFFFFFFU;
  for (std::size_t i = 12; i < 29; ++i) {
    crc ^= static_cast<std::uint32_t>(bytes[i]);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  put(29, ~crc);
  const auto image = decode_png(bytes);
  ASSERT_FALSE(image);
  EXPECT_NE(image.error().message.find("more pixels than its bytes"), std::string::npos) << image.error().message;
}

TEST_F(ImageFiles, RejectsInvalidImagesAndPaths) {
  for (const Image& image : {Image{}, Image{-1, -1, {1, 2, 3}}, Image{2, 1, {1, 2, 3}}}) {
    const auto written = write_png(image, file("a.png"));
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().code, ErrorCode::InvalidArgument);
  }
  for (const FloatImage& image : {FloatImage{}, FloatImage{-1, -1, {1}}, FloatImage{2, 1, {1}}}) {
    const auto written = write_pfm(image, file("a.pfm"));
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().code, ErrorCode::InvalidArgument);
  }
  EXPECT_EQ(write_png(noise(1'000'001, 1, 1), file("a.png")).error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(folder_.count(), 0U);
  EXPECT_EQ(write_png(noise(1, 1, 1), file("no/a.png")).error().code, ErrorCode::CannotWrite);
  EXPECT_EQ(write_pfm({1, 1, {1}}, file("no/a.pfm")).error().code, ErrorCode::CannotWrite);
  EXPECT_EQ(read_png(file("a.png")).error().code, ErrorCode::CannotRead);
  ASSERT_TRUE(write_file(bytes_of("no image"), file("a.png")));
  EXPECT_EQ(read_png(file("a.png")).error().path, file("a.png").string());
  EXPECT_EQ(read_pfm(file("a.png")).error().path, file("a.png").string());
}

TEST(PngDeathTest, AssertsOnMissingPixels) {
  QUOIN_EXPECT_MISTAKE((void)encode_png({2, 2, 3, {}}), "as many bytes of pixels as the sizes say");
}

}  // namespace
}  // namespace quoin
