#include <nlohmann/json.hpp>
#include <string>

#include <quoin/io/formats.h>
#include <quoin/store/world_store.h>

#include "core/work/nightly_for_tests.h"
#include "tests/tool_for_tests.h"

namespace quoin {

namespace {

using Json = nlohmann::json;

class ToolWorld : public ToolTest {
 protected:
  void SetUp() override {
    ToolTest::SetUp();
    const ToolRun made = run("generate terrain hills.quoin --chunks 4x4x4 -q");
    if (made.err.find("not supported by this build") != std::string::npos) GTEST_SKIP() << made.err;
    ASSERT_EQ(made.status, 0) << made.err;
  }
  /// Flips 100 bytes in the middle of a file.
  void damage(const char* name) {
    std::string bytes = text_of(folder_.file(name));
    for (std::size_t i = bytes.size() / 2; i < bytes.size() / 2 + 100; ++i) bytes[i] = static_cast<char>(~bytes[i]);
    std::ofstream(folder_.file(name), std::ios::binary) << bytes;
  }
};

TEST_F(ToolWorld, OtherCommandsReadAndWriteWorlds) {
  const Json world = Json::parse(run("info hills.quoin --json").out);
  EXPECT_EQ(world["format"], "world");
  ASSERT_EQ(run("convert hills.quoin hills.json -q").status, 0);
  const Json scene = Json::parse(run("info hills.json --json").out);
  EXPECT_EQ(world["voxels"], scene["voxels"]);
  EXPECT_EQ(world["grids"], scene["grids"]);
  ASSERT_EQ(run("convert hills.json again.quoin -q").status, 0);
  EXPECT_TRUE(text_of(folder_.file("hills.quoin")) == text_of(folder_.file("again.quoin")));
  ASSERT_EQ(run("convert hills.quoin hills.glb -q").status, 0);
  ASSERT_EQ(run("render hills.quoin -o a.png --size 64x48 -q").status, 0);
  ASSERT_EQ(run("render hills.json -o b.png --size 64x48 -q").status, 0);
  EXPECT_TRUE(text_of(folder_.file("a.png")) == text_of(folder_.file("b.png")));
  const ToolRun refused = run("convert hills.json again.quoin");
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("--force"), std::string::npos) << refused.err;
  EXPECT_EQ(run("convert hills.json again.quoin --force -q").status, 0);
}

TEST_F(ToolWorld, InfoDescribesWorld) {
  const ToolRun text = run("world info hills.quoin");
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_NE(text.out.find(": world version 6"), std::string::npos) << text.out;
  const Json json = Json::parse(run("world info hills.quoin --json").out);
  EXPECT_EQ(json["bytes"], std::filesystem::file_size(folder_.file("hills.quoin")));
  EXPECT_EQ(json["grids"].size(), 1U);
  EXPECT_GT(json["grids"][0]["chunks"], 0);
  EXPECT_EQ(json["grids"][0]["chunk_bounds"]["max"], Json({2, 2, 2}));
}

TEST_F(ToolWorld, InfoAndCopiesKeepWholeGrids) {
  auto loaded = load_scene(folder_.file("hills.quoin"));
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  loaded->scene.add_grid({.name = "ship", .whole = true});
  ASSERT_TRUE(save_scene(loaded->scene, folder_.file("w.quoin")));
  EXPECT_NE(run("world info w.quoin").out.find("Grid 1 \"ship\": 0 chunks within 0 x 0 x 0, whole"), std::string::npos);
  EXPECT_EQ(run("world info hills.quoin").out.find("whole"), std::string::npos);
  EXPECT_EQ(run("world backup w.quoin backup.quoin").status, 0);
  EXPECT_EQ(run("world repair w.quoin -o repaired.quoin").status, 0);
  EXPECT_EQ(run("convert w.quoin copy.quoin -q").status, 0);
  EXPECT_EQ(run("world compact w.quoin").status, 0);
  for (const char* const name : {"w.quoin", "backup.quoin", "repaired.quoin", "copy.quoin"}) {
    const std::string file = name;
    EXPECT_EQ(run("world check " + file).status, 0) << name;
    const Json summary = Json::parse(run("world info " + file + " --json").out);
    ASSERT_EQ(summary["grids"].size(), 2U) << name;
    EXPECT_EQ(summary["grids"][0]["whole"], false) << name;
    EXPECT_EQ(summary["grids"][1]["whole"], true) << name;
    const Json info = Json::parse(run("info " + file + " --json").out);
    EXPECT_FALSE(info["grids"][0].contains("whole")) << name;
    EXPECT_EQ(info["grids"][1]["whole"], true) << name;
  }
}

TEST_F(ToolWorld, ReportsAndRepairsDamage) {
  EXPECT_EQ(run("world check hills.quoin").status, 0);
  damage("hills.quoin");
  const ToolRun check = run("world check hills.quoin");
  EXPECT_EQ(check.status, 1);
  EXPECT_NE(check.err.find("hills.quoin: "), std::string::npos) << check.err;
  const Json json = Json::parse(run("world check hills.quoin --json").out);
  EXPECT_FALSE(json["damage"].empty());
  const ToolRun repair = run("world repair hills.quoin --json");
  EXPECT_EQ(repair.status, 0) << repair.err;
  const Json repaired = Json::parse(repair.out);
  EXPECT_TRUE(std::filesystem::exists(folder_.file(std::string(repaired["kept"]))));
  EXPECT_EQ(run("world check hills.quoin").status, 0);
  EXPECT_EQ(run("render hills.quoin -o a.png --size 64x48 -q").status, 0);
}

TEST_F(ToolWorld, BacksUpAndCompacts) {
  EXPECT_EQ(run("world backup hills.quoin monday.quoin").status, 0);
  EXPECT_EQ(run("world check monday.quoin").status, 0);
  const ToolRun again = run("world backup hills.quoin monday.quoin");
  EXPECT_EQ(again.status, 1);
  EXPECT_NE(again.err.find("file already exists"), std::string::npos) << again.err;
  EXPECT_EQ(run("world compact hills.quoin").status, 0);
  EXPECT_EQ(run("world check hills.quoin").status, 0);
  auto writer = WorldStore::open(folder_.file("hills.quoin"), WorldAccess::Write);
  ASSERT_TRUE(writer);
  const ToolRun refused = run("world compact hills.quoin");
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("it is already open for writing"), std::string::npos) << refused.err;
  EXPECT_EQ(run("world backup hills.quoin tuesday.quoin").status, 0) << "while it is written";
}

