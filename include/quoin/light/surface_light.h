#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/light/light_colour.h>
#include <quoin/light/propagated_light.h>
#include <quoin/mesh/quad.h>
#include <quoin/mesh/smooth_occlusion.h>

namespace quoin {

/// Light at the four corners of a face, in the order of FaceOcclusion: twelfths of a level, which means of up to four
/// levels are whole numbers of. Each in a word: the sky's in the lowest byte, then red, green and blue, 0 to 180.
using FaceLight = std::array<std::uint32_t, 4>;

/// The levels of a corner.
[[nodiscard]] constexpr MeanLevels levels_of_corner(std::uint32_t twelfths) {
  const auto level = [&](int shift) { return static_cast<float>(twelfths >> shift & 255U) / 12.0F; };
  return {level(0), level(8), level(16), level(24)};
}

/// Where faces may stay merged.
enum class LightMerging : std::uint8_t {
  Constant,  ///< along an edge along which light does not change: also right where corners become colours first, and
             ///< these are interpolated
  Linear,    ///< where light is a linear function of the place: right where levels are interpolated, over whichever two
             ///< triangles, and become colours (light_colour) in the fragment shader
};

/// The light that reaches surfaces: smooth over faces and meshes, and never through walls.
///
///   SurfaceLight surface(light, grid, types);                         // one a thread
///   surface.split(quads, chunk, LightMerging::Linear, lit, corners);  // blocks
///   surface.read({mesh.positions, mesh.normals, origin}, levels);     // vertices of smooth meshes
///
/// Corners:  the mean of the voxels in front of the face that touch the corner. One that is opaque is left out, and so
///           is one at the far side of two that are: light does not go there. So a corner of a closed room is dark
///           whatever shines behind the wall, and what touches the same corner from the same side has the same light.
/// Vertices: half a sample in front of the surface, of the eight voxels around by their nearness; those that are
///           opaque, or not connected with the nearest that is not, through the others, are left out.
///           It depends on the place alone, so that meshes of neighbours have the same bits where they meet.
/// Lifetime: light, grid and types must outlive it, and stay as they are while it is used; `light` is up to date.
/// Threads:  each needs one of its own: it remembers rows (1.3 MB).
/// Source:   corners as block games draw them (Luanti leaves out what is opaque likewise).
class SurfaceLight {
 public:
  SurfaceLight(const PropagatedLight& light, const Grid& grid, const VoxelRegistry& types);
  SurfaceLight(SurfaceLight&&) noexcept;
  SurfaceLight& operator=(SurfaceLight&&) noexcept;
  ~SurfaceLight();

  /// The corners of a face of a voxel. All 0 where the voxel in front is opaque.
  [[nodiscard]] FaceLight face(IVec3 voxel, Direction direction);

  /// Splits quads of a chunk, as a mesher gave them, where light at their corners would not be what it is at those of
  /// single faces. `corners` gets those of each quad of `out`, in the order of the quads they come from; both are
  /// replaced.
  void split(const QuadBuffer& quads, IVec3 chunk, LightMerging merging, QuadBuffer& out,
             std::vector<FaceLight>& corners);

  /// Light of vertices, or of any places at a surface: sample (i, j, k) is the middle of voxel (i, j, k).
  /// Requires: as many normals as positions, unit ones, and room for as many in `out`.
  void read(const SmoothPlaces& places, std::span<MeanLevels> out);

 private:
  struct Rows;
  std::unique_ptr<Rows> rows_;
};

}  // namespace quoin
