#pragma once

#include <memory>

#include <quoin/core/vec.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/terrain/terrain.h>

#include "terrain/landform.h"

namespace quoin::terrain {

/// The heights of one column of chunks, and other data that its chunks share. Generates the chunks one by one.
class SmoothColumn {
 public:
  /// `world`: the samples of the world.
  SmoothColumn(const Landform& land, const SmoothTerrainOptions& options, const IBox& world, int chunk_x, int chunk_z);
  ~SmoothColumn();

  [[nodiscard]] DensityChunk make(const TerrainTypes& types, int chunk_y);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin::terrain
