#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <glm/common.hpp>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <quoin/io/file.h>
#include <quoin/io/formats.h>

#include "io/vox/vox_for_tests.h"
#include "tests/tool_for_tests.h"

namespace quoin {

namespace {

using Json = nlohmann::json;

class Tool : public ToolTest {};

TEST_F(Tool, InfoDescribesFile) {
  const ToolRun text = run("info tiny.vox");
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_NE(text.out.find("Voxels: 4 of 2 types\nFaces: 18 visible of 24 total\n"), std::string::npos) << text.out;
  const ToolRun json = run("info tiny.vox --json");
  ASSERT_EQ(json.status, 0) << json.err;
  const Json object = Json::parse(json.out);
  EXPECT_EQ(object["format"], "vox");
  EXPECT_EQ(object["voxels"], 4);
  EXPECT_EQ(object["types"], 2);
  EXPECT_EQ(object["faces_visible"], 18);
  EXPECT_EQ(object["faces_total"], 24);
  ASSERT_EQ(object["grids"].size(), 1U);
  EXPECT_EQ(object["grids"][0]["voxels"], 4);
  EXPECT_EQ(object["grids"][0]["size"], Json({3, 2, 4})) << "MagicaVoxel's z is up";
  const Json& instance = object["grids"][0]["instances"][0];
  EXPECT_EQ(instance["rotation"], Json({0.0, 0.0, 0.0, 1.0}));
  EXPECT_EQ(instance["scale"], Json({1.0, 1.0, 1.0}));
  EXPECT_EQ(instance["position"].size(), 3U);
  for (int axis = 0; axis < 3; ++axis) {
    const double size = object["bounds"]["max"][axis].get<double>() - object["bounds"]["min"][axis].get<double>();
    EXPECT_EQ(size, (std::array{3.0, 2.0, 1.0})[static_cast<std::size_t>(axis)]);
  }
  EXPECT_EQ(object["warnings"], Json::array());
}

TEST_F(Tool, ReportsVoxelDataAndItsLoss) {
  Scene scene;
  const auto stairs = scene.types.add({.name = "stairs", .colour = {150, 110, 70, 255}, .state_bits = 2});
  ASSERT_TRUE(stairs);
  SceneGrid model;
  model.grid.set({1, 0, 0}, *stairs, {.state = 3});
  model.grid.set({2, 0, 0}, *stairs);
  scene.add_instance({.name = "", .grid = scene.add_grid(std::move(model))});
  ASSERT_TRUE(save_scene(scene, folder_.file("data.json")));
  const ToolRun text = run("info data.json");
  EXPECT_NE(text.out.find("Data: at 1 voxel\n"), std::string::npos) << text.out;
  const Json object = Json::parse(run("info data.json --json").out);
  EXPECT_EQ(object["voxels_with_data"], 1);
  EXPECT_EQ(object["grids"][0]["voxels_with_data"], 1);
  EXPECT_NE(run("convert data.json out.glb").err.find("data of voxels left out, not supported by meshes: 1"),
            std::string::npos);
  EXPECT_NE(run("convert data.json out.vox").err.find("data of voxels left out"), std::string::npos);
  EXPECT_EQ(run("convert data.json again.json").err, "");
  EXPECT_EQ(read_file(folder_.file("again.json")).value(), read_file(folder_.file("data.json")).value());
}

TEST_F(Tool, InfoDescribesVolume) {
  std::ofstream(folder_.file("a.nrrd"), std::ios::binary)
      << "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 3 1\nencoding: raw\nspacings: 0.5 1 2\n\nabcdef";
  const ToolRun text = run("info a.nrrd");
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_NE(text.out.find("Values: 2 x 3 x 1 = 6 of type uint8\nRange: 97 to 102\n"), std::string::npos) << text.out;
  const ToolRun json = run("info a.nrrd --json");
  ASSERT_EQ(json.status, 0) << json.err;
  const Json object = Json::parse(json.out);
  EXPECT_EQ(object["format"], "nrrd");
  EXPECT_EQ(object["type"], "uint8");
  EXPECT_EQ(object["size"], Json({2, 3, 1}));
  EXPECT_EQ(object["spacing"], Json({0.5, 1.0, 2.0}));
  EXPECT_EQ(object["range"], Json({97.0, 102.0}));
  EXPECT_EQ(object["warnings"], Json::array());
  std::ofstream(folder_.file("b.nrrd")) << "NRRD0004\n\n";
  const ToolRun bad = run("info b.nrrd");
  EXPECT_EQ(bad.status, 1);
  EXPECT_EQ(bad.err, "quoin: b.nrrd: byte 10: the header has no field \"dimension\"\n");
}

TEST_F(Tool, ConvertWritesEveryFormatAndCounts) {
  const ToolRun text = run("convert tiny.vox tiny.glb");
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_NE(text.out.find("Faces: 18 visible of 24 total"), std::string::npos) << text.out;
  for (const std::string name : {"tiny.glb", "tiny.gltf", "tiny.obj", "tiny.ply", "out.vox", "out.json"}) {
    const ToolRun json = run("convert tiny.vox " + name + " --json --threads 2");
    ASSERT_EQ(json.status, 0) << json.err;
    const Json object = Json::parse(json.out);
    EXPECT_EQ(object["voxels"], 4);
    EXPECT_GT(object["bytes"], 0);
    for (const char* key : {"read", "mesh", "write"}) EXPECT_GE(object["seconds"][key], 0.0);
    EXPECT_TRUE(object["warnings"].is_array());
    EXPECT_TRUE(exists(name));
    EXPECT_EQ(object["faces_visible"], 18);
    EXPECT_EQ(object["faces_total"], 24);
    if (name == "out.vox" || name == "out.json") continue;
    EXPECT_EQ(object["triangles"], 2 * object["quads"].get<int>());
    EXPECT_GT(object["vertices"], 0);
  }
}

TEST_F(Tool, SceneFileKeepsTransformsThatVoxCannotHold) {
  std::ofstream(folder_.file("turned.json")) << R"({"quoin_scene": 1, "files": [{"id": "a", "path": "tiny.vox"}],
      "instances": [{"file": "a", "name": "first", "position": [0.1, 1e9, -3]},
                    {"file": "a", "rotation": [0.1, 0.2, 0.3, 0.4], "scale": 0.45, "mirrored": true}],
      "sun": [1, 2, 3], "camera": {"position": [9, 9, 9], "look_at": [0, 0, 0], "fov": 40}})";
  const ToolRun refused = run("convert turned.json turned.vox");
  EXPECT_EQ(refused.status, 1);
  const Json before = Json::parse(run("info turned.json --json").out);
  ASSERT_EQ(run("convert turned.json whole.json").status, 0);
  std::filesystem::remove(folder_.file("tiny.vox"));
  const ToolRun info = run("info whole.json --json");
  ASSERT_EQ(info.status, 0) << info.err;
  const Json object = Json::parse(info.out);
  EXPECT_EQ(object, before);
  const Json& instances = object["grids"].at(0)["instances"];
  EXPECT_EQ(instances.at(0)["name"], "first");
  EXPECT_EQ(instances.at(1)["scale"], Json({-0.45, 0.45, 0.45}));
  ASSERT_EQ(run("convert whole.json again.json").status, 0);
  EXPECT_EQ(text_of(folder_.file("again.json")), text_of(folder_.file("whole.json")));
}

