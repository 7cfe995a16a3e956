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
  static constexpr int kLevels = 5;          ///< snapshots, each of half as many texels a side as the one before
  static constexpr std::size_t kGroup = 16;  ///< faces that are projected at once

  /// Faces that lie close together in space. Positions are those of Level. Some fillers at the end let kernels read on.
  struct Groups {
    std::array<std::vector<float>, 3> centre;
    std::array<std::vector<float>, 3> half;  ///< from the centre to the sides of the box around them
    std::vector<std::uint32_t> views;        ///< that saw any of them
  };

  /// What the snapshots of one size show: arrays over faces, by direction, each direction's number rounded up to whole
  /// groups with faces that no view saw.
  struct Level {
    std::array<std::vector<float>, 3> centre;  ///< of the face, voxels from the content's centre
    std::vector<std::uint32_t> views;          ///< bit i: view i saw it
    std::vector<std::uint32_t> face;           ///< index into `faces`
    std::array<std::uint32_t, 7> begin{};      ///< of each direction; the end of the last
    Groups groups;                             ///< of each kGroup faces
    float size = 0.0F;                         ///< of the largest coordinate
    float half = 0.5F;  ///< from a face's middle to its edges, voxels: more than a voxel's where texels are larger
  };

  /// What is the same at all levels.
  struct Face {
    IVec3 voxel{0};
    VoxelType type = kAir;
    std::uint8_t occlusion = 0;  ///< of the four corners, two bits each
    Direction direction : 3 = Direction::PosX;
    std::uint8_t open_rays : 4 = kRays;  ///< of so many occlusion rays from the face's middle
    static constexpr int kRays = 9;
  };

  int edge = 0;           ///< texels a side of the finest snapshots
  bool is_whole = false;  ///< `faces` are all that the opaque voxels have, in the order of ImpostorShell::faces
  DVec3 centre{0.0};      ///< of the content, in the grid
  std::array<Level, kLevels> levels;
  /// Faces in crevices that no snapshot looked into but a camera may: drawn with the finest level, where nothing of
  /// that is before them. Of grids with very many faces they are not known.
  Level unseen;
  std::vector<Face> faces;

  [[nodiscard]] std::size_t bytes() const;
};

/// 0 to 1 at a point of a face (in the grid): in OcclusionMode::Vertex and Smooth by its corners, else by rays from its
/// middle.
[[nodiscard]] float openness_of(const ImpostorFaces::Face& face, OcclusionMode mode, DVec3 position);

[[nodiscard]] inline FaceOcclusion unpacked_corners(std::uint8_t packed) {
  FaceOcclusion corners{};
  for (std::size_t i = 0; i < 4; ++i) corners[i] = static_cast<std::uint8_t>(packed >> 2 * i & 3U);
  return corners;
}

}  // namespace quoin
