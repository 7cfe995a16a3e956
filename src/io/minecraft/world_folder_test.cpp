#include "io/minecraft/minecraft.h"

#include <gtest/gtest.h>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>

#include "io/minecraft/minecraft_for_tests.h"
#include "io/minecraft/region_file.h"

namespace quoin {

namespace {

namespace fs = std::filesystem;
using minecraft_test::NbtWriter;

/// A Minecraft world in a temporary folder.
class WrittenWorld {
 public:
  explicit WrittenWorld(const char* name) : path_(fs::path(testing::TempDir()) / "quoin_dimensions" / name) {
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~WrittenWorld() { fs::remove_all(path_); }
  WrittenWorld(const WrittenWorld&) = delete;
  WrittenWorld& operator=(const WrittenWorld&) = delete;

  [[nodiscard]] const fs::path& path() const { return path_; }
  WrittenWorld& region(const std::string& folder,
                       const std::vector<std::byte>& chunk = minecraft_test::chunk_of_stairs(0)) {
    fs::create_directories(path_ / folder);
    EXPECT_TRUE(write_file(minecraft_test::region_with(chunk), path_ / folder / "r.0.0.mca"));
    return *this;
  }
  WrittenWorld& level() {
    NbtWriter nbt;
    nbt.compound("").compound("Data").string("LevelName", "home").end().end();
    EXPECT_TRUE(write_file(nbt.bytes, path_ / "level.dat"));
    return *this;
  }

 private:
  fs::path path_;
};

std::vector<std::string> names_of(const minecraft::WorldFolder& world) {
  std::vector<std::string> names;
  for (const minecraft::Dimension& each : world.dimensions) names.push_back(each.name);
  return names;
}

std::string error_of(const fs::path& path, const std::string& dimension = "") {
  const auto loaded = load_scene(path, {.dimension = dimension});
  return loaded ? "" : loaded.error().message;
}

TEST(Dimensions, AreFoundInBothLayouts) {
  WrittenWorld world("both");
  world.level().region("region").region("DIM-1/region").region("DIM1/region").region("DIM7/region");
  world.region("dimensions/a/b/region").region("dimensions/minecraft/worlds/2b2t/2b2t_2/region");
  const std::vector<std::string> names = {
      "minecraft:overworld",         "DIM7", "a:b", "minecraft:the_end", "minecraft:the_nether",
      "minecraft:worlds/2b2t/2b2t_2"};
  EXPECT_EQ(names_of(minecraft::find_dimensions(world.path())), names);
  EXPECT_EQ(names_of(minecraft::find_dimensions(world.path() / "level.dat")), names);
  for (const std::string& name : names) EXPECT_EQ(load_scene(world.path(), {.dimension = name})->dimension, name);
  EXPECT_EQ(load_scene(world.path(), {.dimension = "worlds/2b2t/2b2t_2"})->dimension, names.back());
}

TEST(Dimensions, ReadsNewerOfTwoLayouts) {
  WrittenWorld world("twice");
  world.level().region("region").region("dimensions/minecraft/overworld/region");
  const minecraft::WorldFolder found = minecraft::find_dimensions(world.path());
  ASSERT_EQ(found.dimensions.size(), 1U);
  EXPECT_EQ(found.dimensions[0].regions, world.path() / "dimensions/minecraft/overworld/region");
  const auto loaded = load_scene(world.path());
  ASSERT_TRUE(loaded);
  ASSERT_EQ(loaded->warnings.size(), 1U);
  EXPECT_NE(loaded->warnings[0].find("newer layout"), std::string::npos);
}

TEST(Dimensions, RejectsNegativeRadius) {
  WrittenWorld world("radius");
  world.level().region("region");
  EXPECT_TRUE(load_scene(world.path(), {.radius = 0}));
  const auto loaded = load_scene(world.path(), {.radius = -1});
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(loaded.error().message, "cannot read a world within a radius of -1 chunks: it is negative");
}

TEST(Dimensions, ReadsFolderOfOneDimension) {
  WrittenWorld world("one");
  world.level().region("region").region("DIM-1/region").region("dimensions/a/b/region");
  const auto name = [&](const char* folder) { return load_scene(world.path() / folder)->dimension; };
  EXPECT_EQ(name("DIM-1"), "minecraft:the_nether");
  EXPECT_EQ(name("DIM-1/region"), "minecraft:the_nether");
  EXPECT_EQ(name("dimensions/a/b"), "a:b");
  EXPECT_EQ(name("region"), "minecraft:overworld");
}

TEST(Dimensions, ReadsNetherFolderOfServer) {
  WrittenWorld world("world_nether");
  world.level().region("DIM-1/region");
  EXPECT_EQ(load_scene(world.path())->dimension, "minecraft:the_nether");
}

TEST(Dimensions, ReportsMissingDimensions) {
  WrittenWorld world("missing");
  world.level().region("region").region("DIM1/region");
  EXPECT_EQ(error_of(world.path(), "nether"),
            "cannot read the dimension minecraft:the_nether: the world has minecraft:overworld, minecraft:the_end");
  EXPECT_NE(error_of(world.path() / "region" / "r.0.0.mca", "nether").find("one region file"), std::string::npos);
}

TEST(Dimensions, ReportsMissingRegions) {
  WrittenWorld world("none");
  EXPECT_NE(error_of(world.path()).find("without a Minecraft world"), std::string::npos);
  world.level();
  EXPECT_NE(error_of(world.path()).find("without region files"), std::string::npos);
  EXPECT_NE(error_of(world.path() / "level.dat").find("without region files"), std::string::npos);
  fs::create_directories(world.path() / "db");
  EXPECT_NE(error_of(world.path()).find("Bedrock"), std::string::npos);
}

TEST(MinecraftSource, RefusesEntityAndPointRegions) {
  NbtWriter entities;
  entities.compound("").list("Entities", 10, 0).tag(11, "Position").number(2, 4).number(0, 4).number(0, 4).end();
  NbtWriter points;
  points.compound("").compound("Sections").end().end();
  WrittenWorld world("apart");
  world.level().region("region").region("entities", entities.bytes).region("poi", points.bytes);
  for (const char* path : {"entities", "entities/r.0.0.mca"}) {
    EXPECT_NE(error_of(world.path() / path).find("a region file of entities, not blocks"), std::string::npos) << path;
  }
  EXPECT_NE(error_of(world.path() / "poi").find("a region file of points of interest"), std::string::npos);
}

TEST(MinecraftSource, PlacesRenamedRegionAtOrigin) {
  WrittenWorld world("renamed");
  world.region("region");
  fs::rename(world.path() / "region" / "r.0.0.mca", world.path() / "mine (1).mca");
  const auto loaded = load_scene(world.path() / "mine (1).mca");
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->scene.voxel_count(), 3);
  ASSERT_EQ(loaded->warnings.size(), 1U);
  EXPECT_NE(loaded->warnings[0].find("r.0.0.mca"), std::string::npos);
}

TEST(LinearRegion, SurvivesDamageAnywhere) {
  const fs::path path =
      fs::path(QUOIN_SOURCE_DIR) / "tests" / "corpus" / "cases" / "minecraft-linear" / "region" / "r.0.0.linear";
  const auto whole = read_file(path);
  ASSERT_TRUE(whole);
  const auto read_all = [](const std::vector<std::byte>& bytes) {
    if (!minecraft::LinearRegion::begins(bytes)) return std::size_t{0};
    const auto region = minecraft::LinearRegion::parse(bytes);
    std::size_t chunks = 0;
    for (std::size_t i = 0; region && i < minecraft::LinearRegion::kChunks; ++i) {
      if ((*region)->has(i)) chunks += (*region)->read(i) ? 1 : 0;
    }
    return chunks;
  };
#ifdef QUOIN_HAVE_STORE  // also requires zstd
  EXPECT_EQ(read_all(*whole), 1U);
#endif
  for (std::size_t size = 0; size < whole->size() - 8; ++size) {
    EXPECT_EQ(read_all({whole->begin(), whole->begin() + static_cast<std::ptrdiff_t>(size)}), 0U) << size;
  }
  for (std::size_t at = 0; at < whole->size(); ++at) {
    std::vector<std::byte> turned = *whole;
    turned[at] ^= std::byte{0x10};
    (void)read_all(turned);
  }
}

}  // namespace

}  // namespace quoin