TEST_F(ToolWorld, WritesThumbnail) {
  EXPECT_GT(Json::parse(run("world info hills.quoin --json").out)["thumbnail_bytes"], 1000);
  ASSERT_EQ(run("world thumbnail hills.quoin hills.png -q").status, 0);
  EXPECT_EQ(text_of(folder_.file("hills.png")).substr(1, 3), "PNG");
  // It equals the image of `quoin thumbnail`.
  ASSERT_EQ(run("thumbnail hills.quoin drawn.png -q").status, 0);
  EXPECT_TRUE(text_of(folder_.file("hills.png")) == text_of(folder_.file("drawn.png")));
  ASSERT_TRUE(WorldStore::create(folder_.file("bare.quoin")));
  const ToolRun none = run("world thumbnail bare.quoin none.png");
  EXPECT_EQ(none.status, 1);
  EXPECT_NE(none.err.find("the world has no thumbnail"), std::string::npos) << none.err;
  EXPECT_FALSE(std::filesystem::exists(folder_.file("none.png")));
  EXPECT_EQ(run("world thumbnail hills.quoin hills.quoin").status, 1);
}

TEST_F(ToolWorld, ConvertingKeepsEverything) {
  {
    auto world = WorldStore::open(folder_.file("hills.quoin"), WorldAccess::Write);
    WorldChanges changes;
    changes.put_value("inventory", {std::byte{7}});
    changes.put_chunk({0, 2, {0, 0, 0}}, {Chunk(1)});
    ASSERT_TRUE(world->save(std::move(changes)));
    ASSERT_TRUE(world->flush());
  }
  const ToolRun done = run("convert hills.quoin copy.quoin --json");
  ASSERT_EQ(done.status, 0) << done.err;
  EXPECT_EQ(Json::parse(done.out)["voxels"], Json::parse(run("info hills.quoin --json").out)["voxels"]);
  const auto copy = WorldStore::open(folder_.file("copy.quoin"), WorldAccess::Read);
  EXPECT_EQ((**copy->value("inventory")).size(), 1U);
  EXPECT_TRUE((*copy->load_chunk({0, 2, {0, 0, 0}})).has_value());
  EXPECT_EQ(run("convert hills.quoin copy.quoin -q").status, 1) << "not without --force";
  EXPECT_EQ(run("convert hills.quoin copy.quoin --force -q").status, 0);
  damage("copy.quoin");
  const ToolRun damaged = run("convert copy.quoin other.quoin");
  EXPECT_NE(damaged.err, "");
}

