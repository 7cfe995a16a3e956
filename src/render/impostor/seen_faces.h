#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/render/impostor.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/trace/occupancy_tree.h>

#include "core/coordinates/chunk_order.h"
#include "render/impostor/impostor_surface.h"
#include "render/impostor/raster/impostor_faces.h"
#include "render/impostor/snapshot.h"

namespace quoin {

/// A face and the views that saw it.
struct SeenFace {
  ShellFace face;
  const ImpostorFaces::Surfel* surfel = nullptr;  ///< null: a voxel face
  std::uint32_t views = 0;
  bool in_shape = false;  ///< the surfel is a piece of a shape

  /// Returns true if its rectangle has a slope. Fields' surfels always count as inclined.
  [[nodiscard]] bool is_inclined() const { return surfel != nullptr && (!in_shape || surfel->is_inclined()); }
};

/// Returns all faces of a shell, then the pieces of field and shapes, with their visibility in the 26 snapshots of
/// `edge` texels per side. Order: as in ImpostorShell::faces and SurfacePieces. `pieces` must outlive the result.
///
/// Source: all faces drawn from each view. Cost: about 10 ns per face and view.
[[nodiscard]] BlockVector<SeenFace> faces_seen_of(const ImpostorShell& shell, const SurfacePieces& pieces,
                                                  const IBox& box, const ContentSphere& content, int edge);

/// Updates the faces after an edit. `before`: an impostor with the same content and edge, and complete faces.
/// `changed`: boxes around the changed voxels.
///
/// Cost: about 10 ns per face, plus the faces that may be visible in the texels of each box and view.
[[nodiscard]] BlockVector<SeenFace> faces_seen_after(const ImpostorFaces& before, const ImpostorShell& shell,
                                                     const ContentSphere& content, std::span<const IBox> changed);

/// The shapes that rays meet: the views that see each shape, by its voxel.
using MetShapes = std::map<IVec3, std::uint32_t, ByZyx>;

/// Returns the faces that one ray per texel meets, and faces that share an edge with one of them (slivers between the
/// rays). Works for any number of faces. `shapes`: receives the shapes that rays meet. Cost: about 0.15 microseconds
/// per covered texel, 1 microsecond with shapes.
[[nodiscard]] BlockVector<SeenFace> faces_seen_by_rays(const SolidVoxels& solid, const ContentSphere& content, int edge,
                                                       MetShapes& shapes);
/// Appends all pieces of shapes that rays met, each seen by the views that it faces among those that met its shape.
/// `pieces` must outlive the result.
void add_pieces_seen(const SurfacePieces& pieces, const MetShapes& met, BlockVector<SeenFace>& faces);

/// Returns the level of the faces that any view saw. Level::face indexes `faces`, which are in the order of
/// `faces_seen_of`. Of equally near faces of one direction, pieces of shapes come first.
[[nodiscard]] ImpostorFaces::Level seen_faces(const BlockVector<SeenFace>& faces, const ContentSphere& content);

/// Returns the level of the faces that no view saw, as if every view had seen them.
[[nodiscard]] ImpostorFaces::Level unseen_faces(const BlockVector<SeenFace>& faces, const ContentSphere& content);

/// Returns the level of all faces, as if every view had seen them.
[[nodiscard]] ImpostorFaces::Level all_faces(const BlockVector<SeenFace>& faces, const ContentSphere& content);

inline constexpr std::uint32_t kAllImpostorViews = (1U << kImpostorViews) - 1U;

/// A rectangle of a level: along two axes of the grid, or inclined to them (a surfel).
struct Rectangle {
  Vec3 centre{0.0F};  ///< voxels from the content's centre
  Direction direction = Direction::PosX;
  std::array<float, 2> reach = {0.5F, 0.5F};  ///< from the middle to the sides along kFaceFrames' u and v
  std::array<float, 2> slope{};               ///< rise along the direction's axis per voxel along u and v
  bool is_inclined = false;

