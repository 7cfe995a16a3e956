#include <quoin/mesh/visible_faces.h>

#include <bit>

#include <quoin/mesh/blocky.h>

namespace quoin {

std::int64_t FaceRows::count() const {
  std::int64_t total = 0;
  for (const auto& direction : rows) {
    for (const std::uint64_t row : direction) total += std::popcount(row);
  }
  return total;
}

void visible_faces(const Neighbourhood& chunks, const VoxelRegistry& types, const IBox& region,
                   std::vector<std::uint8_t>& out) {
  const IBox inside = intersect(region, kWholeChunk);
  const IVec3 size = inside.size();
  out.assign(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) * static_cast<std::size_t>(size.z), 0);
  FaceRows faces;
  BlockyMesher().find_faces(chunks, types, inside, faces);
  std::size_t next = 0;
  for (int z = inside.min.z; z < inside.max.z; ++z) {
    for (int y = inside.min.y; y < inside.max.y; ++y) {
      for (int x = inside.min.x; x < inside.max.x; ++x, ++next) {
        for (std::size_t d = 0; d < 6; ++d) {
          const std::uint64_t row = faces.rows[d][static_cast<std::size_t>(z * kChunkEdge + y)];
          out[next] = static_cast<std::uint8_t>(out[next] | (row >> x & 1U) << d);
        }
      }
    }
  }
}

}  // namespace quoin