TEST_F(ToolWorld, MeshesMatchSceneInMemory) {
  ASSERT_EQ(run("convert hills.quoin hills.json -q").status, 0);
  for (const std::string options : {"", "--mesher culled", "--no-ao", "--watertight"}) {
    for (const std::string ending : {"glb", "ply"}) {
      if (!options.empty() && ending == "ply" && !is_nightly()) continue;
      ASSERT_EQ(run(std::string("convert hills.quoin a.").append(ending).append(" -q ").append(options)).status, 0);
      ASSERT_EQ(run(std::string("convert hills.json b.").append(ending).append(" -q ").append(options)).status, 0);
      EXPECT_TRUE(text_of(folder_.file("a." + ending)) == text_of(folder_.file("b." + ending))) << options;
    }
  }
  const Json by_chunks = Json::parse(run("convert hills.quoin a.glb --json").out);
  const Json whole = Json::parse(run("convert hills.json b.glb --json").out);
  for (const char* key : {"voxels", "faces_visible", "faces_total", "quads", "triangles", "vertices", "warnings"}) {
    EXPECT_EQ(by_chunks[key], whole[key]) << key;
  }
  EXPECT_EQ(run("convert hills.quoin smooth.glb --mesher smooth -q").status, 0);
}

TEST_F(ToolWorld, ReportsInsufficientMemoryBeforeLoading) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers take more addresses than the limit";
#endif
  {
    // Chunks of 256 types take 400 MB in memory and few bytes on disk.
    auto world = WorldStore::create(folder_.file("large.quoin"));
    WorldChanges changes;
    VoxelRegistry types;
    for (int i = 0; i < 255; ++i) {
      VoxelProperties type;
      type.name = "t" + std::to_string(i);
      (void)types.add(std::move(type));
    }
    changes.put_types(types);
    changes.put_grid(0, {});
    Chunk chunk(kAir);
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; x += 4) {
        for (int z = 0; z < 64; z += 4) chunk.set({x, y, z}, static_cast<VoxelType>(1 + (x + y * 4 + z) % 255));
      }
    }
    ASSERT_GT(chunk.bytes(), 100'000U);
    for (int i = 0; i < 1600; ++i) changes.put_chunk({0, 0, {i, 0, 0}}, {chunk});
    ASSERT_TRUE(world->save(std::move(changes)));
    ASSERT_TRUE(world->flush());
  }
  const ToolRun refused = shell("ulimit -v 400000; '" QUOIN_TOOL "' convert large.quoin large.json");
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("loading the whole world needs about"), std::string::npos) << refused.err;
  EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
  const ToolRun copied = shell("ulimit -v 400000; '" QUOIN_TOOL "' convert large.quoin copy.quoin -q");
  EXPECT_EQ(copied.status, 0) << copied.err;
}

TEST_F(ToolWorld, ImportsHeightsOnRequest) {
  const std::string image = "'" QUOIN_SOURCE_DIR "/tests/corpus/heights/grey_8_bits.png'";
  const ToolRun refused = run("convert " + image + " fuji.quoin");
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("--heights grey, mapbox or terrarium"), std::string::npos) << refused.err;
  EXPECT_EQ(run("convert " + image + " fuji.quoin --heights blue").status, 2);
  EXPECT_EQ(run("convert " + image + " fuji.quoin --heights grey --metres-per-pixel 0").status, 2);
  const ToolRun made =
      run("convert " + image + " fuji.quoin --heights grey --metres-per-level 0.1 --metres-per-pixel 2 -q --json");
  ASSERT_EQ(made.status, 0) << made.err;
  // Levels of 0, 100, 255, 7, 8 and 9 tenths of a metre, in voxels of two metres, above eight voxels of ground.
  EXPECT_EQ(Json::parse(made.out)["voxels"], 6 * 8 + 5 + 13);
  const ToolRun smooth = run("info " + image + " --heights grey --metres-per-pixel 2 --smooth-ground --json");
  ASSERT_EQ(smooth.status, 0) << smooth.err;
  EXPECT_EQ(Json::parse(smooth.out)["voxels"], 0);
}

TEST_F(ToolWorld, RefusesInvalidWorldsInOneLine) {
  std::ofstream(folder_.file("text.quoin")) << "hello";
  std::ofstream(folder_.file("empty.quoin")) << "";
  for (const char* name : {"text.quoin", "empty.quoin", "none.quoin", "."}) {
    for (const char* command : {"info", "check", "repair", "compact"}) {
      const ToolRun result = run("world " + std::string(command) + " " + name);
      EXPECT_EQ(result.status, 1) << command << " " << name;
      EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    }
  }
  EXPECT_EQ(run("world").status, 2);
  EXPECT_EQ(run("world check").status, 2);
}

}  // namespace

}  // namespace quoin
