#pragma once

#include <cstdint>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/occlusion.h>

namespace quoin {

/// One merged face, packed into a word.
///
/// bits 0-5 x, 6-11 y, 12-17 z of the lowest voxel it covers (chunk coordinates); 18-23 and 24-29 size along the
/// direction's u and v, less one; 30-37 occlusion of the four corners, corner 0 lowest; 38 diagonal flipped; 39-41
/// direction; 42-57 type; the rest 0.
struct Quad {
  std::uint64_t bits = 0;

  static constexpr int kSizeUShift = 18;
  static constexpr int kSizeVShift = 24;
  static constexpr int kOcclusionShift = 30;
  static constexpr int kFlipShift = 38;
  static constexpr int kDirectionShift = 39;
  static constexpr int kTypeShift = 42;

  /// The lowest voxel covered, 0..63 on each axis.
  [[nodiscard]] IVec3 voxel() const { return {field(0, 63), field(6, 63), field(12, 63)}; }
  /// Voxels along the direction's first and second axis, 1..64.
  [[nodiscard]] int size_u() const { return field(kSizeUShift, 63) + 1; }
  [[nodiscard]] int size_v() const { return field(kSizeVShift, 63) + 1; }
  [[nodiscard]] Direction direction() const { return static_cast<Direction>(field(kDirectionShift, 7)); }
  [[nodiscard]] VoxelType type() const { return static_cast<VoxelType>(field(kTypeShift, 0xFFFF)); }
  [[nodiscard]] bool flipped() const { return field(kFlipShift, 1) != 0; }
  [[nodiscard]] FaceOcclusion occlusion() const { return {occlusion(0), occlusion(1), occlusion(2), occlusion(3)}; }
  /// That of a corner. Requires: 0 <= corner < 4.
  [[nodiscard]] std::uint8_t occlusion(int corner) const {
    QUOIN_ASSERT(corner >= 0 && corner < 4, "0 <= corner < 4");
    return static_cast<std::uint8_t>(field(kOcclusionShift + 2 * corner, 3));
  }
  /// Position of a corner, in the order of FaceOcclusion, in chunk coordinates, 0..64. Requires: 0 <= index < 4.
  [[nodiscard]] IVec3 corner(int index) const {
    QUOIN_ASSERT(index >= 0 && index < 4, "0 <= index < 4");
    const FaceFrame& frame = frame_of(direction());
    IVec3 p = voxel();
    if (frame.sign > 0) p[frame.axis] += 1;
    if (index == 1 || index == 2) p[frame.u] += size_u();
    if (index >= 2) p[frame.v] += size_v();
    return p;
  }

  bool operator==(const Quad&) const = default;

 private:
  [[nodiscard]] int field(int shift, int mask) const { return static_cast<int>(bits >> shift) & mask; }
};

/// Quads of one chunk, in the order direction, layer, row, column. Reuse one between calls: it only grows.
using QuadBuffer = std::vector<Quad>;

/// The part of a quad from its voxel (u, v) on, counted along the direction's u and v. Where faces were merged all of
/// them are alike, so that a part carries what the whole does.
///
/// Requires: it lies within the quad; its sizes are at least 1.
[[nodiscard]] Quad quad_part(Quad quad, int u, int v, int size_u, int size_v);

/// Unit faces that the quads cover.
[[nodiscard]] std::int64_t face_count(const QuadBuffer& quads);

}  // namespace quoin
