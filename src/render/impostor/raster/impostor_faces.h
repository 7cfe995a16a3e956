#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/occlusion.h>
#include <quoin/render/impostor.h>
#include <quoin/render/light_options.h>

namespace quoin {

/// The faces of an impostor.
struct ImpostorFaces {
  static constexpr int kLevels = 6;          ///< the faces themselves, then cells of 2, 4, 8, 16, 32 voxels
  static constexpr std::size_t kGroup = 16;  ///< faces projected at once
  static constexpr std::size_t kSides = 12;  ///< the six directions of voxels' faces, then those of surfels

  /// Rectangles close together in space. Positions match those of Level. Fillers at the end allow kernels to read past
  /// it.
  struct Groups {
    std::array<BlockVector<float>, 3> centre;
    std::array<BlockVector<float>, 3> half;  ///< from the centre to the sides of the box around them
    BlockVector<std::uint32_t> views;        ///< views that saw any of them
  };

  /// The surface in a cube of 4^3 bits.
  struct Cell {
    Vec3 corner{0.0F};                                 ///< lowest corner, voxels from the content's centre
    std::uint64_t bits = 0;                            ///< bit x + 4 y + 16 z
    std::array<std::uint32_t, kImpostorViews> face{};  ///< index into `faces` of a face that the view saw in this cell
    bool operator==(const Cell&) const = default;
  };

  /// The rectangles drawn at one size: arrays over rectangles, by direction, axis-aligned rectangles before inclined
  /// ones (surfels). Each direction's count is rounded up to whole groups with rectangles that no view saw.
  ///
  /// Level 0 holds the faces and surfels themselves. Each coarser level holds the sides of boxes, one around the
  /// visible content of a Cell. A ray that meets a box is followed through the bits of its cell. Boxes and bits contain
  /// every face of a voxel and form a closed layer below surfels, so a ray that meets the grid's surface meets a bit:
  /// no level has holes.
  struct Level {
    std::array<BlockVector<float>, 3> centre;       ///< of the rectangle, voxels from the content's centre
    BlockVector<std::uint32_t> views;               ///< bit i: view i saw it; coarser levels: all
    BlockVector<std::uint32_t> face;                ///< index into `faces`, or into `cells` if there are any
    std::array<BlockVector<float>, 2> reach;        ///< from the middle to the sides along kFaceFrames' u and v; empty:
                                                    ///< 0.5 everywhere
    std::array<BlockVector<float>, 2> slope;        ///< see Surfel; empty if there are no surfels
    std::array<std::uint32_t, kSides + 1> begin{};  ///< of each side; the end of the last
    Groups groups;                                  ///< of each kGroup rectangles
    BlockVector<Cell> cells;
    float step = 0.0F;  ///< the width of a bit of these, voxels
    float size = 0.0F;  ///< no coordinate is larger

    [[nodiscard]] std::size_t count() const { return views.size(); }
    /// Returns the tolerance, in voxels, beyond a rectangle's sides where rays still meet it: rectangles that share an
    /// edge meet at points that differ by rounding.
    [[nodiscard]] float room() const { return 1e-5F + 2e-6F * size; }
  };

  /// The properties of a face that are the same at all levels.
  struct Face {
    IVec3 voxel{0};
    VoxelType type = kAir;
    std::uint8_t occlusion = 0;  ///< of the four corners, two bits each
    Direction direction : 3 = Direction::PosX;
    std::uint8_t open_rays : 4 = kRays;  ///< number of open occlusion rays from the face's middle
    bool in_field : 1 = false;           ///< of a field: `direction` is the axis direction nearest to its normal
    static constexpr int kRays = 9;
  };

  /// Height of light ray starts above a surfel, because it is flat and the surface is curved.
  static constexpr float kSurfelLift = 0.5F;

  /// The side of a shape that a face shows.
  struct ShapeSide {
    const ShapeModel* model = nullptr;  ///< null: the face is of a field
    std::int16_t face = -1;             ///< index into `model->faces`

    /// Returns true if it lies on a side of its voxel.
    [[nodiscard]] bool on_side() const { return face >= 0 && model->faces[static_cast<std::size_t>(face)].on_side; }
  };

