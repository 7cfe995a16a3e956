#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/quad.h>
#include <quoin/mesh/smooth_occlusion.h>
#include <quoin/render/propagated_light.h>

namespace [[gnu::visibility("default")]] quoin {

/// Light at the four corners of a face, in the order of FaceOcclusion, one word per corner: sky in the lowest byte,
/// then red, green and blue. Units are twelfths of a level, 0 to 180; they represent means of up to four levels
/// exactly.
using FaceLight = std::array<std::uint32_t, 4>;

/// Returns the levels of a corner.
[[nodiscard]] constexpr MeanLevels levels_of_corner(std::uint32_t twelfths) {
  const auto level = [&](int shift) { return static_cast<float>(twelfths >> shift & 255U) / 12.0F; };
  return {level(0), level(8), level(16), level(24)};
}

/// Condition under which faces stay merged.
enum class LightMerging : std::uint8_t {
  /// Light is constant along the merged edge. Also right if corners are converted to colours first and the colours are
  /// interpolated.
  Constant,
  /// Light is a linear function of position. Right if levels are interpolated, over either pair of triangles, and
  /// converted to colours (light_colour) in the fragment shader.
  Linear,
};

/// Smooth light on faces and meshes that never leaks through walls.
///
///   SurfaceLight surface(light, grid, types);                         // one per thread
///   surface.split(quads, chunk, LightMerging::Linear, lit, corners);  // blocks
///   surface.read({mesh.positions, mesh.normals, origin}, levels);     // vertices of smooth meshes
///
/// Corners:  the mean of the voxels in front of the face that touch the corner. Skips opaque voxels and the diagonal
///           voxel if both sides are opaque, because light cannot get there. A corner of a closed room is therefore
///           independent of light behind the wall, and faces that touch a corner from the same side have the same light
///           there.
/// Vertices: sampled half a sample in front of the surface, weighted by distance from the eight surrounding voxels.
///           Skips voxels that are opaque or not connected to the nearest open voxel through the others. Depends only
///           on the position, so that neighbouring meshes have the same bits where they meet.
/// Requires: `light` is up to date.
/// Lifetime: light, grid and types must outlive it and must not change while it is used.
/// Threads:  use one object per thread; it caches rows (1.3 MB).
/// Source:   corner light as in block games (Luanti also skips opaque voxels).
class SurfaceLight {
 public:
  SurfaceLight(const PropagatedLight& light, const Grid& grid, const VoxelRegistry& types);
  SurfaceLight(SurfaceLight&&) noexcept;
  SurfaceLight& operator=(SurfaceLight&&) noexcept;
  ~SurfaceLight();

  /// Returns the light at the corners of a voxel's face. All 0 if the voxel in front is opaque.
  [[nodiscard]] FaceLight face(IVec3 voxel, Direction direction);

  /// Splits a mesher's quads where interpolation over a merged quad would differ from the light of the single faces.
  /// `corners` gets the corner light of each quad of `out`, in the order of the source quads. Replaces `out` and
  /// `corners`.
  void split(const QuadBuffer& quads, IVec3 chunk, LightMerging merging, QuadBuffer& out,
             BlockVector<FaceLight>& corners);

  /// Writes the light of vertices, or of any positions at a surface. Sample (i, j, k) is the centre of voxel (i, j, k).
  /// Requires: as many unit normals as positions; `out` has at least as many elements.
  void read(const SmoothSamples& samples, std::span<MeanLevels> out);
  /// Replaces `corners` with the light at the corners of faces of shapes, in the order of ModelFace::corners: that of
  /// `read`, rounded to twelfths of a level. `chunk`: the chunk of the faces.
  /// Reads: voxels up to 3 away from a face's own; up to 2 if its shape stays within its voxel.
  /// Cost:  0.1 microseconds per corner near changing light, less where light is even.
  void read(std::span<const ShapeFace> faces, IVec3 chunk, BlockVector<FaceLight>& corners);

 private:
  struct [[gnu::visibility("hidden")]] Rows;
  std::unique_ptr<Rows> rows_;
};

}  // namespace quoin
