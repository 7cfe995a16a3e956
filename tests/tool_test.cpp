#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "io/glb_for_tests.h"

namespace quoin {

namespace {

using Json = nlohmann::json;

struct ToolRun {
  int status = -1;
  std::string out;
  std::string err;
};

std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A file in MagicaVoxel's oldest form: one model, whose voxels are four bytes each.
std::string vox_file(std::array<std::uint32_t, 3> size, const std::string& voxels) {
  const auto word = [](std::uint32_t value) {
    std::string bytes(4, '\0');
    std::memcpy(bytes.data(), &value, 4);
    return bytes;
  };
  const auto chunk = [&](const std::string& id, const std::string& content) {
    return id + word(static_cast<std::uint32_t>(content.size())) + word(0) + content;
  };
  std::string palette;
  for (std::uint32_t i = 0; i < 256; ++i) palette += word(i == 0 ? 0xFF3366CCU : 0xFF112233U);
  const std::string chunks = chunk("SIZE", word(size[0]) + word(size[1]) + word(size[2])) +
                             chunk("XYZI", word(static_cast<std::uint32_t>(voxels.size() / 4)) + voxels) +
                             chunk("RGBA", palette);
  return "VOX " + word(150) + "MAIN" + word(0) + word(static_cast<std::uint32_t>(chunks.size())) + chunks;
}

/// Four voxels in two colours.
std::string tiny_vox() {
  return vox_file({3, 4, 2}, std::string("\0\0\0\1"
                                         "\1\0\0\1"
                                         "\2\0\0\1"
                                         "\2\0\1\2",
                                         16));
}

/// 4,000 voxels that share no face: large in every format.
std::string checkerboard_vox() {
  std::string voxels;
  for (int i = 0; i < 8'000; ++i) {
    const int x = i % 20;
    const int y = i / 20 % 20;
    const int z = i / 400;
    if ((x + y + z) % 2 != 0) continue;
    for (const int byte : {x, y, z, 1}) voxels += static_cast<char>(byte);
  }
  return vox_file({20, 20, 20}, voxels);
}

class Tool : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::string(QUOIN_TOOL).empty()) GTEST_SKIP() << "the tool is not built";
    std::ofstream(folder_.file("tiny.vox"), std::ios::binary) << tiny_vox();
  }

  /// Runs the tool in the test's folder.
  ToolRun run(const std::string& arguments) {
    const std::string command =
        "cd '" + folder_.file("").string() + "' && '" QUOIN_TOOL "' " + arguments + " > stdout.txt 2> stderr.txt";
    ToolRun result;
    const int status = std::system(command.c_str());
    result.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    result.out = text_of(folder_.file("stdout.txt"));
    result.err = text_of(folder_.file("stderr.txt"));
    return result;
  }

  bool exists(const std::string& name) { return std::filesystem::exists(folder_.file(name)); }

  TestFolder folder_{std::string("tool_") + ::testing::UnitTest::GetInstance()->current_test_info()->name()};
};

void expect_one_error_line(const ToolRun& run) {
  EXPECT_TRUE(run.err.starts_with("quoin: ")) << run.err;
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  EXPECT_EQ(run.out, "");
}

