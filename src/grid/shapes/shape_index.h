#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/grid/changes.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/grid/voxel_shape.h>

#include "core/rows/packed_row.h"

namespace quoin {

// A voxel with a shape.
struct PlacedShape {
  IVec3 voxel{0};
  VoxelType type = kAir;
  const ShapeModel* model = nullptr;
};

// Four planes of a chunk along z with one voxel around them, as plain arrays: for callers that look up the shapes of
// most voxels of a chunk. A plane takes the place of the one four below it.
//
// Space: voxels of the chunk, -1 to 64 on each axis. Lifetime: as the neighbourhood.
class NearPlanes {
 public:
  explicit NearPlanes(const Neighbourhood& chunks);

  // Reads a plane, -1 <= z <= 64.
  void read(int z);
  // Returns the 64 voxels of a row. Requires, as `get` and `state`: the plane was read.
  [[nodiscard]] std::span<const VoxelType, kChunkEdge> row(int y, int z) const {
    return std::span<const VoxelType, kChunkEdge>(&types_[place_of({0, y, z})], std::size_t{kChunkEdge});
  }
  [[nodiscard]] VoxelType get(IVec3 at) const { return types_[place_of(at)]; }
  // Returns the voxels of a row whose neighbourhoods of 3^3 types and states are equal to those of the voxel before, as
  // bits: they have the same shape unless it depends on their position. Requires: the planes z - 1 to z + 1 were read,
  // 0 <= y, z < 64.
  [[nodiscard]] std::uint64_t repeated(int y, int z) const;
  // Returns the type and state of each of the nine rows around a row, as words, if all voxels of each are equal from -1
  // to 64: the row's voxels have the same shape. Requires: as `repeated`.
  [[nodiscard]] std::optional<std::array<std::uint64_t, 9>> rows_around(int y, int z) const;
  [[nodiscard]] std::uint32_t state(IVec3 at) const { return states_.empty() ? 0 : states_[place_of(at)]; }
  [[nodiscard]] IVec3 origin() const { return chunks_.origin; }

 private:
  static constexpr int kRow = kChunkEdge + 2;
  static constexpr int kPlane = kRow * kRow;

  [[nodiscard]] static std::size_t place_of(IVec3 at) {
    QUOIN_ASSERT((IBox{IVec3(-1), IVec3(kChunkEdge + 1)}.contains(at)), "-1 <= x, y, z <= 64");
    return static_cast<std::size_t>((at.z & 3) * kPlane + (at.y + 1) * kRow + at.x + 1);
  }

  [[nodiscard]] static std::size_t change_of(int y, int z) { return static_cast<std::size_t>((z & 3) * kRow + y + 1); }
  // Returns the voxels of a row whose type differs from that of the voxel before.
  [[nodiscard]] static std::uint64_t changes_in(const VoxelType* row);

  Neighbourhood chunks_;
  BlockVector<VoxelType> types_;
  BlockVector<std::uint64_t> changes_;  // by row: voxels whose type or state differs from that of the voxel before
  BlockVector<std::uint8_t> is_other_at_end_;  // by row: 1 if voxel 64 differs from voxel 63
  BlockVector<std::uint32_t> states_;          // empty: all are 0
};

// As the functions of the public headers. Requires: the planes of the voxel and of its neighbours are read.
[[nodiscard]] const ShapeModel* shape_at(const NearPlanes& planes, const VoxelRegistry& types, IVec3 local);

// Returns the bounds of a box of a model, in voxels: the box itself unless it is tilted.
[[nodiscard]] DBox bounds_of(const ModelBox& box);

// Calls `visit(const DBox&)` for each colliding box of a model, in voxels: for the bounds of tilted ones, and of a
// fluid with an inclined surface. Elements that bodies pass are left out, except `with_all`.
template <class Visit>
void visit_solid_boxes(const ShapeModel& model, bool with_all, Visit&& visit) {
  for (const ModelBox& box : model.boxes) {
    if (with_all || box.collides) visit(bounds_of(box));
  }
  if (model.free_faces != 0) visit(DBox{DVec3(model.min), DVec3(model.max)});
}

// A box of a model, ready for rays: the lower planes along x, y and z, then the upper ones, in the box's own space.
struct ListedBox {
  std::array<double, 6> planes{};
  const ModelBox* box = nullptr;
};

// A shape that touches a voxel. Equal voxels of a chunk share it.
struct ListedShape {
  std::array<std::int8_t, 3> offset{};  // from the touched voxel to the shape's own: -1 to 1
  std::uint8_t count = 1;               // of the first shape of a list: how many shapes the list has
  VoxelType type = kAir;
  bool is_opaque = false;  // its material
  bool is_inner = false;   // the fluid next to the own shape: bodies and queries do not meet it
  std::uint32_t first_box = 0;
  std::uint32_t box_count = 0;
  const ShapeModel* model = nullptr;

