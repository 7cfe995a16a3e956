// Formats whose group is switched off. This program has its own table of formats, compiled as in a build with all
// groups off; the rest of the library is that of the build.

#include <filesystem>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include <quoin/io/chunk_source.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/image_files.h>
#include <quoin/io/mesh_file.h>
#include <quoin/io/volume.h>

#include "io/gltf/glb_for_tests.h"

namespace quoin {
namespace {

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

std::filesystem::path written(const TestFolder& folder, const std::string& name, const std::string& content) {
  EXPECT_TRUE(write_file(bytes_of(content), folder.file(name)));
  return folder.file(name);
}

TEST(FormatsOff, NamesTheOptionWhenReading) {
  const TestFolder folder("formats_off_read");
  const std::pair<const char*, const char*> files[] = {
      {"a.glb", "MESHES"},        {"a.STL", "MESHES"},      {"a.3mf", "MESHES"},   {"a.qbt", "MODELS"},
      {"a.schem", "GAME_WORLDS"}, {"a.mca", "GAME_WORLDS"}, {"a.nvdb", "VOLUMES"}, {"a.nrrd", "VOLUMES"}};
  for (const auto& [name, option] : files) {
    const auto loaded = load_scene(written(folder, name, "any content"));
    ASSERT_FALSE(loaded) << name;
    EXPECT_EQ(loaded.error().code, ErrorCode::Unsupported) << name;
    const std::string ending = std::string(": Quoin was built with QUOIN_WITH_") + option + "=OFF";
    EXPECT_TRUE(loaded.error().message.ends_with(ending)) << loaded.error().message;
  }
}

TEST(FormatsOff, ListsTheOptionsForUnknownContent) {
  const auto loaded = load_scene(bytes_of("glTF and more"));
  ASSERT_FALSE(loaded);
  EXPECT_NE(loaded.error().message.find("built with QUOIN_WITH_GAME_WORLDS=OFF, QUOIN_WITH_MODELS=OFF, "
                                        "QUOIN_WITH_VOLUMES=OFF, QUOIN_WITH_MESHES=OFF"),
            std::string::npos)
      << loaded.error().message;
}

TEST(FormatsOff, NamesTheOptionInOtherFunctions) {
  const TestFolder folder("formats_off_other");
  const auto names_option = [](const auto& result, const std::string& option) {
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::Unsupported);
    EXPECT_NE(result.error().message.find(option + "=OFF"), std::string::npos) << result.error().message;
  };
  names_option(format_for_writing("out.glb"), "QUOIN_WITH_MESHES");
  names_option(save_scene(Scene(), folder.file("out.gox")), "QUOIN_WITH_MODELS");
  names_option(write_mesh(SceneMeshes(), folder.file("out.obj")), "QUOIN_WITH_MESHES");
  names_option(write_mesh(SceneMeshes(), FileFormat::Glb), "QUOIN_WITH_MESHES");
  names_option(read_mesh(written(folder, "a.ply", "ply")), "QUOIN_WITH_MESHES");
  names_option(open_chunk_source(written(folder, "b.mca", "region")), "QUOIN_WITH_GAME_WORLDS");
  names_option(open_chunk_source(folder.file("")), "QUOIN_WITH_GAME_WORLDS");
  names_option(read_volume(written(folder, "c.nii", "volume"), {}), "QUOIN_WITH_VOLUMES");
  names_option(write_jpeg(Image{1, 1, {1, 2, 3}}, 90), "QUOIN_WITH_IMAGES");
}

TEST(FormatsOff, KeepsTheOtherFormats) {
  const TestFolder folder("formats_off_kept");
  const Scene scene;
  for (const char* name : {"a.vox", "a.json"}) {
    ASSERT_TRUE(save_scene(scene, folder.file(name))) << name;
    EXPECT_TRUE(load_scene(folder.file(name))) << name;
  }
  EXPECT_EQ(format_info(FileFormat::Glb).capabilities, FormatCapability{});
  EXPECT_EQ(extensions_with(FormatCapability::Meshes), "");
  EXPECT_TRUE(can(FileFormat::Heights, FormatCapability::Read));
}

}  // namespace
}  // namespace quoin
