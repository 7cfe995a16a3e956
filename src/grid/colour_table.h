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

/// Collects pairs of colour and material, and creates a voxel type for each.
class ColourTable {
 public:
  struct Entry {
    Rgba8 colour;
    std::uint32_t material;
    std::uint32_t voxels;
  };

  /// Returns the index of a pair. Equal pairs have equal indices, which count up from 0. Each call counts one voxel.
  [[nodiscard]] std::uint32_t index_of(Rgba8 colour, std::uint32_t material);
  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  /// Returns the colour of a material, of the same alpha, that is nearest to `colour`; `colour` if there is none.
  [[nodiscard]] Rgba8 nearest(Rgba8 colour, std::uint32_t material) const;

  /// Adds a type for each pair and returns the types by index. A type has the properties of the pair's material in
  /// `materials` and the pair's colour; it is transparent if alpha is below 255. If there are more than `most` pairs,
  /// or more than the registry has space for, similar colours of one material are merged into their mean, weighted by
  /// voxels, and a line is added to `warnings`.
  /// Errors: LimitExceeded if the materials alone are too many. Requires: every pair's material is one of `materials`.
  /// Source: P. Heckbert, "Color Image Quantization for Frame Buffer Display" (1982): median cut.
  [[nodiscard]] Result<std::vector<VoxelType>> add_to(VoxelRegistry& types, std::span<const VoxelProperties> materials,
                                                      std::vector<std::string>& warnings,
                                                      std::size_t most = kMaxVoxelTypes) const;

 private:
  /// Returns a reduced colour for each entry; some become equal. Errors: LimitExceeded.
  [[nodiscard]] Result<std::vector<Rgba8>> reduced(std::size_t most) const;
  std::vector<Entry> entries_;
  std::unordered_map<std::uint64_t, std::uint32_t> indices_;  // by colour and material
};

}  // namespace quoin
