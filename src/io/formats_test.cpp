#include <quoin/io/formats.h>

#include <gtest/gtest.h>

#include <string>

#include <quoin/io/scene_file.h>

#include "io/gltf/glb_for_tests.h"

namespace quoin {

namespace {

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

Error error_of(const TestFolder& folder, const std::string& name, const std::string& content) {
  EXPECT_TRUE(write_file(bytes_of(content), folder.file(name)));
  const auto loaded = load_scene(folder.file(name));
  EXPECT_FALSE(loaded) << name;
  return loaded ? Error{} : loaded.error();
}

TEST(Formats, DetectsInputFormatByContent) {
  EXPECT_EQ(detect_format(bytes_of("VOX \x96")), FileFormat::Vox);
  EXPECT_EQ(detect_format(bytes_of("VOX")), std::nullopt);
  EXPECT_EQ(detect_format(bytes_of("glTF")), FileFormat::Glb);
  EXPECT_EQ(detect_format(std::span<const std::byte>()), std::nullopt);
}

TEST(Formats, LoadsSceneFilesFromBytes) {
  SceneFile file;
  file.grids.emplace_back();
  file.grids[0].grid.set({1, 2, 3}, *file.types.add({}));
  file.placements.push_back({});
  file.placements[0].grid = 0;
  file.placements[0].instance.visible = false;
  const auto bytes = write_scene_file(file);
  ASSERT_TRUE(bytes);
  for (const bool shows : {false, true}) {
    const auto loaded = load_scene(std::span<const std::byte>(*bytes), {.show_hidden = shows});
    ASSERT_TRUE(loaded) << loaded.error().message;
    const Scene& scene = loaded->scene;
    EXPECT_EQ(scene.instances()[scene.instances().handles()[0]].visible, shows);
  }
}

TEST(Formats, SelectsOutputFormatByExtension) {
  EXPECT_EQ(format_for_writing("a/b.GLB")->format, FileFormat::Glb);
  EXPECT_EQ(format_for_writing("b.gltf")->format, FileFormat::Gltf);
  EXPECT_EQ(format_for_writing("b.obj")->format, FileFormat::Obj);
  EXPECT_EQ(format_for_writing("b.ply")->format, FileFormat::Ply);
  EXPECT_EQ(format_for_writing("b.c.vox")->format, FileFormat::Vox);
  EXPECT_EQ(format_for_writing("b.json")->format, FileFormat::Scene);
  EXPECT_EQ(format_for_writing("b.Quoin")->format, FileFormat::World);
  EXPECT_EQ(format_for_writing("b.vdb")->format, FileFormat::Vdb);
  for (const char* name : {"b", "b.", "glb", ".glb", "b.glb.bak", "b.glbx"}) {
    const auto format = format_for_writing(name);
    ASSERT_FALSE(format) << name;
    EXPECT_EQ(format.error().code, ErrorCode::Unsupported);
    EXPECT_NE(format.error().message.find(extensions_with(FormatCapability::Write)), std::string::npos)
        << format.error().message;
  }
}

TEST(Formats, StripsGzipAndInnerExtension) {
  for (const auto& [name, stem] : {std::pair("a/castle.vox", "castle"),
                                   {"scan.nii.gz", "scan"},
                                   {"SCAN.NII.GZ", "SCAN"},
                                   {"b.c/scan.nrrd.gz", "scan"},
                                   {"scan.dat.gz", "scan"},
                                   {"v1.2.vox", "v1.2"},
                                   {"ab", "ab"},
                                   {"hand.img.gz", "hand"},
                                   {"", ""}}) {
    EXPECT_EQ(stem_of_file(name), stem) << name;
  }
}

TEST(Formats, LoadsRawVolumeOfGivenSize) {
  std::string values(4 * 4 * 4, '\0');
  values[21] = values[22] = '\x50';
  LoadOptions options;
  options.raw = RawVolume{IVec3(4)};
  const auto loaded = load_scene(bytes_of(values), options);
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->format, "raw");
  EXPECT_EQ(loaded->scene.grids()[loaded->scene.grids().handles()[0]].field.solid_count(), 2);
  const TestFolder folder("formats");
  ASSERT_TRUE(write_file(bytes_of(values), folder.file("four.dat")));
  EXPECT_TRUE(load_scene(folder.file("four.dat"), options));
  options.raw->size.x = 5;
  const auto short_of_values = load_scene(folder.file("four.dat"), options);
  ASSERT_FALSE(short_of_values);
  EXPECT_EQ(short_of_values.error().path, folder.file("four.dat").string());
}

TEST(Formats, ReportsReasonForUnreadableFiles) {
  const TestFolder folder("formats");
  EXPECT_EQ(error_of(folder, "a.txt", "hello").code, ErrorCode::BadFormat);
  EXPECT_NE(error_of(folder, "a.vox", "").message.find("empty"), std::string::npos);
  const Error pointer = error_of(folder, "b.vox", "version https://git-lfs.github.com/spec/v1\noid sha256:0\n");
  EXPECT_NE(pointer.message.find("Git LFS pointer"), std::string::npos) << pointer.message;
  EXPECT_EQ(pointer.path, folder.file("b.vox").string());
  const auto missing = load_scene(folder.file("missing.vox"));
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::CannotRead);
  EXPECT_EQ(missing.error().path, folder.file("missing.vox").string());
}

}  // namespace

}  // namespace quoin
