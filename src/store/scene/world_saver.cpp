#include <quoin/store/world_saver.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <utility>

#include <quoin/core/assert.h>

#include "store/scene/saver_state.h"
#include "store/world/part_text.h"
#include "store/world/world_changes.h"

namespace quoin {

using namespace store;

namespace {

constexpr auto kBefore = [](IVec3 a, IVec3 b) { return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x); };
using ChunkSet = std::set<IVec3, decltype(kBefore)>;

/// One save: collects the changes of a scene.
class Save {
 public:
  Save(WorldStore& world, const Scene& scene, SaverState& state, WorldChanges& changes)
      : world_(world), scene_(scene), state_(state), changes_(changes) {}

  Status run() {
    for (const PartKey& key : std::exchange(state_.pending_removals, {}))
      remove(key.kind.c_str(), std::get<std::int64_t>(key.id));
    if (state_.needs_full_save) start_anew();
    if (auto done = put_types(); !done) return done;
    SceneChanges changed = scene_.changes_since(state_.scene);
    if (changed.all) name_everything(changed);
    // Parts are saved before the parts that refer to them.
    put_named(changed.layers, scene_.layers(), state_.layers, part::kLayer);
    put_groups(changed.groups);
    for (const GridHandle handle : changed.grids) {
      if (auto done = put_grid(handle); !done) return done;
    }
    for (const InstanceHandle handle : changed.instances) {
      if (auto done = put_instance(handle); !done) return done;
    }
    put_lamps();
    put_environment();
    put_view();
    state_.is_begun = true;
    state_.needs_full_save = false;
    return {};
  }
  /// Restores the unsaved state after the store refused the changes.
  void give_back() {
    state_.needs_full_save = true;
    state_.is_view_new |= had_view_;
    std::ranges::move(removed_, std::back_inserter(state_.pending_removals));
  }

 private:
  // Existing numbers are kept.
  void start_anew() {
    state_.scene = {};
    state_.types = {};
    for (auto& [handle, grid] : state_.grids) grid.voxels = grid.data = grid.densities = {};
  }

  void remove(const char* kind, std::int64_t number) {
    if (kind == std::string_view(part::kGrid)) {
      changes_.remove_grid(static_cast<std::uint32_t>(number));
    } else {
      WorldParts::remove(changes_, kind, number);
    }
    removed_.push_back({kind, number});
  }

  Status put_types() {
    const TypeChanges changed = scene_.types.changes_since(state_.types);
    if (!state_.is_begun) {
      if (auto empty = check_empty(); !empty) return empty;
      const auto held = world_.types();
      if (!held) return held.error();
      for (std::size_t type = 1; type < held->size(); ++type) {
        const auto number = static_cast<VoxelType>(type);
        if (type < scene_.types.size() && (*held)[number] == scene_.types[number]) continue;
        return make_error(ErrorCode::InvalidArgument, "the world and the scene differ in type " + std::to_string(type));
      }
      changes_.put_types(scene_.types, static_cast<VoxelType>(std::min<std::size_t>(held->size(), kMaxVoxelTypes)));
      return {};
    }
    if (changed.all) changes_.put_types(scene_.types);
    for (const TypeChange& change : changed.items) changes_.put_type(change.type, scene_.types[change.type]);
    return {};
  }

  // The world's existing scene must not be mixed with this scene.
  Status check_empty() const {
    bool is_empty = true;
    for (const char* const kind : {part::kGrid, part::kInstance, part::kGroup, part::kLayer, part::kLamp}) {
      Status read = WorldParts::each(world_, kind, [&](const Part&, bool) { is_empty = false; });
      if (!read) return read;
    }
    if (is_empty) return {};
    return make_error(ErrorCode::InvalidArgument, "the world already holds a scene; load it with load_world");
  }

  // Lists all current and all saved elements.
  void name_everything(SceneChanges& changed) const {
    const auto add = [](auto& list, const auto& map, const auto& known) {
      list = map.handles();
      for (const auto& [handle, entry] : known) {
        if (map.find(handle) == nullptr) list.push_back(handle);
      }
    };
    add(changed.grids, scene_.grids(), state_.grids);
    add(changed.instances, scene_.instances(), state_.instances.numbers);
    add(changed.groups, scene_.groups(), state_.groups.numbers);
    add(changed.layers, scene_.layers(), state_.layers.numbers);
  }

