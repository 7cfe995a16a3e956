#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/light/light_options.h>
#include <quoin/mesh/occlusion.h>
#include <quoin/render/impostor.h>

namespace quoin {

/// The faces that an impostor is drawn from.
struct ImpostorFaces {
  [[nodiscard]] static const ImpostorFaces& of(const Impostor& impostor) { return *impostor.faces_; }

  static constexpr int kLevels = 5;          ///< snapshots, each of half as many texels a side as the one before
  static constexpr std::size_t kGroup = 16;  ///< faces that are projected at once
  static constexpr std::size_t kSides = 12;  ///< the six directions of voxels' faces, then those of surfels

  /// Faces that lie close together in space. Positions are those of Level. Some fillers at the end let kernels read on.
  struct Groups {
    std::array<std::vector<float>, 3> centre;
    std::array<std::vector<float>, 3> half;  ///< from the centre to the sides of the box around them
    std::vector<std::uint32_t> views;        ///< that saw any of them
  };

  /// What the snapshots of one size show: arrays over faces, by direction, those of voxels before those of the field,
  /// each direction's number rounded up to whole groups with faces that no view saw.
  struct Level {
    std::array<std::vector<float>, 3> centre;       ///< of the face, voxels from the content's centre
    std::vector<std::uint32_t> views;               ///< bit i: view i saw it
    std::vector<std::uint32_t> face;                ///< index into `faces`
    std::array<std::vector<float>, 2> slope;        ///< see Surfel; empty where there is no field
    std::array<std::vector<float>, 2> reach;        ///< of surfels: `half`, and what texels are larger than a sample
    std::array<std::uint32_t, kSides + 1> begin{};  ///< of each side; the end of the last
    Groups groups;                                  ///< of each kGroup faces
    float size = 0.0F;                              ///< of the largest coordinate
    float half = 0.5F;  ///< from a face's middle to its edges, voxels: more than a voxel's where texels are larger
  };

  /// What is the same at all levels.
  struct Face {
    IVec3 voxel{0};
    VoxelType type = kAir;
    std::uint8_t occlusion = 0;  ///< of the four corners, two bits each
    Direction direction : 3 = Direction::PosX;
    std::uint8_t open_rays : 4 = kRays;  ///< of so many occlusion rays from the face's middle
    bool in_field : 1 = false;           ///< a surfel: `direction` is that to which its normal is near
    static constexpr int kRays = 9;
  };

  /// A piece of a field's surface, where that crosses an edge of the lattice of samples: of a plane through that point
  /// what lies within half a sample to each side of the edge, or up to where the surface ends there, at a sharp edge or
  /// the foot of a wall. `Face::voxel` is the edge's lower end, `direction` along it. So the surfels of one direction
  /// lie side by side as the lattice's edges do.
  struct Surfel {
    Vec3 normal{0.0F};             ///< with which it is lit
    float offset = 0.0F;           ///< of its middle from the edge's lower end, along the direction's axis
    std::array<float, 2> shift{};  ///< the same along kFaceFrames' u and v
    std::array<float, 2> half{};   ///< from the middle to the sides along these, at most 1: whole 1/1,024
    /// How much the plane rises along the direction's axis by a sample along these.
    std::array<float, 2> slope{};
  };
  static constexpr float kSurfelRoom =
      0.05F;  ///< by which rays meet a surfel beyond its edges, since they are not flush
  /// From a surfel along its normal to where rays of light start, for what it leaves out of the surface's curvature.
  static constexpr float kSurfelLift = 0.5F;

  int edge = 0;           ///< texels a side of the finest snapshots
  bool is_whole = false;  ///< `faces` are all that the opaque voxels have, in the order of ImpostorShell::faces
  DVec3 centre{0.0};      ///< of the content, in the grid
  std::array<Level, kLevels> levels;
  /// Faces in crevices that no snapshot looked into but a camera may: drawn with the finest level, where nothing of
  /// that is before them. Of grids with very many faces they are not known.
  Level unseen;
  std::vector<Face> faces;
  std::vector<Surfel> surfels;  ///< of the last of `faces`
  [[nodiscard]] const Surfel& surfel_of(std::size_t face) const {
    return surfels[face - (faces.size() - surfels.size())];
  }

  [[nodiscard]] std::size_t bytes() const;
};

/// 0 to 1 at a point of a face (in the grid): of voxels in OcclusionMode::Vertex and Smooth by its corners, else by
/// rays from its middle.
[[nodiscard]] float openness_of(const ImpostorFaces::Face& face, OcclusionMode mode, DVec3 position);

[[nodiscard]] inline FaceOcclusion unpacked_corners(std::uint8_t packed) {
  FaceOcclusion corners{};
  for (std::size_t i = 0; i < 4; ++i) corners[i] = static_cast<std::uint8_t>(packed >> 2 * i & 3U);
  return corners;
}

}  // namespace quoin
