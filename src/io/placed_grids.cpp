#include "io/placed_grids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include <glm/gtc/quaternion.hpp>
#include <quoin/core/assert.h>
#include <quoin/core/axis_orientation.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/thousands.h>
#include <quoin/grid/copy_box.h>
#include <quoin/io/block_packs.h>

#include "core/bytes/text.h"

namespace quoin::models {

namespace {

constexpr double kRounding = 1e-6;
constexpr double kFarthest = 1 << 26;

std::string name_of(const Instance& instance, const SceneGrid& grid) {
  std::string text = "the instance \"";
  return text.append(printable(instance.name.empty() ? grid.name : instance.name)).append("\"");
}

/// Returns an error that names the lowest type without properties, if the voxels have one.
Status check_types(const Grid& voxels, const VoxelRegistry& types, const std::string& owner) {
  const std::vector<VoxelType> used = voxels.types();
  const auto unknown = std::ranges::find_if(used, [&](VoxelType type) { return type >= types.size(); });
  if (unknown == used.end()) return {};
  return make_error(ErrorCode::InvalidArgument,
                    owner + " has voxels of type " + std::to_string(*unknown) + ", which is not registered");
}

/// Turns the states of blocks, each once.
class StateTurns {
 public:
  std::uint32_t operator()(const VoxelProperties& type, std::uint32_t state, const AxisOrientation& turn) {
    const auto [known, is_new] = known_.try_emplace({&type, state, turn.index()});
    if (is_new) {
      // Files with block names have the states of blocks, which orientations alone do not describe.
      const auto of_block = turned_block_state(type, state, turn);
      known->second = of_block ? *of_block : type.orientations.turned(state, turn);
    }
    return known->second;
  }

 private:
  std::map<std::tuple<const VoxelProperties*, std::uint32_t, int>, std::uint32_t> known_;
};

/// Counts the content that a format cannot store.
class Losses {
 public:
  Losses(const Scene& scene, const FormatHolds& holds) : scene_(scene), holds_(holds) {}

  std::vector<std::string> lines;
  std::int64_t rounded = 0;
  std::int64_t hidden = 0;
  std::int64_t without_voxels = 0;
  std::int64_t without_place = 0;
  std::int64_t nameless = 0;
  std::int64_t turned_states = 0;

  /// Counts a grid of the file. Requires: its types are registered in the scene.
  void count(const PlacedGrid& grid, const AxisOrientation& orientation) {
    ++placed_;
    states_ += grid.voxels.data_count();
    if (orientation != AxisOrientation() && grid.voxels.data_count() != 0) {
      grid.voxels.for_each_data([&](IVec3, VoxelType type, const VoxelData& data) {
        turned_states += is_turned(type, data.state, orientation) ? 0 : 1;
      });
    }
    for (const VoxelType type : grid.voxels.types()) {
      QUOIN_ASSERT(type < used_.size(), "a registered type");
      used_[type] = true;
    }
  }

  /// Returns true if a state of a turned copy can have been turned.
  [[nodiscard]] bool is_turned(VoxelType type, std::uint32_t state, const AxisOrientation& orientation) const {
    return scene_.types.is_turned_by_state(type) ||
           turned_block_state(scene_.types[type], state, orientation.inverse()).has_value();
  }

  std::vector<std::string> take() {
    if (rounded != 0) lines.push_back("instances rounded to whole voxels: " + with_thousands(rounded));
    add("hidden instances left out", hidden);
    add("instances without voxels left out", without_voxels);
    add("instances without a valid placement left out", without_place);
    if (!holds_.several && placed_ > 1) add("instances merged into one model", placed_);
    if (!holds_.names) add("names left out", nameless);
    add("groups left out", static_cast<std::int64_t>(scene_.groups().size()));
    add("layers left out", static_cast<std::int64_t>(scene_.layers().size()));
    add("lamps left out", static_cast<std::int64_t>(scene_.lamps.size()));
    if (!holds_.type_names) add("data of voxels left out", states_);
    if (holds_.type_names && turned_states != 0) {
      lines.push_back("voxels of rotated instances whose states keep their unrotated directions: " +
                      with_thousands(turned_states));
    }
    count_types();
    return std::move(lines);
  }