TEST_F(Tool, AtlasNeedsFewerTriangles) {
  std::string voxels;
  for (int i = 0; i < 400; ++i) {
    for (const int byte : {i % 20, i / 20, 0, 1}) voxels += static_cast<char>(byte);
    if (i % 7 == 0) {
      for (const int byte : {i % 20, i / 20, 1, 2}) voxels += static_cast<char>(byte);
    }
  }
  std::ofstream(folder_.file("floor.vox"), std::ios::binary) << vox_file({20, 20, 2}, voxels);
  const Json plain = Json::parse(run("convert floor.vox plain.glb --json").out);
  const Json baked = Json::parse(run("convert floor.vox baked.glb --texture atlas --json").out);
  EXPECT_EQ(baked["faces_visible"], plain["faces_visible"]);
  EXPECT_LT(baked["triangles"].get<int>(), plain["triangles"].get<int>() * 0.7);
  EXPECT_EQ(Json::parse(run("convert floor.vox floor.obj --texture atlas --json").out)["files"],
            Json({"floor.obj", "floor.mtl", "floor_palette.png", "floor_atlas.png"}));
  for (const std::string arguments :
       {"out.ply --texture atlas", "out.vox --texture atlas", "out.glb --texture atlas --no-ao",
        "out.glb --texture atlas --watertight", "out.glb --texture atlas --mesher smooth",
        "out.glb --texture atlas --mesher culled", "out.glb --texture atlas --ao-attribute", "out.glb --texture x"}) {
    const ToolRun refused = run("convert floor.vox " + arguments);
    EXPECT_EQ(refused.status, 2) << arguments;
    expect_one_error_line(refused);
  }
}

// A box with a hole in its lid: vertices carry the light inside, and faces are split where it changes.
TEST_F(Tool, WritesLightAtVertices) {
  std::string voxels;
  for (int i = 0; i < 20 * 20 * 6; ++i) {
    const int x = i % 20, y = i / 20 % 20, z = i / 400;
    const bool is_wall = x == 0 || x == 19 || y == 0 || y == 19 || z == 0 || z == 5;
    const bool is_hole = z == 5 && x >= 3 && x < 6 && y >= 3 && y < 6;
    if (!is_wall || is_hole) continue;
    for (const int byte : {x, y, z, 1}) voxels += static_cast<char>(byte);
  }
  std::ofstream(folder_.file("box.vox"), std::ios::binary) << vox_file({20, 20, 6}, voxels);
  const Json plain = Json::parse(run("convert box.vox plain.glb --json --light none").out);
  const Json lit = Json::parse(run("convert box.vox lit.glb --light propagated --json").out);
  EXPECT_EQ(lit["faces_visible"], plain["faces_visible"]);
  EXPECT_GT(lit["quads"].get<int>(), plain["quads"].get<int>());
  EXPECT_NE(text_of(folder_.file("lit.glb")).find("KHR_materials_unlit"), std::string::npos);
  EXPECT_EQ(text_of(folder_.file("plain.glb")).find("KHR_materials_unlit"), std::string::npos);
  EXPECT_EQ(run("convert box.vox smooth.gltf --light propagated --mesher smooth").status, 0);
  EXPECT_NE(text_of(folder_.file("smooth.gltf")).find("KHR_materials_unlit"), std::string::npos);
  for (const std::string arguments : {"out.ply --light propagated", "out.obj --light propagated",
                                      "out.vox --light propagated", "out.glb --light propagated --watertight",
                                      "out.glb --light propagated --texture atlas", "out.glb --light rays"}) {
    const ToolRun refused = run("convert box.vox " + arguments);
    EXPECT_EQ(refused.status, 2) << arguments;
    expect_one_error_line(refused);
  }
}

TEST_F(Tool, ConvertsFramesToAnimation) {
  vox_test::FileBuilder file;
  file.model(1, 1, 1, {{0, 0, 0, 1}}).model(1, 1, 2, {{0, 0, 0, 2}, {0, 0, 1, 2}});
  ASSERT_TRUE(write_file(file.file(), folder_.file("film.vox")));
  EXPECT_EQ(Json::parse(run("info film.vox --json").out)["frames"], 2);
  const ToolRun result = run("convert film.vox film.glb --animate --fps 4 --json");
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_EQ(Json::parse(result.out)["warnings"], Json::array());
  const Json glb = parse_glb(read_file(folder_.file("film.glb")).value()).document;
  ASSERT_EQ(glb["animations"].size(), 1U);
  const std::size_t times = glb["animations"][0]["samplers"][0]["input"];
  EXPECT_EQ(glb["accessors"][times]["max"], Json({0.5}));
  EXPECT_EQ(run("convert film.vox smooth.gltf --animate --mesher smooth").status, 0);
  EXPECT_NE(text_of(folder_.file("smooth.gltf")).find("\"animations\""), std::string::npos);
  const ToolRun still = run("convert tiny.vox still.glb --animate");
  EXPECT_EQ(still.status, 0);
  EXPECT_NE(still.err.find("warning: --animate has no effect"), std::string::npos) << still.err;
  for (const std::string arguments : {"out.obj --animate", "out.vox --animate", "out.glb --fps 3",
                                      "out.glb --animate --fps 0", "out.glb --animate --frame 1"}) {
    const ToolRun refused = run("convert film.vox " + arguments);
    EXPECT_EQ(refused.status, 2) << arguments;
    expect_one_error_line(refused);
  }
}

// Such a file shows no voxels; `info` should give the reason.
TEST_F(Tool, InfoReportsHiddenUnnamedLayers) {
  vox_test::FileBuilder file;
  file.model(2, 2, 2, {{0, 0, 0, 1}});
  file.transform(0, 1, {{}}, {}, -1).group(1, {2});
  file.transform(2, 3, {{}}, {}, 0).shape(3, {{0, {}}});
  file.layer(0, {{"_hidden", "1"}}).layer(1, {{"_name", "people"}});
  ASSERT_TRUE(write_file(file.file(), folder_.file("hidden.vox")));
  const ToolRun text = run("info hidden.vox");
  EXPECT_NE(text.out.find("Layers: 2: \"people\", 1 unnamed and hidden\n"), std::string::npos) << text.out;
}

