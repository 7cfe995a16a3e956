// Linear light in image files: Radiance .hdr and OpenEXR.

#include <cmath>
#include <filesystem>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include <quoin/io/image_files.h>

namespace quoin {
namespace {

std::vector<std::byte> bytes_of(const std::string& text) {
  const auto* const data = reinterpret_cast<const std::byte*>(text.data());
  return {data, data + text.size()};
}

Result<RadianceImage> read(const std::string& text) {
  return read_radiance(bytes_of(text));
}

const std::string kHeader = "#?RADIANCE\n# made by hand\nFORMAT=32-bit_rle_rgbe\n\n";

TEST(Radiance, ReadsPlainPixels) {
  // 2^(129 - 136) = 1/128: (128.5, 64.5, 0.5) / 128 is near 1, a half and 0.
  const auto image = read(kHeader + "-Y 1 +X 2\n" + std::string("\x80\x40\x00\x81\x00\x00\x00\x00", 8));
  ASSERT_TRUE(image.has_value()) << image.error().message;
  EXPECT_EQ(image->width, 2);
  EXPECT_EQ(image->rgb, (std::vector<float>{128.5F / 128, 64.5F / 128, 0.5F / 128, 0.0F, 0.0F, 0.0F}));
}

TEST(Radiance, ReadsRuns) {
  std::string row("\x02\x02\x00\x0A", 4);
  row += std::string("\x8A\x80", 2);                                       // ten times 128
  row += std::string("\x0A\x00\x01\x02\x03\x04\x05\x06\x07\x08\x09", 11);  // ten of their own
  row += std::string("\x85\x01\x85\x02", 4);                               // twice five
  row += std::string("\x8A\x88", 2);                                       // exponent 136: times 1
  const auto image = read(kHeader + "-Y 1 +X 10\n" + row);
  ASSERT_TRUE(image.has_value()) << image.error().message;
  for (std::size_t x = 0; x < 10; ++x) {
    EXPECT_EQ(image->rgb[3 * x], 128.5F);
    EXPECT_EQ(image->rgb[3 * x + 1], static_cast<float>(x) + 0.5F);
    EXPECT_EQ(image->rgb[3 * x + 2], x < 5 ? 1.5F : 2.5F);
  }
}

TEST(Radiance, DividesByExposure) {
  const auto image =
      read("#?RADIANCE\nEXPOSURE=2\nEXPOSURE= 2.0\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x81");
  ASSERT_TRUE(image.has_value()) << image.error().message;
  EXPECT_EQ(image->rgb[0], 128.5F / 128 / 4);
}

TEST(Radiance, RejectsBrokenFiles) {
  const std::string good = kHeader + "-Y 1 +X 2\n" + std::string("\x80\x40\x00\x81\x00\x00\x00\x00", 8);
  for (std::size_t size = 0; size < good.size(); ++size) EXPECT_FALSE(read(good.substr(0, size)).has_value()) << size;
  for (const std::string size :
       {"+Y 1 +X 2", "-Y 0 +X 2", "-Y 1 +X x", "-Y 1000000 +X 1000000", "-Y 1.5 +X 2", "-Y 1"}) {
    EXPECT_FALSE(read(kHeader + size + "\n" + std::string(8, '\x01')).has_value()) << size;
  }
  EXPECT_FALSE(read("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n\x01\x02\x03\x04").has_value());
  EXPECT_FALSE(read("#?RADIANCE\nEXPOSURE=0\n\n-Y 1 +X 1\n\x01\x02\x03\x04").has_value());
  EXPECT_FALSE(read("PNG").has_value());
  // A run that exceeds its row.
  EXPECT_FALSE(read(kHeader + "-Y 1 +X 10\n" + std::string("\x02\x02\x00\x0A\x8B\x80", 6) + std::string(60, '\x01'))
                   .has_value());
}

TEST(Radiance, ReadsOrRefusesCorpus) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(QUOIN_SOURCE_DIR "/tests/corpus/radiance")) {
    ++files;
    const auto image = read_radiance(entry.path());
    EXPECT_TRUE(image.has_value() || !image.error().message.empty()) << entry.path();
  }
  EXPECT_GE(files, 2);
}

std::vector<ExrChannel> three_channels(const std::vector<float>& values, ExrChannel::Type type) {
  std::vector<ExrChannel> channels;
  for (const char* name : {"R", "G", "B"}) channels.push_back({name, type, values, {}});
  return channels;
}

