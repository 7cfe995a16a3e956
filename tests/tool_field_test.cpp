// Volumes and fields in voxel formats, and surfaces of volumes.

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <set>
#include <string>

#include <nlohmann/json.hpp>

#include <quoin/io/formats.h>
#include <quoin/io/volume.h>
#include <quoin/scene/scene_meshes.h>

#include "tests/tool_for_tests.h"

namespace quoin {

namespace {

using Json = nlohmann::json;

constexpr int kSide = 24;

/// Integers that fall by 5 per sample from 100 in the middle: many equal 60.
int value_at(int x, int y, int z) {
  const double away = std::sqrt((x - 11) * (x - 11) + (y - 12) * (y - 12) + (z - 11) * (z - 11));
  return static_cast<int>(std::lround(100.0 - 5.0 * away));
}

class ToolField : public ToolTest {
 protected:
  void SetUp() override {
    ToolTest::SetUp();
    write_ball("ball.nrrd", "");
    // Spacing of 0.5, turned by 10 degrees about the third axis.
    write_ball("turned.nrrd",
               "space: right-anterior-superior\n"
               "space directions: (0.492404,0.086824,0) (-0.086824,0.492404,0) (0,0,0.5)\nspace origin: (3,4,5)\n");
  }
  void write_ball(const std::string& name, const std::string& space) {
    std::ofstream out(folder_.file(name), std::ios::binary);
    out << "NRRD0005\ntype: int16\ndimension: 3\n" << space << "sizes: 24 24 24\nencoding: raw\nendian: little\n\n";
    for (int z = 0; z < kSide; ++z) {
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
          const auto value = static_cast<std::int16_t>(value_at(x, y, z));
          out.write(reinterpret_cast<const char*>(&value), 2);
        }
      }
    }
  }
  static int count_above(int iso) {
    int count = 0;
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
      count += value_at(i % kSide, i / kSide % kSide, i / kSide / kSide) > iso ? 1 : 0;
    }
    return count;
  }
  Json said(const std::string& arguments) {
    const ToolRun result = run(arguments + " --json");
    EXPECT_EQ(result.status, 0) << arguments << result.err;
    return result.status == 0 ? Json::parse(result.out) : Json();
  }
};

TEST_F(ToolField, BecomesVoxelsAtSurfaceValue) {
  for (const std::string ending : {"vox", "qb", "gox", "vxl", "binvox", "schem"}) {
    const Json made = said("convert ball.nrrd a." + ending + " --iso 60");
    EXPECT_EQ(made["voxels"], count_above(60)) << ending;
    EXPECT_EQ(made["iso"], 60.0) << ending;
    EXPECT_NE(made["warnings"].dump().find("fields converted to voxels"), std::string::npos) << ending;
  }
  EXPECT_EQ(said("info a.vox")["voxels"], count_above(60));
  EXPECT_EQ(said("info a.qb")["voxels"], count_above(60));
  EXPECT_GT(said("convert ball.nrrd b.vox")["voxels"], 0) << "at a value that is found";
}

TEST_F(ToolField, StaysFieldUnlessSolidIsRequested) {
  const Json field = said("convert ball.nrrd a.json --iso 60");
  EXPECT_EQ(field["voxels"], 0);
  EXPECT_EQ(field["solid_samples"], count_above(60));
  EXPECT_EQ(said("convert ball.nrrd b.json --iso 60 --solid")["voxels"], count_above(60));
  EXPECT_EQ(said("convert a.json c.json --solid")["voxels"], count_above(60));
  EXPECT_EQ(said("convert a.json c.vox")["voxels"], count_above(60));
  EXPECT_EQ(run("convert ball.nrrd a.glb --solid").status, 2);
}

TEST_F(ToolField, RoundsRotationToQuarterTurns) {
  const Json made = said("convert turned.nrrd a.vox --iso 60");
  EXPECT_EQ(made["voxels"], count_above(60));
  EXPECT_NE(made["warnings"].dump().find("rotated by up to 10"), std::string::npos) << made["warnings"];
  EXPECT_EQ(made["warnings"].dump().find("between voxels"), std::string::npos) << made["warnings"];
}

TEST_F(ToolField, CountsTriangles) {
  const Json of_volume = said("convert ball.nrrd a.glb --iso 60");
  EXPECT_EQ(of_volume["faces_visible"], of_volume["triangles"]);
  ASSERT_EQ(run("convert ball.nrrd a.json --iso 60 -q").status, 0);
  const Json of_field = said("convert a.json b.glb");
  EXPECT_EQ(of_field["faces_visible"], of_field["triangles"]);
  EXPECT_EQ(of_field["faces_total"], of_field["triangles"]);
}

