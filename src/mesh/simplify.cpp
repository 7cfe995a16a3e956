#include <quoin/mesh/simplify.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include <quoin/core/assert.h>

#ifdef QUOIN_HAVE_MESHOPTIMIZER
#include <meshoptimizer.h>

#include "mesh/manifold.h"
#endif

namespace quoin {

#ifdef QUOIN_HAVE_MESHOPTIMIZER

namespace {

#if QUOIN_ASSERT_ENABLED
bool has_arrays_of_one_length(const SmoothMesh& mesh) {
  const std::size_t count = mesh.positions.size();
  return mesh.normals.size() == count && mesh.albedo.size() == count && mesh.types.size() == count &&
         (mesh.occlusion.empty() || mesh.occlusion.size() == count);
}

bool names_vertices(const SmoothMesh& mesh) {
  return std::all_of(mesh.indices.begin(), mesh.indices.end(),
                     [&](std::uint32_t index) { return index < mesh.positions.size(); });
}

bool has_finite_positions(const SmoothMesh& mesh) {
  return std::all_of(mesh.positions.begin(), mesh.positions.end(),
                     [](Vec3 p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); });
}
#endif

/// Removes triangles; returns the error reached, in samples.
float remove_triangles(SmoothMesh& mesh, float error_in_samples) {
  const float* positions = &mesh.positions[0].x;
  const std::size_t count = mesh.positions.size();
  const float scale = meshopt_simplifyScale(positions, count, sizeof(Vec3));
  if (!(scale > 0.0F)) return 0.0F;
  float reached = 0.0F;
  std::vector<std::uint32_t> left(mesh.indices.size());
  left.resize(meshopt_simplify(left.data(), mesh.indices.data(), mesh.indices.size(), positions, count, sizeof(Vec3), 0,
                               error_in_samples / scale, 0, &reached));
  mesh.indices = std::move(left);
  return std::fmin(reached * scale, error_in_samples);
}

template <class T>
void keep_used(std::vector<T>& values, const std::vector<std::uint32_t>& place_of, std::size_t used) {
  if (values.empty()) return;
  std::vector<T> kept(used);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (place_of[i] != ~0U) kept[place_of[i]] = values[i];
  }
  values = std::move(kept);
}

void order_for_caches(SmoothMesh& mesh) {
  const std::size_t count = mesh.positions.size();
  meshopt_optimizeVertexCache(mesh.indices.data(), mesh.indices.data(), mesh.indices.size(), count);
  std::vector<std::uint32_t> place_of(count);
  const std::size_t used =
      meshopt_optimizeVertexFetchRemap(place_of.data(), mesh.indices.data(), mesh.indices.size(), count);
  for (std::uint32_t& index : mesh.indices) index = place_of[index];
  keep_used(mesh.positions, place_of, used);
  keep_used(mesh.normals, place_of, used);
  keep_used(mesh.occlusion, place_of, used);
  keep_used(mesh.albedo, place_of, used);
  keep_used(mesh.types, place_of, used);
}

}  // namespace

bool can_simplify() {
  return true;
}

Result<float> simplify_smooth_mesh(SmoothMesh& mesh, float error_in_samples) {
  if (!(error_in_samples >= 0.0F))
    return make_error(ErrorCode::InvalidArgument, "the error must be a number of at least 0");
#if QUOIN_ASSERT_ENABLED
  QUOIN_ASSERT(has_arrays_of_one_length(mesh));
  QUOIN_ASSERT(names_vertices(mesh));
  QUOIN_ASSERT(has_finite_positions(mesh));
#endif
  if (mesh.indices.empty()) return 0.0F;
  const float reached = remove_triangles(mesh, error_in_samples);
  // A neck three edges round, say, is drawn together to one edge.
  make_manifold(mesh);
  order_for_caches(mesh);
  return reached;
}

#else

bool can_simplify() {
  return false;
}

Result<float> simplify_smooth_mesh(SmoothMesh&, float error_in_samples) {
  if (!(error_in_samples >= 0.0F))
    return make_error(ErrorCode::InvalidArgument, "the error must be a number of at least 0");
  return make_error(
      ErrorCode::Unsupported,
      "this build cannot simplify meshes: it was made without meshoptimizer (libmeshoptimizer-dev in Debian)");
}

#endif

}  // namespace quoin
