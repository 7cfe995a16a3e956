#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include <quoin/io/formats.h>
#include <quoin/terrain/terrain.h>

#include "tests/tool_for_tests.h"

namespace quoin {

namespace {

using Json = nlohmann::json;

class ToolGenerate : public ToolTest {};

TEST_F(ToolGenerate, WritesSameWorldAsLibrary) {
  const ToolRun result = run("generate terrain world.vox --seed 9 --chunks 3x2x2 --json");
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_EQ(result.err, "");
  VoxelRegistry registry;
  TerrainOptions options;
  options.seed = 9;
  options.size = {3, 2, 2};
  const Grid world = generate_terrain(options, add_terrain_types(registry).value()).value();
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json["voxels"], world.voxel_count());
  EXPECT_EQ(json["types"], world.types().size());
  EXPECT_EQ(json["size"], Json({96, 64, 64}));
  EXPECT_EQ(json["bytes"], std::filesystem::file_size(folder_.file("world.vox")));
  for (const char* key : {"generate", "write"}) EXPECT_GE(json["seconds"][key], 0.0);
  EXPECT_EQ(json["warnings"], Json::array());

  const LoadedScene loaded = load_scene(folder_.file("world.vox")).value();
  ASSERT_EQ(loaded.scene.grids().size(), 1U);
  const SceneGrid& grid = loaded.scene.grids()[loaded.scene.grids().handles().front()];
  EXPECT_EQ(grid.grid.voxel_count(), world.voxel_count());
  int differing = 0;
  world.for_each([&](IVec3 v, VoxelType type) { differing += grid.grid.get(v) != type; });
  EXPECT_EQ(differing, 0);
  EXPECT_TRUE(loaded.scene.types.is_transparent(6)) << "water";
  EXPECT_EQ(loaded.scene.types[1].colour, (Rgba8{77, 179, 51, 255}));
}

TEST_F(ToolGenerate, DefaultsToSeed42And4x2x4) {
  EXPECT_EQ(run("generate terrain a.vox").status, 0);
  EXPECT_EQ(run("generate terrain b.vox --seed 42 --chunks 4x2x4 --threads 3").status, 0);
  EXPECT_EQ(run("generate terrain c.vox --seed 43").status, 0);
  const std::string a = text_of(folder_.file("a.vox"));
  EXPECT_GT(a.size(), 1'000'000U);
  EXPECT_TRUE(a == text_of(folder_.file("b.vox"))) << "the same bytes for any number of threads";
  EXPECT_FALSE(a == text_of(folder_.file("c.vox")));
}

TEST_F(ToolGenerate, ReportsResult) {
  const ToolRun result = run("generate terrain hills.vox --chunks 1x1x1");
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_NE(result.out.find("seed 42, 32 x 32 x 32"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("\nFaces: "), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("Wrote hills.vox"), std::string::npos) << result.out;
  EXPECT_NE(run("generate terrain --help").out.find("Example: quoin generate terrain"), std::string::npos);
  EXPECT_NE(run("generate --help").out.find("Example: quoin generate terrain"), std::string::npos);
}

TEST_F(ToolGenerate, OtherCommandsReadSmoothTerrain) {
  const ToolRun made = run("generate smooth-terrain cliffs.json --seed 9 --chunks 2x1x1 --no-caves --json");
  ASSERT_EQ(made.status, 0) << made.err;
  SmoothTerrainOptions options;
  options.seed = 9;
  options.size = {2, 1, 1};
  options.caves = false;
  VoxelRegistry registry;
  const DensityGrid world = generate_smooth_terrain(options, add_terrain_types(registry).value()).value();
  const Json json = Json::parse(made.out);
  EXPECT_EQ(json["voxels"], world.solid_count());
  EXPECT_EQ(json["size"], Json({128, 64, 64}));
  EXPECT_TRUE(json["faces_visible"].is_null()) << "a field has no faces";
  const LoadedScene loaded = load_scene(folder_.file("cliffs.json")).value();
  const SceneGrid& grid = loaded.scene.grids()[loaded.scene.grids().handles().front()];
  ASSERT_EQ(grid.field.chunks(), world.chunks());
  for (const IVec3 chunk : world.chunks()) {
    EXPECT_EQ(grid.field.find_chunk(chunk)->content_hash(), world.find_chunk(chunk)->content_hash());
  }
  const ToolRun info = run("info cliffs.json --json");
  ASSERT_EQ(info.status, 0) << info.err;
  EXPECT_EQ(Json::parse(info.out)["grids"][0]["solid_samples"], world.solid_count());
  EXPECT_EQ(run("render cliffs.json -o cliffs.png --size 80x60").status, 0);
  const ToolRun mesh = run("convert cliffs.json cliffs.ply --json");
  ASSERT_EQ(mesh.status, 0) << mesh.err;
  EXPECT_GT(Json::parse(mesh.out)["triangles"], 10'000);

  EXPECT_EQ(run("generate smooth-terrain cliffs.vox").status, 2) << "no file of blocks";
  EXPECT_EQ(run("generate smooth-terrain cliffs.glb").status, 2);
  EXPECT_EQ(run("generate smooth-terrain a.json --chunks 513x1x1").status, 2);
  const ToolRun voxels = run("convert cliffs.json cliffs.vox");
  EXPECT_EQ(voxels.status, 0) << voxels.err;
  EXPECT_NE(voxels.err.find("fields converted to voxels"), std::string::npos) << voxels.err;
}

TEST_F(ToolGenerate, WorldsBeyond256VoxelsKeepEveryVoxel) {
  const ToolRun made = run("generate terrain wide.vox --chunks 10x1x1 --json");
  ASSERT_EQ(made.status, 0) << made.err;
  const ToolRun info = run("info wide.vox --json");
  ASSERT_EQ(info.status, 0) << info.err;
  EXPECT_EQ(Json::parse(info.out)["voxels"], Json::parse(made.out)["voxels"]);
}

TEST_F(ToolGenerate, ReturnsStatus2WithoutFileForWrongUsage) {
  for (const std::string arguments : {"",
                                      "terrain",
                                      "forest out.vox",
                                      "terrain out.glb",
                                      "terrain out",
                                      "terrain out.vox --chunks 0x2x4",
                                      "terrain out.vox --chunks 4x-2x4",
                                      "terrain out.vox --chunks 4x2",
                                      "terrain out.vox --chunks 4x2x4x1",
                                      "terrain out.vox --chunks 4,2,4",
                                      "terrain out.vox --chunks ''",
                                      "terrain out.vox --chunks 1025x1x1",
                                      "terrain out.vox --chunks 1x33x1",
                                      "terrain out.vox --chunks 1024x32x1024",
                                      "terrain out.vox --chunks 99999999999x1x1",
                                      "terrain out.vox --seed -1",
                                      "terrain out.vox --seed x",
                                      "terrain out.vox --seed 18446744073709551616",
                                      "terrain out.vox --threads 0",
                                      "terrain ''",
                                      "terrain out.vox --unknown"}) {
    const ToolRun result = run("generate " + arguments);
    EXPECT_EQ(result.status, 2) << arguments;
    expect_one_error_line(result);
  }
  EXPECT_FALSE(exists("out.vox") || exists("out.glb") || exists("out"));
  EXPECT_EQ(run("generate forest out.vox").err, "quoin: generate needs one of: terrain, smooth-terrain (try --help)\n");
  EXPECT_EQ(run("generate terrain out.vox --endless").err, "quoin: --endless needs a .quoin file (try --help)\n");
  EXPECT_EQ(run("generate smooth-terrain out.json --chunks 4x17x4").err,
            "quoin: --chunks: must be XxYxZ, as in 4x2x4, at most 512x16x512 and 8,192 units, not \"4x17x4\" "
            "(try --help)\n");
  EXPECT_EQ(run("generate smooth-terrain out.vox").err,
            "quoin: cannot write out.vox: smooth terrain is written as .quoin or .json; use `quoin convert` for other "
            "formats (try --help)\n");
  EXPECT_TRUE(
      run("generate terrain out.vox --seed 5 --unknown").err.starts_with("quoin: unknown option \"--unknown\""));
}

// The error comes before the work: this world would take minutes and gigabytes.
TEST_F(ToolGenerate, ReportsUnwritableFileBeforeGenerating) {
  const ToolRun result = shell("ulimit -t 10; '" QUOIN_TOOL "' generate terrain nowhere/out.vox --chunks 1024x2x32");
  EXPECT_EQ(result.status, 1);
  expect_one_error_line(result);
}

}  // namespace

}  // namespace quoin
