#include <quoin/scene/smooth_scene.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/grid/voxel_field.h>

#include "core/coordinates/chunk_order.h"
#include "core/moved_from.h"
#include "scene/scene_follower.h"
#include "scene/smooth/marched_density.h"

namespace quoin {
namespace {

/// The fields made from one grid.
struct GridFields {
  ChangeCursor voxels_read;
  ChangeCursor field_read;
  DensityGrid made = DensityGrid();  // field of the voxels
  std::vector<IVec3> to_make;        // its outdated chunks
  bool is_made_new = true;           // not in the scene yet
  bool is_field_new = true;          // to the scene
  DVec3 pivot{0.0};
  GridHandle of_voxels;  // in the scene, if they were there
  GridHandle of_field;
};

// Returns the chunks whose densities depend on the voxels of a chunk's box.
void add_reached(const ChunkChange& change, std::vector<IVec3>& chunks) {
  const IBox reached{change.box.min - kVoxelFieldReach, change.box.max + kVoxelFieldReach};
  for (int i = 0; i < 27; ++i) {
    const IVec3 offset = Neighbourhood::offset(i);
    const IBox there{offset * kChunkEdge, (offset + 1) * kChunkEdge};
    if (!intersect(reached, there).empty()) chunks.push_back(change.chunk + offset);
  }
}

void add_all_near(const Grid& grid, std::vector<IVec3>& chunks) {
  for (const IVec3 chunk : grid.chunks()) {
    for (int i = 0; i < 27; ++i) chunks.push_back(chunk + Neighbourhood::offset(i));
  }
}

std::size_t chunk_count(const Scene& scene) {
  std::size_t count = 0;
  for (const GridHandle handle : scene.grids().handles()) count += scene.grids()[handle].grid.chunk_count();
  return count;
}

}  // namespace

struct SmoothScene::Impl {
  explicit Impl(const SmoothFieldOptions& given) : options(given), follower(given.instances) {}

  SmoothFieldOptions options;
  Scene scene;
  SceneFollower follower;
  ChangeCursor types_read;
  std::map<GridHandle, GridFields> grids;  // placed by drawn instances
  bool is_placed_anew = true;              // the instances or the set of grids changed
  std::size_t bytes = 0;
  std::optional<std::size_t> too_many;  // chunks

