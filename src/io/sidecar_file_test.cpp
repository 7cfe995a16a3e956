#include <quoin/io/file.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include <quoin/io/formats.h>
#include <quoin/io/mesh_file.h>
#include <quoin/io/scene_file.h>
#include <quoin/io/volume.h>

namespace quoin {
namespace {

namespace fs = std::filesystem;

/// A folder `in` with a file that names others, and a file `secret` outside the folder.
class SidecarFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "quoin-sidecar-XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = fs::canonical(pattern);
    fs::create_directories(folder_ / "in" / "below");
    write("secret", "secret");
    write("in/plain", "plain");
    write("in/below/deep", "deep");
    fs::create_symlink(folder_ / "secret", folder_ / "in" / "link");
    fs::create_symlink("below/deep", folder_ / "in" / "inner");
    fs::create_directory_symlink("..", folder_ / "in" / "up");
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  [[nodiscard]] fs::path main_file() const { return folder_ / "in" / "main"; }
  [[nodiscard]] Result<fs::path> path_of(const std::string& name) const { return sidecar_path(main_file(), name); }

  /// Writes a glTF file that names this buffer of 6 bytes and this image.
  void write_gltf(const std::string& buffer, const std::string& image) const {
    write("in/main.gltf", R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
                          R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],)"
                          R"("materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],)"
                          R"("textures":[{"source":0}],"images":[{"uri":")" +
                              image +
                              R"("}],)"
                              R"("buffers":[{"byteLength":36,"uri":")" +
                              buffer +
                              R"("}],)"
                              R"("bufferViews":[{"buffer":0,"byteLength":36}],)"
                              R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}]})");
  }
  [[nodiscard]] Result<LoadedMesh> read_gltf(SidecarFiles allowed = SidecarFiles::WithinFolder) const {
    return read_mesh(folder_ / "in" / "main.gltf", {}, allowed);
  }

  fs::path folder_;
};

TEST_F(SidecarFile, IsFoundInTheFolderAndBelow) {
  for (const std::string name :
       {"plain", "./plain", "below/deep", "below\\deep", "below/../plain", "inner", "missing"}) {
    const auto path = path_of(name);
    ASSERT_TRUE(path) << name << to_string(path.error());
    EXPECT_EQ(path->parent_path().lexically_normal().string().find((folder_ / "in").string()), 0U) << name;
  }
  EXPECT_TRUE(sidecar_path("main", "plain")) << "a file without a folder lies in the current one";
}

TEST_F(SidecarFile, IsRefusedOutsideTheFolderByName) {
  for (const std::string& name : {(folder_ / "secret").string(), std::string("../secret"), std::string("..\\secret"),
                                  std::string("below/../../secret"), std::string("link"), std::string("up/secret"),
                                  std::string("C:\\secret"), std::string("C:secret"), std::string("..")}) {
    const auto path = path_of(name);
    ASSERT_FALSE(path) << name;
    EXPECT_EQ(path.error().code, ErrorCode::CannotRead) << name;
    EXPECT_NE(path.error().message.find(name), std::string::npos) << path.error().message;
    EXPECT_NE(path.error().message.find("--allow-outside-files"), std::string::npos);
  }
  EXPECT_EQ(path_of("").error().code, ErrorCode::BadFormat);
  EXPECT_EQ(path_of(std::string("a\0b", 3)).error().code, ErrorCode::BadFormat);
}

TEST_F(SidecarFile, IsFoundAnywhereOnRequest) {
  for (const std::string& name : {(folder_ / "secret").string(), std::string("../secret"), std::string("link")}) {
    const auto path = sidecar_path(main_file(), name, SidecarFiles::Anywhere);
    ASSERT_TRUE(path) << name;
    EXPECT_TRUE(fs::equivalent(*path, folder_ / "secret"));
  }
}

TEST_F(SidecarFile, RefusesGltfReferencesOutsideTheFolder) {
  if (!can(FileFormat::Gltf, FormatCapability::Read)) GTEST_SKIP() << "the build reads no glTF";
  const std::string corners("\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80?\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80?\0\0\0\0", 36);
  write("corners.bin", corners);
  write("in/corners.bin", corners);
  fs::create_symlink("../corners.bin", folder_ / "in" / "linked.bin");
  for (const std::string& name : {(folder_ / "corners.bin").string(), std::string("../corners.bin"),
                                  std::string("%2e%2e/corners.bin"), std::string("linked.bin")}) {
    const std::string shown = name.starts_with('%') ? "../corners.bin" : name;
    write_gltf(name, "missing.png");
    auto loaded = read_gltf();
    ASSERT_FALSE(loaded) << name;
    EXPECT_NE(to_string(loaded.error()).find(shown), std::string::npos) << to_string(loaded.error());
    loaded = read_gltf(SidecarFiles::Anywhere);
    ASSERT_TRUE(loaded) << to_string(loaded.error());
    EXPECT_EQ(loaded->mesh.triangles.size(), 1U);
    write_gltf("corners.bin", name);
    loaded = read_gltf();
    ASSERT_FALSE(loaded) << name << " as an image";
    EXPECT_NE(to_string(loaded.error()).find(shown), std::string::npos) << to_string(loaded.error());
  }
  write_gltf("corners.bin", "missing.png");
  EXPECT_TRUE(read_gltf());
}

TEST_F(SidecarFile, LeavesOutObjReferencesOutsideTheFolder) {
  if (!can(FileFormat::Obj, FormatCapability::Read)) GTEST_SKIP() << "the build reads no OBJ";
  write("outer.mtl", "newmtl a\nKd 1 0 0\n");
  fs::create_symlink("../outer.mtl", folder_ / "in" / "linked.mtl");
  for (const std::string name : {"../outer.mtl", "linked.mtl"}) {
    write("in/main.obj", "mtllib " + name + "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n");
    const auto loaded = read_mesh(folder_ / "in" / "main.obj");
    ASSERT_TRUE(loaded) << to_string(loaded.error());
    ASSERT_FALSE(loaded->warnings.empty());
    EXPECT_NE(loaded->warnings.front().find(name), std::string::npos) << loaded->warnings.front();
    EXPECT_TRUE(loaded->sidecars.empty());
    const auto trusted = read_mesh(folder_ / "in" / "main.obj", {}, SidecarFiles::Anywhere);
    ASSERT_TRUE(trusted);
    EXPECT_EQ(trusted->mesh.materials.front().name, "a");
  }
}

TEST_F(SidecarFile, RefusesSceneReferencesOutsideTheFolder) {
  Scene scene;
  const auto type = scene.types.find_or_add({});
  ASSERT_TRUE(type);
  SceneGrid grid;
  grid.grid.set({0, 0, 0}, *type);
  Instance instance;
  instance.grid = scene.add_grid(std::move(grid));
  scene.add_instance(instance);
  ASSERT_TRUE(save_scene(scene, folder_ / "outer.vox"));
  write(
      "in/main.json",
      R"({"quoin_scene":1,"files":[{"id":"a","path":"../outer.vox"}],"instances":[{"file":"a","position":[0,0,0]}]})");
  const auto refused = load_scene(folder_ / "in" / "main.json");
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("../outer.vox"), std::string::npos) << to_string(refused.error());
  LoadOptions trusted;
  trusted.sidecar_files = SidecarFiles::Anywhere;
  const auto loaded = load_scene(folder_ / "in" / "main.json", trusted);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->scene.voxel_count(), 1);
}

}  // namespace
}  // namespace quoin