  [[nodiscard]] IVec3 voxel(IVec3 touched) const { return touched + IVec3(offset[0], offset[1], offset[2]); }
  [[nodiscard]] bool is_own() const { return (offset[0] | offset[1] | offset[2]) == 0; }
};

// The shapes that touch a voxel: its own first, then a fluid next to it (ListedShape::is_inner), then in the order of
// their voxels (z, y, x). Lifetime: until the next update of the index.
class ShapesAtVoxel {
 public:
  class Iterator {
   public:
    using value_type = PlacedShape;
    using difference_type = std::ptrdiff_t;
    Iterator() = default;
    Iterator(const ShapesAtVoxel* of, std::size_t i) : of_(of), i_(i) {}
    [[nodiscard]] PlacedShape operator*() const { return (*of_)[i_]; }
    Iterator& operator++() {
      ++i_;
      return *this;
    }
    Iterator operator++(int) { return {of_, i_++}; }
    bool operator==(const Iterator& other) const { return i_ == other.i_; }

   private:
    const ShapesAtVoxel* of_ = nullptr;
    std::size_t i_ = 0;
  };

  ShapesAtVoxel() = default;
  ShapesAtVoxel(const ListedShape* first, const ListedBox* boxes, IVec3 voxel)
      : first_(first), boxes_(boxes), voxel_(voxel) {}

  [[nodiscard]] bool empty() const { return first_ == nullptr; }
  [[nodiscard]] std::size_t size() const { return first_ == nullptr ? 0 : first_->count; }
  [[nodiscard]] PlacedShape operator[](std::size_t i) const {
    QUOIN_ASSERT(i < size(), "one of the shapes");
    return {first_[i].voxel(voxel_), first_[i].type, first_[i].model};
  }
  [[nodiscard]] Iterator begin() const { return {this, 0}; }
  [[nodiscard]] Iterator end() const { return {this, size()}; }
  // Returns true if the voxel itself has a shape.
  [[nodiscard]] bool has_own() const { return first_ != nullptr && first_->is_own(); }
  [[nodiscard]] IVec3 voxel() const { return voxel_; }
  [[nodiscard]] std::span<const ListedShape> listed() const { return {first_, size()}; }
  // Returns the boxes of one of the listed shapes.
  [[nodiscard]] std::span<const ListedBox> boxes(const ListedShape& shape) const {
    return {boxes_ + shape.first_box, shape.box_count};
  }

 private:
  const ListedShape* first_ = nullptr;
  const ListedBox* boxes_ = nullptr;
  IVec3 voxel_{0};
};

// Returns the area of a voxel's side that a shape covers if seen along each axis, 0 to 1. Cutout sides count by their
// visible texels. Parts behind each other count separately.
[[nodiscard]] Vec3 coverage_of(const ShapeModel& model, const VoxelFaces& type_faces);

// Returns true if a type's shapes have parts that tint light: without textures or with translucent ones. Requires: the
// type has shapes.
[[nodiscard]] bool has_glass_parts(const VoxelProperties& type);

// Returns the mean colour of the drawn sides of all shapes of a type by their areas and shares of positions, in linear
// light. Cutout sides count by their visible texels. Requires: the type has shapes.
[[nodiscard]] Vec3 mean_of_shapes(const VoxelProperties& type);

// Returns the mean share of a type's emission that these sides have (VoxelFace::emission_share), 0 to 1, by their areas
// and shares of positions. Cutout sides count by the visible texels of the part of their texture that they show. Where
// shares differ, this reads texels. Requires: the type has shapes.
[[nodiscard]] float emission_share_of_shapes(const VoxelProperties& type);

// Returns the colour that a type's shapes emit, as a multiple of the type's emission: the mean of the emitting sides,
// times the greatest share. Requires: the type has shapes.
[[nodiscard]] Vec3 glow_of_shapes(const VoxelProperties& type);

// The shaped voxels of a grid, by the voxels that they touch: a shape may reach outside its own voxel. Chunks without
// shapes take no memory; a copy shares all chunks with the original until either is updated.
//
// Voxels of glass whose shape is exactly the cube of their type (`is_cube` of voxel_shape.h), such as water below
// water, are not listed, since rays find the same in them as in a cube. They are rows of bits, for trees of cubes.
class ShapeIndex {
  struct ChunkShapes;

