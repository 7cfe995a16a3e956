#pragma once

#include <cstddef>
#include <cstdint>

#include <quoin/core/assert.h>
#include <quoin/core/axis_orientation.h>
#include <quoin/core/direction.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/grid/voxel_shape.h>
#include <quoin/mesh/occlusion.h>

namespace [[gnu::visibility("default")]] quoin {

/// One merged face, packed into a 64-bit word.
///
///   bits    content
///   0-17    lowest voxel covered (chunk coordinates): x in 0-5, y in 6-11, z in 12-17
///   18-23   size along the direction's u, minus 1
///   24-29   size along the direction's v, minus 1
///   30-37   occlusion of the four corners, 2 bits each, corner 0 lowest
///   38      diagonal flipped
///   39-41   direction
///   42-57   type
///   58-63   orientation: AxisOrientation::index, 0 except for types whose state turns them (see `orientation`)
struct Quad {
  std::uint64_t bits = 0;

  static constexpr int kSizeUShift = 18;
  static constexpr int kSizeVShift = 24;
  static constexpr int kOcclusionShift = 30;
  static constexpr int kFlipShift = 38;
  static constexpr int kDirectionShift = 39;
  static constexpr int kTypeShift = 42;
  static constexpr int kOrientationShift = 58;

  /// Returns the lowest voxel covered, 0..63 on each axis.
  [[nodiscard]] IVec3 voxel() const { return {field(0, 63), field(6, 63), field(12, 63)}; }
  /// Returns the size in voxels along the direction's u (first axis), 1..64.
  [[nodiscard]] int size_u() const { return field(kSizeUShift, 63) + 1; }
  /// Returns the size in voxels along the direction's v (second axis), 1..64.
  [[nodiscard]] int size_v() const { return field(kSizeVShift, 63) + 1; }
  [[nodiscard]] Direction direction() const { return static_cast<Direction>(field(kDirectionShift, 7)); }
  [[nodiscard]] VoxelType type() const { return static_cast<VoxelType>(field(kTypeShift, 0xFFFF)); }
  [[nodiscard]] bool flipped() const { return field(kFlipShift, 1) != 0; }
  [[nodiscard]] FaceOcclusion occlusion() const { return {occlusion(0), occlusion(1), occlusion(2), occlusion(3)}; }
  /// Returns the occlusion of one corner. Requires: 0 <= corner < 4.
  [[nodiscard]] std::uint8_t occlusion(int corner) const {
    QUOIN_ASSERT(corner >= 0 && corner < 4, "0 <= corner < 4");
    return static_cast<std::uint8_t>(field(kOcclusionShift + 2 * corner, 3));
  }
  /// Returns the orientation of the voxels' faces (VoxelProperties::orientations): `turned_face` returns the quad's
  /// face for it. Orientations with equal faces have one here, the first: all sides of a log have the same. Types
  /// without textures have the orientation that the state selects.
  [[nodiscard]] AxisOrientation orientation() const {
    return AxisOrientation::at(static_cast<int>(bits >> kOrientationShift));
  }
  /// Returns the position of a corner in chunk coordinates, 0..64. Corners are in the order of FaceOcclusion.
  /// Requires: 0 <= index < 4.
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

/// Quads of one chunk, in the order direction, layer, row, column. Reuse a buffer between calls: its capacity only
/// grows.
using QuadBuffer = BlockVector<Quad>;

/// A visible face of a shape (VoxelProperties::shapes).
struct ShapeFace {
  const ShapeModel* model = nullptr;  ///< not null; its lifetime is that of the type's shapes
  std::uint32_t bits = 0;             ///< voxel as in Quad; bits 18 to 25: occlusion of the four corners
  std::uint16_t face = 0;             ///< index into ShapeModel::faces
  VoxelType type = kAir;

  static constexpr int kOcclusionShift = 18;

  [[nodiscard]] const ModelFace& model_face() const {
    QUOIN_ASSERT(model != nullptr && face < model->faces.size(), "a face of a model");
    return model->faces[face];
  }
  /// Returns the voxel, 0..63 on each axis. The face may reach one voxel outside.
  [[nodiscard]] IVec3 voxel() const {
    const auto field = [&](int shift) { return static_cast<int>(bits >> shift & 63U); };
    return {field(0), field(6), field(12)};
  }
  /// Returns the position of a corner in chunk coordinates. Requires: corner < 4.
  [[nodiscard]] Vec3 corner(std::size_t corner) const {
    QUOIN_ASSERT(corner < 4, "corner < 4");
    return Vec3(voxel()) + model_face().corners[corner];
  }
  /// Returns the occlusion of the corners of ModelFace::corners, in their order.
  [[nodiscard]] FaceOcclusion occlusion() const {
    const auto of = [&](int i) { return static_cast<std::uint8_t>(bits >> (kOcclusionShift + 2 * i) & 3U); };
    return {of(0), of(1), of(2), of(3)};
  }
  /// Returns true if the face is a triangle of corners 0, 1 and 2.
  [[nodiscard]] bool is_triangle() const {
    const ModelFace& shown = model_face();
    return shown.corners[2] == shown.corners[3];
  }

  bool operator==(const ShapeFace&) const = default;
};

/// Faces of the shapes of one chunk, by voxel (z, y, x), then in the order of their models. Reuse a buffer, as
/// QuadBuffer.
using ShapeFaceBuffer = BlockVector<ShapeFace>;

/// Returns the part of a quad that starts at its voxel (u, v), counted along the direction's u and v. The part keeps
/// the quad's type and occlusion, because all merged faces have the same.
///
/// Requires: the part lies within the quad; its sizes are at least 1.
[[nodiscard]] Quad quad_part(Quad quad, int u, int v, int size_u, int size_v);

/// Returns the number of unit faces that the quads cover.
[[nodiscard]] std::int64_t face_count(const QuadBuffer& quads);

}  // namespace quoin