 private:
  void add(std::string_view what, std::int64_t count) {
    if (count == 0) return;
    lines.push_back(std::string(what).append(", not supported by ").append(holds_.extension).append(": "));
    lines.back().append(with_thousands(count));
  }
  void count_types() {
    std::int64_t colours = 0;
    std::int64_t transparent = 0;
    std::int64_t materials = 0;
    std::int64_t names = 0;
    std::int64_t others = 0;
    for (std::size_t i = 1; i < used_.size(); ++i) {
      if (!used_[i]) continue;
      const VoxelProperties& type = scene_.types[static_cast<VoxelType>(i)];
      const VoxelProperties plain;
      ++colours;
      transparent += type.visibility == Visibility::Transparent ? 1 : 0;
      const bool has_material =
          type.roughness != plain.roughness || type.metalness != plain.metalness || type.emission != plain.emission;
      materials += has_material ? 1 : 0;
      others += type.scattering != plain.scattering || type.ior != plain.ior || !type.collides ? 1 : 0;
      names += type.name.empty() && type.attributes.empty() ? 0 : 1;
    }
    if (!holds_.colours) {
      add("colours left out", colours);
      return;
    }
    if (!holds_.transparency) add("types made opaque", transparent);
    if (!holds_.materials) add("roughness, metalness or light of types left out", materials);
    if (!holds_.type_names) add("scattering, refraction or collision of types left out", others);
    if (!holds_.type_names) add("names and attributes of types left out", names);
  }

  const Scene& scene_;
  const FormatHolds& holds_;
  std::vector<bool> used_ = std::vector<bool>(scene_.types.size(), false);
  std::int64_t placed_ = 0;
  std::int64_t states_ = 0;
};

/// Passes on each placement, in the order of the instances' handles.
class Placer {
 public:
  using Take = FunctionRef<void(PlacedGrid&&)>;
  Placer(const Scene& scene, const FormatHolds& holds, Take take)
      : scene_(scene), holds_(holds), take_(take), losses_(scene, holds) {}

  Status run() {
    Status done;
    scene_.instances().for_each([&](InstanceHandle, const Instance& instance) {
      if (done) done = place(instance);
    });
    return done;
  }
  [[nodiscard]] double voxel_size() const { return voxel_size_; }
  [[nodiscard]] std::vector<std::string> warnings() {
    std::vector<std::string> lines = losses_.take();
    if (voxel_size_ != 1.0 && !holds_.place_in_units) {
      lines.push_back("voxel size left out, not supported by " + std::string(holds_.extension));
    }
    return lines;
  }

 private:
  Status place(const Instance& instance) {
    const SceneGrid* const grid = scene_.grids().find(instance.grid);
    if (grid == nullptr) return {};
    if (!has_valid_transform(instance)) {
      ++losses_.without_place;
      return {};
    }
    const bool visible = is_shown(scene_, instance);
    if (!visible && !holds_.hidden) {
      ++losses_.hidden;
      return {};
    }
    if (grid->field.chunk_count() != 0) {
      return make_error(ErrorCode::Unsupported, "the grid \"" + printable(grid->name) +
                                                    "\" is a density field, which " + std::string(holds_.extension) +
                                                    " cannot store");
    }
    const IBox box = grid->declared_box();
    if (box.empty()) {
      ++losses_.without_voxels;
      return {};
    }
    if (is_first_) voxel_size_ = instance.voxel_size;
    is_first_ = false;
    if (std::abs(instance.voxel_size - voxel_size_) > kRounding * voxel_size_) {
      return make_error(ErrorCode::Unsupported, name_of(instance, *grid) +
                                                    " has a different voxel size than others, which " +
                                                    std::string(holds_.extension) + " cannot store");
    }
    return turn(instance, *grid, box, visible);
  }

