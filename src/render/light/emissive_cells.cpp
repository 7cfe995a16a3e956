#include "render/light/emissive_cells.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <optional>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/memory.h>

#include "scene/surfaces.h"

namespace quoin {
namespace {

Vec3 emitted_by(const VoxelProperties& properties) {
  if (!(properties.emission > 0.0F)) return Vec3(0.0F);
  const float most = std::numeric_limits<float>::max() / 1e6F;  // so that sums of many are finite
  return linear_colour(properties.colour) * std::min(properties.emission, most);
}

// Sums over the emitting faces of a cell.
struct Sum {
  DVec3 first{0.0};     // power times position
  double second = 0.0;  // power times squared position
  double weight = 0.0;
  IVec3 origin{0};
  EmissiveCell cell;
  bool is_used = false;

  // Places are counted from the first voxel, so that squares stay small wherever the grid's origin is.
  void add(IVec3 voxel, Direction face, Vec3 light) {
    add(DVec3(voxel - origin) + 0.5 + 0.5 * DVec3(normal_of(face)), face, light);
  }
  void add(const DVec3& middle, Direction face, Vec3 light) {
    const double power = static_cast<double>(light.x) + static_cast<double>(light.y) + static_cast<double>(light.z);
    first += power * middle;
    second += power * glm::dot(middle, middle);
    weight += power;
    cell.power[static_cast<std::size_t>(face)] += light;
  }
  void add_voxel(IVec3 voxel) { add_box(voxel, {voxel, voxel + 1}); }
  void add_box(IVec3 voxel, const IBox& own) {
    cell.box = is_used ? unite(cell.box, own) : own;
    if (!is_used) origin = voxel;
    is_used = true;
  }
  [[nodiscard]] EmissiveCell finished() const {
    QUOIN_ASSERT(weight > 0.0 && is_used, "a cell with power");
    EmissiveCell done = cell;
    const DVec3 mean = first / weight;
    done.centre = DVec3(origin) + mean;
    done.spread_squared = std::max(second / weight - glm::dot(mean, mean), 0.0);
    return done;
  }
};

// Sorted by cell number.
BlockVector<EmissiveCell> cells_of(const std::map<int, Sum>& sums) {
  BlockVector<EmissiveCell> cells;
  for (const auto& [number, sum] : sums) {
    if (sum.weight > 0.0) cells.push_back(sum.finished());
  }
  return cells;
}

// Returns the ratio of a surface's area to the sum of its projections on the three axes.
float share_of_area(const DVec3& gradient) {
  const DVec3 size = glm::abs(gradient);
  const double sum = size.x + size.y + size.z;
  return sum > 0.0 ? static_cast<float>(glm::length(gradient) / sum) : 1.0F;
}

// The intersection of a body's surface with a lattice edge, relative to the solid sample, and the share of the surface
// area that it represents.
struct Crossing {
  DVec3 place{0.0};
  float share = 1.0F;
};

// Returns the gradient of a body's own field at a sample. Solid of other bodies counts as air at the same distance.
DVec3 gradient_of_body(const DensityGrid& field, const VoxelRegistry& types, IVec3 sample, VoxelType type) {
  const auto own = [&](IVec3 at) {
    const double density = field.density(at);
    if (!(density < 0.0)) return density;
    const VoxelType other = field.material(at);
    const bool is_same = other == type || (types.is_opaque(other) && types.is_opaque(type));
    return is_same ? density : -density;
  };
  DVec3 gradient;
  for (int axis = 0; axis < 3; ++axis) {
    IVec3 step{0};
    step[axis] = 1;
    gradient[axis] = own(sample + step) - own(sample - step);
  }
  return gradient;
}

// Finds the surface along the edge `out`. Returns nothing if the surface does not cross it or opaque solid is there.
std::optional<Crossing> crossing(const DensityGrid& field, const VoxelRegistry& types, IVec3 sample, VoxelType type,
                                 IVec3 out) {
  const double own = field.density(sample);
  const double next = field.density(sample + out);
  if (!(next < 0.0)) {
    const DVec3 place = own / (own - next) * DVec3(out);
    return Crossing{place, share_of_area(field.gradient_at(DVec3(sample) + place))};
  }
  const VoxelType other = field.material(sample + out);
  if (other == type || !types.is_transparent(other)) return std::nullopt;
  return Crossing{own / (own + next) * DVec3(out), share_of_area(gradient_of_body(field, types, sample, type))};
}

// Finds the emissive cells of one chunk of voxels.
BlockVector<EmissiveCell> look_at(const Grid& grid, const VoxelRegistry& types, IVec3 at) {
  const Chunk* chunk = grid.find_chunk(at);
  if (chunk == nullptr || !has_emissive_types(*chunk, types)) return {};
  constexpr int kAcross = kChunkEdge / EmissiveCells::kEdge;
  std::map<int, Sum> sums;  // by the cell's number
  GridReader reader(grid);
  const IVec3 corner = at * kChunkEdge;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      for (int x = 0; x < kChunkEdge; ++x) {
        const IVec3 voxel = corner + IVec3{x, y, z};
        const VoxelType type = reader.get(voxel);
        if (type == kAir || type >= types.size() || !(types[type].emission > 0.0F)) continue;
        Sum& sum =
            sums[(z / EmissiveCells::kEdge * kAcross + y / EmissiveCells::kEdge) * kAcross + x / EmissiveCells::kEdge];
        sum.add_voxel(voxel);
        const Vec3 light = emitted_by(types[type]);
        for (const Direction face : kDirections) {
          const VoxelType before = grid.get(voxel + normal_of(face));
          if (!types.is_opaque(before) && before != type) sum.add(voxel, face, light);
        }
      }
    }
  }
  return cells_of(sums);
}

