// Smooth meshes of voxels and volumes from `quoin convert`.

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include <quoin/mesh/smooth_mesh.h>

#include "io/mesh_file_for_tests.h"
#include "io/volume/volume_for_tests.h"
#include "tests/tool_for_tests.h"

namespace quoin {

namespace {

using Json = nlohmann::json;

class ToolSmooth : public ToolTest {
 protected:
  /// Converts and returns the JSON report.
  Json converted(const std::string& arguments) {
    const ToolRun result = run("convert " + arguments + " --json");
    EXPECT_EQ(result.status, 0) << arguments << ": " << result.err;
    return result.status == 0 ? Json::parse(result.out) : Json();
  }

  /// The tool's .ply files have +Z up.
  static WorldMesh with_y_up(WorldMesh mesh) {
    for (auto* vectors : {&mesh.positions, &mesh.normals}) {
      for (DVec3& v : *vectors) v = {v.x, v.z, -v.y};
    }
    return mesh;
  }

  WorldMesh read(const std::string& name) {
    const auto bytes = read_file(folder_.file(name)).value_or(std::vector<std::byte>{});
    if (name.ends_with(".ply")) return with_y_up(world_of_ply(bytes));
    return name.ends_with(".obj") ? world_of_obj(bytes) : world_of(parse_glb(bytes));
  }

  /// Writes a floor and a wall to corner.vox.
  void write_corner() {
    std::string voxels;
    for (int x = 0; x < 16; ++x) {
      for (int y = 0; y < 16; ++y) {
        for (int z = 0; z < (x < 4 ? 12 : 4); ++z) {
          for (const int byte : {x, y, z, 1}) voxels += static_cast<char>(byte);
        }
      }
    }
    std::ofstream(folder_.file("corner.vox"), std::ios::binary) << vox_file({16, 16, 16}, voxels);
  }

  void write(const std::string& name, const std::vector<std::byte>& bytes) {
    ASSERT_TRUE(write_file(bytes, folder_.file(name)));
  }
};

/// Returns the values of a ball, x fastest: positive inside.
std::vector<double> ball(IVec3 size, DVec3 centre, double radius) {
  std::vector<double> values;
  for (int i = 0; i < size.x * size.y * size.z; ++i) {
    const DVec3 p(i % size.x, i / size.x % size.y, i / (size.x * size.y));
    values.push_back(radius - glm::length(p - centre));
  }
  return values;
}

/// Counts edges without exactly one triangle on each side; vertices that share a position and differ in colour count as
/// one.
std::size_t open_edges(const WorldMesh& mesh) {
  std::map<std::array<double, 3>, std::size_t> places;
  const auto place = [&](std::size_t i) {
    const DVec3& p = mesh.positions[mesh.indices[i]];
    return places.try_emplace({p.x, p.y, p.z}, places.size()).first->second;
  };
  std::map<std::pair<std::size_t, std::size_t>, int> balance;
  std::map<std::pair<std::size_t, std::size_t>, int> uses;
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
    const std::size_t a = place(i);
    const std::size_t b = place(i / 3 * 3 + (i + 1) % 3);
    balance[std::minmax(a, b)] += a < b ? 1 : -1;
    ++uses[std::minmax(a, b)];
  }
  std::size_t open = 0;
  for (const auto& [edge, count] : uses) open += count == 2 && balance[edge] == 0 ? 0 : 1;
  return open;
}

TEST_F(ToolSmooth, MeshesClosedSurfaceInEveryFormat) {
  for (const std::string name : {"out.ply", "out.obj", "out.glb"}) {
    const Json said = converted("tiny.vox " + name + " --mesher smooth --watertight --threads 2");
    EXPECT_EQ(said["mesher"], "smooth");
    EXPECT_EQ(said["voxels"], 4);
    EXPECT_EQ(said["iso"], nullptr);
    EXPECT_EQ(said["simplify_error"], 0.0);
    EXPECT_EQ(said["faces_visible"], 18);
    EXPECT_EQ(said["faces_total"], 24);
    EXPECT_EQ(said["quads"], 0);
    EXPECT_EQ(said["files"], Json({name}));
    EXPECT_EQ(said["bytes"].get<std::size_t>(), std::filesystem::file_size(folder_.file(name)));
    const WorldMesh mesh = read(name);
    EXPECT_EQ(said["vertices"].get<std::size_t>(), mesh.positions.size());
    EXPECT_EQ(said["triangles"].get<std::size_t>(), mesh.indices.size() / 3);
    EXPECT_GT(mesh.positions.size(), 8U);
    EXPECT_EQ(open_edges(mesh), 0U);
    EXPECT_GT(mesh.volume(), 0.05);
    EXPECT_LT(mesh.volume(), 4.0);
  }
  EXPECT_EQ(converted("tiny.vox out.gltf --mesher smooth")["files"], Json({"out.gltf", "out.bin"}));
}

TEST_F(ToolSmooth, KeepsPositionsAndColours) {
  std::ofstream(folder_.file("bar.vox"), std::ios::binary) << vox_file({9, 1, 1}, std::string("\0\0\0\1"
                                                                                              "\1\0\0\1"
                                                                                              "\2\0\0\1"
                                                                                              "\3\0\0\1"
                                                                                              "\4\0\0\1"
                                                                                              "\5\0\0\2"
                                                                                              "\6\0\0\2"
                                                                                              "\7\0\0\2"
                                                                                              "\10\0\0\2",
                                                                                              36));
  const Json info = Json::parse(run("info bar.vox --json").out);
  const double left = info["bounds"]["min"][0];
  converted("bar.vox out.ply --mesher smooth --no-ao");
  const WorldMesh mesh = read("out.ply");
  ASSERT_FALSE(mesh.positions.empty());
  DBox box;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const DVec3& p = mesh.positions[i];
    box.extend(p);
    if (std::abs(p.x - left - 5.0) <= 0.5) continue;  // between the colours
    const std::array first = {0xCC / 255.0, 0x66 / 255.0, 0x33 / 255.0};
    const std::array second = {0x33 / 255.0, 0x22 / 255.0, 0x11 / 255.0};
    EXPECT_EQ(mesh.colours[i], p.x < left + 5.0 ? first : second);
  }
  for (int axis = 0; axis < 3; ++axis) {
    const double min = info["bounds"]["min"][static_cast<std::size_t>(axis)];
    const double max = info["bounds"]["max"][static_cast<std::size_t>(axis)];
    EXPECT_NEAR((box.min[axis] + box.max[axis]) / 2.0, (min + max) / 2.0, 1e-5) << "centred on the voxels";
    EXPECT_GT(box.min[axis], min - 0.5);
    EXPECT_LT(box.max[axis], max + 0.5);
  }
}

