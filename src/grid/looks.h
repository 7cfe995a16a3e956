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
  struct Look {
    Rgba8 colour;
    std::uint32_t material;
    std::uint32_t voxels;
  };

  /// The number of a colour of a material, the same for the same two; they count up from 0. Each call counts as one
  /// voxel of it.
  [[nodiscard]] std::uint32_t number_of(Rgba8 colour, std::uint32_t material);
  [[nodiscard]] std::size_t size() const { return looks_.size(); }
  /// Returns the colour of a material, of the same alpha, that is nearest to `colour`; `colour` if there is none.
  [[nodiscard]] Rgba8 nearest(Rgba8 colour, std::uint32_t material) const;

  /// Adds a type for each look and returns the types by number. A type has the properties of the look's entry in
  /// `materials` and the look's colour; it is transparent if alpha is below 255. If there are more than `most` looks,
  /// or more than the registry has space for, similar looks of one material are merged into their mean, weighted by
  /// voxels, and a line is added to `warnings`.
  /// Errors: LimitExceeded if the materials alone are too many. Requires: every look's material is one of `materials`.
  /// Source: P. Heckbert, "Color Image Quantization for Frame Buffer Display" (1982): median cut.
  [[nodiscard]] Result<std::vector<VoxelType>> add_to(VoxelRegistry& types, std::span<const VoxelProperties> materials,
                                                      std::vector<std::string>& warnings,
                                                      std::size_t most = kMaxVoxelTypes) const;

 private:
  /// Returns a reduced colour for each look; some become equal. Errors: LimitExceeded.
  [[nodiscard]] Result<std::vector<Rgba8>> reduced(std::size_t most) const;
  std::vector<Look> looks_;
  std::unordered_map<std::uint64_t, std::uint32_t> numbers_;  // by colour and material
};

}  // namespace quoin