 public:
  // Reads single voxels, faster than `at` if they are near each other. Lifetime: until the index is updated.
  class Reader {
   public:
    explicit Reader(const ShapeIndex& index) : index_(&index) {}
    // As ShapeIndex::at.
    [[nodiscard]] ShapesAtVoxel at(IVec3 voxel) {
      const IVec3 chunk = chunk_of(voxel);
      if (chunk != chunk_ || !is_begun_) {
        const auto found = index_->chunks_.find(chunk);
        known_ = found == index_->chunks_.end() ? nullptr : found->second.get();
        chunk_ = chunk;
        is_begun_ = true;
      }
      return known_ == nullptr ? ShapesAtVoxel() : known_->at(voxel);
    }

   private:
    const ShapeIndex* index_;
    const ChunkShapes* known_ = nullptr;
    IVec3 chunk_{0};
    bool is_begun_ = false;
  };

  // Replaces everything. Cost: O(rows) per chunk with shaped types, and around them; O(types) per other chunk.
  void build(const Grid& grid, const VoxelRegistry& types);
  // Applies edits of the grid and of its data. Returns the chunks whose touched voxels may have changed, by z, y, x.
  // Requires: as OccupancyTree::update; if any type's shapes have changed, `changes.all` is true.
  // Cost: O(rows) per chunk within two voxels of a change. If it throws, nothing changes, as for `build`.
  std::vector<IVec3> update(const Grid& grid, const VoxelRegistry& types, const GridChanges& changes,
                            const DataChanges& data);

  [[nodiscard]] bool empty() const { return chunks_.empty(); }
  // Returns the chunks with voxels that shapes touch, or whose shapes are cubes, by z, y, x.
  [[nodiscard]] std::vector<IVec3> chunks() const;
  // Returns the shapes that touch a voxel, its own first, then in the order of their voxels (z, y, x). Lifetime: until
  // the next update. Cost: one hash lookup.
  [[nodiscard]] ShapesAtVoxel at(IVec3 voxel) const;
  [[nodiscard]] bool touches(IVec3 voxel) const { return !at(voxel).empty(); }
  // Returns the row of 64 voxels along x that contains a voxel: bit i is set if shapes touch voxel i of the row.
  [[nodiscard]] std::uint64_t touched_row(IVec3 voxel) const;
  // Returns the shaped voxels of a chunk that are cubes of glass: rows along x as bits, by y + 64 z; no rows if there
  // are none. Lifetime: until the next update.
  [[nodiscard]] std::span<const std::uint64_t> cubes_in(IVec3 chunk) const;
  [[nodiscard]] bool is_cube(IVec3 voxel) const;
  // Calls `visit(const PlacedShape&)` once for each listed voxel of a chunk, by z, y, x: for its own shape.
  template <class Visit>
  void for_each_in(IVec3 chunk, Visit&& visit) const {
    const auto found = chunks_.find(chunk);
    if (found == chunks_.end()) return;
    for (int i = 0; i < kChunkEdge * kChunkEdge; ++i) {
      const IVec3 first = chunk * kChunkEdge + IVec3(0, i % kChunkEdge, i / kChunkEdge);
      for (std::uint64_t left = found->second->row(first); left != 0; left &= left - 1) {
        const ShapesAtVoxel here = found->second->at(first + IVec3(std::countr_zero(left), 0, 0));
        if (here.has_own()) visit(here[0]);
      }
    }
  }
  // Returns the content of a chunk, which is replaced when its shapes change; null if there is none.
  [[nodiscard]] std::shared_ptr<const void> content(IVec3 chunk) const {
    const auto found = chunks_.find(chunk);
    return found == chunks_.end() ? nullptr : found->second;
  }
  // Returns the smallest box around the voxels that shapes touch.
  [[nodiscard]] IBox bounds() const;
  [[nodiscard]] std::size_t bytes() const;

