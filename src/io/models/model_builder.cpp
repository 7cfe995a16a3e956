#include "io/models/model_builder.h"

#include <algorithm>
#include <utility>

#include <quoin/core/assert.h>

namespace quoin::models {

namespace {

constexpr std::size_t kMaxRuns = std::size_t{1} << 25;
// Runs that are set at once.
constexpr std::size_t kBatch = std::size_t{1} << 18;

std::uint64_t key_of(Rgba8 colour, std::uint32_t material) {
  return std::uint64_t{material} << 32 | std::uint64_t{colour.r} << 24 | std::uint64_t{colour.g} << 16 |
         std::uint64_t{colour.b} << 8 | colour.a;
}

// To the middle of what has the same first bits.
std::uint8_t rounded(std::uint8_t channel, int bits_lost) {
  if (bits_lost == 0) return channel;
  const unsigned low = (1U << bits_lost) - 1U;
  return static_cast<std::uint8_t>((channel & ~low) | (low >> 1));
}

Rgba8 rounded(Rgba8 colour, int bits_lost) {
  return {rounded(colour.r, bits_lost), rounded(colour.g, bits_lost), rounded(colour.b, bits_lost), colour.a};
}

}  // namespace

void ModelBuilder::begin(Model model) {
  QUOIN_ASSERT(model.voxel_size > 0.0, "a size");
  parts_.push_back({std::move(model), runs_.size()});
}

std::uint32_t ModelBuilder::add_material(VoxelProperties material) {
  materials_.push_back(std::move(material));
  return static_cast<std::uint32_t>(materials_.size() - 1);
}

void ModelBuilder::use_material(std::uint32_t material) {
  QUOIN_ASSERT(material < materials_.size(), "a material that was added");
  material_ = material;
}

void ModelBuilder::warn(std::string line) {
  warnings_.push_back(std::move(line));
}

Status ModelBuilder::put(IVec3 voxel, Rgba8 colour, int count, int axis) {
  QUOIN_ASSERT(!parts_.empty(), "a model has begun");
  if (colour.a == 0 || count <= 0) return {};
  if (runs_.size() == kMaxRuns) return make_error(ErrorCode::LimitExceeded, "more than 2^25 voxels, or runs of them");
  const auto [known, is_new] =
      numbers_.try_emplace(key_of(colour, material_), static_cast<std::uint32_t>(looks_.size()));
  if (is_new) looks_.push_back({colour, material_});
  runs_.push_back({voxel, known->second, count, axis});
  return {};
}

Result<std::vector<VoxelType>> ModelBuilder::types_of_looks(VoxelRegistry& types) {
  constexpr int kMostLost = 4;
  for (int lost = 0; lost <= kMostLost; ++lost) {
    std::unordered_map<std::uint64_t, VoxelType> by_key;
    std::vector<VoxelType> found;
    found.reserve(looks_.size());
    for (const Look& look : looks_) {
      const auto next = static_cast<VoxelType>(std::min<std::size_t>(by_key.size() + 1, kMaxVoxelTypes));
      found.push_back(by_key.try_emplace(key_of(rounded(look.colour, lost), look.material), next).first->second);
      if (by_key.size() >= kMaxVoxelTypes) break;
    }
    if (by_key.size() >= kMaxVoxelTypes) continue;
    if (lost > 0) {
      warn("its " + std::to_string(looks_.size()) + " colours were rounded to " + std::to_string(by_key.size()) +
           ", of " + std::to_string(8 - lost) + " bits a channel");
    }
    for (std::size_t i = 0; i < looks_.size(); ++i) {
      if (found[i] < types.size()) continue;
      VoxelProperties type = materials_[looks_[i].material];
      type.colour = rounded(looks_[i].colour, lost);
      type.visibility = type.colour.a < 255 ? Visibility::Transparent : Visibility::Opaque;
      const auto added = types.add(std::move(type));
      if (!added) return added.error();
      QUOIN_ASSERT(*added == found[i], "types are numbered as they come");
    }
    return found;
  }
  return make_error(ErrorCode::LimitExceeded, "too many colours and materials: " + std::to_string(looks_.size()));
}

Result<LoadedScene> ModelBuilder::take(std::string format) {
  LoadedScene loaded;
  loaded.format = std::move(format);
  const auto types = types_of_looks(loaded.scene.types);
  if (!types) return types.error();
  std::vector<PlacedVoxel> batch;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    Model& model = parts_[i].model;
    const std::size_t end = i + 1 < parts_.size() ? parts_[i + 1].first : runs_.size();
    SceneGrid grid;
    grid.name = model.name;
    grid.pivot = model.pivot;
    grid.canvas = model.canvas;
    for (std::size_t run = parts_[i].first; run < end; ++run) {
      const Run& r = runs_[run];
      if (r.count == 1) continue;
      IVec3 size(1);
      size[r.axis] = r.count;
      grid.grid.fill_box({r.voxel, r.voxel + size}, (*types)[r.look]);
    }
    for (std::size_t run = parts_[i].first; run < end;) {
      batch.clear();
      for (; run < end && batch.size() < kBatch; ++run) {
        if (runs_[run].count == 1) batch.push_back({runs_[run].voxel, (*types)[runs_[run].look]});
      }
      grid.grid.set(batch);
    }
    Instance instance;
    instance.name = std::move(model.name);
    instance.position = model.position;
    instance.voxel_size = model.voxel_size;
    instance.visible = model.visible;
    instance.grid = loaded.scene.add_grid(std::move(grid));
    loaded.scene.add_instance(std::move(instance));
  }
  loaded.warnings = std::move(warnings_);
  return loaded;
}

}  // namespace quoin::models
