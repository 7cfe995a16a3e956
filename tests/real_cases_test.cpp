// Small inputs of real bug reports, stored in tests/corpus/cases: one test per kind of fault.

#include <algorithm>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include <quoin/io/chunk_source.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/mesh_file.h>
#include <quoin/io/volume.h>
#include <quoin/io/vox.h>
#include <quoin/scene/scene.h>

#include "io/byte_stream.h"
#include "io/vox/write/vox_parts.h"

namespace quoin {

namespace {

namespace fs = std::filesystem;

fs::path case_file(const std::string& name) {
  return fs::path(QUOIN_SOURCE_DIR) / "tests" / "corpus" / "cases" / name;
}

LoadedScene load_case(const std::string& name, const LoadOptions& options = {}) {
  auto loaded = load_scene(case_file(name), options);
  EXPECT_TRUE(loaded) << (loaded ? "" : to_string(loaded.error()));
  return loaded ? std::move(*loaded) : LoadedScene{};
}

bool has_warning(const LoadedScene& loaded, std::string_view part) {
  return std::ranges::any_of(loaded.warnings,
                             [&](const std::string& line) { return line.find(part) != std::string::npos; });
}

const SceneGrid& first_grid(const LoadedScene& loaded) {
  return loaded.scene.grids()[loaded.scene.grids().handles().front()];
}

const VoxelProperties& type_at(const LoadedScene& loaded, IVec3 voxel) {
  return loaded.scene.types[first_grid(loaded).grid.get(voxel)];
}

TEST(MinecraftCases, OpensLayoutOf26) {
  for (const char* path : {"minecraft-26.1-layout", "minecraft-26.1-layout/level.dat"}) {
    const LoadedScene loaded = load_case(path);
    EXPECT_EQ(loaded.scene.voxel_count(), 8704) << path;
    EXPECT_EQ(loaded.dimension, "minecraft:overworld");
    EXPECT_EQ(loaded.dimensions, (std::vector<std::string>{"minecraft:overworld", "minecraft:the_nether"}));
  }
}

TEST(MinecraftCases, ReadsRequestedDimension) {
  for (const char* name : {"nether", "minecraft:the_nether"}) {
    const LoadedScene loaded = load_case("minecraft-26.1-layout", {.dimension = name});
    EXPECT_EQ(loaded.dimension, "minecraft:the_nether");
  }
  const auto other = load_scene(case_file("minecraft-26.1-layout"), {.dimension = "end"});
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::InvalidArgument);
  EXPECT_NE(other.error().message.find("minecraft:overworld, minecraft:the_nether"), std::string::npos);
}

TEST(MinecraftCases, ReadsChunksFarFromTheSpawn) {
  const LoadedScene loaded = load_case("minecraft-far-from-spawn");
  EXPECT_EQ(loaded.scene.voxel_count(), 4352);
  EXPECT_NEAR(first_grid(loaded).grid.bounds().min.x, 30'000'000, 1'000);
}

TEST(MinecraftCases, ReadsSectionsWithoutLongs) {
  const LoadedScene loaded = load_case("minecraft-section-without-longs");
  EXPECT_EQ(loaded.scene.voxel_count(), 8192);
  EXPECT_TRUE(loaded.warnings.empty());
  EXPECT_EQ(load_case("litematic-one-kind-no-longs.litematic").scene.voxel_count(), 64);
}

TEST(MinecraftCases, ReadsLinearRegionsOrNamesMissingLibrary) {
  const auto loaded = load_scene(case_file("minecraft-linear"));
  if (loaded) {
    EXPECT_EQ(loaded->scene.voxel_count(), 4352);
  } else {
    EXPECT_NE(loaded.error().message.find(".linear"), std::string::npos) << loaded.error().message;
    EXPECT_NE(loaded.error().message.find("libzstd-dev"), std::string::npos) << loaded.error().message;
  }
}

TEST(MinecraftCases, ReadsARegionWithOneBadTableEntry) {
  for (const char* path : {"region-one-bad-table-entry", "region-one-bad-table-entry/r.0.0.mca"}) {
    const LoadedScene loaded = load_case(path);
    EXPECT_EQ(loaded.scene.voxel_count(), 4096) << path;
    EXPECT_TRUE(has_warning(loaded, "chunk (1, 0)")) << path;
  }
}

TEST(SchematicCases, BambooIsOpaqueAndYellow) {
  const LoadedScene loaded = load_case("schem-bamboo-is-glass.schem");
  EXPECT_EQ(loaded.scene.voxel_count(), 9);
  for (int x = 1; x < 10; ++x) {
    const VoxelProperties& type = type_at(loaded, {x, 0, 0});
    EXPECT_EQ(type.visibility, Visibility::Opaque) << type.name;
    EXPECT_GT(type.colour.r, type.colour.b + 40) << type.name;
    if (type.name != "minecraft:bamboo_block") {
      EXPECT_GT(type.colour.r, 180) << type.name;
    }
  }
}

TEST(SchematicCases, ReportsInvisibleBlocksAndKeepsLights) {
  const LoadedScene loaded = load_case("schem-barrier-light-vanish.schem");
  EXPECT_EQ(loaded.scene.voxel_count(), 1);
  for (const char* name : {"1 minecraft:barrier", "1 minecraft:light", "1 minecraft:structure_void"}) {
    EXPECT_TRUE(has_warning(loaded, name)) << name;
  }
  ASSERT_EQ(loaded.scene.lamps.size(), 1U);
  EXPECT_EQ(loaded.scene.lamps[0].position, DVec3(3.5, 0.5, 0.5));
  EXPECT_EQ(loaded.scene.lamps[0].range, 15.0);
}

TEST(VoxCases, ReadsPalettesOfFewerColours) {
  const LoadedScene loaded = load_case("vox-rgba-of-255-colours.vox");
  EXPECT_EQ(loaded.scene.voxel_count(), 1);
  EXPECT_TRUE(loaded.warnings.empty());
  const VoxelProperties& type = type_at(loaded, first_grid(loaded).grid.bounds().min);
  EXPECT_EQ(type.colour, (Rgba8{255, 0, 0, 255}));
}

TEST(VoxCases, IgnoresContentClaimedByMain) {
  LoadedScene loaded = load_case("vox-main-claims-8-bytes-of-content.vox");
  EXPECT_EQ(loaded.scene.voxel_count(), 1);
  EXPECT_TRUE(has_warning(loaded, "MAIN claims 8 bytes of content"));
  loaded.scene.edit(loaded.scene.instances().handles().front()).position.x += 3.0;
  const auto written = write_vox(loaded);
  ASSERT_TRUE(written);
  const auto again = read_vox(written->bytes);
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->warnings.empty()) << again->warnings.front();
}

TEST(QubicleCases, ZAxisFlagDoesNotMirror) {
  const LoadedScene left = load_case("qb-letter-F-zaxis0.qb");
  const LoadedScene right = load_case("qb-letter-F-zaxis1.qb");
  EXPECT_EQ(left.scene.bounds().min, right.scene.bounds().min);
  const IBox box = first_grid(right).grid.bounds();
  ASSERT_EQ(first_grid(left).grid.bounds().min, box.min);
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) {
      for (int x = box.min.x; x < box.max.x; ++x) {
        EXPECT_EQ(type_at(left, {x, y, z}).colour, type_at(right, {x, y, z}).colour);
      }
    }
  }
}

