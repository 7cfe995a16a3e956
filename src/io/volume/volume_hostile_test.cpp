#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <random>

#include <quoin/io/file.h>

#include "core/death_for_tests.h"
#include "io/volume/volume_file.h"
#include "io/volume/volume_for_tests.h"

namespace quoin {
namespace {

using volume_test::Bytes;
using volume_test::encode;
using volume_test::gzipped;
using volume_test::NiftiFile;
using volume_test::wrong_with;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Bytes twelve() {
  return encode({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, ScalarType::UInt8);
}

Error error_in(const Bytes& bytes, const VolumeOptions& options = {}) {
  const auto volume = read_volume(bytes, options);
  EXPECT_FALSE(volume);
  return volume ? Error{} : volume.error();
}

std::string text_of(const NiftiFile& file) {
  return to_string(error_in(file.bytes(twelve())));
}

Bytes small_nrrd(bool is_compressed) {
  Bytes bytes;
  volume_test::append_text(bytes, std::string("NRRD0004\ntype: uint8\ndimension: 3\nsizes: 3 2 2\nencoding: ") +
                                      (is_compressed ? "gzip" : "raw") +
                                      "\nspace: RAS\nspace directions: (1,0,0) (0,2,0) (0,0,3)\n"
                                      "space origin: (1,2,3)\nspace units: \"mm\" \"mm\" \"mm\"\n\n");
  const Bytes data = is_compressed ? gzipped(twelve()) : twelve();
  bytes.insert(bytes.end(), data.begin(), data.end());
  return bytes;
}

/// Returns a small file of every kind.
std::vector<Bytes> small_files() {
  const Bytes first = NiftiFile{.sform_code = 1, .srow = {1, 0, 0, 4, 0, 1, 0, 5, 0, 0, 1, 6}}.bytes(twelve());
  NiftiFile second{.is_second = true, .order = std::endian::big, .qform_code = 1};
  second.quaternion = {0.5, 0.5, 0.5, 1, 2, 3};
  return {
      first, second.bytes(twelve()), gzipped(first), small_nrrd(false), small_nrrd(true), gzipped(small_nrrd(false))};
}

TEST(VolumeHostile, AcceptsSmallFiles) {
  for (const Bytes& file : small_files()) {
    const auto volume = read_volume(file);
    ASSERT_TRUE(volume) << to_string(volume.error());
    EXPECT_EQ(volume->values.size(), 12U);
    EXPECT_EQ(wrong_with(file), "");
  }
}

TEST(VolumeHostile, RefusesEveryTruncation) {
  for (const Bytes& whole : small_files()) {
    for (std::size_t size = 0; size < whole.size(); ++size) {
      const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
      ASSERT_FALSE(read_volume(cut)) << size << " of " << whole.size();
      EXPECT_EQ(wrong_with(cut), "");
    }
  }
}

TEST(VolumeHostile, SurvivesFlippedBits) {
  constexpr std::uint32_t kSeed = 4'242;
  std::mt19937 random(kSeed);
  for (const Bytes& whole : small_files()) {
    for (int round = 0; round < 2'000; ++round) {
      Bytes flipped = whole;
      for (std::uint32_t flips = 1 + random() % 4; flips > 0; --flips) {
        flipped[random() % flipped.size()] ^= std::byte{static_cast<unsigned char>(1U << random() % 8)};
      }
      ASSERT_EQ(wrong_with(flipped), "") << "seed " << kSeed << ", round " << round;
    }
  }
}

TEST(VolumeHostile, SurvivesAnyChangedByte) {
  for (const Bytes& whole : small_files()) {
    for (std::size_t at = 0; at < whole.size(); ++at) {
      for (const int value : {0, 0x7F, 0x80, 0xFF}) {
        Bytes changed = whole;
        changed[at] = static_cast<std::byte>(value);
        ASSERT_EQ(wrong_with(changed), "") << "byte " << at << " is " << value;
      }
    }
  }
}

TEST(VolumeHostile, RefusesInvalidDimensions) {
  EXPECT_EQ(text_of({.dim = {0, 3, 2, 2}}), "byte 40: dim[0] is 0; it must be 1 to 7");
  EXPECT_EQ(text_of({.dim = {8, 3, 2, 2, 1, 1, 1, 1}}), "byte 40: dim[0] is 8; it must be 1 to 7");
  EXPECT_EQ(text_of({.dim = {-1, 3, 2, 2}}), "byte 40: dim[0] is -1; it must be 1 to 7");
  EXPECT_EQ(text_of({.dim = {3, 3, -2, 2}}), "byte 44: dim[2] is -2");
  EXPECT_EQ(text_of({.dim = {3, 3, 2, 0}}), "byte 46: dim[3] is 0");
  EXPECT_EQ(text_of({.dim = {4, 3, 2, 2, -7}}), "byte 48: dim[4] is -7");
  EXPECT_EQ(text_of({.is_second = true, .dim = {3, 3, 2, -1}}), "byte 40: dim[3] is -1");
}

TEST(VolumeHostile, RefusesOverflowingSizes) {
  const std::int64_t huge = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(text_of({.is_second = true, .dim = {3, huge, huge, 2}}),
            "byte 16: the header claims 9223372036854775807 x 9223372036854775807 x 2 values, more than the limit of "
            "1073741824");
  EXPECT_EQ(text_of({.is_second = true, .dim = {3, 1LL << 32, 1LL << 32, 1}}),
            "byte 16: the header claims 4294967296 x 4294967296 x 1 values, more than the limit of 1073741824");
  EXPECT_EQ(error_in(NiftiFile{}.bytes(twelve()), {.max_values = 11}).code, ErrorCode::LimitExceeded);
  EXPECT_TRUE(read_volume(NiftiFile{}.bytes(twelve()), {.max_values = 12}));
  EXPECT_FALSE(read_volume(NiftiFile{}.bytes(twelve()), {.max_values = -1}));
}

TEST(VolumeHostile, RefusesOffsetsBeyondFile) {
  EXPECT_EQ(text_of({.vox_offset = 1e6}), "byte 0: the values begin at byte 1000000, but there are 364");
  EXPECT_EQ(text_of({.vox_offset = 100}), "byte 108: vox_offset is 100, within the header");
  EXPECT_EQ(text_of({.vox_offset = 400.5}), "byte 108: vox_offset is 400.5");
  NiftiFile file;
  Bytes bytes = file.bytes(twelve());
  for (const float offset : {-1.0F, 1e30F, static_cast<float>(kNan), std::numeric_limits<float>::infinity()}) {
    volume_test::put(bytes, 108, offset);
    EXPECT_EQ(error_in(bytes).code, ErrorCode::BadFormat) << offset;
  }
}

TEST(VolumeHostile, RefusesContradictoryHeaders) {
  EXPECT_EQ(text_of({.dim = {3, 3, 3, 2}}), "byte 352: 3 x 3 x 2 values of uint8 take 18 bytes, but there are 12");
  EXPECT_EQ(text_of({.datatype = 64}), "byte 352: 3 x 2 x 2 values of float64 take 96 bytes, but there are 12");
  EXPECT_EQ(text_of({.datatype = 3}), "byte 70: datatype 3 is not a NIfTI type");
  EXPECT_EQ(text_of({.slope = 1, .intercept = kNan}), "byte 116: scl_inter is not a finite number");
  for (const int datatype : {1, 32, 128, 1536, 1792, 2048, 2304}) {
    EXPECT_EQ(error_in(NiftiFile{.datatype = datatype}.bytes(twelve())).code, ErrorCode::Unsupported) << datatype;
  }
  EXPECT_EQ(text_of({.datatype = 128}),
            "byte 70: the values are colours, and only plain numbers of up to 64 bits are supported");
  EXPECT_EQ(text_of({.magic = "ni1"}), "the header of a file pair, whose values are in a second file (.img)");
  EXPECT_EQ(to_string(error_in({})), "neither a NIfTI nor a NRRD file");
}

TEST(VolumeHostile, ReportsOffsetsAfterDecompression) {
  EXPECT_EQ(to_string(error_in(gzipped(NiftiFile{.dim = {0}}.bytes(twelve())))),
            "byte 40: dim[0] is 0; it must be 1 to 7 (counted after decompression)");
}

TEST(VolumeHostile, StopsGzipBombs) {
  // 64 MiB of zeros in 64 KiB, with and without a matching header.
  NiftiFile file{.dim = {3, 512, 512, 256}};
  const Bytes bomb = gzipped(file.bytes(Bytes(std::size_t{1} << 26)));
  ASSERT_LT(bomb.size(), std::size_t{70'000});
  EXPECT_EQ(error_in(bomb, {.max_values = 1 << 20}).code, ErrorCode::LimitExceeded);
  file.dim = {3, 1, 1, 1};
  EXPECT_EQ(read_volume(gzipped(file.bytes(Bytes(std::size_t{1} << 26)))).value().values.size(), 1U);
  // More than this few bytes can hold.
  file.dim = {3, 1000, 1000, 1000};
  const Error lie = error_in(gzipped(file.bytes(twelve())));
  EXPECT_EQ(lie.code, ErrorCode::BadFormat);
  EXPECT_NE(lie.message.find("but there are at most"), std::string::npos) << lie.message;
}

TEST(VolumeHostile, RefusesDamagedCompressionBehindValues) {
  Bytes bytes = gzipped(NiftiFile{}.bytes(twelve()));
  bytes[bytes.size() - 6] ^= std::byte{1};
  EXPECT_NE(to_string(error_in(bytes)).find("the compressed data is damaged"), std::string::npos);
}

TEST(VolumeHostile, SurvivesCorpus) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(QUOIN_SOURCE_DIR "/tests/corpus/volume")) {
    const auto bytes = read_file(entry.path());
    ASSERT_TRUE(bytes) << entry.path();
    EXPECT_EQ(wrong_with(*bytes), "") << entry.path();
    ++count;
  }
  EXPECT_GT(count, 5);
}

TEST(VolumeFileDeathTest, AssertsOnStreamBeyondFile) {
  QUOIN_EXPECT_MISTAKE((void)ByteStream({}, 1, Compression::None), "the stream begins in the file");
}

TEST(VolumeFileDeathTest, AssertsOnNonPositiveSizes) {
  Volume volume;
  QUOIN_EXPECT_MISTAKE((void)set_size({1, 0, 1}, {}, std::nullopt, volume), "positive extents");
}

TEST(VolumeFileDeathTest, AssertsOnMissingHeader) {
  QUOIN_EXPECT_MISTAKE((void)nifti::read_header({}, {}), "a header begins here");
  QUOIN_EXPECT_MISTAKE((void)nrrd::read_header({}, {}), "a header begins here");
}

}  // namespace
}  // namespace quoin