TEST_F(Tool, info_says_what_is_in_a_file) {
  const ToolRun text = run("info tiny.vox");
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_NE(text.out.find("Voxels: 4 of 2 types"), std::string::npos) << text.out;
  const ToolRun json = run("info tiny.vox --json");
  ASSERT_EQ(json.status, 0) << json.err;
  const Json object = Json::parse(json.out);
  EXPECT_EQ(object["format"], "vox");
  EXPECT_EQ(object["voxels"], 4);
  EXPECT_EQ(object["types"], 2);
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

TEST_F(Tool, convert_writes_every_format_and_counts) {
  const ToolRun text = run("convert tiny.vox tiny.glb");
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_NE(text.out.find("Faces: 18 visible of 24 total"), std::string::npos) << text.out;
  for (const std::string name : {"tiny.glb", "tiny.gltf", "tiny.obj", "out.vox"}) {
    const ToolRun json = run("convert tiny.vox " + name + " --json --threads 2");
    ASSERT_EQ(json.status, 0) << json.err;
    const Json object = Json::parse(json.out);
    EXPECT_EQ(object["voxels"], 4);
    EXPECT_GT(object["bytes"], 0);
    for (const char* key : {"read", "mesh", "write"}) EXPECT_GE(object["seconds"][key], 0.0);
    EXPECT_TRUE(object["warnings"].is_array());
    EXPECT_TRUE(exists(name));
    if (name == "out.vox") continue;
    EXPECT_EQ(object["faces_visible"], 18);
    EXPECT_EQ(object["faces_total"], 24);
    EXPECT_EQ(object["triangles"], 2 * object["quads"].get<int>());
    EXPECT_GT(object["vertices"], 0);
  }
  EXPECT_TRUE(exists("tiny.bin"));
  EXPECT_TRUE(exists("tiny.mtl"));
  EXPECT_TRUE(exists("tiny.png"));
}

TEST_F(Tool, culled_gives_a_quad_a_face_and_greedy_fewer) {
  const auto quads = [&](const std::string& flags) {
    const ToolRun result = run("convert tiny.vox out.glb --json " + flags);
    return Json::parse(result.out)["quads"].get<int>();
  };
  EXPECT_EQ(quads("--mesher culled"), 18);
  EXPECT_LT(quads("--mesher greedy"), 18);
  EXPECT_LT(quads("--no-ao"), 18);
}

TEST_F(Tool, more_threads_than_processors_are_no_news) {
  const ToolRun result = run("convert tiny.vox out.glb --threads 1000");
  EXPECT_EQ(result.status, 0);
  EXPECT_EQ(result.err, "");
}

TEST_F(Tool, a_file_may_be_converted_onto_itself) {
  ASSERT_EQ(run("convert tiny.vox tiny.vox").status, 0);
  const ToolRun json = run("info tiny.vox --json");
  ASSERT_EQ(json.status, 0) << json.err;
  EXPECT_EQ(Json::parse(json.out)["voxels"], 4);
}

TEST_F(Tool, failures_are_one_line_status_1_and_no_file) {
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

TEST_F(Tool, a_full_disk_is_one_line_status_1_and_no_file) {
  // A file system of 16 KiB, mounted where only these commands see it; the filler leaves one page of it.
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

TEST_F(Tool, wrong_usage_is_status_2) {
  for (const std::string arguments :
       {"", "frobnicate", "render tiny.vox", "info", "info tiny.vox --frame -1", "convert tiny.vox",
        "convert tiny.vox out.xyz", "convert tiny.vox out.glb --mesher fast", "convert tiny.vox out.glb --iso 0.5",
        "convert tiny.vox out.vox --no-ao", "info tiny.vox --threads 0", "info tiny.vox --unknown"}) {
    const ToolRun result = run(arguments);
    EXPECT_EQ(result.status, 2) << arguments;
    expect_one_error_line(result);
  }
}

TEST_F(Tool, the_smooth_mesher_is_announced_as_missing) {
  const ToolRun result = run("convert tiny.vox out.glb --mesher smooth --iso 0.5");
  EXPECT_EQ(result.status, 1);
  expect_one_error_line(result);
  EXPECT_FALSE(exists("out.glb"));
}

TEST_F(Tool, help_has_an_example_for_every_command) {
  const ToolRun all = run("--help");
  EXPECT_EQ(all.status, 0);
  for (const std::string command : {"info", "convert"}) {
    EXPECT_NE(all.out.find(command), std::string::npos);
    const ToolRun help = run(command + " --help");
    EXPECT_EQ(help.status, 0);
    EXPECT_NE(help.out.find("Example: quoin " + command), std::string::npos) << help.out;
  }
  EXPECT_EQ(run("--version").out.substr(0, 6), "quoin ");
}

}  // namespace

}  // namespace quoin
