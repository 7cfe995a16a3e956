#include "io/models/model_builder.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <quoin/core/assert.h>

namespace quoin::models {

namespace {

constexpr std::size_t kMaxRuns = std::size_t{1} << 25;
// Runs that are set at once.
constexpr std::size_t kBatch = std::size_t{1} << 18;

}  // namespace

void ModelBuilder::begin(Model model) {
  QUOIN_ASSERT(model.voxel_size > 0.0 && std::isfinite(model.voxel_size), "0 < voxel_size < infinity");
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
  QUOIN_ASSERT(axis >= 0 && axis < 3, "0 <= axis < 3");
  if (colour.a == 0 || count <= 0) return {};
  if (runs_.size() == kMaxRuns) return make_error(ErrorCode::LimitExceeded, "more than 2^25 voxels or runs of voxels");
  runs_.push_back({voxel, colours_.index_of(colour, material_), count, axis});
  return {};
}

Result<LoadedScene> ModelBuilder::take(std::string format) {
  LoadedScene loaded;
  loaded.format = std::move(format);
  const auto types = colours_.add_to(loaded.scene.types, materials_, warnings_);
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
      QUOIN_ASSERT(r.count > 0 && r.colour < types->size(), "a run of a known colour");
      if (r.count == 1) continue;
      IVec3 size(1);
      size[r.axis] = r.count;
      grid.grid.fill_box({r.voxel, r.voxel + size}, (*types)[r.colour]);
    }
    for (std::size_t run = parts_[i].first; run < end;) {
      batch.clear();
      for (; run < end && batch.size() < kBatch; ++run) {
        if (runs_[run].count == 1) batch.push_back({runs_[run].voxel, (*types)[runs_[run].colour]});
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