TEST(QubicleCases, LeavesOutAnEmptyMatrix) {
  const LoadedScene loaded = load_case("qb-empty-matrix-at-int-max.qb");
  EXPECT_EQ(loaded.scene.voxel_count(), 1);
  EXPECT_EQ(loaded.scene.grids().size(), 1U);
  EXPECT_TRUE(has_warning(loaded, "\"Layer\""));
}

TEST(BinvoxCases, BecomesVoxWithoutItsScale) {
  const LoadedScene loaded = load_case("binvox-to-vox.binvox");
  const auto written = write_vox(loaded);
  ASSERT_TRUE(written) << to_string(written.error());
  ASSERT_FALSE(written->warnings.empty());
  EXPECT_NE(written->warnings.back().find("1.75 units"), std::string::npos) << written->warnings.back();
  const auto again = read_vox(written->bytes);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->scene.voxel_count(), 8);
  EXPECT_EQ(vox_unsupported_features(loaded).value(), written->warnings);
}

TEST(NrrdCases, ReadsBzip2OrNamesMissingLibrary) {
  const auto volume = read_volume(case_file("nrrd-bzip2.nrrd"));
  if (volume) {
    EXPECT_EQ(volume->values, read_volume(case_file("nrrd-detached-gzip.nhdr"))->values);
  } else {
    EXPECT_NE(volume.error().message.find("libbz2-dev"), std::string::npos) << volume.error().message;
  }
}