  template <class T>
  void put_named(const std::vector<Handle<T>>& handles, const SlotMap<T>& map, Numbers<T>& numbers, const char* kind) {
    for (const Handle<T> handle : handles) {
      if (const T* const found = map.find(handle)) {
        WorldParts::put(changes_, kind, numbers.of(handle), text_of(*found));
      } else if (const auto number = numbers.take(handle)) {
        remove(kind, *number);
      }
    }
  }

  template <class T>
  [[nodiscard]] static std::optional<std::size_t> number_of(const Numbers<T>& numbers, Handle<T> handle) {
    const auto found = numbers.numbers.find(handle);
    if (found == numbers.numbers.end()) return std::nullopt;
    return static_cast<std::size_t>(found->second);
  }

  void put_groups(const std::vector<GroupHandle>& handles) {
    for (const GroupHandle handle : handles) {  // a group may come before its parent
      if (scene_.groups().find(handle) != nullptr) state_.groups.of(handle);
    }
    for (const GroupHandle handle : handles) {
      const SceneGroup* const group = scene_.groups().find(handle);
      if (group == nullptr) {
        if (const auto number = state_.groups.take(handle)) remove(part::kGroup, *number);
        continue;
      }
      const SceneFile::Group text{group->name,
                                  number_of(state_.groups, parent_of(scene_, handle)),
                                  number_of(state_.layers, group->layer),
                                  group->position,
                                  group->rotation,
                                  group->mirrored,
                                  group->visible};
      WorldParts::put(changes_, part::kGroup, state_.groups.of(handle), text_of(text));
    }
  }

  Status put_instance(InstanceHandle handle) {
    const Instance* const instance = scene_.instances().find(handle);
    if (instance == nullptr) {
      if (const auto number = state_.instances.take(handle)) remove(part::kInstance, *number);
      return {};
    }
    const auto grid = state_.grids.find(instance->grid);
    if (grid == state_.grids.end()) {
      return make_error(ErrorCode::InvalidArgument, "the grid of instance \"" + instance->name + "\" does not exist");
    }
    SceneFile::Placement text;
    text.grid = grid->second.number;
    text.name = instance->name;
    text.position = instance->position;
    text.rotation = instance->rotation;
    text.scale = instance->voxel_size;
    text.mirrored = instance->mirrored;
    text.visible = instance->visible;
    text.group = number_of(state_.groups, instance->group);
    text.layer = number_of(state_.layers, instance->layer);
    if (instance->categories != Instance().categories) text.categories = instance->categories;
    WorldParts::put(changes_, part::kInstance, state_.instances.of(handle), text_of(text));
    return {};
  }

  Status put_grid(GridHandle handle) {
    const SceneGrid* const grid = scene_.grids().find(handle);
    const auto known = state_.grids.find(handle);
    if (grid == nullptr) {
      if (known == state_.grids.end()) return {};
      remove(part::kGrid, known->second.number);
      state_.grids.erase(known);
      return {};
    }
    const bool is_new = known == state_.grids.end();
    SavedGrid& saved = is_new ? state_.grids[handle] : known->second;
    if (is_new) saved.number = world_.next_grid();
    const WorldGrid header{grid->name, grid->pivot, grid->canvas, grid->field.band()};
    if (is_new || state_.needs_full_save || header != saved.header) changes_.put_grid(saved.number, header);
    saved.header = header;
    return put_chunks(*grid, saved, is_new);
  }

