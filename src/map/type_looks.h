#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/io/chunk_source.h>

namespace quoin::map {

/// The look of a voxel type from straight above.
struct TypeLook {
  Vec3 colour{0.0F};      ///< in linear light
  float coverage = 1.0F;  ///< the share of the voxel's square that hides the voxels below, 0 to 1
  bool is_fluid = false;  ///< hides the ground gradually, by its depth
  bool glows = false;     ///< emits light: higher voxels around do not darken it
};

/// Returns the look of a type: the means of its upper faces' textures, of shapes in their default state; or its colour.
[[nodiscard]] TypeLook look_from_above(const VoxelRegistry& types, VoxelType type);

/// The looks of a source's types, which grow while it is read. Threads: one per object.
class TypeLooks {
 public:
  /// Lifetime: the source must outlive it.
  explicit TypeLooks(const ChunkSource& source) : source_(&source) {}

  /// Returns the look of a type that the source has returned.
  [[nodiscard]] const TypeLook& operator[](VoxelType type) {
    if (type >= looks_.size()) [[unlikely]]
      update();
    return looks_[type];
  }

 private:
  void update();

  const ChunkSource* source_;
  std::vector<TypeLook> looks_;  // by type
};

}  // namespace quoin::map