TEST(NrrdCases, ReadsADetachedHeader) {
  const auto volume = read_volume(case_file("nrrd-detached-gzip.nhdr"));
  ASSERT_TRUE(volume) << to_string(volume.error());
  EXPECT_EQ(volume->size, IVec3(24));
}

/// Inputs that are too large for the repository.
TEST(NrrdCases, ReadsOtherEncodingsAndAxes) {
  const fs::path folder = fs::path(QUOIN_SOURCE_DIR).parent_path() / "shared" / "data" / "cases";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not there";
  const auto raw = read_volume(folder / "nrrd-detached.nhdr");
  ASSERT_TRUE(raw) << to_string(raw.error());
  for (const char* name : {"nrrd-ascii.nrrd", "nrrd-hex.nrrd", "nrrd-vector-axis-first.nrrd"}) {
    const auto volume = read_volume(folder / name);
    ASSERT_TRUE(volume) << to_string(volume.error());
    ASSERT_EQ(volume->values.size(), raw->values.size()) << name;
    for (std::size_t i = 0; i < raw->values.size(); ++i) ASSERT_NEAR(volume->values[i], raw->values[i], 1e-4) << name;
  }
}

std::int64_t voxels_of(const char* name, double voxel_size, SolidVoxels solid = SolidVoxels::Winding) {
  LoadOptions options;
  options.mesh.voxel_size = voxel_size;
  options.mesh.solid = solid;
  return load_case(name, options).scene.voxel_count();
}

TEST(TriangleCases, FacesBetweenVoxelsAddNoVoxels) {
  EXPECT_EQ(voxels_of("obj-cube-on-lattice.obj", 1.0), 64);
  EXPECT_EQ(voxels_of("obj-cube-through-centres.obj", 1.0), 64);
}

