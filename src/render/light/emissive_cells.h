#pragma once

#include <array>
#include <map>
#include <utility>
#include <vector>

#include <quoin/core/changes.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

#include "core/coordinates/chunk_order.h"

namespace quoin {

/// Returns true if any type of a chunk's palette emits light. Cost: O(its types).
[[nodiscard]] bool has_emissive_types(const Chunk& chunk, const VoxelRegistry& types);

/// Returns true if a face of a type or of its shapes does not have all of the type's emission
/// (VoxelFace::emission_share).
[[nodiscard]] bool has_emission_shares(const VoxelProperties& type);

/// Appends the chunks whose cubes may be turned in another way after changes of the voxels' data, and sorts `chunks`.
/// If all data may have changed, these are all chunks of the grid.
void add_turned(const Grid& grid, const VoxelRegistry& types, const DataChanges& data, std::vector<IVec3>& chunks);

/// Appends the chunks whose shapes may look different after changes: those within kShapeReach of one. Sorts `chunks`.
/// Requires: `changes.all` is false.
void add_near_shapes(const Grid& grid, const GridChanges& changes, const DataChanges& data, std::vector<IVec3>& chunks);

/// Data about the light-emitting chunks of a grid or field, kept up to date with its edits.
template <class Item>
class EmissiveChunks {
 public:
  /// `chunks_of(changes)` returns the chunks to examine again. `look_at(chunk)` returns the items of one chunk in a
  /// BlockVector.
  template <class Content, class Find, class Look>
  void follow(const Content& content, const VoxelRegistry& types, Find&& chunks_of, Look&& look_at) {
    if (!types.changes_since(followed_types_).empty()) followed_ = {};
    PendingChanges changes(followed_, content);
    if (changes->all) chunks_.clear();
    for (const IVec3 chunk : chunks_of(*changes)) {
      chunks_.erase(chunk);
      if (BlockVector<Item> found = look_at(chunk); !found.empty()) chunks_[chunk] = std::move(found);
    }
    changes.commit();
  }

  /// Calls `visit(IVec3 chunk, const Item&)`, chunks by z, y, x.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (const auto& [chunk, items] : chunks_) {
      for (const Item& item : items) visit(chunk, item);
    }
  }

 private:
  ChangeCursor followed_;
  ChangeCursor followed_types_;
  std::map<IVec3, BlockVector<Item>, ByZyx> chunks_;  // non-empty ones
};

/// The voxels of a cell of 4^3 that emit light, or the surface of a field there, as one lamp. In the grid, in voxels.
struct EmissiveCell {
  DVec3 centre{0.0};            ///< of the faces that shine, weighted by their power
  double spread_squared = 0.0;  ///< the mean square of their distances from there
  std::array<Vec3, 6> power{};  ///< colour * emission of the faces, linear, summed by direction
  IBox box;                     ///< bounds of the emitting surfaces
};

/// The emissive cells of one grid or field, kept up to date with its edits. A voxel face emits if the voxel before it
/// is neither opaque nor of the same type, and as much as its share of the type's emission; shapes count as cubes. A
/// field's surface emits along each axis at the lattice edges that it crosses
/// in that direction, starting at an emitting sample. Each crossing counts as one sample of projected area. Inclined
/// surfaces are weighted so that the sum is their true area.
class EmissiveCells {
 public:
  static constexpr int kEdge = 4;  ///< voxels

  /// Cost: proportional to the changed chunks. A chunk without emitting types costs O(its types).
  void update(const Grid& grid, const VoxelRegistry& types);
  void update(const DensityGrid& field, const VoxelRegistry& types);

  /// Calls `visit(const EmissiveCell&)` for every cell. Chunks, and the cells in each chunk, are sorted by z, y, x.
  template <class Visit>
  void for_each(Visit&& visit) const {
    chunks_.for_each([&](IVec3, const EmissiveCell& cell) { visit(cell); });
  }

 private:
  EmissiveChunks<EmissiveCell> chunks_;
  ChangeCursor followed_data_;  // the state turns faces
};

}  // namespace quoin
