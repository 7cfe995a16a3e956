#include <filesystem>
#include <fstream>
#include <random>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <quoin/io/file.h>

#include "io/vox/vox_for_tests.h"

/// Real files: 152 of them, next to the source tree on some machines, with counts by other programs.
namespace quoin {
namespace {

namespace fs = std::filesystem;

const fs::path kData = fs::path(QUOIN_SOURCE_DIR) / ".." / "shared" / "data";

struct DataFile {
  std::string path;
  std::int64_t voxels = -1;  ///< -1: not a .vox of MagicaVoxel
  std::size_t models = 0;
};

class VoxData : public testing::Test {
 protected:
  void SetUp() override {
    std::ifstream index(kData / "index.json");
    if (!index) GTEST_SKIP() << "the collection of real files is not here: " << kData;
    for (const nlohmann::json& entry : nlohmann::json::parse(index)) {
      const std::string path = entry.at("file");
      const bool bad = path.starts_with("bad/");
      if (!bad && !path.starts_with("vox/")) continue;
      const nlohmann::json info = bad ? nlohmann::json::object() : entry.at("info");
      const bool readable = !bad && !info.contains("bad");
      files_.push_back({path, readable ? info.value("voxels", std::int64_t{-1}) : -1, info.value("models", 0U)});
    }
  }
  [[nodiscard]] static std::vector<std::byte> bytes_of(const std::string& path) {
    auto bytes = read_file(kData / path);
    EXPECT_TRUE(bytes);
    return bytes.value_or(std::vector<std::byte>{});
  }

