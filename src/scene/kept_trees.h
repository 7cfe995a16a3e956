#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/trace/occupancy_tree.h>

namespace quoin {

/// What rays that make light need of one grid, and of which versions of its chunks it was made.
class KeptTrees {
 public:
  /// Makes the trees, or takes over what was edited since the last time: of that grid, found by the versions of its
  /// chunks, so that whoever takes the grid's dirty chunks misses none; everything when it is another grid. Answers
  /// whether there was anything to do.
  ///
  /// Requires: the types' visibility is that of the last time; otherwise `forget` first.
  /// Cost:     that of OccupancyTree::update for the chunks that changed, and a look at every chunk's version; nothing
  ///           when the grid's version is the last one.
  bool update(const Grid& grid, const VoxelRegistry& types);
  void forget() { *this = {}; }

  [[nodiscard]] const OccupancyTree& opaque() const { return opaque_; }
  /// Null when the grid has no transparent voxel.
  [[nodiscard]] const OccupancyTree* transparent() const { return transparent_ ? &*transparent_ : nullptr; }

 private:
  struct MadeOf {
    IVec3 chunk{0};
    std::uint64_t version = 0;
    bool is_transparent = false;  ///< in part
  };
  [[nodiscard]] std::vector<MadeOf> look_at(const Grid& grid, const VoxelRegistry& types,
                                            std::vector<IVec3>& changed) const;

  std::uint64_t identity_ = 0;  // of the grid; 0: none
  std::uint64_t version_ = 0;
  std::vector<MadeOf> made_of_;
  OccupancyTree opaque_;
  std::optional<OccupancyTree> transparent_;
};

}  // namespace quoin
