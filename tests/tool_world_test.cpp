#include <nlohmann/json.hpp>
#include <string>

#include <quoin/io/formats.h>
#include <quoin/store/world_store.h>

#include "tests/tool_for_tests.h"

namespace quoin {

namespace {

using Json = nlohmann::json;

class ToolWorld : public ToolTest {
 protected:
  void SetUp() override {
    ToolTest::SetUp();
    const ToolRun made = run("generate terrain hills.quoin --chunks 4x4x4 -q");
    if (made.err.find("no worlds on disk") != std::string::npos) GTEST_SKIP() << made.err;
    ASSERT_EQ(made.status, 0) << made.err;
  }
  /// Turns 100 bytes in the middle of a file.
  void damage(const char* name) {
    std::string bytes = text_of(folder_.file(name));
    for (std::size_t i = bytes.size() / 2; i < bytes.size() / 2 + 100; ++i) bytes[i] = static_cast<char>(~bytes[i]);
    std::ofstream(folder_.file(name), std::ios::binary) << bytes;
  }
};

TEST_F(ToolWorld, AWorldIsAFileLikeAnyOther) {
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

TEST_F(ToolWorld, InfoSaysWhatThereIs) {
  const ToolRun text = run("world info hills.quoin");
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_NE(text.out.find("a world of version 1"), std::string::npos) << text.out;
  const Json json = Json::parse(run("world info hills.quoin --json").out);
  EXPECT_EQ(json["bytes"], std::filesystem::file_size(folder_.file("hills.quoin")));
  EXPECT_EQ(json["grids"].size(), 1U);
  EXPECT_GT(json["grids"][0]["chunks"], 0);
  EXPECT_EQ(json["grids"][0]["chunk_bounds"]["max"], Json({2, 2, 2}));
}

TEST_F(ToolWorld, DamageIsToldAndRepaired) {
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

TEST_F(ToolWorld, BackupAndCompact) {
  EXPECT_EQ(run("world backup hills.quoin monday.quoin").status, 0);
  EXPECT_EQ(run("world check monday.quoin").status, 0);
  const ToolRun again = run("world backup hills.quoin monday.quoin");
  EXPECT_EQ(again.status, 1);
  EXPECT_NE(again.err.find("there is a file of that name"), std::string::npos) << again.err;
  EXPECT_EQ(run("world compact hills.quoin").status, 0);
  EXPECT_EQ(run("world check hills.quoin").status, 0);
  auto writer = WorldStore::open(folder_.file("hills.quoin"), WorldAccess::Write);
  ASSERT_TRUE(writer);
  const ToolRun refused = run("world compact hills.quoin");
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("another program is writing it"), std::string::npos) << refused.err;
  EXPECT_EQ(run("world backup hills.quoin tuesday.quoin").status, 0) << "while it is written";
}

TEST_F(ToolWorld, WhatIsNoWorldIsRefusedInOneLine) {
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