// .vox to .vox keeps everything in an artist's file, including content other than voxels; other formats warn of losses.
TEST_F(Tool, VoxToVoxKeepsEverything) {
  vox_test::FileBuilder file;
  file.model(4, 4, 4, {{0, 0, 0, 1}}).model(2, 2, 2, {{0, 0, 0, 3}});
  file.transform(0, 1, {{}}, {}, -1).group(1, {2});
  file.transform(2, 3, {{}}, {{"_name", "crew"}}, 1).group(3, {4});
  file.transform(4, 5, {{}}, {{"_name", "walker"}}, 0).shape(5, {{0, {{"_f", "0"}}}, {1, {{"_f", "3"}}}});
  file.layer(0, {}).layer(1, {{"_name", "people"}});
  file.with("rCAM", [](auto& out) {
    out.i32(0);
    out.dict({});
  });
  const auto bytes = file.file();
  ASSERT_TRUE(write_file(bytes, folder_.file("crew.vox")));
  const ToolRun same = run("convert crew.vox same.vox");
  EXPECT_EQ(same.status, 0);
  EXPECT_EQ(same.err, "") << "nothing is lost";
  EXPECT_EQ(read_file(folder_.file("same.vox")).value(), bytes);
  const ToolRun still = run("convert crew.vox still.vox --frame 3");
  EXPECT_EQ(still.status, 0);
  EXPECT_NE(still.err.find("left out because of --frame: animation: frames 0 to 3"), std::string::npos);
  EXPECT_EQ(Json::parse(run("info still.vox --json").out)["voxels"], 2) << "models stay, placed or not";
  const ToolRun scene = run("convert crew.vox crew.json");
  EXPECT_NE(scene.err.find("left out, only .vox stores it: cameras: 1"), std::string::npos);
  const Json info = Json::parse(run("info crew.vox --json").out);
  EXPECT_EQ(info["groups"].at(0)["name"], "crew");
  EXPECT_EQ(info["groups"].at(0)["parent"], Json());
  EXPECT_EQ(info["groups"].at(0)["layer"], 1);
  EXPECT_EQ(info["layers"].at(1), Json({{"name", "people"}, {"visible", true}}));
  EXPECT_EQ(info["kept"], Json({"animation: frames 0 to 3", "cameras: 1"}));
  EXPECT_EQ(info["grids"].at(0)["instances"].at(0)["group"], 0);
  const ToolRun text = run("info crew.vox");
  EXPECT_NE(text.out.find("Groups: 1: \"crew\"\nLayers: 2: \"people\"\nKept when saved as .vox: animation"),
            std::string::npos)
      << text.out;
  EXPECT_EQ(Json::parse(run("info crew.json --json").out)["groups"], info["groups"]);
}

/// Returns the bounds of an .obj file's vertices.
std::pair<DVec3, DVec3> extent_of_obj(const std::string& text) {
  std::istringstream lines(text);
  DVec3 min(1e9);
  DVec3 max(-1e9);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("v ")) continue;
    std::istringstream numbers(line.substr(2));
    DVec3 at(0.0);
    numbers >> at.x >> at.y >> at.z;
    min = glm::min(min, at);
    max = glm::max(max, at);
  }
  return {min, max};
}

TEST_F(Tool, ScalesAndTurnsMeshes) {
  ASSERT_EQ(run("convert tiny.vox plain.obj").status, 0);
  ASSERT_EQ(run("convert tiny.vox turned.obj --scale 0.25 --up z").status, 0);
  const auto [min, max] = extent_of_obj(text_of(folder_.file("plain.obj")));
  const auto [low, high] = extent_of_obj(text_of(folder_.file("turned.obj")));
  EXPECT_EQ(low, DVec3(min.x, -max.z, min.y) * 0.25);
  EXPECT_EQ(high, DVec3(max.x, -min.z, max.y) * 0.25);
  for (const std::string name : {"a.glb", "a.gltf", "a.ply"}) {
    EXPECT_EQ(run("convert tiny.vox " + name + " --scale 2 --up y").status, 0) << name;
  }
  EXPECT_EQ(run("convert tiny.vox upright.ply").status, 0);
  EXPECT_NE(read_file(folder_.file("a.ply")).value(), read_file(folder_.file("upright.ply")).value());
  for (const std::string wrong : {"--scale 0", "--scale -1", "--scale nan", "--scale x", "--up x"}) {
    EXPECT_EQ(run("convert tiny.vox b.obj " + wrong).status, 2) << wrong;
  }
  EXPECT_EQ(run("convert tiny.vox b.vox --scale 2 --force").status, 2) << "voxels have no scale";
}

TEST_F(Tool, QuietKeepsErrorsAndJson) {
  std::ofstream(folder_.file("hidden.vox"), std::ios::binary) << vox_with_hidden(1);
  const ToolRun quiet = run("convert hidden.vox a.glb -q");
  EXPECT_EQ(quiet.status, 0);
  EXPECT_EQ(quiet.out + quiet.err, "");
  EXPECT_EQ(run("render tiny.vox -o a.png --size 8x8 --quiet").out, "");
  EXPECT_EQ(run("generate terrain t.vox --chunks 1x1x1 -q").out, "");
  EXPECT_TRUE(std::filesystem::exists(folder_.file("t.vox")));
  EXPECT_EQ(Json::parse(run("convert tiny.vox b.glb -q --json").out)["voxels"], 4);
  EXPECT_NE(run("convert none.vox b.glb -q").err, "") << "errors are printed";
  EXPECT_NE(run("info tiny.vox -q").out, "") << "info prints even with -q";
}

// Completions follow the help; the test runs the available shells.
TEST_F(Tool, ShellsCompleteCommandsOptionsAndChoices) {
  const std::string script = run("completions bash").out;
  std::ofstream(folder_.file("quoin.bash")) << script;
  const auto reply = [&](const std::string& words) {
    const std::string command = "cd '" + folder_.file(".").string() +
                                "' && bash -c 'source ./quoin.bash; COMP_WORDS=(" + words +
                                "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _quoin; echo ${COMPREPLY[@]}' > reply";
    EXPECT_EQ(std::system(command.c_str()), 0);
    return text_of(folder_.file("reply"));
  };
  EXPECT_EQ(reply("quoin conv"), "convert\n");
  EXPECT_EQ(reply("quoin generate te"), "terrain\n");
  EXPECT_EQ(reply("quoin render --view le"), "left\n");
  EXPECT_EQ(reply("quoin convert a.vox b.glb --smoothn"), "--smoothness\n");
  EXPECT_EQ(reply("quoin render a.vox -o \"\""), "\n") << "files are the shell's own matter";
  for (const std::string shell : {"zsh", "fish"}) {
    std::ofstream(folder_.file("script")) << run("completions " + shell).out;
    const std::string has = "command -v " + shell + " > /dev/null";
    if (std::system(has.c_str()) != 0) continue;
    EXPECT_EQ(std::system((shell + " -n '" + folder_.file("script").string() + "'").c_str()), 0) << shell;
  }
  EXPECT_EQ(run("completions tcsh").status, 2);
}