TEST_F(ToolField, RefusesSimplifyingBlocksBeforeReading) {
  // The file cannot be read, but option errors come first.
  std::ofstream(folder_.file("broken.vox"), std::ios::binary) << "VOX \x96";
  const ToolRun result = run("convert broken.vox a.glb --simplify 0.1");
  EXPECT_EQ(result.status, 2);
  EXPECT_NE(result.err.find("--simplify needs --mesher smooth"), std::string::npos) << result.err;
}

TEST_F(ToolField, WarnsIfNothingCanBeSimplified) {
  if (!can_simplify()) GTEST_SKIP() << "this build cannot simplify";
  // No two of its triangles are coplanar.
  {
    std::ofstream out(folder_.file("round.nrrd"), std::ios::binary);
    out << "NRRD0005\ntype: float\ndimension: 3\nsizes: 24 24 24\nencoding: raw\nendian: little\n\n";
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
      const DVec3 away = DVec3(i % kSide, i / kSide % kSide, i / kSide / kSide) - DVec3(11.31, 12.17, 11.73);
      const auto value = static_cast<float>(100.0 - 5.0 * glm::length(away));
      out.write(reinterpret_cast<const char*>(&value), sizeof(value));
    }
  }
  const Json made = said("convert round.nrrd a.glb --iso 60 --simplify 0.0000001");
  EXPECT_NE(made["warnings"].dump().find("removes no triangle"), std::string::npos) << made["warnings"];
  EXPECT_EQ(said("convert ball.nrrd a.glb --iso 60 --simplify 0.5")["warnings"].dump().find("removes no"),
            std::string::npos);
}

using Point = std::array<float, 3>;
using PointEdge = std::pair<Point, Point>;

/// The faults of a surface after joining vertices by position.
struct SurfaceFaults {
  std::size_t flat = 0;
  std::size_t crowded_edges = 0;
  std::size_t twice = 0;
};

SurfaceFaults faults_of(const MeshView& view) {
  SurfaceFaults faults;
  std::map<PointEdge, int> edges;
  std::map<std::set<Point>, int> triangles;
  for (std::size_t i = 0; i < view.indices.size(); i += 3) {
    std::array<Vec3, 3> p{};
    std::array<Point, 3> at{};
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = view.positions[view.indices[i + k]];
      at[k] = {p[k].x, p[k].y, p[k].z};
    }
    faults.flat += glm::length(glm::cross(DVec3(p[1]) - DVec3(p[0]), DVec3(p[2]) - DVec3(p[0]))) < 1e-9 ? 1 : 0;
    for (std::size_t k = 0; k < 3; ++k) ++edges[std::minmax(at[k], at[(k + 1) % 3])];
    ++triangles[{at[0], at[1], at[2]}];
  }
  for (const auto& [edge, count] : edges) faults.crowded_edges += count > 2 ? 1 : 0;
  for (const auto& [triangle, count] : triangles) faults.twice += count > 1 ? 1 : 0;
  return faults;
}

void expect_sound_surface(const std::filesystem::path& path, float iso) {
  const auto volume = read_volume(path);
  ASSERT_TRUE(volume) << to_string(volume.error());
  VolumeMeshOptions options;
  options.iso = iso;
  const auto meshes = mesh_volume(*volume, options);
  ASSERT_TRUE(meshes);
  ASSERT_EQ(meshes->parts.size(), 1U);
  const SurfaceFaults faults = faults_of(meshes->parts[0].surfaces[0]);
  EXPECT_EQ(faults.flat, 0U);
  EXPECT_EQ(faults.crowded_edges, 0U);
  EXPECT_EQ(faults.twice, 0U);
}

TEST_F(ToolField, HasSoundSurfaceWhereValuesEqualIso) {
  expect_sound_surface(folder_.file("ball.nrrd"), 60.0F);
  const auto real = std::filesystem::path(QUOIN_SOURCE_DIR).parent_path() / "shared" / "data" / "cases" /
                    "nrrd-integers-equal-to-iso.nrrd";
  if (!std::filesystem::exists(real)) GTEST_SKIP() << "the files are not here";
  expect_sound_surface(real, 20.0F);
  if (!can_simplify()) return;
  std::int64_t last = 3'876 / 2;
  for (const float error : {0.2F, 0.5F}) {
    VolumeMeshOptions options;
    options.iso = 20.0F;
    options.simplify_error = error;
    const auto meshes = mesh_volume(*read_volume(real), options);
    ASSERT_TRUE(meshes);
    EXPECT_LE(meshes->stats.triangles, last) << error;
    last = meshes->stats.triangles;
  }
}

}  // namespace

}  // namespace quoin
