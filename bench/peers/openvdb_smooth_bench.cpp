// OpenVDB's volumeToMesh: quads without normals, on one thread.

#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/global_control.h>

#include "bench/peers/smooth_report.h"

namespace quoin::peers {
namespace {

// Unlike the others, it closes the sides and the bottom of the terrain, where its background begins.
constexpr std::int64_t kTerrainTriangles = 45'656;

struct Prepared {
  std::vector<openvdb::FloatGrid::Ptr> grids;
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> quads;
};

Prepared prepare(const std::vector<std::vector<float>>& fields) {
  openvdb::initialize();
  Prepared prepared;
  for (const auto& field : fields) {
    using Values = openvdb::tools::Dense<const float, openvdb::tools::LayoutXYZ>;
    const Values dense(openvdb::CoordBBox({0, 0, 0}, {63, 63, 63}), field.data());
    const auto grid = openvdb::FloatGrid::create(1000.0F);
    openvdb::tools::copyFromDense(dense, grid->tree(), 0.0F);
    prepared.grids.push_back(grid);
  }
  return prepared;
}

void mesh(Prepared& prepared, std::size_t i) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  openvdb::tools::volumeToMesh(*prepared.grids[i], prepared.points, prepared.quads, 0.0);
}

PeerMesh take(const Prepared& prepared) {
  PeerMesh mesh;
  mesh.triangles = 2 * static_cast<std::int64_t>(prepared.quads.size());
  for (const openvdb::Vec3s& p : prepared.points) mesh.vertices.emplace_back(p.x(), p.y(), p.z());
  return mesh;
}

[[maybe_unused]] const bool kRegistered = [] {
  add_smooth("peer/openvdb/", "no_normals", kTerrainTriangles, prepare, mesh, take);
  return true;
}();

}  // namespace
}  // namespace quoin::peers