 private:
  // A chunk has 4^3 bricks of 4^3 blocks of 4^3 voxels, each numbered x + 4 y + 16 z. Only bricks with touched voxels
  // have blocks. The voxels of a chunk share equal lists: a voxel takes four bytes, and so does a block of equal
  // voxels.
  //
  //   bricks     0  0  1  0  2 ...         0: no blocks; else 1 + the brick's place in `blocks`, in units of 64
  //   blocks     touched, first, ranks     one bit per voxel; the k-th touched voxel has cells[first + (k & ranks)]
  //   cells      3  3  0 ...               the first shape of a list in `shapes`; that shape has the list's length
  struct ChunkShapes {
    struct Block {
      std::uint64_t touched = 0;
      std::uint32_t first = 0;
      std::uint32_t ranks = 0;  // all bits are set, or none if all touched voxels have the same list
    };
    std::array<std::uint8_t, 64> bricks{};
    std::vector<Block> blocks;
    std::vector<std::uint32_t> cells;
    std::vector<ListedShape> shapes;
    std::vector<ListedBox> boxes;
    IBox bounds;                       // voxels of the grid
    std::vector<std::uint64_t> cubes;  // see `cubes_in`

    // `voxel`: of the grid, in this chunk.
    [[nodiscard]] ShapesAtVoxel at(IVec3 voxel) const {
      const std::uint32_t brick = bricks[part_of(voxel, 4)];
      if (brick == 0) return {};
      const Block& block = blocks[(brick - 1) * 64 + part_of(voxel, 2)];
      const std::size_t bit = part_of(voxel, 0);
      if ((block.touched >> bit & 1U) == 0) return {};
      const std::uint32_t rank = packed_row::count_bits(block.touched & ((std::uint64_t{1} << bit) - 1));
      return {&shapes[cells[block.first + (rank & block.ranks)]], boxes.data(), voxel};
    }
    // Returns the row of voxels along x that contains a voxel, as bits.
    [[nodiscard]] std::uint64_t row(IVec3 voxel) const {
      std::uint64_t bits = 0;
      const IVec3 first{0, voxel.y, voxel.z};
      const std::size_t shift = part_of(first, 0);
      for (std::size_t x = 0; x < 4; ++x) {
        const std::uint32_t brick = bricks[part_of(first, 4) + x];
        if (brick == 0) continue;
        const Block* const of_brick = &blocks[(brick - 1) * 64 + part_of(first, 2)];
        for (std::size_t block = 0; block < 4; ++block) {
          bits |= (of_brick[block].touched >> shift & 15U) << (16 * x + 4 * block);
        }
      }
      return bits;
    }
    // Returns the number of the unit of 2^shift voxels in the next larger one.
    static std::size_t part_of(IVec3 voxel, int shift) {
      return static_cast<std::size_t>((voxel.x >> shift & 3) + 4 * (voxel.y >> shift & 3) +
                                      16 * (voxel.z >> shift & 3));
    }
  };
  class Lists;

  using Chunks = std::unordered_map<IVec3, std::shared_ptr<const ChunkShapes>, CoordinateHash>;
  struct Types {
    // Cube: without shapes. Glass: may be a cube by its shape.
    enum class Kind : std::uint8_t { Cube, Shaped, Glass, HoldsFluid };
    VoxelRegistry registry;  // keeps the models
    std::vector<Kind> kinds;

    Types() = default;
    explicit Types(const VoxelRegistry& types);
  };

  // Returns the shapes of a chunk, or null if there are none.
  [[nodiscard]] static std::shared_ptr<const ChunkShapes> made(const Grid& grid, const Types& types, IVec3 chunk);

  Types types_;
  Chunks chunks_;
};

}  // namespace quoin