TEST_F(Tool, ManualPageHasCommandsAndOptions) {
  const std::string page = run("man").out;
  EXPECT_TRUE(page.starts_with(".TH QUOIN 1"));
  for (const std::string what :
       {".SS quoin convert", ".SS quoin generate terrain", "\\-\\-smoothness", "EXIT STATUS"}) {
    EXPECT_NE(page.find(what), std::string::npos) << what;
  }
}

TEST_F(Tool, ReportsMissingOutputFolder) {
  std::ofstream(folder_.file("file")) << "no folder";
  for (const std::string command :
       {"convert tiny.vox none/out.glb", "convert tiny.vox none/out.gltf", "convert tiny.vox none/out.obj",
        "convert tiny.vox none/out.ply", "convert tiny.vox none/out.vox", "convert tiny.vox none/out.json",
        "render tiny.vox -o none/out.png", "generate terrain none/out.vox", "generate terrain none/out.json"}) {
    const ToolRun failed = run(command);
    EXPECT_EQ(failed.status, 1) << command;
    const std::string file = command.substr(command.find("none/"));
    EXPECT_EQ(failed.err, "quoin: " + file + ": the folder \"none\" does not exist\n") << command;
  }
  EXPECT_EQ(run("render tiny.vox -o out.png --depth none/out.pfm").err,
            "quoin: none/out.pfm: the folder \"none\" does not exist\n");
  EXPECT_EQ(run("convert tiny.vox file/out.glb").err, "quoin: file/out.glb: \"file\" is not a folder\n");
}

TEST_F(Tool, CommandsAgreeOnFaceCounts) {
  std::ofstream(folder_.file("hidden.vox"), std::ios::binary) << vox_with_hidden(2);
  std::vector<Json> counts;
  for (const std::string hidden : {"", " --hidden"}) {
    for (const std::string command : {"info hidden.vox", "convert hidden.vox a.glb", "convert hidden.vox a.vox --force",
                                      "render hidden.vox -o a.png --size 8x8"}) {
      const ToolRun json = run(std::string(command).append(" --json").append(hidden));
      ASSERT_EQ(json.status, 0) << json.err;
      const Json object = Json::parse(json.out);
      counts.push_back({object["faces_visible"], object["faces_total"]});
    }
  }
  for (std::size_t i = 0; i < counts.size(); ++i) EXPECT_EQ(counts[i], counts[i / 4 * 4]);
  EXPECT_EQ(counts[0], Json({0, 0}));
  EXPECT_EQ(counts[4], Json({18, 24}));
}

TEST_F(Tool, ConvertListsWrittenFiles) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> files_of = {
      {"a.glb", {"a.glb"}},
      {"b.vox", {"b.vox"}},
      {"b.json", {"b.json"}},
      {"c.gltf", {"c.gltf", "c.bin"}},
      {"d.obj", {"d.obj", "d.mtl", "d_palette.png"}}};
  run("--version");  // creates the files for its output
  for (const auto& [out, files] : files_of) {
    const std::size_t before = folder_.count();
    const ToolRun json = run("convert tiny.vox " + out + " --json");
    ASSERT_EQ(json.status, 0) << json.err;
    EXPECT_EQ(Json::parse(json.out)["files"], Json(files));
    const ToolRun text = run("convert tiny.vox " + out + " --force");
    std::string list = "\nWrote ";
    for (const std::string& file : files) list += file + ", ";
    EXPECT_NE(text.out.find(list), std::string::npos) << text.out;
    for (const std::string& file : files) EXPECT_TRUE(exists(file)) << file;
    EXPECT_EQ(folder_.count(), before + files.size());
  }
}

TEST_F(Tool, NeverReplacesInputWithCompanionFile) {
  for (const auto& [in, out] : std::vector<std::array<std::string, 2>>{
           {"foo.bin", "foo.gltf"}, {"foo.mtl", "foo.obj"}, {"foo_palette.png", "foo.obj"}, {"link", "castle.gltf"}}) {
    std::ofstream(folder_.file(in == "link" ? "castle.bin" : in), std::ios::binary) << tiny_vox();
    if (in == "link") std::filesystem::create_symlink("castle.bin", folder_.file(in));
    const ToolRun result = run(std::string("convert ").append(in).append(" ").append(out));
    EXPECT_EQ(result.status, 1) << in;
    expect_one_error_line(result);
    EXPECT_EQ(text_of(folder_.file(in)), tiny_vox()) << in;
    EXPECT_FALSE(exists(out));
  }
  EXPECT_FALSE(exists("foo.obj"));
  std::ofstream(folder_.file("castle.png")) << "an image";
  ASSERT_EQ(run("convert tiny.vox castle.obj").status, 0);
  EXPECT_EQ(text_of(folder_.file("castle.png")), "an image") << "an unrelated image of the same name is kept";
}

TEST_F(Tool, WarnsOnlyIfHiddenInstancesAreLeftOut) {
  const auto warnings = [&](const std::string& arguments) {
    const ToolRun result = run(arguments + " --json");
    EXPECT_EQ(result.status, 0) << result.err;
    return Json::parse(result.out)["warnings"];
  };
  std::ofstream(folder_.file("one.vox"), std::ios::binary) << vox_with_hidden(1);
  std::ofstream(folder_.file("two.vox"), std::ios::binary) << vox_with_hidden(2);
  EXPECT_EQ(warnings("info one.vox"), Json::array());
  EXPECT_EQ(warnings("convert one.vox out.vox"), Json::array());
  EXPECT_EQ(warnings("convert one.vox out.glb --hidden"), Json::array());
  EXPECT_EQ(warnings("convert one.vox out.glb"), Json({"1 hidden instance left out; --hidden includes it"}));
  EXPECT_EQ(warnings("convert two.vox out.obj"),
            Json({"2 hidden instances left out; --hidden includes them", "the mesh is empty"}));
  EXPECT_EQ(warnings("convert two.vox none.gltf"), warnings("convert two.vox out.obj"));
  EXPECT_FALSE(exists("none.bin"));
  EXPECT_EQ(run("convert one.vox out.glb").err, "quoin: warning: 1 hidden instance left out; --hidden includes it\n");
}