TEST_F(ToolSmooth, OcclusionDarkensHollows) {
  write_corner();
  const auto darkest = [&](const std::string& flags) {
    converted("corner.vox out.glb --mesher smooth " + flags);
    double least = 1.0;
    for (const auto& colour : read("out.glb").colours) least = std::min(least, colour[0]);
    return least;
  };
  const double plain = darkest("--no-ao");
  EXPECT_LT(darkest(""), plain * 0.8);
  EXPECT_NEAR(plain, 0.6038, 1e-3) << "0xCC in linear light";
}

TEST_F(ToolSmooth, AppliesOcclusionFormAndAttribute) {
  write_corner();
  const auto glb = [&](const std::string& flags) {
    converted("corner.vox out.glb --mesher smooth " + flags);
    return read_file(folder_.file("out.glb")).value();
  };
  const auto plain = glb("");
  EXPECT_EQ(glb("--ao-form soft-share --ao-spread 2"), plain);
  EXPECT_EQ(glb("--ao-form none"), glb("--no-ao"));
  for (const std::string flags :
       {"--ao-form share", "--ao-form weighted", "--ao-form weighted-published", "--ao-spread 0.5",
        "--ao-form weighted --ao-offset 0.1", "--ao-form weighted --ao-power 4"}) {
    EXPECT_NE(glb(flags), plain) << flags;
  }
  const ParsedGlb separate = parse_glb(glb("--ao-attribute"));
  const auto& attributes = separate.document["meshes"][0]["primitives"][0]["attributes"];
  const auto open = separate.array<float>(attributes["_AO"]);
  EXPECT_LT(*std::ranges::min_element(open), 0.8F);
  for (const auto& colour : separate.array<LinearRgba16>(attributes["COLOR_0"])) {
    ASSERT_NEAR(colour[0] / 65535.0, 0.6038, 1e-3) << "albedo alone";
  }
  EXPECT_EQ(run("convert corner.vox out.ply --ao-attribute").status, 0) << "of blocks too";
}

