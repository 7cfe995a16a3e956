#include "render/light/emissive_cells.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <optional>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/memory.h>

#include "grid/shapes/shape_index.h"
#include "scene/surfaces.h"

namespace quoin {
namespace {

// Light per face of a voxel or side of a field, by Direction, before the state turns the type.
using FaceLights = std::array<Vec3, 6>;

// A shape counts as a cube of the mean colour of its emitting sides: games draw a torch with a small flame, but it
// lights a room.
FaceLights lights_of(const VoxelProperties& type) {
  const float most = std::numeric_limits<float>::max() / 1e6F;  // so that sums of many are finite
  const float emission = type.emission > 0.0F ? std::min(type.emission, most) : 0.0F;
  FaceLights lights;
  lights.fill(linear_colour(type.colour) * emission);
  if (!has_emission_shares(type)) return lights;
  if (!type.shapes.empty()) {
    lights.fill(glow_of_shapes(type) * emission);
    return lights;
  }
  for (const Direction face : kDirections) {
    const VoxelFace& look = type.faces[face];
    lights[static_cast<std::size_t>(face)] = mean_colour(look) * (emission * emission_factor(look));
  }
  return lights;
}

// The lights of a chunk's types, each found once.
class LightsOfTypes {
 public:
  explicit LightsOfTypes(const VoxelRegistry& types) : types_(types) {}

  [[nodiscard]] const FaceLights& of(VoxelType type) {
    const auto [known, is_new] = known_.try_emplace(type);
    if (is_new) known->second = lights_of(types_[type]);
    return known->second;
  }

 private:
  const VoxelRegistry& types_;
  std::map<VoxelType, FaceLights> known_;
};

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
  LightsOfTypes lights(types);
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
        const FaceLights& light = lights.of(type);
        AxisOrientation unturned;
        if (types.is_turned_by_state(type) && has_emission_shares(types[type])) {
          unturned = types[type].orientations.of(grid.data(voxel).state).inverse();
        }
        for (const Direction face : kDirections) {
          const VoxelType before = grid.get(voxel + normal_of(face));
          if (types.is_opaque(before) || before == type) continue;
          sum.add(voxel, face, light[static_cast<std::size_t>(unturned.apply(face))]);
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
  LightsOfTypes lights(types);
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
          const Vec3 light = lights.of(type)[static_cast<std::size_t>(face)];
          sum.add(DVec3(sample - sum.origin) + found->place, face, light * found->share);
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

bool has_emission_shares(const VoxelProperties& type) {
  bool has_shares = false;
  for_each_look(type, [&](const VoxelFace& look) { has_shares |= look.emission_share != 255; });
  return has_shares;
}

namespace {

// Removed chunks that are listed already stay: their lamps must go.
void add_all(const Grid& grid, std::vector<IVec3>& chunks) {
  const std::vector<IVec3> all = grid.chunks();
  chunks.insert(chunks.end(), all.begin(), all.end());
}

}  // namespace

void add_turned(const Grid& grid, const VoxelRegistry& types, const DataChanges& data, std::vector<IVec3>& chunks) {
  if (!types.has_turned_by_state()) return;
  if (data.all) add_all(grid, chunks);
  for (const DataChange& change : data.items_unless_all()) chunks.push_back(change.chunk);
  sort_and_unite(chunks);
}

void add_near_shapes(const Grid& grid, const GridChanges& changes, const DataChanges& data,
                     std::vector<IVec3>& chunks) {
  QUOIN_ASSERT(!changes.all, "changes that are listed");
  if (data.all) add_all(grid, chunks);
  const auto add = [&](const auto& change) { add_chunks_near(change.chunk, change.box, kShapeReach, chunks); };
  for (const ChunkChange& change : changes.items_unless_all()) add(change);
  for (const DataChange& change : data.items_unless_all()) add(change);
  sort_and_unite(chunks);
}

void EmissiveCells::update(const Grid& grid, const VoxelRegistry& types) {
  ChangeCursor followed_data = followed_data_;
  const DataChanges data = grid.data_changes_since(followed_data);
  const auto chunks_of = [&](const GridChanges& changes) {
    std::vector<IVec3> chunks = chunks_to_mesh(grid, changes);
    if (!changes.all) add_turned(grid, types, data, chunks);
    return chunks;
  };
  chunks_.follow(grid, types, chunks_of, [&](IVec3 chunk) { return look_at(grid, types, chunk); });
  followed_data_ = followed_data;
}

void EmissiveCells::update(const DensityGrid& field, const VoxelRegistry& types) {
  chunks_.follow(
      field, types, [&](const DensityChanges& changes) { return chunks_to_mesh(field, changes, 1); },
      [&](IVec3 chunk) { return look_at(field, types, chunk); });
}

}  // namespace quoin