TEST_F(Tool, GreedyMesherNeedsFewerQuadsThanCulled) {
  const auto quads = [&](const std::string& flags) {
    const ToolRun result = run("convert tiny.vox out.glb --json " + flags);
    return Json::parse(result.out)["quads"].get<int>();
  };
  EXPECT_EQ(quads("--mesher culled"), 18);
  EXPECT_LT(quads("--mesher greedy"), 18);
  EXPECT_LT(quads("--no-ao"), 18);
}

TEST_F(Tool, AcceptsMoreThreadsThanProcessors) {
  const ToolRun result = run("convert tiny.vox out.glb --threads 1000");
  EXPECT_EQ(result.status, 0);
  EXPECT_EQ(result.err, "");
}

TEST_F(Tool, NeverReplacesInputs) {
  std::filesystem::create_symlink("tiny.vox", folder_.file("link.vox"));
  std::ofstream(folder_.file("other.vox"), std::ios::binary) << tiny_vox();
  for (const std::string arguments : {"tiny.vox tiny.vox", "tiny.vox ./tiny.vox --force", "tiny.vox link.vox --force",
                                      "tiny.vox other.vox --to vox", "tiny.vox --to vox --out-dir . --force"}) {
    const ToolRun result = run("convert " + arguments);
    EXPECT_EQ(result.status, 1) << arguments;
    EXPECT_NE(result.err.find(": it is an input file"), std::string::npos) << result.err;
    EXPECT_EQ(text_of(folder_.file("tiny.vox")), tiny_vox()) << arguments;
  }
}

TEST_F(Tool, ReplacesModelsOnlyWithForce) {
  const std::string large = checkerboard_vox(6);
  std::ofstream(folder_.file("other.vox"), std::ios::binary) << large;
  std::ofstream(folder_.file("misnamed.glb"), std::ios::binary) << large;
  for (const std::string command :
       {"convert tiny.vox other.vox", "convert tiny.vox misnamed.glb", "generate terrain other.vox --chunks 1x1x1",
        "convert tiny.vox --to glb --out-dir ."}) {
    if (command.ends_with(".")) std::ofstream(folder_.file("tiny.glb"), std::ios::binary) << large;
    const ToolRun result = run(command);
    EXPECT_EQ(result.status, 1) << command;
    EXPECT_NE(result.err.find(": the file exists; use --force to overwrite it"), std::string::npos) << result.err;
    EXPECT_EQ(text_of(folder_.file("other.vox")), large);
    EXPECT_EQ(text_of(folder_.file("misnamed.glb")), large);
  }
  // This also holds for files that are written next to OUT.
  std::ofstream(folder_.file("scene.bin"), std::ios::binary) << large;
  EXPECT_EQ(run("convert tiny.vox scene.gltf").status, 1);
  EXPECT_EQ(text_of(folder_.file("scene.bin")), large);
  EXPECT_FALSE(exists("scene.gltf"));
  EXPECT_EQ(run("convert tiny.vox other.vox --force").status, 0);
  EXPECT_NE(text_of(folder_.file("other.vox")), large);
  EXPECT_EQ(run("generate terrain other.vox --chunks 1x1x1 --force").status, 0);
  // Outputs that hold no model are replaced without --force.
  EXPECT_EQ(run("convert tiny.vox mesh.glb").status, 0);
  EXPECT_EQ(run("convert tiny.vox mesh.glb").status, 0);
}

TEST_F(Tool, ConvertsManyFilesAndListsFailuresLast) {
  std::filesystem::create_directories(folder_.file("models/deep"));
  std::ofstream(folder_.file("models/one.vox"), std::ios::binary) << tiny_vox();
  std::ofstream(folder_.file("models/deep/two.VOX"), std::ios::binary) << tiny_vox();
  std::ofstream(folder_.file("models/deep/broken.vox"), std::ios::binary) << tiny_vox().substr(0, 40);
  std::ofstream(folder_.file("models/notes.txt")) << "not a model";
  const ToolRun text = run("convert tiny.vox models missing.vox --to glb --out-dir out --recursive");
  EXPECT_EQ(text.status, 1);
  EXPECT_NE(text.out.find("Converted 3 of 5"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("models/deep/two.VOX -> out/deep/two.glb"), std::string::npos) << text.out;
  EXPECT_EQ(std::count(text.err.begin(), text.err.end(), '\n'), 2) << text.err;
  EXPECT_NE(text.err.find("quoin: models/deep/broken.vox: "), std::string::npos) << text.err;
  EXPECT_NE(text.err.find("quoin: missing.vox: "), std::string::npos) << text.err;
  for (const std::string name : {"out/tiny.glb", "out/one.glb", "out/deep/two.glb"}) EXPECT_TRUE(exists(name)) << name;
  ASSERT_EQ(run("convert tiny.vox alone.glb").status, 0);
  EXPECT_EQ(text_of(folder_.file("out/tiny.glb")), text_of(folder_.file("alone.glb")));

  const ToolRun json = run("convert tiny.vox models/one.vox missing.vox --to ply --json");
  EXPECT_EQ(json.status, 1);
  const Json object = Json::parse(json.out);
  EXPECT_EQ(object["converted"].size(), 2U);
  EXPECT_EQ(object["converted"][1]["input"], "models/one.vox");
  EXPECT_EQ(object["converted"][1]["files"], Json({"models/one.ply"}));
  EXPECT_EQ(object["converted"][1]["voxels"], 4);
  ASSERT_EQ(object["failed"].size(), 1U);
  EXPECT_EQ(object["failed"][0]["input"], "missing.vox");
}

TEST_F(Tool, KeepsOutputsOfManyFilesApart) {
  std::filesystem::create_directories(folder_.file("a"));
  std::ofstream(folder_.file("a/tiny.vox"), std::ios::binary) << tiny_vox();
  const ToolRun both = run("convert tiny.vox a/tiny.vox --to glb --out-dir out");
  EXPECT_EQ(both.status, 2);
  EXPECT_EQ(both.err, "quoin: tiny.vox and a/tiny.vox would both be written to out/tiny.glb\n");
  EXPECT_FALSE(exists("out"));
  // The names of the input folders make no difference.
  std::filesystem::create_symlink("a", folder_.file("b"));
  std::ofstream(folder_.file("a/tiny.json")) << "{}";
  const ToolRun refused = run("convert a/tiny.vox b/tiny.json --to glb");
  EXPECT_EQ(refused.status, 2);
  EXPECT_EQ(refused.err, "quoin: a/tiny.vox and b/tiny.json would both be written to b/tiny.glb\n");
  std::filesystem::remove(folder_.file("a/tiny.json"));
  // Output of an earlier run below a folder is not an input of the next run.
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(run("convert a --to vox --recursive --out-dir a/out --force").status, 0);
    EXPECT_FALSE(exists("a/out/out"));
  }
  // A file named twice counts once.
  EXPECT_EQ(run("convert tiny.vox ./tiny.vox --to glb --out-dir out").status, 0);
  EXPECT_EQ(run("convert a --to glb").err, "quoin: a: is a folder; use --recursive to convert the files in it\n");
  std::filesystem::create_directories(folder_.file("empty"));
  EXPECT_EQ(run("convert empty --to glb --recursive").err, "quoin: empty: the folder has no readable files\n");
}