TEST_F(ToolSmooth, RefusesInvalidOcclusionOptions) {
  const std::vector<std::pair<std::string, std::string>> errors = {
      {"out.glb --ao-form share", "--ao-form, --ao-spread, --ao-offset and --ao-power need --mesher smooth"},
      {"out.glb --mesher smooth --ao-form rays",
       "--ao-form: must be none, soft-share, share, weighted or weighted-published"},
      {"out.glb --mesher smooth --ao-spread 0", "--ao-spread: must be 0.0625 to 4, not \"0\""},
      {"out.glb --mesher smooth --ao-spread nan", "--ao-spread: must be 0.0625 to 4"},
      {"out.glb --mesher smooth --ao-form weighted --ao-offset 1", "--ao-offset: must be 0 to 0.99, not \"1\""},
      {"out.glb --mesher smooth --ao-form weighted --ao-power 65", "--ao-power: must be 0.0625 to 64"},
      {"out.glb --mesher smooth --ao-offset 0.2", "--ao-offset needs --ao-form weighted"},
      {"out.glb --mesher smooth --ao-form none --ao-spread 1", "--ao-spread and --ao-form none cannot be used"},
      {"out.glb --mesher smooth --no-ao --ao-form share", "--ao-form and --no-ao cannot be used together"},
      {"out.glb --no-ao --ao-attribute", "--ao-attribute and --no-ao cannot be used together"},
      {"out.obj --ao-attribute", "cannot write --ao-attribute to .obj"},
      {"out.vox --ao-attribute", "--mesher, --no-ao, --ao-..., --watertight, --smoothness, --colours, --no-unite"}};
  for (const auto& [arguments, error] : errors) {
    const ToolRun result = run("convert tiny.vox " + arguments);
    EXPECT_EQ(result.status, 2) << arguments;
    expect_one_error_line(result);
    EXPECT_TRUE(result.err.starts_with("quoin: " + error)) << arguments << ": " << result.err;
  }
}

TEST_F(ToolSmooth, WarnsOfHiddenInstancesAndEmptyMesh) {
  std::ofstream(folder_.file("two.vox"), std::ios::binary) << vox_with_hidden(2);
  const Json said = converted("two.vox out.glb --mesher smooth");
  EXPECT_EQ(said["warnings"], Json({"2 hidden instances left out; --hidden includes them", "the mesh is empty"}));
  EXPECT_EQ(parse_glb(read_file(folder_.file("out.glb")).value()).document["asset"]["version"], "2.0");
  EXPECT_EQ(converted("two.vox out.glb --mesher smooth --hidden")["warnings"], Json::array());
  EXPECT_EQ(parse_glb(read_file(folder_.file("out.glb")).value()).document["nodes"].size(), 2U);
}

TEST_F(ToolSmooth, MeshesRawVolume) {
  const IVec3 size{40, 36, 38};
  const DVec3 centre(21.3, 18.1, 17.6);
  for (const auto& [type, name] :
       {std::pair(ScalarType::Float32, "float32"), std::pair(ScalarType::Float64, "float64")}) {
    for (const auto order : {std::endian::little, std::endian::big}) {
      write("ball.raw", volume_test::encode(ball(size, centre, 12.0), type, order));
      const Json said = converted("ball.raw out.ply --raw-size 40x36x38 --raw-type " + std::string(name) +
                                  " --raw-order " + (order == std::endian::big ? "big" : "little") + " --iso -2.5");
      EXPECT_EQ(said["iso"], -2.5);
      EXPECT_EQ(said["mesher"], "smooth") << "the default of volumes";
      const WorldMesh mesh = read("out.ply");
      ASSERT_GT(mesh.positions.size(), 1000U);
      EXPECT_EQ(open_edges(mesh), 0U);
      EXPECT_EQ(mesh.inward_normals(), 0U);
      for (const DVec3& p : mesh.positions) {
        // (x, y, z) becomes (x, z, -y).
        EXPECT_NEAR(glm::length(DVec3(p.x, -p.z, p.y) - centre), 14.5, 0.06);
      }
      const double volume = 4.0 / 3.0 * 3.14159265 * std::pow(14.5, 3);
      EXPECT_NEAR(mesh.volume(), volume, 0.01 * volume);
      EXPECT_NEAR(said["voxels"].get<double>(), volume, 0.02 * volume);
    }
  }
  EXPECT_EQ(run("convert ball.raw out.ply --raw-size 40x36x39 --raw-type float64").status, 1);
}

