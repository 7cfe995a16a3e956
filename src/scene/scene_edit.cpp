#include <quoin/scene/scene.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>

#include "core/coordinates/unit_rotation.h"

namespace quoin {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// The valid coordinates of a grid: all except the outermost chunks.
constexpr double kMinVoxel = double{std::numeric_limits<int>::min()} + kChunkEdge;
constexpr double kMaxVoxel = double{std::numeric_limits<int>::max()} - kChunkEdge;

// The range of a row in which voxel centres lie in a box.
struct Span {
  double first = -kInfinity;
  double last = kInfinity;
};

// A box in a grid's space, as the intersection of three slabs.
class BoxInGrid {
 public:
  // `edges`: the box's half edges, as columns; `axes`: its unit axes times the world units per voxel.
  BoxInGrid(DVec3 centre, const glm::dmat3& edges, const glm::dmat3& axes, DVec3 half_size)
      : centre_(centre),
        reach_(glm::abs(edges[0]) + glm::abs(edges[1]) + glm::abs(edges[2])),
        axes_(axes),
        half_size_(half_size) {}

  // Returns a box of all voxels whose centre may lie in the box.
  [[nodiscard]] IBox bounds() const {
    IBox box;
    for (int axis = 0; axis < 3; ++axis) {
      box.min[axis] = whole(std::floor(centre_[axis] - reach_[axis] - 1.0));
      box.max[axis] = whole(std::ceil(centre_[axis] + reach_[axis] + 1.0));
    }
    return box;
  }
  [[nodiscard]] bool holds_centre(IVec3 voxel) const {
    const DVec3 p = glm::abs((DVec3(voxel) + 0.5 - centre_) * axes_);
    return p.x <= half_size_.x && p.y <= half_size_.y && p.z <= half_size_.z;
  }
  [[nodiscard]] bool holds_all(const IBox& voxels) const {
    for (int corner = 0; corner < 8; ++corner) {
      const IVec3 last = voxels.max - 1;
      const IVec3 voxel{(corner & 1) != 0 ? last.x : voxels.min.x, (corner & 2) != 0 ? last.y : voxels.min.y,
                        (corner & 4) != 0 ? last.z : voxels.min.z};
      if (!holds_centre(voxel)) return false;
    }
    return true;
  }
  // Returns true if one of the box's own axes separates it from the voxel centres. The grid's axes are tested by
  // `bounds`.
  [[nodiscard]] bool does_not_touch(const IBox& voxels) const {
    const DVec3 half = (DVec3(voxels.max) - DVec3(voxels.min) - 1.0) * 0.5;
    const DVec3 middle = DVec3(voxels.min) + 0.5 + half;
    const DVec3 between = middle - centre_;
    for (int i = 0; i < 3; ++i) {
      const double reach = half_size_[i] + glm::dot(half, glm::abs(axes_[i]));
      const double rounding = 1e-12 * (reach + glm::dot(glm::abs(between), glm::abs(axes_[i])));
      if (std::abs(glm::dot(between, axes_[i])) > reach + rounding) return true;
    }
    return false;
  }
  // Returns the voxels from `first` to `last` of a row whose centres lie in the box.
  [[nodiscard]] std::pair<int, int> run(int first, int last, int y, int z) const {
    QUOIN_ASSERT(first <= last, "a row with voxels");
    const DVec3 start = (DVec3(first, y, z) + 0.5 - centre_) * axes_;
    Span span;
    for (int i = 0; i < 3; ++i) {
      const double slope = axes_[i].x;
      if (slope == 0.0) {
        if (std::abs(start[i]) > half_size_[i]) return {first, first - 1};
        continue;
      }
      const double a = (-half_size_[i] - start[i]) / slope;
      const double b = (half_size_[i] - start[i]) / slope;
      span.first = std::max(span.first, std::min(a, b));
      span.last = std::min(span.last, std::max(a, b));
    }
    const auto length = static_cast<double>(last - first);
    if (!(span.first <= length + 1.0 && span.last >= -1.0)) return {first, first - 1};
    int low = first + static_cast<int>(std::clamp(std::floor(span.first) - 1.0, 0.0, length));
    int high = first + static_cast<int>(std::clamp(std::ceil(span.last) + 1.0, 0.0, length));
    // The quotients are rounded, so the voxels at the ends are tested individually.
    while (low <= high && !holds_centre({low, y, z})) ++low;
    while (high >= low && !holds_centre({high, y, z})) --high;
    return {low, high};
  }

 private:
  // Includes one past the last voxel, for the ends of boxes.
  static int whole(double coordinate) { return static_cast<int>(std::clamp(coordinate, kMinVoxel, kMaxVoxel + 1.0)); }

  DVec3 centre_;
  DVec3 reach_;
  glm::dmat3 axes_;  // columns: the slabs' normals, in world units per voxel
  DVec3 half_size_;  // world units
};

// Fills a box in one grid, from large parts to small ones.
class BoxFiller {
 public:
  BoxFiller(Grid& grid, const BoxInGrid& box, VoxelType type) : grid_(grid), box_(box), type_(type) {}