  Status turn(const Instance& instance, const SceneGrid& grid, const IBox& box, bool visible) {
    const auto orientation = AxisOrientation::near_matrix(world_axes(instance), kRounding);
    if (!orientation) {
      return make_error(ErrorCode::Unsupported, name_of(instance, grid) +
                                                    " is not rotated by multiples of 90 degrees, as " +
                                                    std::string(holds_.extension) + " requires");
    }
    QUOIN_ASSERT(voxel_size_ > 0.0 && !box.empty(), "voxels with a size");
    const DVec3 a = world_from_grid(instance, grid, DVec3(box.min)) / voxel_size_;
    const DVec3 b = world_from_grid(instance, grid, DVec3(box.max)) / voxel_size_;
    const DVec3 least = glm::min(a, b);
    // Halves always round the same way, so that touching instances still touch.
    const DVec3 nearest = glm::floor(least + 0.5);
    const IVec3 size = orientation->size_of(box.size());
    const double reach = std::max({std::abs(nearest.x), std::abs(nearest.y), std::abs(nearest.z)}) +
                         static_cast<double>(std::max({size.x, size.y, size.z}));
    if (!(reach < kFarthest)) {
      return make_error(ErrorCode::LimitExceeded, name_of(instance, grid) + " is too far from the origin");
    }
    const DVec3 off = glm::abs(nearest - least);
    if (std::max({off.x, off.y, off.z}) > kNearestVoxel) ++losses_.rounded;
    PlacedGrid placed;
    placed.name = instance.name.empty() ? grid.name : instance.name;
    placed.visible = visible;
    const IVec3 min(nearest);
    placed.box = {min, min + size};
    CopyOptions turned;
    turned.types = &scene_.types;
    StateTurns turns;
    turned.turn_state = std::ref(turns);
    copy_box(grid.grid, box, placed.voxels, min, *orientation, turned);
    if (auto known = check_types(placed.voxels, scene_.types, name_of(instance, grid)); !known) return known;
    if (!placed.name.empty()) ++losses_.nameless;
    losses_.count(placed, *orientation);
    take_(std::move(placed));
    return {};
  }

  // Rounding error, in voxels.
  static constexpr double kNearestVoxel = 1e-4;
  const Scene& scene_;
  const FormatHolds& holds_;
  Take take_;
  Losses losses_;
  double voxel_size_ = 1.0;
  bool is_first_ = true;
};

}  // namespace

Result<PlacedGrids> place_grids(const Scene& scene, const FormatHolds& holds) {
  PlacedGrids placed;
  const auto take = [&](PlacedGrid&& grid) { placed.grids.push_back(std::move(grid)); };
  Placer placer(scene, holds, take);
  if (auto done = placer.run(); !done) return done.error();
  placed.voxel_size = placer.voxel_size();
  placed.warnings = placer.warnings();
  return placed;
}

Result<MergedGrid> merge_grids(const Scene& scene, const FormatHolds& holds) {
  MergedGrid merged;
  CopyOptions solid;
  solid.copy_air = false;
  const auto take = [&](PlacedGrid&& grid) {
    if (merged.box.empty()) {
      merged.name = std::move(grid.name);
      merged.voxels = std::move(grid.voxels);
    } else {
      copy_box(grid.voxels, grid.box, merged.voxels, grid.box.min, {}, solid);
    }
    merged.box = unite(merged.box, grid.box);
  };
  Placer placer(scene, holds, take);
  if (auto done = placer.run(); !done) return done.error();
  merged.voxel_size = placer.voxel_size();
  merged.warnings = placer.warnings();
  return merged;
}

std::string cut_name(const std::string& name, std::size_t bytes, std::vector<std::string>& warnings) {
  if (name.size() <= bytes) return name;
  std::size_t end = bytes;
  QUOIN_ASSERT(end < name.size(), "a name that is too long");
  while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xC0U) == 0x80U) --end;
  warnings.push_back("a name was cut to " + std::to_string(end) + " bytes: \"" + printable(name) + "\"");
  return name.substr(0, end);
}

void read_voxels(const Grid& grid, IVec3 first, std::span<VoxelType> out) {
  std::array<VoxelType, kChunkEdge> row{};
  for (std::size_t done = 0; done < out.size();) {
    const IVec3 at = first + IVec3(static_cast<int>(done), 0, 0);
    const IVec3 chunk = chunk_of(at);
    const IVec3 within = at - chunk * kChunkEdge;
    QUOIN_ASSERT(within.x >= 0 && within.x < kChunkEdge, "a voxel of the chunk");
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