TEST_F(Tool, InfoAndRenderReadStandardInput) {
  const ToolRun info = shell("'" QUOIN_TOOL "' info - < tiny.vox");
  EXPECT_EQ(info.status, 0);
  EXPECT_TRUE(info.out.starts_with("standard input: vox, ")) << info.out;
  const std::string named = run("info tiny.vox").out;
  EXPECT_EQ(info.out.substr(info.out.find(':')), named.substr(named.find(':')));
  EXPECT_EQ(shell("'" QUOIN_TOOL "' info - --json < tiny.vox").out, run("info tiny.vox --json").out);
  ASSERT_EQ(run("render tiny.vox -o named.png --size 32x24").status, 0);
  EXPECT_EQ(shell("'" QUOIN_TOOL "' render - -o streamed.png --size 32x24 < tiny.vox").status, 0);
  EXPECT_EQ(text_of(folder_.file("streamed.png")), text_of(folder_.file("named.png")));
  for (const char* command : {"info -", "render - -o none.png"}) {
    const ToolRun result = shell("'" QUOIN_TOOL "' " + std::string(command) + " < named.png");
    EXPECT_EQ(result.status, 1);
    EXPECT_TRUE(result.err.starts_with("quoin: standard input: an image, not a voxel file")) << result.err;
    EXPECT_FALSE(exists("none.png"));
  }
}

TEST_F(Tool, ListsAndSelectsDimensions) {
  const std::string world = QUOIN_SOURCE_DIR "/tests/corpus/cases/minecraft-26.1-layout";
  const Json all = Json::parse(run("info '" + world + "' --json").out);
  EXPECT_EQ(all["dimension"], "minecraft:overworld");
  EXPECT_EQ(all["dimensions"], Json({"minecraft:overworld", "minecraft:the_nether"}));
  const ToolRun text = run("info '" + world + "' --dimension nether");
  EXPECT_NE(text.out.find("Dimension: minecraft:the_nether (select another with --dimension: minecraft:overworld)\n"),
            std::string::npos)
      << text.out;
  for (const char* command : {"convert 'W' nether.glb", "convert 'W' nether.quoin",
                              "render 'W' -o nether.png --size 64x64", "thumbnail 'W' small.png"}) {
    std::string line = command;
    line.replace(line.find('W'), 1, world);
    const ToolRun missing = run(line + " --dimension end");
    EXPECT_EQ(missing.status, 1) << command;
    expect_one_error_line(missing);
    EXPECT_NE(missing.err.find("cannot read the dimension minecraft:the_end"), std::string::npos) << missing.err;
    EXPECT_EQ(run(line + " --dimension nether").status, 0) << command;
  }
  const ToolRun none = run("info tiny.vox --dimension nether");
  EXPECT_EQ(none.status, 1);
  EXPECT_EQ(Json::parse(run("info tiny.vox --json").out)["dimension"], Json());
  EXPECT_NE(none.err.find("tiny.vox: cannot select a dimension"), std::string::npos) << none.err;
}

TEST_F(Tool, ReportsUnrecognisedMeshBeforeVoxelOption) {
  std::ofstream(folder_.file("broken.ply")) << "hello";
  const ToolRun result = run("convert broken.ply out.vox --voxel 1");
  EXPECT_EQ(result.status, 1);
  expect_one_error_line(result);
  EXPECT_NE(result.err.find("broken.ply: its name ends in .ply, but its content is not ply"), std::string::npos)
      << result.err;
  const ToolRun misuse = run("convert tiny.vox out.qb --voxel 1");
  EXPECT_EQ(misuse.status, 2);
  EXPECT_NE(misuse.err.find("cannot use --voxel: it needs a triangle mesh, and the input is vox"), std::string::npos);
}

TEST_F(Tool, ConvertReadsAndWritesStandardStreams) {
  ASSERT_EQ(run("convert tiny.vox tiny.ply").status, 0);
  std::ofstream(folder_.file("nothing.txt")) << "of no format";
  const ToolRun through = shell("'" QUOIN_TOOL "' convert - - --to ply < tiny.vox > streamed.ply");
  EXPECT_EQ(through.status, 0);
  EXPECT_EQ(through.err, "");
  EXPECT_EQ(text_of(folder_.file("streamed.ply")), text_of(folder_.file("tiny.ply")));
  // Models without a name get the file's name; standard input has none.
  ASSERT_EQ(run("convert tiny.vox tiny.glb").status, 0);
  EXPECT_EQ(shell("'" QUOIN_TOOL "' convert - - --to glb < tiny.vox > streamed.glb").status, 0);
  const auto node_in = [&](const char* name) {
    return parse_glb(read_file(folder_.file(name)).value()).document["nodes"][0];
  };
  EXPECT_EQ(node_in("tiny.glb")["name"], "tiny");
  EXPECT_FALSE(node_in("streamed.glb").contains("name"));
  EXPECT_EQ(shell("'" QUOIN_TOOL "' convert - named.glb --from vox < tiny.vox").status, 0);
  for (const auto& [arguments, error] : std::vector<std::array<std::string, 2>>{
           {"convert - x.glb --from nifti < tiny.vox", "quoin: standard input: the format is vox, not nifti\n"},
           {"convert - x.glb < nothing.txt", "quoin: standard input: unknown file format; readable are .3mf"},
           {"convert tiny.vox -", "quoin: writing to standard output needs --to FORMAT"},
           {"convert tiny.vox - --to obj",
            "quoin: cannot write .obj to standard output: it consists of several files (try --help)\n"},
           {"convert tiny.vox - --to glb --json", "quoin: cannot use --json: OUT is standard output (try --help)\n"},
           {"convert - --to glb", "quoin: standard input (-) must be the only input"},
           {"convert tiny.vox - --to glb > /dev/full", "quoin: standard output: No space left on device\n"}}) {
    const ToolRun result = shell("'" QUOIN_TOOL "' " + arguments);
    EXPECT_NE(result.status, 0) << arguments;
    expect_one_error_line(result);
    EXPECT_TRUE(result.err.starts_with(error)) << arguments << ": " << result.err;
    EXPECT_FALSE(exists("x.glb"));
  }
}