  /// A piece of a field's surface at its crossing with an edge of the sample lattice. It is part of the plane through
  /// the crossing: half a sample to each side of the edge, or less if the surface ends sooner, at a sharp edge or the
  /// foot of a wall. `Face::voxel` is the edge's lower end, `direction` runs along the edge. So the surfels of one
  /// direction lie side by side like the lattice edges.
  ///
  /// Also a piece of a shape's side: `Face::voxel` is the voxel of the shape, `direction` the one nearest to the
  /// normal. Without slope, it is a rectangle along two axes, as a voxel's face is.
  struct Surfel {
    Vec3 normal{0.0F};             ///< normal for lighting
    float offset = 0.0F;           ///< of its centre from the edge's lower end, along the direction's axis
    std::array<float, 2> shift{};  ///< the same along kFaceFrames' u and v
    /// From the middle to the sides along these, at most 1, of shapes 1.5: multiples of 1/1,024 if there is a slope.
    std::array<float, 2> half{};
    /// Rise of the plane along the direction's axis per sample along the other two axes.
    std::array<float, 2> slope{};

    [[nodiscard]] bool is_inclined() const { return slope != std::array<float, 2>{}; }
    /// Returns its middle. `lower_end`: of its lattice edge.
    [[nodiscard]] DVec3 middle(DVec3 lower_end, Direction direction) const {
      const FaceFrame& frame = frame_of(direction);
      lower_end[frame.axis] += double{offset};
      lower_end[frame.u] += double{shift[0]};
      lower_end[frame.v] += double{shift[1]};
      return lower_end;
    }

    /// Returns the start of light rays for a point lit with this surfel: above the plane through its middle, along its
    /// normal. Points of cells may lie below that plane. `lower_end`: of its edge.
    [[nodiscard]] DVec3 start_of_light(const DVec3& point, const DVec3& lower_end, Direction direction) const {
      const double below = glm::dot(middle(lower_end, direction) - point, DVec3(normal));
      return point + (std::max(below, 0.0) + double{kSurfelLift}) * DVec3(normal);
    }
  };
  static constexpr float kSurfelRoom =
      0.05F;  ///< tolerance beyond a surfel's edges for rays, since surfels are not flush

  int edge = 0;           ///< texels per side of the snapshots
  int first_width = 0;    ///< log2 of the width in voxels of level 0's cells; 0: level 0 holds the faces themselves
  bool is_whole = false;  ///< `faces` are all faces of the opaque voxels, in the order of ImpostorShell::faces
  DVec3 centre{0.0};      ///< of the content, in the grid
  std::array<Level, kLevels> levels;
  /// Faces in crevices that no snapshot shows but a camera may see: drawn after level 0, if no face of that level hides
  /// them. Empty for grids with so many faces that level 0 holds cells.
  ///
  /// If level 0 holds surfels: cells of such faces and of the solid behind the surfels; see SurfaceCells::behind.
  Level unseen;
  BlockVector<Face> faces;
  BlockVector<Surfel> surfels;         ///< of the last of `faces`
  BlockVector<ShapeSide> shapes;       ///< of each of `surfels`; empty if no shape is shown
  std::optional<VoxelRegistry> types;  ///< if there are shapes: keeps their models
  /// The rectangles of one part of a drawn impostor: `level` of `levels`, or `unseen` for kLevels.
  [[nodiscard]] const Level& level(std::size_t number) const {
    QUOIN_ASSERT(number <= kLevels, "a level, or the unseen faces");
    return number < kLevels ? levels[number] : unseen;
  }
  [[nodiscard]] const Surfel& surfel_of(std::size_t face) const {
    QUOIN_ASSERT(face < faces.size() && face >= faces.size() - surfels.size(), "a face with a surfel");
    return surfels[face - (faces.size() - surfels.size())];
  }
  [[nodiscard]] bool has_surfel(std::size_t face) const { return face >= faces.size() - surfels.size(); }
  /// Returns the side of a shape that a face shows; null for faces of voxels and fields.
  [[nodiscard]] const ShapeSide* shape_of(std::size_t face) const {
    QUOIN_ASSERT(face < faces.size() && (shapes.empty() || shapes.size() == surfels.size()), "a face of the impostor");
    const std::size_t first = faces.size() - shapes.size();
    return face < first || shapes[face - first].model == nullptr ? nullptr : &shapes[face - first];
  }

  [[nodiscard]] std::size_t bytes() const;
};

/// Returns the openness, 0 to 1, at a point of a face (in the grid): from its corners for voxels and shapes in
/// OcclusionMode::Vertex and Smooth, otherwise from rays at its middle.
[[nodiscard]] float openness_of(const ImpostorFaces::Face& face, OcclusionMode mode, DVec3 position);

[[nodiscard]] inline FaceOcclusion unpacked_corners(std::uint8_t packed) {
  FaceOcclusion corners{};
  for (std::size_t i = 0; i < 4; ++i) corners[i] = static_cast<std::uint8_t>(packed >> 2 * i & 3U);
  return corners;
}

}  // namespace quoin