  /// Half the sides of the box around it.
  [[nodiscard]] Vec3 half_box() const {
    const FaceFrame& frame = frame_of(direction);
    Vec3 half;
    half[frame.u] = reach[0], half[frame.v] = reach[1];
    half[frame.axis] = is_inclined ? reach[0] * std::abs(slope[0]) + reach[1] * std::abs(slope[1]) : 0.0F;
    return half;
  }
  [[nodiscard]] std::size_t side() const {
    return static_cast<std::size_t>(direction) + (is_inclined ? ImpostorFaces::kSides / 2 : 0);
  }
};

/// Returns the rectangle of a face or surfel. `centre` is the content's.
[[nodiscard]] Rectangle rectangle_of(const SeenFace& seen, DVec3 centre);

/// Collects the rectangles of a level.
class LevelMaker {
 public:
  explicit LevelMaker(const ContentSphere& content) { level_.size = static_cast<float>(content.radius); }
  /// Reserves memory for this number of rectangles.
  void reserve(std::size_t count);

  /// Requires: sides come in their order; `views` has a bit set. `face`: see ImpostorFaces::Level::face.
  void add(const Rectangle& rectangle, std::uint32_t views, std::uint32_t face);
  [[nodiscard]] ImpostorFaces::Level level() &&;

 private:
  void put(const Rectangle& rectangle, std::uint32_t views, std::uint32_t face);
  void end_sides(std::size_t side);
  void end_group();

  ImpostorFaces::Level level_;
  std::size_t side_ = 0;  // minimum side of the next rectangle
  Rectangle last_;
  Vec3 low_{0.0F};  // of the current group
  Vec3 high_{0.0F};
  bool has_reach_ = false;  // of another length than 0.5
  bool has_slope_ = false;
};

// Faces and cells are sorted along a Morton curve.

/// Returns the 21 low bits of a number, spread to every third bit.
[[nodiscard]] constexpr std::uint64_t spread_bits(std::uint64_t bits) {
  bits &= 0x1F'FFFF;
  bits = (bits | bits << 32) & 0x001F'0000'0000'FFFF;
  bits = (bits | bits << 16) & 0x001F'0000'FF00'00FF;
  bits = (bits | bits << 8) & 0x100F'00F0'0F00'F00F;
  bits = (bits | bits << 4) & 0x10C3'0C30'C30C'30C3;
  return (bits | bits << 2) & 0x1249'2492'4924'9249;
}

/// Reverses `spread_bits`; ignores the bits between.
[[nodiscard]] constexpr std::uint64_t gathered_bits(std::uint64_t bits) {
  bits &= 0x1249'2492'4924'9249;
  bits = (bits | bits >> 2) & 0x10C3'0C30'C30C'30C3;
  bits = (bits | bits >> 4) & 0x100F'00F0'0F00'F00F;
  bits = (bits | bits >> 8) & 0x001F'0000'FF00'00FF;
  bits = (bits | bits >> 16) & 0x001F'0000'0000'FFFF;
  return (bits | bits >> 32) & 0x1F'FFFF;
}

/// The position along a Morton curve, which keeps neighbours mostly together. Requires: coordinates of 0 to 2^21 - 1.
[[nodiscard]] constexpr std::uint64_t morton_code(IVec3 position) {
  QUOIN_ASSERT((static_cast<std::uint32_t>(position.x | position.y | position.z) >> 21) == 0, "coordinates of 21 bits");
  return spread_bits(static_cast<std::uint64_t>(position.x)) |
         spread_bits(static_cast<std::uint64_t>(position.y)) << 1 |
         spread_bits(static_cast<std::uint64_t>(position.z)) << 2;
}

[[nodiscard]] constexpr IVec3 morton_position(std::uint64_t code) {
  return {static_cast<int>(gathered_bits(code)), static_cast<int>(gathered_bits(code >> 1)),
          static_cast<int>(gathered_bits(code >> 2))};
}

struct MortonHash {
  std::size_t operator()(std::uint64_t code) const {
    const std::uint64_t hash = code * 0x9E37'79B9'7F4A'7C15U;
    return hash ^ hash >> 32;
  }
};

}  // namespace quoin
