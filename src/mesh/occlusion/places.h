#pragma once

// Occlusion at places that nobody meshed: where each lies, and the places of one chunk, slice by slice.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <quoin/mesh/smooth_occlusion.h>

#include "mesh/smooth/scratch.h"

namespace quoin::smooth {

/// A place as a vertex: in whole 1/65,536 of a cell of the level.
struct CellPlace {
  IVec3 cell;    ///< of the whole field, at the level
  Vec3 snapped;  ///< 0 to 1 within it
};

/// None where the position is NaN or outside the int32 range. The position is in samples of level 0.
[[nodiscard]] std::optional<CellPlace> place_at(DVec3 position, int level);

/// What occlusion reads a normal as.
[[nodiscard]] Vec3 sound_normal(Vec3 normal);

/// The occlusion of far air.
[[nodiscard]] float open_occlusion(const SmoothOcclusionOptions& options);

/// The settings as they count, at the level at which they do.
struct Sampling {
  SmoothOcclusionOptions occlusion;
  int level = 0;

  Sampling(const SmoothOcclusionOptions& wanted, int wanted_level);
};

/// Of one place, sample by sample. `place.cell` is relative to the centre chunk's first.
[[nodiscard]] float occlusion_of_place(const DensityNeighbourhood& chunks, const CellPlace& place, Vec3 normal,
                                       const Sampling& sampling);

/// Places of one chunk.
struct ChunkPlaces {
  const SmoothPlaces& places;
  IVec3 chunk{0};                          ///< its coordinates, where `places` has the field's
  std::span<const std::uint32_t> numbers;  ///< of those that lie in the chunk or a cell around it; others are far air
};

/// The mesher's kernels for occlusion, with whatever the places of a chunk read.
class PlaceKernel {
 public:
  PlaceKernel();

  void occlude(const DensityNeighbourhood& chunks, const ChunkPlaces& places, const Sampling& sampling,
               std::span<float> out);

 private:
  using Kernel = void (*)(Work&, int z, std::size_t count, float* occlusion);

  void sort_by_slice(const ChunkPlaces& places, const Sampling& sampling, std::span<float> out);
  void occlude_some(const SmoothPlaces& places, int z, std::size_t first, std::size_t count, std::span<float> out);

  struct Entry {
    std::uint32_t number;
    std::uint16_t place;
    std::int16_t z;
    Vec3 snapped;
  };

  Kernel kernel_;
  Work work_;
  std::vector<Entry> entries_;                                  // those in reach, as they came
  std::vector<Entry> sorted_;                                   // by slice
  std::array<std::uint32_t, kChunkEdge + 3> first_of_slice_{};  // [z + 1], from cell -1 on
  std::array<float, kPlacesAtOnce + 64> occlusion_{};
};

}  // namespace quoin::smooth