  Status put_chunks(const SceneGrid& grid, SavedGrid& saved, bool is_new) {
    ChunkSet changed(kBefore);
    bool is_all = false;
    const auto add = [&](const auto& changes) {
      is_all |= changes.all;
      for (const auto& change : changes.items) {
        if (change.is_edit) changed.insert(change.chunk);
      }
    };
    add(grid.grid.changes_since(saved.voxels));
    add(grid.grid.data_changes_since(saved.data));
    add(grid.field.changes_since(saved.densities));
    if (is_all) {
      for (const IVec3 chunk : grid.grid.chunks()) changed.insert(chunk);
      for (const IVec3 chunk : grid.field.chunks()) changed.insert(chunk);
      if (!is_new && !saved.is_partly_read) {  // finds chunks emptied since, except chunks that were never read
        const auto held = world_.chunks(saved.number, 0);
        if (!held) return held.error();
        ChunkSet emptied(held->begin(), held->end(), kBefore);
        for (const IVec3 chunk : saved.unread) emptied.erase(chunk);
        changed.merge(emptied);
      }
    }
    for (const IVec3 chunk : changed) {
      if (!grid.grid.is_loaded(chunk) || !grid.field.is_loaded(chunk)) continue;  // unloaded chunks are unchanged
      StoredChunk stored;
      if (const Chunk* const voxels = grid.grid.find_chunk(chunk)) stored.voxels = *voxels;
      if (const DensityChunk* const densities = grid.field.find_chunk(chunk)) stored.densities = *densities;
      changes_.put_chunk({saved.number, 0, chunk}, std::move(stored));
    }
    return {};
  }

  void put_lamps() {
    const std::vector<Lamp>& now = scene_.lamps;
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (!state_.needs_full_save && !state_.needs_lamp_save && i < state_.lamps.size() && state_.lamps[i] == now[i])
        continue;
      WorldParts::put(changes_, part::kLamp, static_cast<std::int64_t>(i), text_of(now[i]));
    }
    for (const std::int64_t number : state_.lamp_numbers) {
      if (number < 0 || number >= static_cast<std::int64_t>(now.size())) remove(part::kLamp, number);
    }
    state_.lamp_numbers.resize(now.size());
    std::iota(state_.lamp_numbers.begin(), state_.lamp_numbers.end(), 0);
    state_.lamps = now;
    state_.needs_lamp_save = false;
  }

  // Writes a part with id 0, or removes it.
  template <class T>
  void put_single(const char* kind, const std::optional<T>& content) {
    if (content) {
      WorldParts::put(changes_, kind, 0, text_of(*content));
    } else {
      remove(kind, 0);
    }
  }

  void put_environment() {
    const std::optional<Environment>& now = scene_.environment;
    if (!state_.needs_full_save && state_.environment == now) return;
    const bool is_sun = now && is_only_sun(*now);
    put_single(part::kSun, is_sun ? std::optional(now->sun.direction) : std::nullopt);
    put_single(part::kEnvironment, is_sun ? std::nullopt : now);
    state_.environment = now;
  }

  void put_view() {
    if (!state_.is_view_new) return;
    had_view_ = true;
    const WorldView& view = state_.view;
    put_single(part::kView, view.camera);
    for (std::size_t i = 0; i < view.cameras.size(); ++i) {
      WorldParts::put(changes_, part::kCamera, static_cast<std::int64_t>(i), text_of(view.cameras[i]));
    }
    for (std::size_t i = view.cameras.size(); i < state_.saved_cameras; ++i) {
      remove(part::kCamera, static_cast<std::int64_t>(i));
    }
    state_.saved_cameras = view.cameras.size();
    state_.is_view_new = false;
  }

  WorldStore& world_;
  const Scene& scene_;
  SaverState& state_;
  WorldChanges& changes_;
  std::vector<PartKey> removed_;
  bool had_view_ = false;
};

}  // namespace

WorldSaver::WorldSaver() : impl_(std::make_unique<Impl>()) {}
WorldSaver::WorldSaver(WorldSaver&&) noexcept = default;
WorldSaver& WorldSaver::operator=(WorldSaver&&) noexcept = default;
WorldSaver::~WorldSaver() = default;

Result<SaveTicket> WorldSaver::save(WorldStore& world, const Scene& scene, WorldChanges more,
                                    std::function<void(const Status&)> on_saved) {
  QUOIN_ASSERT(impl_ != nullptr && world.is_writable(), "a saver, and a world opened for writing");
  Save saving(world, scene, impl_->state, more);
  const Status put = saving.run();
  Result<SaveTicket> ticket = put ? world.save(std::move(more), std::move(on_saved)) : Result<SaveTicket>(put.error());
  if (!ticket) saving.give_back();
  return ticket;
}

void WorldSaver::set_view(WorldView view) {
  impl_->state.view = std::move(view);
  impl_->state.is_view_new = true;
}

}  // namespace quoin
