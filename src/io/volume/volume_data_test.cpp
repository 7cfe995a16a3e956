#include <filesystem>
#include <fstream>
#include <glm/matrix.hpp>
#include <regex>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <quoin/io/volume.h>

/// Real scans, present next to the source tree on some machines.
namespace quoin {
namespace {

namespace fs = std::filesystem;

const fs::path kData = fs::path(QUOIN_SOURCE_DIR) / ".." / "shared" / "data";

class VolumeData : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kData / "index.json")) GTEST_SKIP() << "the collection of real files is not here: " << kData;
  }
  static Volume read(const std::string& path) {
    const auto volume = read_volume(kData / "vol" / path);
    EXPECT_TRUE(volume) << to_string(volume.error());
    return volume.value_or(Volume{});
  }
};

/// Returns the numbers in "dims=(64, 33, 32)"; a list of eight begins with their count.
std::vector<int> dims_in(const std::string& info) {
  std::smatch found;
  std::vector<int> dims;
  if (!std::regex_search(info, found, std::regex(R"(dims=\(([^)]*)\))"))) return dims;
  std::istringstream in(found[1]);
  for (std::string word; std::getline(in, word, ',');) dims.push_back(std::stoi(word));
  if (dims.size() == 8) dims.erase(dims.begin());
  return dims;
}

TEST_F(VolumeData, MatchesSizesAndTypesInIndex) {
  std::ifstream index(kData / "index.json");
  int count = 0;
  for (const nlohmann::json& entry : nlohmann::json::parse(index)) {
    const std::string file = entry.at("file");
    if (!file.starts_with("vol/")) continue;
    const std::string info = entry.at("info");
    const Volume volume = read(file.substr(4));
    const std::vector<int> dims = dims_in(info);
    ASSERT_GE(dims.size(), 3U) << file;
    EXPECT_EQ(volume.size, IVec3(dims[0], dims[1], dims[2])) << file;
    // NIfTI's type numbers; the index lacks the type of the single version 2 file.
    const bool is_uint8 = info.find("dtype=2 ") != std::string::npos;
    EXPECT_EQ(volume.type, is_uint8 ? ScalarType::UInt8 : ScalarType::Int16) << file;
    EXPECT_EQ(volume.warnings.size(), dims.size() > 3 && dims[3] > 1 ? 1U : 0U) << file;
    EXPECT_EQ(volume.units, "mm") << file;
    EXPECT_EQ(volume.nan_count + volume.infinite_count, 0) << file;
    EXPECT_LT(volume.min, volume.max) << file;
    ++count;
  }
  EXPECT_EQ(count, 6);
}

TEST_F(VolumeData, ScalesValuesByHeader) {
  const Volume volume = read("nipy+nibabel/nibabel__tests__data__functional.nii");
  EXPECT_NEAR(volume.min, 762.542, 0.001);
  EXPECT_NEAR(volume.max, 5538.07, 0.01);
}

TEST_F(VolumeData, PlacesRealScansByHeader) {
  // From the header of this scan: srow_x and its like, in RAS.
  const Volume brain = read("neurolabusc+VolumeRenderingData/stroke__T1.nii.gz");
  const DVec3 origin(brain.world_from_voxel[3]);
  EXPECT_NEAR(origin.x, 64.8982, 1e-3);
  EXPECT_NEAR(origin.y, -27.9255, 1e-3);
  EXPECT_NEAR(origin.z, -110.4311, 1e-3);
  const Volume mirrored = read("nipy+nibabel/nibabel__tests__data__anatomical.nii");
  EXPECT_LT(glm::determinant(mirrored.world_from_voxel), 0.0) << "stored from right to left";
  EXPECT_EQ(mirrored.spacing, DVec3(2.0));
}

}  // namespace
}  // namespace quoin