TEST_F(ToolSmooth, FindsAndReportsSurfaceValue) {
  std::vector<double> values = ball({24, 24, 24}, DVec3(11.5), 8.0);
  for (double& value : values) value = value > 0.0 ? 200.0 : 40.0;
  write("ball.raw", volume_test::encode(values, ScalarType::UInt8));
  const Json said = converted("ball.raw out.ply --raw-size 24x24x24");
  EXPECT_NEAR(said["iso"].get<double>(), 120.0, 1.0);
  const ToolRun text = run("convert ball.raw out.ply --raw-size 24x24x24");
  EXPECT_NE(text.out.find("\nIso: "), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("set another with --iso"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("Solid samples: "), std::string::npos) << text.out;
}

TEST_F(ToolSmooth, ConvertsMillimetresToMetresOnlyInGltf) {
  volume_test::NiftiFile file;
  file.dim = {3, 20, 20, 20, 1, 1, 1, 1};
  file.datatype = 16;
  file.bitpix = 32;
  file.sform_code = 1;
  for (const double x_axis : {2.0, -2.0}) {
    file.srow = {x_axis, 0, 0, 100, 0, 3, 0, 0, 0, 0, 4, 0};
    write("ball.nii", file.bytes(volume_test::encode(ball({20, 20, 20}, DVec3(9.0), 6.0), ScalarType::Float32)));
    const double volume = 24.0 * 905.0;
    for (const std::string name : {"out.ply", "out.obj", "out.glb", "out.gltf"}) {
      converted("ball.nii " + name + " --iso 0");
      if (name == "out.gltf") continue;
      const double unit = name == "out.glb" ? 1e-3 : 1.0;
      const WorldMesh mesh = read(name);
      EXPECT_NEAR(mesh.volume(), volume * std::pow(unit, 3), 0.05 * volume * std::pow(unit, 3)) << name;
      for (const DVec3& p : mesh.positions) {
        // The file's right, front and head are Quoin's -x, z and y.
        const DVec3 in_voxels((-p.x / unit - 100.0) / x_axis, p.z / unit / 3.0, p.y / unit / 4.0);
        EXPECT_NEAR(glm::length(in_voxels - DVec3(9.0)), 6.0, 0.1) << name;
      }
    }
    const Json document = parse_glb(read_file(folder_.file("out.glb")).value()).document;
    ASSERT_EQ(document["nodes"].size(), 1U);
    EXPECT_NEAR(document["nodes"][0]["scale"][0].get<double>(), 2e-3, 1e-12);
  }
}

TEST_F(ToolSmooth, WritesEmptyFilesForVolumesWithoutSurface) {
  for (const double value : {0.0, 255.0}) {
    write("flat.raw", volume_test::encode(std::vector<double>(1000, value), ScalarType::UInt8));
    const Json said = converted("flat.raw out.glb --raw-size 10x10x10");
    EXPECT_EQ(said["warnings"], Json({"the mesh is empty"}));
    EXPECT_EQ(said["triangles"], 0);
    EXPECT_FALSE(parse_glb(read_file(folder_.file("out.glb")).value()).document.contains("meshes"));
    const std::string text = run("convert flat.raw out.glb --raw-size 10x10x10").out;
    EXPECT_NE(text.find("\nIso: "), std::string::npos) << text;
    EXPECT_EQ(text.find("groups"), std::string::npos) << "there is one group of values: " << text;
  }
  const Json solid = converted("flat.raw out.glb --raw-size 10x10x10 --iso 100");
  EXPECT_EQ(solid["warnings"], Json::array()) << "a solid block has the faces of the volume";
  EXPECT_GT(read("out.glb").volume(), 0.0);
}

TEST_F(ToolSmooth, RefusesVolumesWithoutFiniteValue) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double value : {nan, infinity}) {
    write("none.raw", volume_test::encode(std::vector<double>(1000, value), ScalarType::Float32));
    const std::string raw = " --raw-size 10x10x10 --raw-type float32";
    for (const std::string command :
         {"convert none.raw out.glb", "convert none.raw out.json", "render none.raw -o out.png --size 16x16"}) {
      const ToolRun result = run(command + raw);
      EXPECT_EQ(result.status, 1) << command;
      expect_one_error_line(result);
      EXPECT_NE(result.err.find(std::isnan(value) ? "all values are NaN" : "no value is finite"), std::string::npos)
          << result.err;
      EXPECT_NE(result.err.find("none.raw"), std::string::npos) << result.err;
    }
    EXPECT_FALSE(exists("out.glb") || exists("out.json") || exists("out.png"));
    const ToolRun reported = run("info none.raw" + raw);
    EXPECT_EQ(reported.status, 0) << "info still describes it";
    EXPECT_NE(reported.out.find("Range: none"), std::string::npos) << reported.out;
    EXPECT_EQ(run("convert none.raw out.glb --iso 3" + raw).status, std::isnan(value) ? 1 : 0);
  }
}

