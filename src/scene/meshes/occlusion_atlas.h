#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include <quoin/core/image.h>
#include <quoin/core/result.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/blocky.h>

namespace quoin {

/// Colours and occlusion of faces in a texture, so that faces can be merged across changes of occlusion.
///
///   a merged face of 4 x 1 voxels        its patch: one texel per voxel corner. The vertices are at texel
///   +---+---+---+---+                    centres, so a linear filter never reads beyond the patch
///   |   |   |   |   |                    o-------o-------o-------o-------o
///   +---+---+---+---+                    |       |       |       |       |
///                                        o-------o-------o-------o-------o
///
/// If occlusion is constant along an axis, the patch is one texel wide. Equal patches are stored once. A filter turns
/// the four levels of a voxel's face into a saddle, where two triangles have an edge; at the corners both are equal.
class OcclusionAtlas {
 public:
  /// The maximum texture size that devices support.
  static constexpr int kMaxEdge = 16'384;

  /// Returns true if no face was added.
  [[nodiscard]] bool is_empty() const { return patches_.empty(); }

  /// Adds the faces of a surface with voxels within 2^24 of the origin. `split` and `merged` are the same faces of the
  /// same grid, as build_blocky_mesh makes them with and without occlusion. Returns the index of this addition, for
  /// `coordinates`.
  std::size_t add(const BlockyTriangles& split, const BlockyTriangles& merged, const VoxelRegistry& types);

  /// Packs all added patches into a texture whose sides are powers of two. The same additions give the same texture.
  /// Errors: LimitExceeded beyond kMaxEdge.
  [[nodiscard]] Result<Image> draw();

  /// Returns the texture coordinates of the vertices of an addition, 0 to 1 from the upper left corner. Requires:
  /// draw() was called.
  [[nodiscard]] std::vector<std::array<float, 2>> coordinates(std::size_t addition) const;

 private:
  /// One texel per corner, rows from v = 0.
  struct Patch {
    int columns = 1;
    int rows = 1;
    int x = 0;
    int y = 0;
    Rgba8 colour{};
    std::size_t first_level = 0;  ///< in levels_
  };

  [[nodiscard]] std::size_t patch_of(const BlockyTriangles& merged, std::size_t first_vertex, Rgba8 colour);
  [[nodiscard]] bool place(const std::vector<std::size_t>& order, int edge, int& height);
  void paint(const BlockyTriangles& split, std::size_t first_vertex);

  std::vector<std::uint8_t> levels_;
  std::vector<Patch> patches_;
  std::unordered_map<std::string, std::size_t> known_;
  std::vector<std::vector<std::size_t>> additions_;  ///< of each face the patch
  std::vector<std::uint8_t> faces_;                  ///< of a chunk, by direction, layer, v and u: four levels each
  std::string key_;
  int width_ = 0;
  int height_ = 0;
};

}  // namespace quoin
