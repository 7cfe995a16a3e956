// Reads every real file next to the source tree, or refuses it in one clear line. Compares the counts with those of
// other programs.

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <quoin/io/formats.h>

namespace quoin {
namespace {

namespace fs = std::filesystem;

const fs::path kData = fs::path(QUOIN_SOURCE_DIR) / ".." / "shared" / "data";

/// Returns the numbers that a pattern's groups match.
std::vector<std::int64_t> numbers_in(const std::string& text, const char* pattern) {
  std::smatch found;
  std::vector<std::int64_t> numbers;
  if (!std::regex_search(text, found, std::regex(pattern))) return numbers;
  for (std::size_t i = 1; i < found.size(); ++i) numbers.push_back(std::stoll(found[i]));
  return numbers;
}

/// The blocks of a scene, counted in the units of Minecraft files.
struct Blocks {
  std::set<std::pair<int, int>> columns;  ///< of 16 x 16 blocks
  std::set<std::array<int, 3>> sections;  ///< of 16^3
};
Blocks blocks_of(const Scene& scene) {
  Blocks blocks;
  scene.grids().for_each([&](GridHandle, const SceneGrid& grid) {
    grid.grid.for_each([&](IVec3 v, VoxelType) {
      blocks.columns.emplace(v.x >> 4, v.z >> 4);
      blocks.sections.insert({v.x >> 4, v.y >> 4, v.z >> 4});
    });
  });
  return blocks;
}

std::optional<IVec3> first_canvas(const Scene& scene) {
  const auto handles = scene.grids().handles();
  if (handles.empty()) return std::nullopt;
  return scene.grids()[handles.front()].canvas.size();
}

/// Compares a scene with the file's entry in the collection's index. Returns true if the entry has anything to compare.
bool compare(const std::string& file, const std::string& info, const LoadedScene& loaded) {
  SCOPED_TRACE(file);
  const Scene& scene = loaded.scene;
  bool is_known = false;
  const auto expect = [&](std::int64_t found, std::int64_t wanted, const char* what) {
    is_known = true;
    EXPECT_EQ(found, wanted) << what;
  };
  const auto expect_size = [&](const std::vector<std::int64_t>& wanted) {
    if (wanted.size() != 3) return;
    is_known = true;
    const auto size = first_canvas(scene);
    ASSERT_TRUE(size);
    std::array<std::int64_t, 3> found = {size->x, size->y, size->z};
    std::array<std::int64_t, 3> sorted = {wanted[0], wanted[1], wanted[2]};
    // The up axis depends on the format.
    std::ranges::sort(found);
    std::ranges::sort(sorted);
    EXPECT_EQ(found, sorted);
  };
  for (const char* const pattern : {R"( surfvox=(\d+))", R"( set=(\d+))"}) {
    if (const auto n = numbers_in(info, pattern); !n.empty()) expect(scene.voxel_count(), n[0], "voxels");
  }
  if (const auto n = numbers_in(info, R"( matrices=(\d+))"); !n.empty()) {
    expect(static_cast<std::int64_t>(scene.grids().size()), n[0], "matrices");
  }
  expect_size(numbers_in(info, R"(dims=(\d+)x(\d+)x(\d+))"));
  expect_size(numbers_in(info, R"(^W(\d+) H(\d+) L(\d+))"));
  expect_size(numbers_in(info, R"(structure size=\[(\d+), (\d+), (\d+)\])"));
  if (info.starts_with("magic=b'MTSM'")) expect_size(numbers_in(info, R"(size=\((\d+), (\d+), (\d+)\))"));
  if (file.ends_with(".mca")) {
    const Blocks blocks = blocks_of(scene);
    // The index also counts chunks and sections that hold only air. Only finished worlds have none.
    EXPECT_LE(static_cast<std::int64_t>(blocks.columns.size()), numbers_in(info, R"(chunks=(\d+))").at(0));
    EXPECT_LE(static_cast<std::int64_t>(blocks.sections.size()), numbers_in(info, R"(sections=(\d+))").at(0));
    for (const char* const finished : {"1.12.2__r.0.-1.mca", "example__r.1.0.mca"}) {
      if (!file.ends_with(finished)) continue;
      expect(static_cast<std::int64_t>(blocks.columns.size()), numbers_in(info, R"(chunks=(\d+))").at(0), "chunks");
      expect(static_cast<std::int64_t>(blocks.sections.size()), numbers_in(info, R"(sections=(\d+))").at(0),
             "sections");
    }
  }
  if (const auto n = numbers_in(info, R"(mapblocks=(\d+))"); !n.empty()) {
    EXPECT_LE(static_cast<std::int64_t>(blocks_of(scene).sections.size()), n[0]) << "most are air";
  }
  return is_known;
}

TEST(RealFiles, MatchOtherReadersOrFailInOneLine) {
  if (!fs::exists(kData / "index.json")) GTEST_SKIP() << "the collection of real files is not here: " << kData;
  std::ifstream index(kData / "index.json");
  std::map<std::string, std::array<int, 3>> counts;  // by folder: read, of these compared, refused
  LoadOptions options;
  options.radius = 40;
  options.keep_source = false;
  for (const nlohmann::json& entry : nlohmann::json::parse(index)) {
    const std::string file = entry.at("file");
    auto& [read, compared, refused] = counts[file.substr(0, file.find('/'))];
    const auto loaded = load_scene(kData / file, options);
    if (loaded) {
      ++read;
      // For .vox files the entry says more; src/io/vox/vox_data_test.cpp compares it.
      const nlohmann::json& info = entry.at("info");
      if (info.is_string() && compare(file, info, *loaded)) ++compared;
      continue;
    }
    ++refused;
    const std::string line = to_string(loaded.error());
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
    EXPECT_NE(line.find(fs::path(file).filename().string()), std::string::npos) << line;
    EXPECT_LT(line.size(), 600U) << line;
  }
  // Refused files hold no voxels: pointers to files stored elsewhere, other NBT trees, and damaged files.
  EXPECT_EQ(counts["bad"], (std::array{0, 0, 23}));
  EXPECT_EQ(counts["kv6"], (std::array{49, 49, 0}));
  EXPECT_EQ(counts["binvox"], (std::array{1, 1, 0}));
  EXPECT_EQ(counts["cub"], (std::array{2, 2, 0}));
  EXPECT_GE(counts["mc"][1], 8);
  EXPECT_GE(counts["qb"][1], 11);
  EXPECT_GE(counts["luanti"][1], 28);
  EXPECT_EQ(counts["vox"][2], 1);
  EXPECT_EQ(counts["vol"][2], 0);
}

}  // namespace
}  // namespace quoin