TEST(Exr, RoundTrips) {
  if (!has_exr()) GTEST_SKIP() << "built without OpenEXR";
  const std::vector<float> values{0.0F, 1.0F, 0.123456F, 1000.5F, -2.0F, 65504.0F};
  for (const auto type : {ExrChannel::Type::Float16, ExrChannel::Type::Float32}) {
    std::vector<ExrChannel> channels = three_channels(values, type);
    channels.push_back(
        {"Z", ExrChannel::Type::Float32, std::vector<float>(6, std::numeric_limits<float>::infinity()), {}});
    channels.push_back({"id", ExrChannel::Type::Uint32, {}, {0, 1, 2, 3, 4, 0xFFFF'FFFFU}});
    const auto bytes = write_exr(3, 2, channels);
    ASSERT_TRUE(bytes.has_value()) << bytes.error().message;
    EXPECT_EQ(*bytes, *write_exr(3, 2, channels));
    const auto image = read_radiance(*bytes);
    ASSERT_TRUE(image.has_value()) << image.error().message;
    EXPECT_EQ(image->width, 3);
    EXPECT_EQ(image->height, 2);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const float tolerance = type == ExrChannel::Type::Float16 ? std::abs(values[i]) * 0.0005F : 0.0F;
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(image->rgb[3 * i + c], values[i], tolerance);
    }
    for (std::size_t size = 0; size < bytes->size(); size += 7) {
      EXPECT_FALSE(read_radiance(std::span(*bytes).first(size)).has_value()) << size;
    }
  }
}

TEST(Exr, RejectsSizesThatTheFileCannotHold) {
  if (!has_exr()) GTEST_SKIP() << "built without OpenEXR";
  const auto bytes = write_exr(1, 1, three_channels({1.0F}, ExrChannel::Type::Float16));
  ASSERT_TRUE(bytes) << bytes.error().message;
  std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  for (const char* name : {"dataWindow", "displayWindow"}) {
    const std::size_t at = text.find(name);
    ASSERT_NE(at, std::string::npos);
    // After name, type "box2i" and length: the box 0, 0, 8191, 8191.
    const std::size_t box = text.find("box2i", at) + 10;
    for (const std::size_t corner : {box + 8, box + 12}) text.replace(corner, 4, std::string("\xFF\x1F\0\0", 4));
  }
  text.append(std::size_t{1} << 14, '\0');  // space for the table of rows
  const auto image = read(text);
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, ErrorCode::BadFormat);
  EXPECT_NE(image.error().message.find("too short for its 8192 x 8192 pixels"), std::string::npos)
      << image.error().message;
  // A flat image compresses well, and is still read.
  const std::size_t flat = std::size_t{2048} * 1024;
  EXPECT_TRUE(
      read_radiance(*write_exr(2048, 1024, three_channels(std::vector<float>(flat, 0.5F), ExrChannel::Type::Float16))));
}

// OpenEXR allocates as many bytes as an attribute claims.
TEST(Exr, RejectsAttributesThatTheFileCannotHold) {
  if (!has_exr()) GTEST_SKIP() << "built without OpenEXR";
  const auto bytes = write_exr(1, 1, three_channels({1.0F}, ExrChannel::Type::Float16));
  ASSERT_TRUE(bytes) << bytes.error().message;
  const std::string plain(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  const auto with = [&](const std::string& type, const std::string& length, const std::string& value) {
    const std::string attribute = "aa" + std::string(1, '\0') + type + '\0' + length + value;
    std::string file = plain.substr(0, 8) + attribute + plain.substr(8);
    // The position of the row precedes the row: y, length and three halves.
    const std::size_t table = file.size() - 8 - 14;
    const std::size_t row = table + 8;
    file[table] = static_cast<char>(row & 0xFFU);
    file[table + 1] = static_cast<char>(row >> 8);
    return file;
  };
  for (const char* type : {"unknown", "string", "preview"}) {
    for (const std::string& length : {std::string("\xF0\xFF\xFF\x7F", 4), std::string("\xFF\xFF\xFF\xFF", 4)}) {
      const auto image = read(with(type, length, {}));
      ASSERT_FALSE(image);
      EXPECT_EQ(image.error().message, "the attribute is longer than the file");
      EXPECT_EQ(image.error().byte_offset, 8U);
    }
  }
  const std::string thumbnail("\x0C\0\0\0", 4);
  const auto claims = read(with("preview", thumbnail, std::string("\xFF\x7F\0\0\xFF\x7F\0\0....", 12)));
  ASSERT_FALSE(claims);
  EXPECT_EQ(claims.error().message, "the attribute is longer than the file");
  for (const std::string& tile : {std::string("\xFF\xFF\0\0\xFF\xFF\0\0\0", 9), std::string(8, '\xFF') + '\0'}) {
    const auto tiles = read(with("tiledesc", std::string("\x09\0\0\0", 4), tile));
    ASSERT_FALSE(tiles);
    EXPECT_EQ(tiles.error().message, "the OpenEXR file is too short for its tiles");
  }
  const auto sound = read(with("preview", thumbnail, std::string("\1\0\0\0\1\0\0\0....", 12)));
  EXPECT_TRUE(sound) << sound.error().message;
}

TEST(Exr, ClampsValuesTooBrightForHalf) {
  if (!has_exr()) GTEST_SKIP() << "built without OpenEXR";
  const auto image = read_radiance(*write_exr(1, 1, three_channels({1e9F}, ExrChannel::Type::Float16)));
  ASSERT_TRUE(image.has_value());
  EXPECT_EQ(image->rgb[0], 65504.0F);
}

TEST(Exr, RejectsInvalidInput) {
  const std::vector<float> one{1.0F};
  EXPECT_FALSE(write_exr(0, 1, three_channels(one, ExrChannel::Type::Float16)).has_value());
  EXPECT_FALSE(write_exr(2, 1, three_channels(one, ExrChannel::Type::Float16)).has_value());
  EXPECT_FALSE(write_exr(1, 1, std::vector<ExrChannel>{}).has_value());
  EXPECT_FALSE(write_exr(1, 1, std::vector<ExrChannel>{{"R", {}, one, {}}, {"R", {}, one, {}}}).has_value());
}

Image stripes() {
  Image image{40, 24, {}};
  for (int i = 0; i < 40 * 24; ++i) {
    const bool is_red = i % 40 / 8 % 2 == 0;
    for (const int channel : {is_red ? 220 : 20, 30, is_red ? 20 : 220}) {
      image.rgb.push_back(static_cast<std::uint8_t>(channel));
    }
  }
  return image;
}

TEST(WebPImages, KeepAllPixelsAtAnyEffort) {
  if (!has_webp()) GTEST_SKIP() << "built without libwebp";
  AlphaImage image{33, 21, {}};
  for (int i = 0; i < 33 * 21 * 4; ++i) image.rgba.push_back(static_cast<std::uint8_t>(i * i / 7 + i / 50));
  const auto quick = write_webp(image, WebPEffort::Quick);
  ASSERT_TRUE(quick);
  EXPECT_EQ(*quick, *write_webp(image, WebPEffort::Quick));
  const auto read = read_alpha_image(*quick);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->width, 33);
  EXPECT_EQ(read->rgba, image.rgba) << "also where alpha is 0";
  const auto small = read_alpha_image(*write_webp(image, WebPEffort::Small));
  ASSERT_TRUE(small);
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    if (image.rgba[i + 3] == 0) continue;
    EXPECT_TRUE(std::equal(&image.rgba[i], &image.rgba[i] + 4, &small->rgba[i])) << i;
  }
  EXPECT_FALSE(write_webp(AlphaImage{2, 2, {}}, WebPEffort::Quick));
}