  std::vector<DataFile> files_;
};

TEST_F(VoxData, MatchesIndependentVoxelCounts) {
  int readable = 0;
  for (const DataFile& file : files_) {
    if (file.voxels < 0) continue;
    const auto loaded = read_vox(bytes_of(file.path));
    ASSERT_TRUE(loaded) << file.path << ": " << to_string(loaded.error());
    EXPECT_EQ(loaded->scene.voxel_count(), file.voxels) << file.path;
    EXPECT_EQ(loaded->scene.grids().size(), file.models) << file.path;
    EXPECT_FALSE(loaded->scene.instances().empty()) << file.path;
    ++readable;
  }
  EXPECT_EQ(readable, 150);
}

TEST_F(VoxData, RoundTripsEveryFile) {
  for (const DataFile& file : files_) {
    if (file.voxels < 0) continue;
    const auto loaded = read_vox(bytes_of(file.path));
    ASSERT_TRUE(loaded) << file.path;
    EXPECT_EQ(vox_test::difference_after_round_trip(loaded->scene), "") << file.path;
  }
}

TEST_F(VoxData, WritesUntouchedFilesUnchanged) {
  for (const DataFile& file : files_) {
    if (file.voxels < 0) continue;
    const std::vector<std::byte> bytes = bytes_of(file.path);
    const auto loaded = read_vox(bytes);
    ASSERT_TRUE(loaded) << file.path;
    const auto written = write_vox(*loaded);
    ASSERT_TRUE(written) << file.path << ": " << to_string(written.error());
    EXPECT_TRUE(written->bytes == bytes) << file.path;
    EXPECT_TRUE(written->warnings.empty()) << file.path << ": " << written->warnings.front();
  }
}

// Simulates an artist's first stroke: it changes the voxels of one model only.
TEST_F(VoxData, PaintedVoxelChangesOnlyItsModel) {
  for (const DataFile& file : files_) {
    if (file.voxels <= 0) continue;
    const std::vector<std::byte> bytes = bytes_of(file.path);
    auto loaded = read_vox(bytes);
    ASSERT_TRUE(loaded) << file.path;
    const GridHandle shown = loaded->scene.instances()[loaded->scene.instances().handles().back()].grid;
    Grid& grid = loaded->scene.edit(shown).grid;
    if (grid.chunk_count() == 0) continue;
    IVec3 painted{0};
    visit_voxels(grid, [&](IVec3 voxel, VoxelType) { painted = voxel; });
    grid.set(painted, static_cast<VoxelType>(grid.get(painted) % 255 + 1));
    const auto written = write_vox(*loaded);
    ASSERT_TRUE(written) << file.path << ": " << to_string(written.error());
    ASSERT_EQ(written->bytes.size(), bytes.size()) << file.path;
    std::size_t different = 0;
    for (std::size_t i = 0; i < bytes.size(); ++i) different += bytes[i] != written->bytes[i] ? 1U : 0U;
    EXPECT_EQ(different, 1U) << file.path << ": a voxel's colour is a byte";
    const auto again = read_vox(written->bytes);
    ASSERT_TRUE(again) << file.path;
    EXPECT_EQ(vox_test::difference(loaded->scene, again->scene), "") << file.path;
  }
}

TEST_F(VoxData, RefusesOtherFormatsInOneLine) {
  for (const DataFile& file : files_) {
    if (file.voxels >= 0) continue;
    const auto loaded = read_vox(bytes_of(file.path));
    ASSERT_FALSE(loaded) << file.path;
    const std::string text = to_string(loaded.error());
    const std::string expected = file.path.find("slab6") != std::string::npos ? "SLAB6"
                                 : file.path.starts_with("bad/")              ? "Git LFS"
                                                                              : "starts with";
    EXPECT_NE(text.find(expected), std::string::npos) << file.path << ": " << text;
    EXPECT_EQ(text.find('\n'), std::string::npos);
  }
}

const std::string kSmallFile = "vox/vengi-voxel+vengi/data__tests__rgb_small.vox";
const std::string kSceneFile = "vox/vengi-voxel+vengi/data__tests__robo.vox";

TEST_F(VoxData, RefusesEveryTruncationOfRealFiles) {
  for (const std::string& path : {kSmallFile, kSceneFile}) {
    const std::vector<std::byte> whole = bytes_of(path);
    for (std::size_t size = 0; size < whole.size(); ++size) {
      ASSERT_FALSE(read_vox(std::span(whole).first(size))) << path << " cut to " << size;
    }
  }
}

TEST_F(VoxData, SurvivesFlippedBitsInRealFiles) {
  constexpr std::uint32_t kSeed = 4'711;
  std::mt19937 random(kSeed);
  for (const std::string& path : {kSmallFile, kSceneFile}) {
    const std::vector<std::byte> whole = bytes_of(path);
    for (int round = 0; round < 500; ++round) {
      std::vector<std::byte> flipped = whole;
      flipped[random() % flipped.size()] ^= std::byte{static_cast<unsigned char>(1U << random() % 8)};
      ASSERT_EQ(vox_test::wrong_with(flipped), "") << path << ", seed " << kSeed << ", round " << round;
    }
  }
}

TEST_F(VoxData, KeepsAxesOfRealFile) {
  // An artist's axes of 32^3: red along x, green along y, blue (up) along z, from the corner.
  const auto loaded = read_vox(bytes_of("vox/Arlorean+Voxels/Voxels.CommandLine__Axes.vox"));
  ASSERT_TRUE(loaded);
  const Scene& scene = loaded->scene;
  DVec3 reddest{0};
  DVec3 greenest{0};
  DVec3 bluest{0};
  std::array<int, 3> counts{};
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const SceneGrid& grid = scene.grids()[instance.grid];
    grid.grid.for_each([&](IVec3 voxel, VoxelType type) {
      const Rgba8 c = scene.types[type].colour;
      const DVec3 at = world_from_grid(instance, grid, DVec3(voxel) + 0.5);
      if (c.r > 150 && c.g < 100 && c.b < 100) reddest += at, ++counts[0];
      if (c.g > 150 && c.r < 100 && c.b < 100) greenest += at, ++counts[1];
      if (c.b > 150 && c.r < 100 && c.g < 100) bluest += at, ++counts[2];
    });
  }
  ASSERT_GT(std::min({counts[0], counts[1], counts[2]}), 0);
  reddest /= counts[0];
  greenest /= counts[1];
  bluest /= counts[2];
  EXPECT_GT(reddest.x, std::max(greenest.x, bluest.x));
  EXPECT_GT(bluest.y, std::max(reddest.y, greenest.y));
  EXPECT_LT(greenest.z, std::min(reddest.z, bluest.z));
}

}  // namespace
}  // namespace quoin