TEST_F(Tool, ReportsFailuresInOneLineWithoutFile) {
  std::ofstream(folder_.file("broken.vox"), std::ios::binary) << tiny_vox().substr(0, 60);
  std::ofstream(folder_.file("pointer.vox")) << "version https://git-lfs.github.com/spec/v1\noid sha256:0\n";
  std::ofstream(folder_.file("empty.vox"));
  for (const std::string name : {"broken.vox", "pointer.vox", "empty.vox", "missing.vox", "."}) {
    for (const std::string flag : {"", " --json"}) {
      const ToolRun result = run("convert " + name + " out.glb" + flag);
      EXPECT_EQ(result.status, 1) << name;
      expect_one_error_line(result);
      EXPECT_NE(result.err.find(name + ": "), std::string::npos) << result.err;
      EXPECT_FALSE(exists("out.glb"));
      EXPECT_EQ(run("info " + name + flag).status, 1);
    }
  }
  for (const std::string out : {"none/out.glb", "none/out.obj", "none/out.gltf", "none/out.vox"}) {
    const ToolRun result = run("convert tiny.vox " + out);
    EXPECT_EQ(result.status, 1) << out;
    expect_one_error_line(result);
  }
}

TEST_F(Tool, ReportsFullDiskInOneLineWithoutFile) {
  // A file system of 16 KiB, mounted only for these commands; the filler leaves one page free.
  const std::string in_small_disk =
      "unshare -rm sh -c \"mkdir -p disk && mount -t tmpfs -o size=16k none disk && "
      "head -c 12288 /dev/zero > disk/filler && ";
  const std::string probe = "cd '" + folder_.file("").string() + "' && " + in_small_disk + "true\" 2> probe.txt";
  if (std::system(probe.c_str()) != 0) GTEST_SKIP() << "a small file system cannot be mounted here";
  std::ofstream(folder_.file("large.vox"), std::ios::binary) << checkerboard_vox();
  for (const std::string out : {"out.glb", "out.gltf", "out.obj", "out.vox"}) {
    const std::string command = "cd '" + folder_.file("").string() + "' && " + in_small_disk +
                                "'" QUOIN_TOOL "' convert large.vox disk/" + out +
                                " 2> stderr.txt; echo \\$? > status.txt; ls -A disk > left.txt\" > stdout.txt";
    ASSERT_EQ(std::system(command.c_str()), 0);
    EXPECT_EQ(text_of(folder_.file("status.txt")), "1\n") << out;
    EXPECT_EQ(text_of(folder_.file("left.txt")), "filler\n") << out;
    const std::string error = text_of(folder_.file("stderr.txt"));
    EXPECT_TRUE(error.starts_with("quoin: disk/")) << error;
    EXPECT_NE(error.find("No space left"), std::string::npos) << error;
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << error;
  }
}

TEST_F(Tool, ReportsFileSizeLimitInOneLineWithoutFile) {
  std::ofstream(folder_.file("large.vox"), std::ios::binary) << checkerboard_vox();
  for (const std::string out : {"out.glb", "out.gltf", "out.obj"}) {
    const ToolRun result = shell("ulimit -f 40; '" QUOIN_TOOL "' convert large.vox " + out);
    EXPECT_EQ(result.status, 1) << out;
    expect_one_error_line(result);
    EXPECT_TRUE(result.err.starts_with("quoin: out.")) << result.err;
  }
  EXPECT_EQ(folder_.count(), 5U) << "the two inputs, run.sh, stdout.txt and stderr.txt";
}

TEST_F(Tool, SignalsLeaveNoTemporaryFile) {
  std::ofstream(folder_.file("large.vox"), std::ios::binary) << checkerboard_vox(40);
  for (const std::string signal : {"HUP", "INT", "TERM"}) {
    // Each run ends before, during or after the signal; a few runs are interrupted while writing.
    for (int i = 0; i < 3; ++i) {
      const std::string out = signal + std::to_string(i) + ".obj";
      const ToolRun result = shell("'" QUOIN_TOOL "' convert large.vox " + out +
                                   " & while kill -0 $! && ! ls -A | grep -q quoin-; do sleep 0.01; done; sleep 0.0" +
                                   std::to_string(i * 3) + "; kill -" + signal + " $!; wait $!");
      const auto files = shell("ls -A").out;
      EXPECT_EQ(files.find(".quoin-"), std::string::npos) << files;
      EXPECT_EQ(exists(out), result.status == 0) << result.status << result.err;
    }
  }
}

TEST_F(Tool, KeepsIgnoringHangup) {
  std::ofstream(folder_.file("large.vox"), std::ios::binary) << checkerboard_vox(40);
  const ToolRun result = shell("trap '' HUP; '" QUOIN_TOOL
                               "' convert large.vox out.obj & while kill -0 $! && ! ls -A | grep -q quoin-; do sleep "
                               "0.01; done; kill -HUP $!; wait $!");
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_TRUE(exists("out.obj"));
}

TEST_F(Tool, ReturnsStatus1ForUnwritableOutput) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full here";
  for (const std::string arguments :
       {"--help", "--version", "convert --help", "info tiny.vox", "info tiny.vox --json"}) {
    const ToolRun result = run(arguments + " > /dev/full");
    EXPECT_EQ(result.status, 1) << arguments;
    expect_one_error_line(result);
  }
}

