#include "command_files.h"

#include <fstream>
#include <span>
#include <string>

#include <gtest/gtest.h>

#include <quoin/io/vox.h>
#include <quoin/scene/scene.h>

namespace quoin::tool {

namespace {

/// Writes a file in the folder of temporary files and removes it at the end.
struct TemporaryFile {
  std::filesystem::path path;
  explicit TemporaryFile(const std::string& name, const std::string& content = "")
      : path(std::filesystem::path(testing::TempDir()) /
             (std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + name)) {
    std::ofstream(path, std::ios::binary) << content;
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() { std::filesystem::remove(path); }
};

TEST(OpenedInput, IsRecognisedByContent) {
  const TemporaryFile model(".stl", "VOX \x96");
  const auto input = open_input(model.path, {});
  ASSERT_TRUE(input);
  EXPECT_EQ(input->file.path, model.path);
  EXPECT_EQ(input->file.format, FileFormat::Vox);
  EXPECT_FALSE(input->is_volume || input->heeds_iso());
}

TEST(OpenedInput, MayHaveUnknownFormat) {
  const TemporaryFile text(".txt", "neither voxels nor triangles");
  const auto input = open_input(text.path, {});
  ASSERT_TRUE(input);
  EXPECT_EQ(input->file.format, std::nullopt);
}

TEST(OpenedInput, IsVolumeIfRawOptionsAreGiven) {
  const TemporaryFile values(".raw", "VOX ");
  LoadOptions load;
  load.raw = RawVolume{IVec3(2, 2, 1)};
  const auto input = open_input(values.path, load);
  ASSERT_TRUE(input);
  EXPECT_TRUE(input->is_volume && input->heeds_iso());
}

TEST(OpenedInput, ReportsMissingFiles) {
  const auto input = open_input("no_such_folder/model.vox", {});
  ASSERT_FALSE(input);
  EXPECT_EQ(input.error().code, ErrorCode::CannotRead);
}

TEST(OpenedInput, RejectsDimensionOfOtherFormats) {
  const TemporaryFile model(".vox", "VOX ");
  LoadOptions load;
  load.dimension = "nether";
  const auto input = open_input(model.path, load);
  ASSERT_FALSE(input);
  EXPECT_EQ(input.error().message,
            "cannot select a dimension: --dimension needs a Minecraft world, and the file format is vox");
}

Scene one_voxel() {
  Scene scene;
  const auto type = scene.types.add({});
  EXPECT_TRUE(type);
  SceneGrid content;
  content.grid.set({0, 0, 0}, *type);
  Instance instance;
  instance.grid = scene.add_grid(std::move(content));
  scene.add_instance(instance);
  return scene;
}

TEST(OpenedInput, LoadsWithoutDetectingAgain) {
  const TemporaryFile model(".vox");
  ASSERT_TRUE(write_vox(one_voxel(), model.path));
  const auto input = open_input(model.path, {});
  ASSERT_TRUE(input);
  const auto loaded = load_scene(input->file);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->format, "vox");
  EXPECT_EQ(loaded->scene.voxel_count(), 1);
  EXPECT_TRUE(load_scene(DetectedFile{model.path, std::nullopt})) << "the content decides";
}

TEST(OpenedInput, IsReadEvenIfFileIsReplaced) {
  const TemporaryFile model(".vox");
  ASSERT_TRUE(write_vox(one_voxel(), model.path));
  const auto input = open_input(model.path, {});
  ASSERT_TRUE(input);
  ASSERT_TRUE(write_file(std::as_bytes(std::span("neither voxels nor triangles")), model.path));
  for (int time = 0; time < 2; ++time) {
    const auto loaded = load_scene(input->file);
    ASSERT_TRUE(loaded) << to_string(loaded.error());
    EXPECT_EQ(loaded->scene.voxel_count(), 1);
  }
  EXPECT_FALSE(load_scene(model.path)) << "another input is the new file";
}

}  // namespace

}  // namespace quoin::tool
