#include <quoin/mesh/occlusion.h>

namespace quoin {

FaceLevels face_occlusion(const Neighbourhood& chunks, const VoxelRegistry& types, IVec3 voxel, Direction direction) {
  const FaceFrame& frame = frame_of(direction);
  const auto is_occluder = [&](int du, int dv) {
    IVec3 at = voxel + normal_of(direction);
    at[frame.u] += du;
    at[frame.v] += dv;
    return types.is_opaque(chunks.get(at));
  };
  const auto level = [&](int du, int dv) {
    return vertex_occlusion(is_occluder(du, 0), is_occluder(0, dv), is_occluder(du, dv));
  };
  return {level(-1, -1), level(1, -1), level(1, 1), level(-1, 1)};
}

}  // namespace quoin