  void follow(const Scene& of);
  void follow_grid(const SceneGrid& grid, GridFields& fields);
  Status make(const Scene& of, Threads threads, const Progress& progress);
  void make_some(const Grid& grid, const VoxelRegistry& types, GridFields& fields, std::size_t count, Threads threads);
  void place_all(const Scene& of);
  void renew_fields(const Scene& of);
  Error refuse(const Scene& of);
};

SmoothScene::SmoothScene(const SmoothFieldOptions& options) : impl_(std::make_unique<Impl>(options)) {}
SmoothScene::SmoothScene(SmoothScene&&) noexcept = default;
SmoothScene& SmoothScene::operator=(SmoothScene&&) noexcept = default;
SmoothScene::~SmoothScene() = default;

const Scene& SmoothScene::scene() const {
  return impl_of(impl_).scene;
}

std::size_t SmoothScene::bytes() const {
  return impl_of(impl_).bytes;
}

// Records the outdated chunks. Makes nothing yet.
void SmoothScene::Impl::follow(const Scene& of) {
  SceneFollower::Update update(follower, of);
  is_placed_anew |= update.has_other_instances();
  if (has_other_visibility(of.types.changes_since(types_read))) {
    for (auto& [handle, fields] : grids) fields.voxels_read = {};
  }
  for (const GridHandle grid : update.touched()) {
    if (follower.places(grid)) {
      grids.try_emplace(grid);
    } else {
      grids.erase(grid);
    }
  }
  update.commit();
  for (auto& [handle, fields] : grids) follow_grid(of.grids()[handle], fields);
}

void SmoothScene::Impl::follow_grid(const SceneGrid& grid, GridFields& fields) {
  const DVec3 pivot = std::exchange(fields.pivot, grid.pivot);
  if (pivot != grid.pivot) is_placed_anew = true;
  fields.is_field_new |= !grid.field.changes_since(fields.field_read).empty();
  PendingChanges changes(fields.voxels_read, grid.grid);
  if (changes->empty()) return;
  if (changes->all) {
    fields.made = DensityGrid();
    fields.to_make.clear();
    add_all_near(grid.grid, fields.to_make);
  }
  for (const ChunkChange& change : changes->items_unless_all()) add_reached(change, fields.to_make);
  sort_and_unite(fields.to_make);
  fields.is_made_new = true;
  changes.commit();
}

Status SmoothScene::update(const Scene& of, Threads threads, const Progress& progress) {
  Impl& me = impl_of(impl_);
  if (me.too_many && chunk_count(of) >= *me.too_many) return me.refuse(of);
  me.too_many.reset();
  me.follow(of);
  if (Status made = me.make(of, threads, progress); !made) return made;
  if (me.is_placed_anew) {
    me.place_all(of);
  } else {
    me.renew_fields(of);
  }
  me.scene.types = of.types;
  me.scene.lamps = of.lamps;
  return {};
}

Status SmoothScene::Impl::make(const Scene& of, Threads threads, const Progress& progress) {
  std::size_t left = 0;
  bytes = 0;
  for (const auto& [handle, fields] : grids) {
    left += fields.to_make.size();
    bytes += fields.made.bytes();
  }
  const auto all = static_cast<double>(left);
  // A cancelled call ends after at most two chunks per thread.
  const std::size_t batch = std::size_t{2} * thread_count(threads);
  for (auto& [handle, fields] : grids) {
    while (!fields.to_make.empty()) {
      if (progress && !progress(1.0 - static_cast<double>(left) / all)) {
        return make_error(ErrorCode::Cancelled, "cancelled");
      }
      const std::size_t count = std::min(batch, fields.to_make.size());
      make_some(of.grids()[handle].grid, of.types, fields, count, threads);
      left -= count;
      if (bytes > options.max_bytes) {
        too_many = chunk_count(of);
        return refuse(of);
      }
    }
  }
  return {};
}

// The last chunk to be made.
void SmoothScene::Impl::make_some(const Grid& grid, const VoxelRegistry& types, GridFields& fields, std::size_t count,
                                  Threads threads) {
  QUOIN_ASSERT(count <= fields.to_make.size(), "chunks that are still to be made");
  const std::size_t first = fields.to_make.size() - count;
  std::vector<std::optional<DensityChunk>> made(count);
  parallel_for(count, threads,
               [&](std::size_t i) { made[i] = marched_density(grid.neighbourhood(fields.to_make[first + i]), types); });
  for (std::size_t i = 0; i < count; ++i) {
    const IVec3 at = fields.to_make[first + i];
    if (const DensityChunk* before = fields.made.find_chunk(at)) bytes -= std::min(bytes, before->bytes());
    fields.made.put_chunk(at, std::move(*made[i]));
    if (const DensityChunk* now = fields.made.find_chunk(at)) bytes += now->bytes();
  }
  fields.to_make.resize(first);
}

// Releases everything.
Error SmoothScene::Impl::refuse(const Scene& of) {
  grids.clear();
  scene = Scene();
  follower.forget();
  bytes = 0;
  is_placed_anew = true;
  return Error{ErrorCode::LimitExceeded,
               "the densities of " + std::to_string(chunk_count(of)) + " chunks exceed the limit of " +
                   std::to_string(options.max_bytes >> 20) + " MiB",
               "", std::nullopt};
}

// Rebuilds the scene with all grids in place.
void SmoothScene::Impl::place_all(const Scene& of) {
  is_placed_anew = true;  // until all is placed
  Scene placed;
  for (auto& [handle, fields] : grids) {
    const SceneGrid& grid = of.grids()[handle];
    fields.of_voxels = fields.of_field = {};
    if (fields.made.chunk_count() > 0) {
      // Samples are the voxels' centres.
      fields.of_voxels = placed.add_grid({grid.name, Grid(), grid.pivot - 0.5, IBox{}, fields.made.snapshot()});
    }
    if (grid.field.chunk_count() > 0) {
      fields.of_field = placed.add_grid({grid.name, Grid(), grid.pivot, IBox{}, grid.field.snapshot()});
    }
    fields.is_made_new = fields.is_field_new = false;
  }
  for (const InstanceHandle handle : of.instances().handles()) {
    const Instance& instance = of.instances()[handle];
    if (!is_drawn(of, instance, options.instances)) continue;
    const GridFields& fields = grids.at(instance.grid);
    for (const GridHandle grid : {fields.of_voxels, fields.of_field}) {
      if (placed.grids().find(grid) == nullptr) continue;
      Instance copy = instance;
      copy.grid = grid;
      copy.visible = true;
      copy.group = {};
      copy.layer = {};
      placed.add_instance(std::move(copy));
    }
  }
  scene = std::move(placed);
  is_placed_anew = false;
}

// Updates only the contents of grids. If a grid's first content appears or its last disappears, the scene is rebuilt.
void SmoothScene::Impl::renew_fields(const Scene& of) {
  const bool is_other = std::ranges::any_of(grids, [&](const auto& entry) {
    const GridFields& fields = entry.second;
    const bool has_voxels = fields.made.chunk_count() > 0;
    const bool has_field = of.grids()[entry.first].field.chunk_count() > 0;
    return has_voxels != (scene.grids().find(fields.of_voxels) != nullptr) ||
           has_field != (scene.grids().find(fields.of_field) != nullptr);
  });
  if (is_other) return place_all(of);
  for (auto& [handle, fields] : grids) {
    if (fields.is_made_new && fields.made.chunk_count() > 0) {
      scene.edit(fields.of_voxels).field = fields.made.snapshot();
    }
    const DensityGrid& field = of.grids()[handle].field;
    if (fields.is_field_new && field.chunk_count() > 0) {
      scene.edit(fields.of_field).field = field.snapshot();
    }
    fields.is_made_new = fields.is_field_new = false;
  }
}

}  // namespace quoin