TEST(TriangleCases, VoxelizesConcavePolygonsExactly) {
  // A square of 4 with a hole of 2, and a star: each voxel whose centre lies in the polygon counts. The square without
  // its hole has the area 12, 30,000 voxels of 0.02 x 0.02. The star has the area 4.702282 by the shoelace formula, of
  // the corners in the file; that is 11,755.7 voxels. Counting the centres within by the even-odd rule gives 11,758.
  EXPECT_EQ(voxels_of("obj-keyhole-polygon.obj", 0.02, SolidVoxels::None), 30'000);
  EXPECT_EQ(voxels_of("ply-concave-polygon.ply", 0.02, SolidVoxels::None), 11'758);
}

TEST(TriangleCases, ReadsFilesOfOtherPrograms) {
  for (const char* name : {"obj-bom.obj", "obj-continued-line.obj", "obj-empty-indices.obj", "ply-cr-lines.ply"}) {
    const auto mesh = read_mesh(case_file(name));
    ASSERT_TRUE(mesh) << name << ": " << to_string(mesh.error());
    EXPECT_EQ(mesh->mesh.triangles.size(), 1U) << name;
    EXPECT_EQ(mesh->mesh.positions.size(), 3U) << name;
    EXPECT_TRUE(mesh->warnings.empty()) << name;
  }
}

TEST(TriangleCases, ReadsFullyTransparentModelsAsOpaque) {
  const LoadedScene loaded = load_case("obj-tr-1.obj");
  EXPECT_TRUE(has_warning(loaded, "fully transparent"));
  const VoxelProperties& type = type_at(loaded, first_grid(loaded).grid.bounds().min);
  EXPECT_EQ(type.colour, (Rgba8{255, 0, 0, 255}));
  EXPECT_EQ(type.visibility, Visibility::Opaque);
}

TEST(TriangleCases, ReadsLongStlAndRefusesCutStl) {
  const auto mesh = read_mesh(case_file("stl-trailing-bytes.stl"));
  ASSERT_TRUE(mesh) << to_string(mesh.error());
  EXPECT_EQ(mesh->mesh.triangles.size(), 1U);
  ASSERT_EQ(mesh->warnings.size(), 1U);
  EXPECT_EQ(mesh->warnings[0], "left out: the last 9 bytes, which follow the triangles");
  const auto cut = load_scene(case_file("stl-cut.stl"));
  ASSERT_FALSE(cut);
  EXPECT_EQ(cut.error().message, "the header promises 1 triangles, which need 134 bytes, but the file has 127");
}

TEST(GoxelCases, ReadsShapeLayers) {
  const LoadedScene loaded = load_case("gox-two-shape-layers.gox");
  EXPECT_EQ(loaded.scene.voxel_count(), 744);
  ASSERT_EQ(loaded.scene.grids().size(), 2U);
  const SceneGrid& ball = loaded.scene.grids()[loaded.scene.grids().handles()[0]];
  const SceneGrid& box = loaded.scene.grids()[loaded.scene.grids().handles()[1]];
  EXPECT_EQ(ball.grid.voxel_count(), 552);
  EXPECT_EQ(box.grid.voxel_count(), 192);
  EXPECT_EQ(ball.grid.bounds().min, IVec3(-5, 0, -5));
  EXPECT_EQ(ball.grid.bounds().max, IVec3(5, 10, 5));
  EXPECT_EQ(box.grid.bounds().size(), IVec3(6, 8, 4));
  EXPECT_EQ(loaded.scene.types[box.grid.get(box.grid.bounds().min)].colour, (Rgba8{40, 200, 40, 255}));
  EXPECT_TRUE(loaded.warnings.empty());
}

// A file of 15 bytes promises 65,535 names: the reader looks up none of them.
TEST(LuantiCases, RefusesCutOffNames) {
  const auto loaded = load_scene(case_file("mts-names-cut-off.mts"));
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().message, "the file ends before its nodes");
  EXPECT_EQ(loaded.error().byte_offset, 15U);
}

// Its width is 0, with 38,400 x 65,280 rows.
TEST(LuantiCases, RefusesSchematicWithoutNodes) {
  const auto loaded = load_scene(case_file("mts-no-width.mts"));
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().message, "invalid size: 0 x 38400 x 65280 nodes");
}

std::vector<std::byte> unpacked(const fs::path& path) {
  const auto packed = read_file(path);
  EXPECT_TRUE(packed);
  return packed ? first_bytes(*packed, std::size_t{1} << 24).value() : std::vector<std::byte>();
}

TEST(AceOfSpadesCases, ReadsMapsOf240Layers) {
  std::vector<std::byte> bytes = unpacked(case_file("vxl-height-240.vxl.gz"));
  auto loaded = load_scene(bytes);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->scene.voxel_count(), 262'144);
  EXPECT_EQ(first_grid(*loaded).canvas.size(), IVec3(512, 240, 512));
  // The first column without a voxel: four bytes say so.
  bytes.erase(bytes.begin() + 4, bytes.begin() + 8);
  bytes[1] = std::byte{240};
  loaded = load_scene(bytes);
  ASSERT_TRUE(loaded) << to_string(loaded.error());
  EXPECT_EQ(loaded->scene.voxel_count(), 262'143);
}

}  // namespace

}  // namespace quoin
