#include <quoin/render/propagated_light.h>

#include <array>
#include <bit>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>

#include "core/coordinates/chunk_order.h"
#include "core/moved_from.h"

namespace quoin {

struct SceneLight::Entry {
  explicit Entry(const PropagatedLightOptions& options) : light(options) {}
  Entry(const Entry& other)
      : light(other.light.snapshot()),
        voxels(other.voxels == &other.both ? &both : other.voxels),
        both(other.both.snapshot()),
        followed_voxels(other.followed_voxels),
        followed_field(other.followed_field),
        has_shapes(other.has_shapes) {}
  Entry& operator=(const Entry&) = delete;

  PropagatedLight light;
  const Grid* voxels = nullptr;  // the scene's, or `both`
  Grid both;                     // union of voxels and field, if there is a field
  ChangeCursor followed_voxels;
  ChangeCursor followed_field;
  bool has_shapes = false;  // `both` follows the voxels' data

  void update(const SceneGrid& grid, const VoxelRegistry& types, Threads threads);
  void unite(const SceneGrid& grid, const VoxelRegistry& types);
};

namespace {

constexpr VoxelType kUnknown = 65'535;

Chunk united_chunk(const Chunk* voxels, const DensityChunk* field) {
  Chunk all = voxels == nullptr ? Chunk() : *voxels;
  if (field == nullptr) return all;
  std::vector<VoxelType> dense(kChunkVoxels);
  std::array<VoxelType, kChunkEdge> materials;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const auto first = dense.begin() + (y + kChunkEdge * z) * kChunkEdge;
      const std::span<VoxelType, kChunkEdge> row(first, kChunkEdge);
      all.read_row(y, z, row);
      const std::uint64_t solid = field->solid_row(y, z);
      if (solid != 0) field->materials().read_row(y, z, materials);
      for (std::uint64_t left = solid; left != 0; left &= left - 1) {
        const auto x = static_cast<std::size_t>(std::countr_zero(left));
        if (row[x] == kAir) row[x] = materials[x] == kAir ? kUnknown : materials[x];
      }
    }
  }
  Chunk united = Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(dense));
  all.for_each_data([&](IVec3 local, const VoxelData& data) { united.set_data(local, {.state = data.state}); });
  return united;
}

}  // namespace

void SceneLight::Entry::unite(const SceneGrid& grid, const VoxelRegistry& types) {
  std::vector<IVec3> chunks;
  if (std::exchange(has_shapes, types.has_shapes()) != types.has_shapes()) followed_voxels = {};
  ChangeCursor followed_data = followed_voxels;
  PendingChanges of_voxels(followed_voxels, grid.grid);
  PendingChanges of_field(followed_field, grid.field);
  DataChanges of_data;
  if (has_shapes) of_data = grid.grid.data_changes_since(followed_data);
  if (!of_data.empty()) followed_voxels = {};  // until `commit`
  if (of_voxels->all || of_field->all || of_data.all) {
    both.clear();
    for (const std::vector<IVec3>& more : {grid.grid.chunks(), grid.field.chunks()}) {
      chunks.insert(chunks.end(), more.begin(), more.end());
    }
  } else {
    for (const auto& change : of_voxels->items_unless_all()) chunks.push_back(change.chunk);
    for (const auto& change : of_data.items_unless_all()) chunks.push_back(change.chunk);
    for (const auto& change : of_field->items_unless_all()) chunks.push_back(change.chunk);
  }
  sort_and_unite(chunks);
  for (const IVec3 chunk : chunks) {
    both.put_chunk(chunk, united_chunk(grid.grid.find_chunk(chunk), grid.field.find_chunk(chunk)));
  }
  of_voxels.commit();
  of_field.commit();
}

void SceneLight::Entry::update(const SceneGrid& grid, const VoxelRegistry& types, Threads threads) {
  const bool has_field = grid.field.chunk_count() > 0;
  if (has_field) unite(grid, types);
  voxels = has_field ? &both : &grid.grid;
  light.update(*voxels, types, threads);
}

SceneLight::SceneLight(PropagatedLightOptions options)
    : options_(std::move(options)), unknown_(std::make_unique<Entry>(options_)) {
  unknown_->voxels = &unknown_->both;
}
SceneLight::SceneLight(SceneLight&&) noexcept = default;
SceneLight& SceneLight::operator=(SceneLight&&) noexcept = default;
SceneLight::~SceneLight() = default;

void SceneLight::update(const Scene& scene, Threads threads) {
  std::erase_if(grids_, [&](const auto& each) { return scene.grids().find(each.first) == nullptr; });
  for (const GridHandle handle : scene.grids().handles()) {
    const SceneGrid& grid = scene.grids()[handle];
    auto entry = grids_.find(handle);
    if (entry == grids_.end()) entry = grids_.emplace(handle, std::make_unique<Entry>(options_)).first;
    entry->second->update(grid, scene.types, threads);
  }
}

SceneLight SceneLight::snapshot() const {
  SceneLight copy(options_);
  for (const auto& [handle, entry] : grids_) copy.grids_[handle] = std::make_unique<Entry>(*entry);
  return copy;
}

std::size_t SceneLight::bytes() const {
  std::size_t sum = 0;
  for (const auto& [handle, entry] : grids_) sum += entry->light.bytes() + entry->both.bytes();
  return sum;
}

GridLight SceneLight::of(GridHandle grid) const {
  const auto found = grids_.find(grid);
  // An update that threw may have left an entry without voxels.
  const bool is_known = found != grids_.end() && found->second->voxels != nullptr;
  const Entry& entry = is_known ? *found->second : impl_of(unknown_);
  return {&entry.light, entry.voxels};
}

}  // namespace quoin
