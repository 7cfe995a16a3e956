#include <cstring>
#include <map>
#include <random>
#include <string>

#include <zlib.h>

#include <gtest/gtest.h>

#include <quoin/io/mesh_file.h>
#include <quoin/mesh/blocky.h>

#include "core/bytes/bytes.h"

namespace quoin {
namespace {

/// Returns voxels of two colours that touch in all ways.
Scene touching_voxels() {
  Scene scene;
  VoxelProperties red;
  red.colour = {255, 0, 0, 255};
  VoxelProperties blue;
  blue.colour = {0, 0, 255, 255};
  (void)scene.types.add(red);
  (void)scene.types.add(blue);
  SceneGrid grid;
  grid.name = "touching & <apart>";
  std::mt19937 random(3);
  grid.grid.edit({IVec3(0), IVec3(9)}, [&](IVec3, VoxelType) { return static_cast<VoxelType>(random() % 3); });
  Instance instance;
  instance.position = {10.0, 20.0, 30.0};
  instance.voxel_size = 2.0;
  instance.grid = scene.add_grid(std::move(grid));
  scene.add_instance(instance);
  return scene;
}

SceneMeshes for_printing(const Scene& scene) {
  BlockySceneOptions options;
  options.part_of = [&](GridHandle grid, MeshStats&) -> Result<MeshPart> {
    BlockyMesh mesh;
    mesh.surfaces[0] = *closed_surface(scene.grids()[grid].grid);
    return mesh_part("", std::move(mesh));
  };
  return *mesh_scene(scene, options);
}

/// Returns the files of a zip by name, as its directory lists them.
std::map<std::string, std::string> unzipped(std::span<const std::byte> zip) {
  std::map<std::string, std::string> files;
  constexpr std::size_t kEnd = 22;
  ByteReader end(zip, zip.size() - kEnd, zip.size());
  EXPECT_EQ(end.u32(), 0x06054B50U);
  (void)end.u32();
  (void)end.u16();
  const std::uint16_t count = end.u16();
  (void)end.u32();
  ByteReader directory(zip, end.u32(), zip.size());
  for (int i = 0; i < count; ++i) {
    EXPECT_EQ(directory.u32(), 0x02014B50U);
    (void)directory.take(12);
    const std::uint32_t crc = directory.u32();
    const std::uint32_t packed = directory.u32();
    const std::uint32_t size = directory.u32();
    const std::uint16_t name_size = directory.u16();
    (void)directory.take(12);
    const std::uint32_t at = directory.u32();
    const std::string name(directory.text(name_size));
    std::string text(size, '\0');
    z_stream stream{};
    inflateInit2(&stream, -MAX_WBITS);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(zip.data() + at + 30 + name_size));
    stream.avail_in = packed;
    stream.next_out = reinterpret_cast<Bytef*>(text.data());
    stream.avail_out = size;
    EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END) << name;
    inflateEnd(&stream);
    EXPECT_EQ(crc32(0, reinterpret_cast<const Bytef*>(text.data()), size), crc) << name;
    // The local header must match.
    ByteReader own(zip, at, zip.size());
    EXPECT_EQ(own.u32(), 0x04034B50U);
    (void)own.take(10);
    EXPECT_EQ(own.u32(), crc);
    files[name] = text;
  }
  return files;
}

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

TEST(Print, ClosesMeshesForPrinting) {
  const Scene scene = touching_voxels();
  EXPECT_EQ(count_open_edges(for_printing(scene)), 0U);
  EXPECT_GT(count_open_edges(*mesh_scene(scene)), 100U);
  const auto smooth = mesh_scene_smoothly(scene);
  ASSERT_TRUE(smooth);
  EXPECT_EQ(count_open_edges(*smooth), 0U);
}

TEST(Print, StlRoundTrips) {
  const Scene scene = touching_voxels();
  const SceneMeshes meshes = for_printing(scene);
  MeshFileOptions options;
  options.up = UpAxis::Z;
  options.scale = 0.5;
  const auto bytes = write_mesh(meshes, FileFormat::Stl, options);
  ASSERT_TRUE(bytes);
  const std::size_t triangles = meshes.parts[0].surfaces[0].indices.size() / 3;
  EXPECT_EQ(bytes->size(), 84 + 50 * triangles);
  const auto read = read_mesh(*bytes);
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->mesh.triangles.size(), triangles);
  const DBox box = read->mesh.bounds();
  EXPECT_NEAR(box.min.x, 5.0, 0.02);
  EXPECT_NEAR(box.min.y, 10.0, 0.02);
  EXPECT_NEAR(box.max.z, 24.0, 0.02);
  // After welding by position, each edge lies in two triangles.
  std::map<std::tuple<double, double, double>, int> numbers;
  std::map<std::pair<int, int>, int> uses;
  for (const auto& t : read->mesh.triangles) {
    std::array<int, 3> n{};
    for (std::size_t k = 0; k < 3; ++k) {
      const DVec3& p = read->mesh.positions[t[k]];
      n[k] = numbers.try_emplace({p.x, p.y, p.z}, static_cast<int>(numbers.size())).first->second;
    }
    for (std::size_t k = 0; k < 3; ++k) ++uses[{n[k], n[(k + 1) % 3]}];
  }
  std::size_t bad = 0;
  for (const auto& [edge, count] : uses) {
    const auto back = uses.find({edge.second, edge.first});
    bad += count == 1 && back != uses.end() && back->second == 1 ? 0 : 1;
  }
  EXPECT_EQ(bad, 0U);
}

TEST(Print, ThreeMfHasAColouredModel) {
  const Scene scene = touching_voxels();
  const SceneMeshes meshes = for_printing(scene);
  const auto bytes = write_mesh(meshes, FileFormat::ThreeMf);
  ASSERT_TRUE(bytes);
  const auto files = unzipped(*bytes);
  ASSERT_EQ(files.size(), 3U);
  EXPECT_TRUE(files.contains("[Content_Types].xml"));
  EXPECT_TRUE(files.contains("_rels/.rels"));
  const std::string& model = files.at("3D/3dmodel.model");
  EXPECT_NE(model.find("unit=\"millimeter\""), std::string::npos);
  EXPECT_NE(model.find("name=\"touching &amp; &lt;apart>\""), std::string::npos);
  EXPECT_EQ(count_of(model, "<m:color "), 2U);
  EXPECT_NE(model.find("#FF0000FF"), std::string::npos);
  EXPECT_EQ(count_of(model, "<triangle "), meshes.parts[0].surfaces[0].indices.size() / 3);
  EXPECT_LT(count_of(model, "<vertex "), meshes.parts[0].surfaces[0].positions.size());
  EXPECT_EQ(count_of(model, "<item "), 1U);
  EXPECT_EQ(*write_mesh(meshes, FileFormat::ThreeMf), *bytes);
}

}  // namespace
}  // namespace quoin
