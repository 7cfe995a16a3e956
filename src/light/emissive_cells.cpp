#include "light/emissive_cells.h"

#include <algorithm>
#include <limits>

#include <glm/geometric.hpp>

#include <quoin/core/direction.h>

#include "light/surfaces.h"

namespace quoin {
namespace {

Vec3 emitted_by(const VoxelProperties& properties) {
  if (!(properties.emission > 0.0F)) return Vec3(0.0F);
  const float most = std::numeric_limits<float>::max() / 1e6F;  // so that sums of many are finite
  return linear_colour(properties.colour) * std::min(properties.emission, most);
}

// What is gathered of a cell.
struct Sum {
  DVec3 first{0.0};     // power times place
  double second = 0.0;  // and times its square
  double weight = 0.0;
  IVec3 origin{0};
  EmissiveCell cell;
  bool is_used = false;

  // Places are counted from the first voxel, so that squares stay small wherever the grid's origin is.
  void add(IVec3 voxel, Direction face, Vec3 light) {
    const DVec3 middle = DVec3(voxel - origin) + 0.5 + 0.5 * DVec3(normal_of(face));
    const double power = static_cast<double>(light.x) + static_cast<double>(light.y) + static_cast<double>(light.z);
    first += power * middle;
    second += power * glm::dot(middle, middle);
    weight += power;
    cell.power[static_cast<std::size_t>(face)] += light;
  }
  void add_voxel(IVec3 voxel) {
    const IBox own{voxel, voxel + 1};
    cell.box = is_used ? unite(cell.box, own) : own;
    if (!is_used) origin = voxel;
    is_used = true;
  }
  [[nodiscard]] EmissiveCell finished() const {
    EmissiveCell done = cell;
    const DVec3 mean = first / weight;
    done.centre = DVec3(origin) + mean;
    done.spread_squared = std::max(second / weight - glm::dot(mean, mean), 0.0);
    return done;
  }
};

bool has_emissive_types(const Chunk& chunk, const VoxelRegistry& types) {
  const std::vector<VoxelType> all = chunk.types();
  return std::any_of(all.begin(), all.end(),
                     [&](VoxelType type) { return type < types.size() && types[type].emission > 0.0F; });
}

}  // namespace

void EmissiveCells::look_at(const Grid& grid, const VoxelRegistry& types, IVec3 at) {
  chunks_.erase(at);
  const Chunk* chunk = grid.find_chunk(at);
  if (chunk == nullptr || !has_emissive_types(*chunk, types)) return;
  constexpr int kAcross = kChunkEdge / kEdge;
  std::map<int, Sum> sums;  // by the cell's number
  GridReader reader(grid);
  const IVec3 corner = at * kChunkEdge;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      for (int x = 0; x < kChunkEdge; ++x) {
        const IVec3 voxel = corner + IVec3{x, y, z};
        const VoxelType type = reader.get(voxel);
        if (type == kAir || type >= types.size() || !(types[type].emission > 0.0F)) continue;
        Sum& sum = sums[((z / kEdge) * kAcross + y / kEdge) * kAcross + x / kEdge];
        sum.add_voxel(voxel);
        const Vec3 light = emitted_by(types[type]);
        for (const Direction face : kDirections) {
          const VoxelType before = grid.get(voxel + normal_of(face));
          if (!types.is_opaque(before) && before != type) sum.add(voxel, face, light);
        }
      }
    }
  }
  std::vector<EmissiveCell> cells;
  for (const auto& [number, sum] : sums) {
    if (sum.weight > 0.0) cells.push_back(sum.finished());
  }
  if (!cells.empty()) chunks_[at] = std::move(cells);
}

void EmissiveCells::update(const Grid& grid, const VoxelRegistry& types) {
  if (!types.changes_since(followed_types_).empty()) followed_ = {};
  ChangeCursor now = followed_;
  const GridChanges changes = grid.changes_since(now);
  followed_ = {};  // stays so when memory runs out
  if (changes.all) chunks_.clear();
  for (const IVec3 chunk : chunks_to_mesh(grid, changes)) look_at(grid, types, chunk);
  followed_ = now;
}

}  // namespace quoin
