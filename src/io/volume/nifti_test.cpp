#include <gtest/gtest.h>

#include <glm/matrix.hpp>
#include <limits>

#include "io/volume/volume_for_tests.h"

namespace quoin {
namespace {

using volume_test::Bytes;
using volume_test::encode;
using volume_test::gzipped;
using volume_test::kNiftiTypes;
using volume_test::kTwelve;
using volume_test::NiftiFile;
using volume_test::position_of;

Volume volume_of(const NiftiFile& file, const Bytes& values) {
  const auto volume = read_volume(file.bytes(values));
  EXPECT_TRUE(volume) << to_string(volume.error());
  return volume.value_or(Volume{});
}

/// Returns a volume of twelve bytes, whose values do not matter.
Volume placed(const NiftiFile& file) {
  return volume_of(file, encode(kTwelve, ScalarType::UInt8));
}

void expect_near(DVec3 a, DVec3 b) {
  EXPECT_LT(glm::length(a - b), 1e-5) << a.x << " " << a.y << " " << a.z << ", not " << b.x << " " << b.y << " " << b.z;
}

bool warns(const Volume& volume, const std::string& of) {
  for (const std::string& warning : volume.warnings) {
    if (warning.find(of) != std::string::npos) return true;
  }
  return false;
}

TEST(Nifti, ReadsEveryTypeOrderAndVersion) {
  for (std::size_t type = 0; type < kNiftiTypes.size(); ++type) {
    const auto scalar = static_cast<ScalarType>(type);
    std::vector<double> values = kTwelve;
    const bool is_signed = name_of(scalar)[0] != 'u';
    if (is_signed) values[3] = -100;
    if (scalar == ScalarType::Float32 || scalar == ScalarType::Float64) values[4] = 0.5;
    // Differs from the same bytes in reverse order, and lies at the end of the range.
    if (scalar == ScalarType::UInt64) values[5] = 18446744073709549568.0;
    if (scalar == ScalarType::Int32) values[5] = -2147483648.0;
    for (const std::endian order : {std::endian::little, std::endian::big}) {
      for (const bool is_second : {false, true}) {
        NiftiFile file{.is_second = is_second, .order = order};
        file.datatype = kNiftiTypes[type];
        file.bitpix = static_cast<int>(8 * size_of(scalar));
        const Volume volume = volume_of(file, encode(values, scalar, order));
        EXPECT_EQ(volume.values, std::vector<float>(values.begin(), values.end())) << name_of(scalar);
        EXPECT_EQ(volume.type, scalar);
        EXPECT_EQ(volume.size, IVec3(3, 2, 2));
        EXPECT_EQ(volume.min, *std::min_element(volume.values.begin(), volume.values.end()));
        EXPECT_EQ(volume.max, *std::max_element(volume.values.begin(), volume.values.end()));
        EXPECT_EQ(volume.format, "nifti");
        EXPECT_EQ(volume.units, "mm");
        EXPECT_TRUE(volume.warnings.empty()) << volume.warnings.front();
      }
    }
  }
}

TEST(Nifti, ReadsGzipOfSeveralMembers) {
  const Bytes plain = NiftiFile{}.bytes(encode(kTwelve, ScalarType::UInt8));
  const std::vector<float> expected(kTwelve.begin(), kTwelve.end());
  EXPECT_EQ(read_volume(gzipped(plain)).value().values, expected);
  Bytes members = gzipped(std::span(plain).first(100));
  for (const auto& rest : {gzipped(std::span(plain).subspan(100, 257)), gzipped(std::span(plain).subspan(357))}) {
    members.insert(members.end(), rest.begin(), rest.end());
  }
  EXPECT_EQ(read_volume(members).value().values, expected);
  members.resize(members.size() + 100);
  EXPECT_EQ(read_volume(members).value().values, expected) << "padded with zeros";
}

TEST(Nifti, AppliesValidSlopeAndIntercept) {
  NiftiFile file;
  const auto first = [&](double slope, double intercept) {
    file.slope = slope;
    file.intercept = intercept;
    return placed(file).values.front();
  };
  EXPECT_EQ(first(2.0, -0.5), 1.5F);
  EXPECT_EQ(first(1.0, 10.0), 11.0F);
  EXPECT_EQ(first(0.0, 10.0), 1.0F) << "a slope of 0 means none";
  EXPECT_EQ(first(std::nan(""), std::nan("")), 1.0F) << "as some programs write it";
  EXPECT_TRUE(warns(placed(file), "scl_slope"));
}

TEST(Nifti, PlacesSamplesBySpacingWithoutForm) {
  NiftiFile file;
  file.pixdim = {1, 2, 3, 4, 1, 1, 1, 1};
  const Volume volume = placed(file);
  EXPECT_EQ(volume.spacing, DVec3(2, 3, 4));
  // Right, front, head become -X, +Z, +Y.
  expect_near(position_of(volume, {1, 1, 1}), {-2, 4, 3});
  EXPECT_GT(glm::determinant(volume.world_from_voxel), 0.0);
}

TEST(Nifti, PrefersSformOverQform) {
  NiftiFile file;
  file.pixdim = {1, 2, 2, 2, 1, 1, 1, 1};
  file.qform_code = 1;
  file.sform_code = 2;
  file.quaternion = {0, 0, 0, 7, 7, 7};
  // i runs to the left, as many scans do; j up; k to the front.
  file.srow = {-2, 0, 0, 10, 0, 0, 2, 20, 0, 2, 0, 30};
  const Volume volume = placed(file);
  expect_near(position_of(volume, {0, 0, 0}), {-10, 30, 20});
  expect_near(position_of(volume, {1, 0, 0}), {-8, 30, 20});
  expect_near(position_of(volume, {0, 1, 0}), {-10, 32, 20});
  expect_near(position_of(volume, {0, 0, 1}), {-10, 30, 22});
  file.sform_code = 0;
  expect_near(position_of(placed(file), {0, 0, 0}), {-7, 7, 7});
}

TEST(Nifti, WarnsIfFormsDisagree) {
  NiftiFile file;
  file.qform_code = 1;
  file.sform_code = 1;
  file.srow = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  EXPECT_FALSE(warns(placed(file), "disagree")) << "the same";
  file.srow = {-1, 0, 0, 9, 0, 1, 0, 0, 0, 0, 1, 0};
  Volume volume = placed(file);
  EXPECT_TRUE(warns(volume, "the sform and the qform disagree on left and right; the sform is used"));
  expect_near(position_of(volume, {1, 0, 0}), {-8, 0, 0});
  file.srow = {-1, 0, 0, 9, 0, -1, 0, 0, 0, 0, 1, 0};
  EXPECT_TRUE(warns(placed(file), "orient the axes differently"));
  file.qform_code = 0;
  EXPECT_FALSE(warns(placed(file), "orient the axes differently"));
}

TEST(Nifti, AppliesQformAndQfac) {
  for (const bool is_second : {false, true}) {
    NiftiFile file{.is_second = is_second, .order = std::endian::big};
    file.pixdim = {-1, 2, 3, 4, 1, 1, 1, 1};
    file.qform_code = 1;
    // A quarter turn about the third axis: i runs to the front, j to the left.
    file.quaternion = {0, 0, std::sqrt(0.5), 5, 6, 7};
    const Volume volume = placed(file);
    const auto ras = [](DVec3 p) { return DVec3(-p.x, p.z, p.y); };
    expect_near(position_of(volume, {0, 0, 0}), ras({5, 6, 7}));
    expect_near(position_of(volume, {1, 0, 0}), ras({5, 8, 7}));
    expect_near(position_of(volume, {0, 1, 0}), ras({2, 6, 7}));
    expect_near(position_of(volume, {0, 0, 1}), ras({5, 6, 3}));
    EXPECT_LT(glm::determinant(volume.world_from_voxel), 0.0) << "stored mirrored";
    file.pixdim[0] = 0;
    expect_near(position_of(placed(file), {0, 0, 1}), ras({5, 6, 11}));
    // Rounding left no room for the real part: half a turn about the first axis.
    file.quaternion = {1.0000001, 0, 0, 0, 0, 0};
    expect_near(position_of(placed(file), {0, 1, 0}), ras({0, -3, 0}));
  }
}

TEST(Nifti, IgnoresInvalidFormsWithWarning) {
  NiftiFile file;
  file.sform_code = 1;
  Volume volume = placed(file);
  EXPECT_TRUE(warns(volume, "sform"));
  expect_near(position_of(volume, {1, 0, 0}), {-1, 0, 0});
  file.srow = {1, 0, 0, std::nan(""), 0, 1, 0, 0, 0, 0, 1, 0};
  EXPECT_TRUE(warns(placed(file), "sform"));
  file.sform_code = 0;
  file.qform_code = 1;
  file.quaternion[0] = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(warns(placed(file), "qform"));
  file.qform_code = 0;
  file.pixdim[2] = 0;
  volume = placed(file);
  EXPECT_TRUE(warns(volume, "pixdim"));
  EXPECT_EQ(volume.spacing, DVec3(1));
  // Found by changing single bytes: a number too small to square.
  NiftiFile second{.is_second = true};
  second.pixdim[1] = 1e-200;
  EXPECT_EQ(placed(second).spacing, DVec3(1));
}

TEST(Nifti, ReadsFirstVolumeOfMoreThanThreeDimensions) {
  NiftiFile file;
  file.dim = {4, 3, 2, 2, 5, 1, 1, 1};
  std::vector<double> values = kTwelve;
  for (int i = 12; i < 60; ++i) values.push_back(99);
  const Volume volume = volume_of(file, encode(values, ScalarType::UInt8));
  EXPECT_EQ(volume.values, std::vector<float>(kTwelve.begin(), kTwelve.end()));
  EXPECT_TRUE(warns(volume, "4 dimensions"));
  file.dim = {4, 3, 2, 2, 1, 1, 1, 1};
  EXPECT_TRUE(placed(file).warnings.empty()) << "one volume";
  file.dim = {1, 12, -3, -3, 0, 0, 0, 0};
  EXPECT_EQ(placed(file).size, IVec3(12, 1, 1)) << "the rest means nothing";
}

TEST(Nifti, KeepsAndCountsNonFiniteValues) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  NiftiFile file;
  file.datatype = 64;
  file.bitpix = 64;
  std::vector<double> values = kTwelve;
  values[0] = std::nan("");
  values[2] = -kInfinity;
  values[4] = 1e300;
  const Volume volume = volume_of(file, encode(values, ScalarType::Float64));
  EXPECT_TRUE(std::isnan(volume.values[0]));
  EXPECT_EQ(volume.values[2], -std::numeric_limits<float>::infinity());
  EXPECT_EQ(volume.values[4], std::numeric_limits<float>::infinity());
  EXPECT_EQ(volume.nan_count, 1);
  EXPECT_EQ(volume.infinite_count, 2);
  EXPECT_EQ(volume.min, 2.0F);
  EXPECT_EQ(volume.max, 12.0F);
  EXPECT_TRUE(warns(volume, "not a number: 1"));
  EXPECT_TRUE(warns(volume, "for a float: 2"));
  const Volume none = volume_of(file, encode(std::vector<double>(12, std::nan("")), ScalarType::Float64));
  EXPECT_TRUE(warns(none, "no value is finite"));
  EXPECT_EQ(none.min, 0.0F);
  EXPECT_EQ(none.max, 0.0F);
}

TEST(Nifti, ReadsValuesBehindExtensions) {
  NiftiFile file;
  file.vox_offset = 1024;
  EXPECT_EQ(placed(file).values.front(), 1.0F);
  file.vox_offset = 0;
  EXPECT_EQ(placed(file).values.front(), 1.0F);
  EXPECT_TRUE(warns(placed(file), "vox_offset"));
}

}  // namespace
}  // namespace quoin