TEST_F(Tool, NamesArgumentOfWrongUsage) {
  const std::vector<std::array<std::string, 2>> errors = {
      {"info tiny.vox --frame -1", "quoin: --frame: must be 0 or more, not \"-1\""},
      {"info tiny.vox --frame x", "quoin: --frame: must be 0 or more, not \"x\""},
      {"info tiny.vox --frame 1.5", "quoin: --frame: must be 0 or more, not \"1.5\""},
      {"info tiny.vox --frame 99999999999", "quoin: --frame: too large: \"99999999999\""},
      {"convert tiny.vox out.glb --simplify -1", "quoin: --simplify: must be 0 or more, not \"-1\""},
      {"convert tiny.vox out.glb --simplify nan", "quoin: --simplify: must be 0 or more, not \"nan\""},
      {"convert tiny.vox out.glb --iso nan", "quoin: --iso: must be a number, not \"nan\""},
      {"convert tiny.vox out.glb --iso 1e39", "quoin: --iso: must be from -3.4e38"},
      {"convert tiny.vox out.glb --iso 1", "quoin: cannot use --iso: the input holds voxels"},
      {"convert tiny.vox out.glb --raw-size 1x2", "quoin: --raw-size: must be XxYxZ, as in 256x256x128, not \"1x2\""},
      {"convert tiny.vox out.glb --raw-size 0x2x2",
       "quoin: --raw-size: must be XxYxZ, as in 256x256x128, not \"0x2x2\""},
      {"convert tiny.vox out.glb --raw-size 1x2x2 --raw-type half", "quoin: --raw-type: must be uint8, int8"},
      {"convert tiny.vox out.glb --raw-size 1x1x1 --frame 2", "quoin: cannot use --hidden or --frame: the input"},
      {"convert tiny.vox out.glb --raw-order big", "quoin: --raw-order needs --raw-size"},
      {"convert tiny.vox out.glb --raw-size 1x1x1 --mesher greedy", "quoin: cannot use --mesher greedy: the input"},
      {"convert tiny.vox", "quoin: OUT is required"},
      {"convert tiny.vox a.vox b.vox", "quoin: cannot convert 3 files: several inputs need --to FORMAT"},
      {"convert tiny.vox a.glb --out-dir x", "quoin: --out-dir needs --to"},
      {"convert tiny.vox --to xyz", "quoin: --to: unknown extension; use one of .3mf"},
      {"convert tiny.vox --to vox --no-ao", "quoin: --mesher, --no-ao"},
      {"", "quoin: missing command; use one of: info, convert"},
      {"bogus", "quoin: unknown command \"bogus\"; use one of: info, convert"},
      {"bogus tiny.vox", "quoin: unknown command \"bogus\"; use one of: info, convert"},
      {"info -dash.vox", "quoin: unknown option \"-dash.vox\"; for a file with this name use ./-dash.vox"},
      {"convert -dash.vox out.glb", "quoin: unknown option \"-dash.vox\"; for a file with this name use ./-dash.vox"},
      {"info tiny.vox --unknown", "quoin: unknown option \"--unknown\""},
      {"--unknown", "quoin: unknown option \"--unknown\""},
      {"info ''", "quoin: IN: must be a file name, not \"\""},
      {"convert tiny.vox ''", "quoin: OUT: must be a file name, not \"\""}};
  for (const auto& [arguments, error] : errors) {
    const ToolRun result = run(arguments);
    EXPECT_EQ(result.status, 2) << arguments;
    expect_one_error_line(result);
    EXPECT_TRUE(result.err.starts_with(error)) << arguments << ": " << result.err;
  }
}

/// Counts how often any process opens a file, from now on.
class OpenCounter {
 public:
  explicit OpenCounter(const std::filesystem::path& file) : events_(::inotify_init1(IN_NONBLOCK | IN_CLOEXEC)) {
    // With the other events between them, equal events of different opens are not merged.
    is_watching_ = ::inotify_add_watch(events_, file.c_str(), IN_OPEN | IN_ACCESS | IN_CLOSE) >= 0;
  }
  OpenCounter(const OpenCounter&) = delete;
  OpenCounter& operator=(const OpenCounter&) = delete;
  ~OpenCounter() { ::close(events_); }

  [[nodiscard]] bool is_watching() const { return is_watching_; }

  [[nodiscard]] int count() {
    std::array<inotify_event, 64> events{};  // of files, which have no names
    for (ssize_t bytes = 1; bytes > 0;) {
      bytes = ::read(events_, events.data(), sizeof(events));
      const std::size_t read = bytes > 0 ? static_cast<std::size_t>(bytes) / sizeof(inotify_event) : 0;
      for (std::size_t i = 0; i < read; ++i) opens_ += (events[i].mask & IN_OPEN) != 0 ? 1 : 0;
    }
    return opens_;
  }

 private:
  int events_;
  bool is_watching_ = false;
  int opens_ = 0;
};

TEST_F(Tool, OpensItsInputOnce) {
  std::ofstream(folder_.file("board.vox"), std::ios::binary) << checkerboard_vox(8);
  std::vector<std::string> inputs = {"board.vox", "volume.nrrd"};
  for (const std::string extension : {"json", "vxl", "nii", "gltf", "stl"}) {
    inputs.push_back("board." + extension);
    ASSERT_EQ(run("convert board.vox board." + extension).status, 0) << extension;
  }
  std::ofstream(folder_.file("volume.nrrd"))
      << "NRRD0001\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: ascii\n\n0 0 0 9 9 0 0 9\n";
  for (const std::string& input : inputs) {
    for (const std::string& command :
         {"info " + input, "convert " + input + " out.glb", "thumbnail " + input + " out.png",
          "render " + input + " -o out.png --size 16x16"}) {
      OpenCounter counter(folder_.file(input));
      if (!counter.is_watching()) GTEST_SKIP() << "this system does not report opened files";
      const ToolRun done = run(command);
      EXPECT_EQ(done.status, 0) << command << ": " << done.err;
      EXPECT_EQ(counter.count(), 1) << command;
    }
  }
}

TEST_F(Tool, ReturnsStatus2ForWrongUsage) {
  for (const std::string arguments :
       {"", "frobnicate", "info", "info tiny.vox --frame -1", "convert tiny.vox", "convert tiny.vox out.xyz",
        "convert tiny.vox out.glb --mesher fast", "convert tiny.vox out.glb --iso 0.5",
        "convert tiny.vox out.vox --no-ao", "convert tiny.vox out.vox --mesher smooth",
        "convert tiny.vox out.glb --mesher smooth --iso 1", "convert tiny.vox out.glb --simplify 1",
        "convert tiny.vox out.glb --raw-type int8", "info tiny.vox --threads 0", "info tiny.vox --unknown"}) {
    const ToolRun result = run(arguments);
    EXPECT_EQ(result.status, 2) << arguments;
    expect_one_error_line(result);
  }
}

TEST_F(Tool, HelpHasExampleForEveryCommand) {
  const ToolRun all = run("--help");
  EXPECT_EQ(all.status, 0);
  EXPECT_NE(all.out.find("Example: quoin convert"), std::string::npos) << all.out;
  for (const std::string command : {"info", "convert", "render", "thumbnail", "generate"}) {
    EXPECT_NE(all.out.find(command), std::string::npos);
    const ToolRun help = run(command + " --help");
    EXPECT_EQ(help.status, 0);
    EXPECT_NE(help.out.find("Example: quoin " + command), std::string::npos) << help.out;
    // Two screens.
    EXPECT_LE(std::ranges::count(help.out, '\n'), 80) << command;
    for (const ToolRun& each : {help, run(command + " --help-all")}) {
      std::istringstream lines(each.out);
      for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100U) << line;
    }
    for (const std::string option : {"--raw-size", "--raw-type", "--raw-order"}) {
      const bool reads_volumes_of_any_kind = command != "generate" && command != "thumbnail";
      const ToolRun all_options = run(command + " --help-all");
      EXPECT_EQ(all_options.out.find(option) != std::string::npos, reads_volumes_of_any_kind) << command;
    }
  }
  EXPECT_EQ(run("--version").out.substr(0, 6), "quoin ");
}

}  // namespace

}  // namespace quoin
