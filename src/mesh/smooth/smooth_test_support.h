#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include <glm/common.hpp>

#include <quoin/core/hash.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/mesh/smooth.h>

namespace quoin {

inline constexpr float kBand = 8.0F;

inline constexpr SmoothOcclusion kForms[] = {SmoothOcclusion::SolidShare, SmoothOcclusion::Weighted,
                                             SmoothOcclusion::WeightedPublished, SmoothOcclusion::SoftShare};

/// Returns a chunk of a field. Samples outside the box `within` are air, and not computed.
inline DensityChunk chunk_of_field(const std::function<double(IVec3)>& field, IVec3 chunk = IVec3{0},
                                   const std::optional<IBox>& within = std::nullopt) {
  const Half air = stored_density(kBand, kBand);
  DensityChunk out(air);
  const IVec3 corner = chunk * kChunkEdge;
  const IVec3 first = within ? glm::clamp(within->min - corner, 0, kChunkEdge) : IVec3(0);
  const IVec3 end = within ? glm::clamp(within->max - corner, 0, kChunkEdge) : IVec3(kChunkEdge);
  std::array<Half, kChunkEdge> row{};
  row.fill(air);
  for (int z = first.z; z < end.z && first.x < end.x; ++z) {
    for (int y = first.y; y < end.y; ++y) {
      for (int x = first.x; x < end.x; ++x) {
        row[static_cast<std::size_t>(x)] = stored_density(static_cast<float>(field(corner + IVec3(x, y, z))), kBand);
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
  /// `within`: as in `chunk_of_field`.
  explicit World(const std::function<double(IVec3)>& field, const std::optional<IBox>& within = std::nullopt) {
    for (int i = 0; i < 27; ++i) {
      chunks_.push_back(chunk_of_field(field, Neighbourhood::offset(i), within));
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
