#include "io/placed/placed_grids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include <glm/gtc/quaternion.hpp>
#include <quoin/core/axis_orientation.h>
#include <quoin/core/thousands.h>
#include <quoin/grid/copy_box.h>

namespace quoin::models {

namespace {

constexpr double kRounding = 1e-6;
constexpr double kFarthest = 1 << 26;

/// Nothing when it is not by quarter turns.
std::optional<AxisOrientation> orientation_of(const Instance& instance) {
  const double length = glm::length(instance.rotation);
  const DQuat rotation = length > 0.0 ? instance.rotation / length : DQuat(1.0, 0.0, 0.0, 0.0);
  glm::dmat3 matrix = glm::mat3_cast(rotation);
  if (instance.mirrored) matrix[0] = -matrix[0];
  for (int index = 0; index < AxisOrientation::kCount; ++index) {
    const AxisOrientation orientation = AxisOrientation::at(index);
    const glm::dmat3 other = orientation.matrix();
    double most = 0.0;
    for (int column = 0; column < 3; ++column) {
      for (int row = 0; row < 3; ++row) most = std::max(most, std::abs(matrix[column][row] - other[column][row]));
    }
    if (most <= kRounding) return orientation;
  }
  return std::nullopt;
}

std::string text_of(const Instance& instance, const SceneGrid& grid) {
  std::string text = "the instance \"";
  return text.append(instance.name.empty() ? grid.name : instance.name).append("\"");
}

/// Counts what a format does not hold.
class Losses {
 public:
  Losses(const Scene& scene, const FormatHolds& holds) : scene_(scene), holds_(holds) {}

  std::vector<std::string> lines;
  std::int64_t rounded = 0;
  std::int64_t hidden = 0;
  std::int64_t without_voxels = 0;
  std::int64_t nameless = 0;

  void count_all(const std::vector<PlacedGrid>& placed) {
    add("instances between voxels moved to the nearest", rounded);
    add("hidden instances left out", hidden);
    add("instances without voxels left out", without_voxels);
    if (!holds_.several && placed.size() > 1)
      add("instances became one model", static_cast<std::int64_t>(placed.size()));
    if (!holds_.names) add("names left out", nameless);
    add("groups left out", static_cast<std::int64_t>(scene_.groups().size()));
    add("layers left out", static_cast<std::int64_t>(scene_.layers().size()));
    add("lamps left out", static_cast<std::int64_t>(scene_.lamps.size()));
    std::int64_t states = 0;
    std::vector<bool> used(scene_.types.size(), false);
    for (const PlacedGrid& grid : placed) {
      states += grid.voxels.data_count();
      for (const VoxelType type : grid.voxels.types()) {
        if (type < used.size()) used[type] = true;
      }
    }
    if (!holds_.type_names) add("voxels whose data is left out", states);
    count_types(used);
  }

 private:
  void add(std::string_view what, std::int64_t count) {
    if (count == 0) return;
    lines.push_back(std::string(what).append(", which ").append(holds_.extension).append(" does not hold: "));
    lines.back().append(with_thousands(count));
  }
  void count_types(const std::vector<bool>& used) {
    std::int64_t colours = 0;
    std::int64_t transparent = 0;
    std::int64_t materials = 0;
    std::int64_t names = 0;
    for (std::size_t i = 1; i < used.size(); ++i) {
      if (!used[i]) continue;
      const VoxelProperties& type = scene_.types[static_cast<VoxelType>(i)];
      const VoxelProperties plain;
      ++colours;
      transparent += type.visibility == Visibility::Transparent ? 1 : 0;
      const bool has_material = type.roughness != plain.roughness || type.metalness != plain.metalness ||
                                type.emission != plain.emission || type.scattering != plain.scattering;
      materials += has_material ? 1 : 0;
      names += type.name.empty() && type.attributes.empty() ? 0 : 1;
    }
    if (!holds_.colours) {
      add("colours left out", colours);
      return;
    }
    if (!holds_.transparency) add("types that are no longer transparent", transparent);
    if (!holds_.materials) add("types whose roughness, metalness or light is left out", materials);
    if (!holds_.type_names) add("types whose names and attributes are left out", names);
  }

  const Scene& scene_;
  const FormatHolds& holds_;
};

class Placer {
 public:
  Placer(const Scene& scene, const FormatHolds& holds) : scene_(scene), holds_(holds), losses_(scene, holds) {}

  Result<PlacedGrids> run() {
    Status done;
    scene_.instances().for_each([&](InstanceHandle, const Instance& instance) {
      if (done) done = place(instance);
    });
    if (!done) return done.error();
    losses_.count_all(placed_.grids);
    placed_.warnings = std::move(losses_.lines);
    return std::move(placed_);
  }