TEST_F(ToolSmooth, ReportsRendersAndKeepsRawVolumes) {
  write("ball.raw", volume_test::encode(ball({20, 18, 16}, DVec3(9.0), 6.0), ScalarType::Float32));
  const std::string raw = " --raw-size 20x18x16 --raw-type float32";
  const ToolRun reported = run("info ball.raw --json" + raw);
  ASSERT_EQ(reported.status, 0) << reported.err;
  const Json info = Json::parse(reported.out);
  EXPECT_EQ(info["format"], "raw");
  EXPECT_EQ(info["size"], Json({20, 18, 16}));
  EXPECT_EQ(info["name"], "ball");
  const ToolRun drawn = run("render ball.raw -o out.png --size 64x64 --iso 0 --json" + raw);
  ASSERT_EQ(drawn.status, 0) << drawn.err;
  EXPECT_GT(Json::parse(drawn.out)["pixels_hit"], 500);
  ASSERT_EQ(run("convert ball.raw ball.json --iso 0" + raw).status, 0);
  ASSERT_EQ(run("render ball.json -o again.png --size 64x64").status, 0);
  EXPECT_EQ(text_of(folder_.file("out.png")), text_of(folder_.file("again.png"))) << "the field is the volume's";
  for (const std::string command : {"info ball.raw", "render ball.raw -o no.png"}) {
    EXPECT_EQ(run(command).status, 1) << "the layout is unknown: " << command;
    EXPECT_EQ(run(command + " --raw-type int8").status, 2) << command;
    EXPECT_EQ(run(command + " --raw-size 20x18").status, 2) << command;
    EXPECT_EQ(run(command + " --raw-size 20x18x15 --raw-type float32").status, 1) << command;
  }
  EXPECT_FALSE(exists("no.png"));
  EXPECT_NE(run("view --raw-size 2x2x2").err.find("--raw-size needs a file"), std::string::npos);
}

TEST_F(ToolSmooth, RefusesSurfaceValuesBeyondFloat) {
  write("ball.raw", volume_test::encode(ball({8, 8, 8}, DVec3(4.0), 3.0), ScalarType::Float32));
  for (const std::string command : {"convert ball.raw out.glb", "render ball.raw -o out.png", "view ball.raw"}) {
    const std::string raw = command + " --raw-size 8x8x8 --raw-type float32 --iso ";
    const ToolRun large = run(raw + "1e300");
    EXPECT_EQ(large.status, 2) << command;
    EXPECT_NE(large.err.find("3.4e38"), std::string::npos) << large.err;
    const ToolRun word = run(raw + "much");
    EXPECT_EQ(word.status, 2) << command;
    EXPECT_NE(word.err.find("must be a number"), std::string::npos) << word.err;
  }
}

TEST_F(ToolSmooth, ReportsSamplesAndMeshesFieldsSmoothly) {
  ASSERT_EQ(run("generate smooth-terrain cliffs.json --chunks 1x1x1 --seed 4").status, 0);
  const Json info = Json::parse(run("info cliffs.json --json").out);
  EXPECT_EQ(info["voxels"], 0);
  EXPECT_GT(info["solid_samples"], 1000);
  EXPECT_GT(info["types"], 1) << "materials of solid samples";
  const std::string text = run("info cliffs.json").out;
  EXPECT_NE(text.find("Solid samples: "), std::string::npos) << text;
  EXPECT_EQ(text.find("Voxels: "), std::string::npos) << text;
  EXPECT_EQ(text.find("Faces: "), std::string::npos) << text;
  const Json whole = converted("cliffs.json whole.glb");
  EXPECT_EQ(whole["mesher"], "smooth");
  EXPECT_EQ(whole["solid_samples"], info["solid_samples"]);
  EXPECT_EQ(run("convert cliffs.json open.glb --ao-form weighted").status, 0);
  EXPECT_EQ(run("convert cliffs.json no.glb --mesher greedy --simplify 0.1").status, 2);
  EXPECT_EQ(run("convert tiny.vox no.glb --simplify 0.1").status, 2) << "blocks are no surface to simplify";
  EXPECT_FALSE(exists("no.glb"));
  if (!can_simplify()) GTEST_SKIP() << "this build has no meshoptimizer";
  EXPECT_LT(converted("cliffs.json simple.glb --simplify 0.1")["triangles"].get<int>(),
            whole["triangles"].get<int>() / 2);
}

