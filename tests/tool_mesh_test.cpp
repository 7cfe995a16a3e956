// Reads triangle meshes and writes files for 3D printers.

#include <fstream>
#include <string>

#include <nlohmann/json.hpp>
#include <quoin/io/formats.h>

#include "tests/tool_for_tests.h"

namespace quoin {

namespace {

using Json = nlohmann::json;

/// Returns a text STL of a box of 2 x 1 x 1, open at its top.
std::string open_box() {
  const char* const corners[] = {"0 0 0", "2 0 0", "2 1 0", "0 1 0", "0 0 1", "2 0 1", "2 1 1", "0 1 1"};
  const int faces[10][3] = {{0, 2, 1}, {0, 3, 2}, {0, 1, 5}, {0, 5, 4}, {1, 2, 6},
                            {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};
  std::string text = "solid box\n";
  for (const auto& face : faces) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const int corner : face) text += std::string("vertex ") + corners[corner] + "\n";
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid box\n";
}

class ToolMesh : public ToolTest {
 protected:
  void SetUp() override {
    ToolTest::SetUp();
    std::ofstream(folder_.file("box.stl"), std::ios::binary) << open_box();
  }
  Json converted(const std::string& arguments) {
    const ToolRun result = run("convert box.stl " + arguments + " --json");
    EXPECT_EQ(result.status, 0) << result.err;
    return result.status == 0 ? Json::parse(result.out) : Json();
  }
};

TEST_F(ToolMesh, VoxelizesAtAnySize) {
  EXPECT_EQ(converted("a.json --size 40 --solid")["voxels"], 40 * 20 * 20);
  EXPECT_EQ(converted("b.json --voxel 0.1 --solid")["voxels"], 20 * 10 * 10);
  EXPECT_EQ(converted("c.json --size 40")["warnings"].size(), 0U);
  const Json reported = converted("d.json");
  ASSERT_EQ(reported["warnings"].size(), 1U);
  EXPECT_NE(reported["warnings"][0].get<std::string>().find("128 voxels"), std::string::npos);
  const Json thin = converted("e.json --size 40 --surface");
  const Json thick = converted("f.json --size 40 --surface --separating 26");
  EXPECT_LE(thin["voxels"], thick["voxels"]);
  EXPECT_GT(converted("g.json --size 40 --field")["solid_samples"], 10'000);
  const Json info = Json::parse(run("info a.json --json").out);
  EXPECT_EQ(info["grids"][0]["name"], "box");
}

TEST_F(ToolMesh, ChecksTriangleOptions) {
  for (const std::string arguments :
       {"convert box.stl a.json --size 10 --voxel 1", "convert box.stl a.json --solid --surface",
        "convert box.stl a.json --field --surface", "convert box.stl a.json --band 3",
        "convert box.stl a.json --size 0", "convert tiny.vox a.json --size 10", "convert box.stl a.glb --voxel-mm 2",
        "convert box.stl a.stl --voxel-mm 2 --scale 3"}) {
    const ToolRun result = run(arguments);
    EXPECT_EQ(result.status, 2) << arguments << result.err;
    EXPECT_FALSE(exists("a.json"));
  }
}

TEST_F(ToolMesh, WritesVoxAtUnitSize) {
  const ToolRun result = run("convert box.stl box.vox --size 20");
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_NE(result.err.find("stores no voxel size"), std::string::npos);
  EXPECT_EQ(Json::parse(run("info box.vox --json").out)["voxels"], 20 * 10 * 10);
}

TEST_F(ToolMesh, ClosesMeshesForPrinting) {
  std::ofstream(folder_.file("checker.vox"), std::ios::binary) << checkerboard_vox(4);
  for (const std::string out : {"a.stl", "a.3mf", "b.stl --mesher smooth", "b.3mf --mesher smooth"}) {
    const ToolRun result = run("convert checker.vox " + out + " --voxel-mm 2 --json");
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(Json::parse(result.out)["warnings"].size(), 0U) << result.out;
  }
  // Reading it again gives the same volume: 32 voxels of 2 mm.
  const Json again = Json::parse(run("info a.stl --json").out);
  EXPECT_EQ(again["format"], "stl");
  const Json& bounds = again["bounds"];
  EXPECT_NEAR(bounds["max"][0].get<double>() - bounds["min"][0].get<double>(), 8.0, 0.1);
  // An existing mesh is an output, replaced without --force.
  EXPECT_EQ(run("convert tiny.vox a.stl").status, 0);
}

TEST_F(ToolMesh, WritesOrNamesTexturesOfTypes) {
  const AlphaImage image{16, 16, std::vector<std::uint8_t>(std::size_t{4} * 16 * 16, 255)};
  Scene scene;
  const VoxelType snow = scene.types.add({.name = "snow", .faces = Texture::from_image("snow", image).value()}).value();
  SceneGrid grid;
  grid.grid.fill_box({{0, 0, 0}, {3, 1, 1}}, snow);
  scene.add_instance({.grid = scene.add_grid(std::move(grid))});
  ASSERT_TRUE(save_scene(scene, folder_.file("snow.json")));
  const auto report = [&](const std::string& rest) {
    const ToolRun result = run("convert snow.json --json " + rest);
    EXPECT_EQ(result.status, 0) << result.err;
    return Json::parse(result.out);
  };
  EXPECT_EQ(report("a.glb")["warnings"], Json::array());
  EXPECT_EQ(report("a.obj")["warnings"], Json::array());
  EXPECT_EQ(report("a.ply")["warnings"], Json::array({"textures of types left out: 1"}));
  // In an atlas, faces are not merged.
  EXPECT_EQ(report("a.glb")["quads"], 6);
  const Json atlas = report("a.glb --texture atlas");
  EXPECT_EQ(atlas["quads"], 14);
  EXPECT_EQ(atlas["warnings"], Json::array());
  EXPECT_EQ(report("a.obj --texture atlas")["files"], Json({"a.obj", "a.mtl", "a_palette.png", "a_texture_1.png"}));
}

}  // namespace

}  // namespace quoin
