#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

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

// The shaped voxels of a grid, by the voxels that they touch: a shape may reach outside its own voxel. Chunks without
// shapes take no memory; a copy shares all chunks with the original until either is updated.
class ShapeIndex {
  struct ChunkShapes;

 public:
  // Reads single voxels, faster than `at` if they are near each other. Lifetime: until the index is updated.
  class Reader {
   public:
    explicit Reader(const ShapeIndex& index) : index_(&index) {}
    // As ShapeIndex::at.
    [[nodiscard]] std::span<const PlacedShape> at(IVec3 voxel) {
      const IVec3 chunk = chunk_of(voxel);
      if (chunk != chunk_ || !is_begun_) {
        const auto found = index_->chunks_.find(chunk);
        known_ = found == index_->chunks_.end() ? nullptr : found->second.get();
        chunk_ = chunk;
        is_begun_ = true;
      }
      return known_ == nullptr ? std::span<const PlacedShape>() : known_->at(local_of(voxel));
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
  // Cost: O(rows) per chunk within two voxels of a change.
  std::vector<IVec3> update(const Grid& grid, const VoxelRegistry& types, const GridChanges& changes,
                            const DataChanges& data);

  [[nodiscard]] bool empty() const { return chunks_.empty(); }
  // Returns the chunks with voxels that shapes touch, by z, y, x.
  [[nodiscard]] std::vector<IVec3> chunks() const;
  // Returns the shapes that touch a voxel, its own first, then in the order of their voxels (z, y, x). Lifetime: until
  // the next update. Cost: one hash lookup.
  [[nodiscard]] std::span<const PlacedShape> at(IVec3 voxel) const;
  [[nodiscard]] bool touches(IVec3 voxel) const { return !at(voxel).empty(); }
  // Returns the row of 64 voxels along x that contains a voxel: bit i is set if shapes touch voxel i of the row.
  [[nodiscard]] std::uint64_t touched_row(IVec3 voxel) const;
  // Calls `visit(const PlacedShape&)` once for each shaped voxel of a chunk, by z, y, x.
  template <class Visit>
  void for_each_in(IVec3 chunk, Visit&& visit) const {
    const auto found = chunks_.find(chunk);
    if (found == chunks_.end()) return;
    const ChunkShapes& all = *found->second;
    std::size_t cell = 0;
    for (std::size_t row = 0; row < all.touched.size(); ++row) {
      for (std::uint64_t left = all.touched[row]; left != 0; left &= left - 1, ++cell) {
        const PlacedShape& shape = all.shapes[all.starts[cell]];  // the cell's own, if it has one
        const auto i = static_cast<int>(row);
        if (shape.voxel == chunk * kChunkEdge + IVec3(std::countr_zero(left), i % kChunkEdge, i / kChunkEdge))
          visit(shape);
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
  // Voxels are numbered x + 64 y + 4096 z. `touched` has a bit for each; `first[i]` is the number of set bits before
  // row i, and cell k of those lists shapes[starts[k]] to shapes[starts[k + 1]].
  struct ChunkShapes {
    std::vector<std::uint64_t> touched;
    std::vector<std::uint32_t> first;
    std::vector<std::uint32_t> starts;
    std::vector<PlacedShape> shapes;
    IBox bounds;  // voxels of the grid

    [[nodiscard]] std::span<const PlacedShape> at(IVec3 local) const {
      const auto number = static_cast<std::size_t>(local.y + kChunkEdge * local.z);
      const std::uint64_t row = touched[number];
      if ((row >> local.x & 1U) == 0) return {};
      const std::size_t cell = first[number] + packed_row::count_bits(row & ((std::uint64_t{1} << local.x) - 1));
      return std::span(shapes).subspan(starts[cell], starts[cell + 1] - starts[cell]);
    }
  };

  [[nodiscard]] std::shared_ptr<const ChunkShapes> made(const Grid& grid, IVec3 chunk) const;
  void rebuild(const Grid& grid, IVec3 chunk);
  void take_types(const VoxelRegistry& types);

  VoxelRegistry types_;  // keeps the models
  std::vector<std::uint8_t> is_shaped_;
  std::unordered_map<IVec3, std::shared_ptr<const ChunkShapes>, CoordinateHash> chunks_;
};

}  // namespace quoin
