#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// Numbers the colours that voxels have, each with the material that it is of, and makes types of them.
class Looks {
 public:
  /// The number of a colour of a material, the same for the same two; they count up from 0.
  [[nodiscard]] std::uint32_t number_of(Rgba8 colour, std::uint32_t material);
  [[nodiscard]] std::size_t size() const { return looks_.size(); }

  /// Adds a type for each look and returns them by number: `materials` of the look's, its colour, transparent where
  /// alpha is below 255. Where there are more looks than there is room for, the last bits of all colours are rounded,
  /// and `warnings` gets a line.
  /// Errors: LimitExceeded when four bits are not enough. Requires: every look's material is one of `materials`.
  [[nodiscard]] Result<std::vector<VoxelType>> add_to(VoxelRegistry& types, std::span<const VoxelProperties> materials,
                                                      std::vector<std::string>& warnings) const;

 private:
  struct Look {
    Rgba8 colour;
    std::uint32_t material;
  };
  std::vector<Look> looks_;
  std::unordered_map<std::uint64_t, std::uint32_t> numbers_;  // by colour and material
};

}  // namespace quoin