TEST(LossyImages, AreDeterministicAndRejectInvalidInput) {
  if (!has_jpeg() || !has_webp()) GTEST_SKIP() << "built without libjpeg or libwebp";
  const Image image = stripes();
  const auto jpeg = write_jpeg(image);
  ASSERT_TRUE(jpeg.has_value());
  EXPECT_EQ(*jpeg, *write_jpeg(image));
  EXPECT_LT(write_jpeg(image, 20)->size(), write_jpeg(image, 100)->size());
  const auto webp = write_webp(image);
  ASSERT_TRUE(webp.has_value());
  EXPECT_EQ(*webp, *write_webp(image));
  EXPECT_FALSE(write_jpeg(image, 0).has_value());
  EXPECT_FALSE(write_jpeg(image, 101).has_value());
  EXPECT_FALSE(write_jpeg(Image{3, 3, {}}).has_value());
  EXPECT_FALSE(write_webp(Image{0, 0, {}}).has_value());
  EXPECT_FALSE(write_webp(AlphaImage{1, 1, {1, 2, 3}}).has_value());
  EXPECT_EQ(write_jpeg(Image{70'000, 1, std::vector<std::uint8_t>(210'000)}).error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(write_webp(Image{70'000, 1, std::vector<std::uint8_t>(210'000)}).error().code, ErrorCode::LimitExceeded);
}

}  // namespace
}  // namespace quoin
