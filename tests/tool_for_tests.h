#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include <quoin/io/vox.h>

#include "io/gltf/glb_for_tests.h"

/// Helpers for the tests of the command-line tool.
namespace quoin {

struct ToolRun {
  int status = -1;
  std::string out;
  std::string err;
};

inline std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Returns a file in MagicaVoxel's oldest form: one model with four bytes per voxel.
inline std::string vox_file(std::array<std::uint32_t, 3> size, const std::string& voxels) {
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

/// Returns a file of four voxels in two colours.
inline std::string tiny_vox() {
  return vox_file({3, 4, 2}, std::string("\0\0\0\1"
                                         "\1\0\0\1"
                                         "\2\0\0\1"
                                         "\2\0\1\2",
                                         16));
}

/// Returns a file with two instances of the model of `tiny_vox`; the first `hidden` instances are hidden.
inline std::string vox_with_hidden(int hidden) {
  const std::string file = tiny_vox();
  Scene scene = read_vox(std::as_bytes(std::span(file))).value().scene;
  Instance second = scene.instances()[scene.instances().handles().front()];
  second.position.x += 10;
  scene.add_instance(second);
  for (const InstanceHandle handle : scene.instances().handles()) {
    if (hidden-- > 0) scene.edit(handle).visible = false;
  }
  const std::vector<std::byte> bytes = write_vox(scene).value().bytes;
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Returns a file whose voxels fill half of a cube and share no face: large in every format. 4,000 voxels by default.
inline std::string checkerboard_vox(int edge = 20) {
  std::string voxels;
  for (int i = 0; i < edge * edge * edge; ++i) {
    const int x = i % edge;
    const int y = i / edge % edge;
    const int z = i / (edge * edge);
    if ((x + y + z) % 2 != 0) continue;
    for (const int byte : {x, y, z, 1}) voxels += static_cast<char>(byte);
  }
  const auto size = static_cast<std::uint32_t>(edge);
  return vox_file({size, size, size}, voxels);
}

/// Runs a test in a folder of its own, which holds tiny.vox.
class ToolTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::string(QUOIN_TOOL).empty()) GTEST_SKIP() << "the tool is not built";
    std::ofstream(folder_.file("tiny.vox"), std::ios::binary) << tiny_vox();
  }

  /// Runs the tool in the test's folder.
  ToolRun run(const std::string& arguments) { return shell("'" QUOIN_TOOL "' " + arguments); }

  /// Runs a command line in the test's folder.
  ToolRun shell(const std::string& line) {
    std::ofstream(folder_.file("run.sh")) << line << "\n";
    const std::string command = "cd '" + folder_.file("").string() + "' && sh run.sh > stdout.txt 2> stderr.txt";
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

inline void expect_one_error_line(const ToolRun& run) {
  EXPECT_TRUE(run.err.starts_with("quoin: ")) << run.err;
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  EXPECT_EQ(run.out, "");
}

}  // namespace quoin