 private:
  Status place(const Instance& instance) {
    const SceneGrid* const grid = scene_.grids().find(instance.grid);
    if (grid == nullptr || !has_place(instance)) return {};
    if (grid->field.chunk_count() != 0) {
      return make_error(ErrorCode::Unsupported, "the grid \"" + grid->name + "\" holds a field of densities, which " +
                                                    std::string(holds_.extension) + " does not");
    }
    const bool visible = is_shown(scene_, instance);
    if (!visible && !holds_.hidden) {
      ++losses_.hidden;
      return {};
    }
    const IBox box = grid->declared_box();
    if (box.empty()) {
      ++losses_.without_voxels;
      return {};
    }
    if (placed_.grids.empty()) placed_.voxel_size = instance.voxel_size;
    if (std::abs(instance.voxel_size - placed_.voxel_size) > kRounding * placed_.voxel_size) {
      return make_error(ErrorCode::Unsupported, text_of(instance, *grid) +
                                                    " has voxels of another size than others, which " +
                                                    std::string(holds_.extension) + " does not hold");
    }
    return turn(instance, *grid, box, visible);
  }

  Status turn(const Instance& instance, const SceneGrid& grid, const IBox& box, bool visible) {
    const auto orientation = orientation_of(instance);
    if (!orientation) {
      return make_error(ErrorCode::Unsupported, text_of(instance, grid) + " is not turned by quarter turns, as " +
                                                    std::string(holds_.extension) + " requires");
    }
    const DVec3 a = world_from_grid(instance, grid, DVec3(box.min)) / placed_.voxel_size;
    const DVec3 b = world_from_grid(instance, grid, DVec3(box.max)) / placed_.voxel_size;
    const DVec3 least = glm::min(a, b);
    const DVec3 nearest = glm::round(least);
    const IVec3 size = orientation->size_of(box.size());
    const double reach = std::max({std::abs(nearest.x), std::abs(nearest.y), std::abs(nearest.z)}) +
                         static_cast<double>(std::max({size.x, size.y, size.z}));
    if (!(reach < kFarthest)) {
      return make_error(ErrorCode::LimitExceeded, text_of(instance, grid) + " lies too far out");
    }
    const DVec3 off = glm::abs(nearest - least);
    if (std::max({off.x, off.y, off.z}) > kNearestVoxel) ++losses_.rounded;
    PlacedGrid placed;
    placed.name = instance.name.empty() ? grid.name : instance.name;
    placed.visible = visible;
    const IVec3 min(nearest);
    placed.box = {min, min + size};
    copy_box(grid.grid, box, placed.voxels, min, *orientation);
    if (!placed.name.empty()) ++losses_.nameless;
    placed_.grids.push_back(std::move(placed));
    return {};
  }

  // Of a voxel: what arithmetic leaves.
  static constexpr double kNearestVoxel = 1e-4;
  const Scene& scene_;
  const FormatHolds& holds_;
  Losses losses_;
  PlacedGrids placed_;
};

}  // namespace

Result<PlacedGrids> place_grids(const Scene& scene, const FormatHolds& holds) {
  return Placer(scene, holds).run();
}

Result<MergedGrid> merge_grids(const Scene& scene, const FormatHolds& holds) {
  auto placed = place_grids(scene, holds);
  if (!placed) return placed.error();
  MergedGrid merged;
  merged.voxel_size = placed->voxel_size;
  merged.warnings = std::move(placed->warnings);
  CopyOptions solid;
  solid.copy_air = false;
  for (PlacedGrid& grid : placed->grids) {
    if (merged.box.empty()) {
      merged.name = std::move(grid.name);
      merged.voxels = std::move(grid.voxels);
    } else {
      copy_box(grid.voxels, grid.box, merged.voxels, grid.box.min, {}, solid);
    }
    merged.box = unite(merged.box, grid.box);
  }
  return merged;
}

void read_voxels(const Grid& grid, IVec3 first, std::span<VoxelType> out) {
  std::array<VoxelType, kChunkEdge> row{};
  for (std::size_t done = 0; done < out.size();) {
    const IVec3 at = first + IVec3(static_cast<int>(done), 0, 0);
    const IVec3 chunk = chunk_of(at);
    const IVec3 within = at - chunk * kChunkEdge;
    const auto count = std::min(out.size() - done, static_cast<std::size_t>(kChunkEdge - within.x));
    const auto to = out.subspan(done, count);
    if (const Chunk* const voxels = grid.find_chunk(chunk); voxels != nullptr) {
      voxels->read_row(within.y, within.z, row);
      std::copy_n(row.begin() + within.x, count, to.begin());
    } else {
      std::ranges::fill(to, kAir);
    }
    done += count;
  }
}

std::vector<Rgba8> colours_of(const VoxelRegistry& types) {
  std::vector<Rgba8> colours(types.size(), Rgba8{0, 0, 0, 0});
  for (std::size_t i = 1; i < colours.size(); ++i) {
    const VoxelProperties& type = types[static_cast<VoxelType>(i)];
    colours[i] = type.colour;
    colours[i].a = type.visibility == Visibility::Transparent ? std::max<std::uint8_t>(type.colour.a, 1) : 255;
  }
  return colours;
}

}  // namespace quoin::models