TEST_F(ToolSmooth, ReportsSimplificationError) {
  if (!can_simplify()) GTEST_SKIP() << "this build has no meshoptimizer";
  write("ball.raw", volume_test::encode(ball({40, 40, 40}, DVec3(20.0), 15.0), ScalarType::Float32));
  const std::string arguments = "ball.raw out.ply --raw-size 40x40x40 --raw-type float32 --iso 0";
  const Json whole = converted(arguments);
  const Json simple = converted(arguments + " --simplify 0.1");
  EXPECT_EQ(whole["simplify_error"], 0.0);
  EXPECT_GT(simple["simplify_error"], 0.0);
  EXPECT_LE(simple["simplify_error"], 0.1);
  EXPECT_LT(simple["triangles"].get<int>(), whole["triangles"].get<int>() / 2);
  EXPECT_EQ(open_edges(read("out.ply")), 0U);
  EXPECT_NE(run("convert " + arguments + " --simplify 0.1").out.find("Simplified: "), std::string::npos);
}

TEST_F(ToolSmooth, ConvertsAndRendersVolumes) {
  write("ball.raw", volume_test::encode(ball({8, 8, 8}, DVec3(4.0), 3.0), ScalarType::Int8));
  const ToolRun voxels = run("convert ball.raw out.vox --raw-size 8x8x8 --raw-type int8");
  EXPECT_EQ(voxels.status, 0) << voxels.err;
  EXPECT_NE(voxels.err.find("fields converted to voxels"), std::string::npos) << voxels.err;
  std::ofstream(folder_.file("a.nrrd"), std::ios::binary)
      << "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 3 1\nencoding: raw\n\nabcdef";
  const ToolRun greedy = run("convert a.nrrd out.glb --mesher greedy");
  EXPECT_EQ(greedy.status, 2);
  EXPECT_NE(greedy.err.find("use --mesher smooth"), std::string::npos) << greedy.err;
  EXPECT_FALSE(exists("out.glb"));
  const ToolRun image = run("render a.nrrd -o out.png --size 32x32 --iso 98.5 --json");
  EXPECT_EQ(image.status, 0) << image.err;
  EXPECT_GT(Json::parse(image.out)["pixels_hit"], 10);
  EXPECT_TRUE(exists("out.png"));
  // No value reaches this threshold; the tool warns of an empty image.
  EXPECT_NE(run("render a.nrrd -o out.png --size 32x32 --iso 1000").err.find("the image shows only sky"),
            std::string::npos);
  EXPECT_EQ(run("render a.nrrd -o out.png --iso much").status, 2);
  std::ofstream(folder_.file("tiny2.vox"), std::ios::binary) << vox_file({1, 1, 1}, std::string("\0\0\0\1", 4));
  EXPECT_NE(run("render tiny2.vox -o out.png --iso 3").err.find("cannot use --iso"), std::string::npos);
  EXPECT_EQ(run("convert a.nrrd out.glb").status, 0);
}

TEST_F(ToolSmooth, ReportsFailuresInOneLineWithoutFile) {
  for (const std::string arguments :
       {"missing.nii out.glb", "tiny.vox none/out.ply --mesher smooth", "tiny.vox none/out.gltf --mesher smooth",
        "missing.raw out.glb --raw-size 1x1x1", "tiny.vox out.glb --raw-size 900000000x900000000x900000000"}) {
    const ToolRun result = run("convert " + arguments);
    EXPECT_EQ(result.status, 1) << arguments;
    expect_one_error_line(result);
    EXPECT_FALSE(exists("out.glb"));
  }
  const ToolRun companion = shell("cp tiny.vox foo.bin; '" QUOIN_TOOL "' convert foo.bin foo.gltf --mesher smooth");
  EXPECT_EQ(companion.status, 1);
  expect_one_error_line(companion);
}

}  // namespace

}  // namespace quoin