  std::int64_t fill() {
    const IBox voxels = box_.bounds();
    const DVec3 chunks = DVec3(voxels.max) / double{kChunkEdge} - DVec3(voxels.min) / double{kChunkEdge};
    if (type_ != kAir || chunks.x * chunks.y * chunks.z <= static_cast<double>(grid_.chunk_count())) {
      fill_part(voxels);
      return changed_;
    }
    // Erasing affects only existing chunks.
    for (const IVec3 chunk : grid_.chunks()) {
      fill_part(intersect(voxels, {chunk * kChunkEdge, chunk * kChunkEdge + kChunkEdge}));
    }
    return changed_;
  }

 private:
  // `voxels` is cut along its longest axis, at a chunk's side, until it lies in one chunk.
  void fill_part(const IBox& voxels) {
    if (voxels.empty() || box_.does_not_touch(voxels)) return;
    if (box_.holds_all(voxels)) {
      changed_ += grid_.fill_box(voxels, type_);
      return;
    }
    const IVec3 first = chunk_of(voxels.min);
    const IVec3 last = chunk_of(voxels.max - 1);
    const IVec3 chunks = last - first;
    if (chunks == IVec3(0)) return fill_rows(voxels);
    const int longest = std::max({chunks.x, chunks.y, chunks.z});
    const int axis = chunks.x == longest ? 0 : chunks.y == longest ? 1 : 2;
    IBox lower = voxels;
    IBox upper = voxels;
    lower.max[axis] = upper.min[axis] = (first[axis] + (longest + 1) / 2) * kChunkEdge;
    fill_part(lower);
    fill_part(upper);
  }
  void fill_rows(const IBox& voxels) {
    QUOIN_ASSERT(!voxels.empty() && chunk_of(voxels.min) == chunk_of(voxels.max - 1), "voxels of one chunk");
    if (type_ == kAir && grid_.find_chunk(chunk_of(voxels.min)) == nullptr) return;
    changed_ += grid_.edit_rows(voxels, [&](IVec3 row, std::span<VoxelType> types) {
      const int last = row.x + static_cast<int>(types.size()) - 1;
      const auto [low, high] = box_.run(row.x, last, row.y, row.z);
      QUOIN_ASSERT(low > high || (low >= row.x && high <= last), "voxels of the row");
      for (int x = low; x <= high; ++x) types[static_cast<std::size_t>(x - row.x)] = type_;
    });
  }

  Grid& grid_;
  BoxInGrid box_;
  VoxelType type_;
  std::int64_t changed_ = 0;
};

const SceneGrid& grid_of(const Scene& scene, const Instance& instance) {
  const SceneGrid* grid = scene.grids().find(instance.grid);
  QUOIN_ASSERT(grid != nullptr, "the instance's grid is in the scene");
  return *grid;
}

bool is_sound(const OrientedBox& box) {
  const DVec3 half = box.half_size;
  const DQuat& q = box.rotation;
  return is_finite(box.centre) && is_finite({q.x, q.y, q.z}) && std::isfinite(q.w) && is_finite(half) &&
         half.x >= 0.0 && half.y >= 0.0 && half.z >= 0.0;
}

}  // namespace

bool set_voxel(Scene& scene, InstanceHandle handle, DVec3 point_in_world, VoxelType type) {
  const Instance& instance = scene.instances()[handle];
  const auto voxel = voxel_from_world(instance, grid_of(scene, instance), point_in_world);
  if (!voxel.has_value() || grid_of(scene, instance).grid.get(*voxel) == type) return false;
  return scene.edit(instance.grid).grid.set(*voxel, type);
}

std::int64_t fill_sphere(Scene& scene, InstanceHandle handle, DVec3 centre_in_world, double radius, VoxelType type) {
  const Instance& instance = scene.instances()[handle];
  const DVec3 centre = grid_from_world(instance, grid_of(scene, instance), centre_in_world);
  const double radius_in_grid = radius / instance.voxel_size;
  if (!is_finite(centre) || !(radius_in_grid >= 0.0 && std::isfinite(radius_in_grid))) return 0;
  return scene.edit(instance.grid).grid.fill_sphere(centre, radius_in_grid, type);
}

std::int64_t fill_box(Scene& scene, InstanceHandle handle, const OrientedBox& box, VoxelType type) {
  const Instance& instance = scene.instances()[handle];
  const DVec3 centre = grid_from_world(instance, grid_of(scene, instance), box.centre);
  if (!is_sound(box) || !is_finite(centre)) return 0;
  const glm::dmat3 box_axes = glm::mat3_cast(unit_rotation(box.rotation));
  glm::dmat3 axes;
  glm::dmat3 edges;
  for (int i = 0; i < 3; ++i) {
    axes[i] = glm::transpose(world_axes(instance)) * box_axes[i] * instance.voxel_size;
    edges[i] = grid_from_world_direction(instance, box_axes[i] * box.half_size[i]);
  }
  return BoxFiller(scene.edit(instance.grid).grid, BoxInGrid(centre, edges, axes, box.half_size), type).fill();
}

}  // namespace quoin
