#pragma once

#include <array>
#include <functional>
#include <vector>

#include <quoin/core/hash.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/mesh/smooth.h>

namespace quoin {

inline constexpr float kBand = 8.0F;

inline constexpr SmoothOcclusion kForms[] = {SmoothOcclusion::SolidShare, SmoothOcclusion::Weighted,
                                             SmoothOcclusion::WeightedPublished, SmoothOcclusion::SoftShare};

inline DensityChunk chunk_of_field(const std::function<double(IVec3)>& field, IVec3 chunk = IVec3{0}) {
  DensityChunk out(stored_density(kBand, kBand));
  std::array<Half, kChunkEdge> row{};
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      for (int x = 0; x < kChunkEdge; ++x) {
        row[static_cast<std::size_t>(x)] =
            stored_density(static_cast<float>(field(chunk * kChunkEdge + IVec3(x, y, z))), kBand);
      }
      out.write_row(y, z, row);
    }
  }
  out.compact();
  return out;
}

/// Chunks of a field around the origin's, all 27.
class World {
 public:
  explicit World(const std::function<double(IVec3)>& field) {
    for (int i = 0; i < 27; ++i) {
      chunks_.push_back(chunk_of_field(field, Neighbourhood::offset(i)));
    }
  }
  [[nodiscard]] DensityNeighbourhood around() const {
    DensityNeighbourhood n;
    n.outside = stored_density(kBand, kBand);
    for (std::size_t i = 0; i < 27; ++i) n.chunks[i] = &chunks_[i];
    return n;
  }

 private:
  std::vector<DensityChunk> chunks_;
};

inline std::function<double(IVec3)> sphere(DVec3 centre, double radius) {
  return [=](IVec3 p) { return glm::length(DVec3(p) - centre) - radius; };
}

inline std::function<double(IVec3)> noise(std::uint32_t seed, double amount) {
  return [=](IVec3 p) {
    std::uint32_t bits = mix_bits(static_cast<std::uint32_t>(p.x) ^ seed);
    bits = mix_bits(bits + static_cast<std::uint32_t>(p.y));
    bits = mix_bits(bits + static_cast<std::uint32_t>(p.z));
    return amount * (bits * 0x1p-31 - 1.0);
  };
}

inline SmoothOptions with(SmoothOcclusion form, int level = 0, float spread = 2.0F) {
  SmoothOptions options;
  options.split_sheets = false;
  options.occlusion.method = form;
  options.occlusion.spread = spread;
  options.levels.fill(static_cast<std::uint8_t>(level));
  return options;
}

}  // namespace quoin