// Finds the emissive cells of one field chunk, from the lattice edges that the surface crosses and that begin or end at
// emitting samples of the chunk.
BlockVector<EmissiveCell> look_at(const DensityGrid& field, const VoxelRegistry& types, IVec3 at) {
  const DensityChunk* chunk = field.find_chunk(at);
  if (chunk == nullptr || !has_emissive_types(chunk->materials(), types)) return {};
  constexpr int kAcross = kChunkEdge / EmissiveCells::kEdge;
  std::map<int, Sum> sums;  // by the cell's number
  const IVec3 corner = at * kChunkEdge;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      for (std::uint64_t solid = chunk->solid_row(y, z); solid != 0; solid &= solid - 1) {
        const int x = std::countr_zero(solid);
        const VoxelType type = chunk->materials().get(x, y, z);
        if (type >= types.size() || !(types[type].emission > 0.0F)) continue;
        const IVec3 sample = corner + IVec3{x, y, z};
        for (const Direction face : kDirections) {
          const std::optional<Crossing> found = crossing(field, types, sample, type, normal_of(face));
          if (!found) continue;
          Sum& sum = sums[(z / EmissiveCells::kEdge * kAcross + y / EmissiveCells::kEdge) * kAcross +
                          x / EmissiveCells::kEdge];
          sum.add_box(sample, {sample - 1, sample + 1});
          sum.add(DVec3(sample - sum.origin) + found->place, face, emitted_by(types[type]) * found->share);
        }
      }
    }
  }
  return cells_of(sums);
}

}  // namespace

bool has_emissive_types(const Chunk& chunk, const VoxelRegistry& types) {
  const std::vector<VoxelType> all = chunk.types();
  return std::any_of(all.begin(), all.end(),
                     [&](VoxelType type) { return type < types.size() && types[type].emission > 0.0F; });
}

void EmissiveCells::update(const Grid& grid, const VoxelRegistry& types) {
  chunks_.follow(
      grid, types, [&](const GridChanges& changes) { return chunks_to_mesh(grid, changes); },
      [&](IVec3 chunk) { return look_at(grid, types, chunk); });
}

void EmissiveCells::update(const DensityGrid& field, const VoxelRegistry& types) {
  chunks_.follow(
      field, types, [&](const DensityChanges& changes) { return chunks_to_mesh(field, changes, 1); },
      [&](IVec3 chunk) { return look_at(field, types, chunk); });
}

}  // namespace quoin
