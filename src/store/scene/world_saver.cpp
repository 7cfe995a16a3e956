#include <quoin/store/world_saver.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/changes.h>

#include "core/bytes/files.h"
#include "core/bytes/text.h"
#include "core/coordinates/chunk_order.h"
#include "io/scene_file/scene_parts.h"
#include "store/database/schema.h"
#include "store/scene/world_file.h"
#include "store/world/part_text.h"
#include "store/world/world_changes.h"

namespace quoin::store {

/// The numbers of a scene's elements in a world.
template <class T>
struct Numbers {
  std::map<Handle<T>, std::int64_t> numbers;
  std::int64_t next = 0;

  /// Returns an element's number; assigns a new number if it has none.
  std::int64_t of(Handle<T> handle) {
    const auto [found, is_new] = numbers.try_emplace(handle, next);
    if (is_new) ++next;
    return found->second;
  }
  void add(Handle<T> handle, std::int64_t number) {
    QUOIN_ASSERT(number >= 0 && !numbers.contains(handle), "a number for a new element");
    numbers.emplace(handle, number);
    next = std::max(next, number + 1);
  }
};

struct SavedGrid {
  std::uint32_t number = 0;
  WorldGrid header;
  ChangeCursor voxels;  // of `follow`
  ChangeCursor data;
  ChangeCursor densities;
  EditedChunks edited;
  bool is_all_edited = false;   ///< any chunk may have been edited since the last save began
  std::vector<IVec3> unread;    ///< damaged chunks: missing in the scene, and kept in the world
  bool is_partly_read = false;  ///< the scene may lack other chunks
};

/// The part of a scene that a world has stored.
struct SaverState {
  ChangeCursor scene;  // of `follow`
  ChangeCursor types;
  // Results of the last `follow`, kept for their memory:
  SceneChanges scene_changes;
  GridChanges voxel_changes;
  DensityChanges density_changes;
  ChangedObjects changed;
  std::map<GridHandle, SavedGrid> grids;
  std::set<GridHandle> left_out;  ///< grids of the scene that are marked as not saved
  Numbers<Instance> instances;
  SavedInstances saved_instances;
  Numbers<SceneGroup> groups;
  Numbers<SceneLayer> layers;
  std::vector<Lamp> lamps;
  std::vector<std::int64_t> lamp_numbers;  ///< numbers of the lamps in the world
  std::optional<Environment> environment;
  WorldView view;
  std::size_t saved_cameras = 0;
  bool is_view_new = false;
  bool is_begun = false;         ///< the world has a state of this scene
  bool is_partial = false;       ///< from load_partial_world: grids that are not partial are whole
  bool needs_lamp_save = false;  ///< lamp numbers differ from the scene's order
  bool needs_full_save = false;  ///< a save was refused: the next save must contain everything
  std::vector<PartKey> pending_removals;
};

namespace {

void put_removal(WorldChanges& changes, const PartKey& key) {
  const auto number = std::get<std::int64_t>(key.id);
  if (key.kind == part::kGrid) {
    changes.remove_grid(static_cast<std::uint32_t>(number));
  } else {
    WorldParts::remove(changes, key.kind.c_str(), number);
  }
}

void remove(SaveInSteps& save, const char* kind, std::int64_t number) {
  put_removal(save.changes, save.removed.emplace_back(PartKey{kind, number}));
}
/// Removes an element that the scene does not have any more.
template <class T>
void remove(SaveInSteps& save, const char* kind, Numbers<T>& numbers, Handle<T> handle) {
  const auto found = numbers.numbers.find(handle);
  if (found == numbers.numbers.end()) return;
  remove(save, kind, found->second);
  numbers.numbers.erase(found);
}

}  // namespace
}  // namespace quoin::store

namespace quoin {

struct WorldSaver::Impl {
  store::SaverState state;
  std::optional<store::SaveInSteps> begun;

  void follow(const Scene& scene, FunctionRef<void(GridHandle, std::optional<IVec3>)> on_edit);
  /// Keeps the unsaved state after a save was refused or has failed: the next save contains everything.
  void give_back();
};

using namespace store;

namespace {

using OnEdit = FunctionRef<void(GridHandle, std::optional<IVec3>)>;

template <class T>
void sort_and_unite(std::vector<Handle<T>>& handles) {
  std::sort(handles.begin(), handles.end());
  handles.erase(std::unique(handles.begin(), handles.end()), handles.end());
}

template <class T>
[[nodiscard]] std::optional<std::size_t> number_of(const Numbers<T>& numbers, Handle<T> handle) {
  const auto found = numbers.numbers.find(handle);
  if (found == numbers.numbers.end()) return std::nullopt;
  return static_cast<std::size_t>(found->second);
}

Error lacks_grid(const std::string& instance) {
  return make_error(ErrorCode::InvalidArgument, "the grid of instance \"" + instance + "\" does not exist");
}

/// The beginning of a save: collects the changes of a scene, except most chunks, and keeps instances for the steps.
class Save {
 public:
  Save(WorldStore& world, const Scene& scene, SaverState& state, SaveInSteps& save)
      : world_(world), scene_(scene), state_(state), save_(save), changes_(save.changes), removed_(save.removed) {}

  Status run() {
    std::swap(removed_, state_.pending_removals);
    for (const PartKey& key : removed_) put_removal(changes_, key);
    if (state_.needs_full_save) start_anew();
    if (auto done = put_types(); !done) return done;
    SceneChanges changed = state_.changed.take();
    if (changed.all) name_everything(changed);
    // Parts are saved before the parts that refer to them.
    put_named(changed.layers, scene_.layers(), state_.layers, part::kLayer);
    put_groups(changed.groups);
    for (const GridHandle handle : changed.grids) {
      if (auto done = put_grid(handle); !done) return done;
    }
    add_instances_of(marked_, changed.instances);
    save_.instances.reserve(changed.instances.size());
    for (const InstanceHandle handle : changed.instances) {
      if (auto done = keep_instance(handle); !done) return done;
    }
    put_lamps();
    put_environment();
    put_view();
    make_room(changes_.content().chunks, chunks_);
    for (const FewChunks& of : few_chunks_) {
      for (const IVec3 chunk : of.chunks) save_.put_chunk(of.number, of.grid.grid, of.grid.field, chunk);
    }
    save_.is_full = state_.needs_full_save;
    state_.is_begun = true;
    state_.needs_full_save = false;
    return {};
  }

 private:
  // Existing numbers are kept.
  void start_anew() {
    state_.changed.add_all();
    state_.types = {};
    for (auto& [handle, grid] : state_.grids) grid.is_all_edited = true;
  }

  void remove(const char* kind, std::int64_t number) { store::remove(save_, kind, number); }
  template <class T>
  void remove(const char* kind, Numbers<T>& numbers, Handle<T> handle) {
    store::remove(save_, kind, numbers, handle);
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
      return put_types(types_from(held->size()));
    }
    std::vector<VoxelType> types = types_from(changed.all ? 1 : scene_.types.size());
    for (const TypeChange& change : changed.items_unless_all()) types.push_back(change.type);
    return put_types(types);
  }

  [[nodiscard]] std::vector<VoxelType> types_from(std::size_t first) const {
    std::vector<VoxelType> types;
    for (std::size_t type = first; type < scene_.types.size(); ++type) types.push_back(static_cast<VoxelType>(type));
    return types;
  }

  // Each type's part has all of its textures, also those that types share, and a save keeps all parts in memory.
  Status put_types(std::span<const VoxelType> types) {
    constexpr std::uint64_t kMaxTextureBytes = std::uint64_t{2} << 30;
    std::uint64_t bytes = 0;
    for (const VoxelType type : types) bytes += texture_bytes(scene_.types[type]);
    if (bytes > kMaxTextureBytes) {
      return make_error(ErrorCode::LimitExceeded, "the textures of the types would have more than 2 GiB in the world");
    }
    for (const VoxelType type : types) changes_.put_type(type, scene_.types[type]);
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
      } else {
        remove(kind, numbers, handle);
      }
    }
  }

  void put_groups(std::vector<GroupHandle> handles) {
    if (handles.empty()) return;
    scene_.groups().for_each([&](GroupHandle handle, const SceneGroup& group) {  // those below a changed mark
      if (state_.groups.numbers.contains(handle) != is_saved(scene_, group)) handles.push_back(handle);
    });
    sort_and_unite(handles);
    const auto saved_group = [&](GroupHandle handle) {
      const SceneGroup* const group = scene_.groups().find(handle);
      return group != nullptr && is_saved(scene_, *group) ? group : nullptr;
    };
    for (const GroupHandle handle : handles) {  // a group may come before its parent
      if (saved_group(handle) != nullptr) state_.groups.of(handle);
    }
    for (const GroupHandle handle : handles) {
      const SceneGroup* const group = saved_group(handle);
      if (group == nullptr) {
        remove(part::kGroup, state_.groups, handle);
        continue;
      }
      WorldParts::put(changes_, state_.groups.of(handle),
                      SceneFile::Group{*group, number_of(state_.groups, parent_of(scene_, handle)),
                                       number_of(state_.layers, group->layer)});
    }
  }

  // Keeps an instance as it is now. `step` numbers it, and compares it with the last save.
  Status keep_instance(InstanceHandle handle) {
    const Instance* const instance = scene_.instances().find(handle);
    if (instance == nullptr || !is_saved(scene_, *instance)) {
      save_.instances.push_back({.handle = handle});
      return {};
    }
    if (scene_.grids().find(instance->grid) == nullptr) return lacks_grid(instance->name);
    const auto known = state_.saved_instances.find(handle);
    const bool has_name =
        known != state_.saved_instances.end() && known->second.name != nullptr && *known->second.name == instance->name;
    save_.instances.push_back(
        {.handle = handle,
         .is_saved = true,
         .instance = without_name(*instance),
         .name = has_name ? known->second.name : std::make_shared<const std::string>(instance->name)});
    return {};
  }

  // Adds the instances of grids whose mark has changed.
  void add_instances_of(const std::set<GridHandle>& grids, std::vector<InstanceHandle>& instances) const {
    if (grids.empty()) return;
    scene_.instances().for_each([&](InstanceHandle handle, const Instance& instance) {
      if (grids.contains(instance.grid)) instances.push_back(handle);
    });
    sort_and_unite(instances);
  }

  // Removes a grid that the scene does not have any more, or that is marked as not saved.
  Status leave_out(GridHandle handle, const SceneGrid* grid) {
    const auto known = state_.grids.find(handle);
    if (grid == nullptr) {
      state_.left_out.erase(handle);
    } else {
      if (known != state_.grids.end() && (grid->grid.is_partial() || grid->field.is_partial())) {
        return make_error(ErrorCode::InvalidArgument,
                          "cannot leave out grid \"" + printable(grid->name) +
                              "\": it is partial, and its unloaded chunks are only in the file; remove it from the "
                              "scene instead");
      }
      if (state_.left_out.insert(handle).second) marked_.insert(handle);
    }
    if (known == state_.grids.end()) return {};
    remove(part::kGrid, known->second.number);
    state_.grids.erase(known);
    return {};
  }

  Status put_grid(GridHandle handle) {
    const SceneGrid* const grid = scene_.grids().find(handle);
    if (grid == nullptr || !grid->saved) return leave_out(handle, grid);
    auto known = state_.grids.find(handle);
    const bool is_new = known == state_.grids.end();
    if (is_new) {
      if (state_.left_out.erase(handle) != 0) marked_.insert(handle);
      const std::uint32_t number = world_.next_grid();
      known = state_.grids.try_emplace(handle).first;
      known->second.number = number;
    }
    SavedGrid& saved = known->second;
    const bool is_streamed = !state_.is_partial || grid->grid.is_partial() || grid->field.is_partial();
    const WorldGrid header{grid->name, grid->pivot, grid->canvas, grid->field.band(), grid->whole || !is_streamed};
    if (is_new || state_.needs_full_save || header != saved.header) changes_.put_grid(saved.number, header);
    saved.header = header;
    return put_chunks(*grid, saved, is_new);
  }

  // Names the chunks that `step` copies, and takes snapshots of the grid's content. To copy a few chunks is faster.
  Status put_chunks(const SceneGrid& grid, SavedGrid& saved, bool is_new) {
    std::vector<IVec3> chunks;
    if (is_new) {
      saved.voxels = saved.data = grid.grid.cursor();
      saved.densities = grid.field.cursor();
    }
    if (is_new || saved.is_all_edited) {
      static_cast<void>(saved.edited.take());
      // All loaded chunks of a partial grid: the world may lack a chunk that edits made air.
      chunks = is_new ? grid.grid.chunks() : grid.grid.loaded_chunks();
      const std::vector<IVec3> of_field = grid.field.chunks();
      chunks.insert(chunks.end(), of_field.begin(), of_field.end());
      if (!is_new && !saved.is_partly_read) {  // finds chunks emptied since, except chunks that were never read
        auto held = world_.chunks(saved.number, 0);
        if (!held) return held.error();
        std::erase_if(*held, [&](IVec3 chunk) { return std::ranges::find(saved.unread, chunk) != saved.unread.end(); });
        chunks.insert(chunks.end(), held->begin(), held->end());
      }
      quoin::sort_and_unite(chunks);
    } else {
      chunks = saved.edited.take();
    }
    saved.is_all_edited = false;
    if (chunks.empty()) return {};
    chunks_ += chunks.size();
    if (chunks.size() <= StepTime::kItemsPerLook) {
      few_chunks_.push_back({saved.number, grid, std::move(chunks)});
      return {};
    }
    save_.grids.push_back({saved.number, std::move(chunks), grid.grid.snapshot(), grid.field.snapshot()});
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
    save_.had_view = true;
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

  struct FewChunks {
    std::uint32_t number;
    const SceneGrid& grid;
    std::vector<IVec3> chunks;
  };

  WorldStore& world_;
  const Scene& scene_;
  SaverState& state_;
  SaveInSteps& save_;
  WorldChanges& changes_;          // of `save_`
  std::vector<PartKey>& removed_;  // of `save_`
  std::set<GridHandle> marked_;    // left out by this save, or no longer left out
  std::vector<FewChunks> few_chunks_;
  std::size_t chunks_ = 0;  // of all grids of `save_`
};

// Numbers an instance as it was when the save began, and adds it unless the last save had it like this.
Status put_instance(SaverState& state, SaveInSteps& save, SaveInSteps::OfInstance& kept) {
  if (!kept.is_saved) {
    store::remove(save, part::kInstance, state.instances, kept.handle);
    state.saved_instances.erase(kept.handle);
    return {};
  }
  const auto grid = state.grids.find(kept.instance.grid);
  if (grid == state.grids.end()) return lacks_grid(*kept.name);  // marked as saved, but without `edit`
  const auto group = number_of(state.groups, kept.instance.group);
  const auto layer = number_of(state.layers, kept.instance.layer);
  InstancePart now{{std::move(kept.instance), grid->second.number, group, layer}, std::move(kept.name)};
  const auto [known, is_new] = state.saved_instances.try_emplace(kept.handle);
  InstancePart& saved = known.value();
  if (!is_new && !save.is_full && is_same(saved, now)) return {};
  saved = now;
  WorldParts::put(save.changes, state.instances.of(kept.handle), std::move(now));
  return {};
}

// Copies a part of a save. Returns true if nothing is left.
Result<bool> copy_some(SaverState& state, SaveInSteps& save, StepTime& time) {
  for (; save.next_instance < save.instances.size(); ++save.next_instance) {
    if (time.is_over()) return false;
    if (const auto done = put_instance(state, save, save.instances[save.next_instance]); !done) return done.error();
  }
  return save.copy_chunks(time);
}

// Adds a grid's edits since the last call. Loaded and unloaded chunks are not edits.
void follow_grid(GridHandle handle, const SceneGrid& grid, SaverState& state, SavedGrid& saved, OnEdit on_edit) {
  const auto add = [&](const auto& changes) {
    if (changes.all) {
      saved.is_all_edited = true;
      on_edit(handle, std::nullopt);
    }
    for (const auto& change : changes.items_unless_all()) {
      if (!change.is_edit) continue;
      saved.edited.add(change.chunk);
      on_edit(handle, change.chunk);
    }
  };
  // If it throws, the next call reads the changes again. All cursors move to the present, also those that have read
  // nothing: a journal drops old records of both aspects.
  const ChangeCursor now = grid.grid.cursor();
  ChangeCursor voxels = saved.voxels;
  ChangeCursor data = saved.data;
  ChangeCursor densities = saved.densities;
  if (grid.grid.has_changed_since(voxels)) {
    grid.grid.changes_since(voxels, state.voxel_changes);
    add(state.voxel_changes);
  }
  if (grid.grid.has_data_changed_since(data)) add(grid.grid.data_changes_since(data));
  if (grid.field.has_changed_since(densities)) {
    grid.field.changes_since(densities, state.density_changes);
    add(state.density_changes);
  }
  saved.voxels = saved.data = now;
  saved.densities = densities;
}

}  // namespace

void WorldSaver::Impl::follow(const Scene& scene, OnEdit on_edit) {
  ChangeCursor end = state.scene;
  scene.changes_since(end, state.scene_changes);
  const SceneChanges& changes = state.scene_changes;
  const auto follow_one = [&](GridHandle handle, SavedGrid& saved) {
    if (const SceneGrid* const grid = scene.grids().find(handle)) follow_grid(handle, *grid, state, saved, on_edit);
  };
  if (changes.all) {
    for (auto& [handle, saved] : state.grids) follow_one(handle, saved);
  }
  for (const GridHandle handle : changes.grids) {
    if (const auto known = state.grids.find(handle); known != state.grids.end()) follow_one(handle, known->second);
  }
  // With more, it is as fast to look at all objects. The list of a saver that never saves stays short.
  constexpr std::size_t kFew = 4096;
  state.changed.add(changes, kFew + 2 * (scene.instances().size() + state.instances.numbers.size()));
  state.scene = end;
}

void WorldSaver::Impl::give_back() {
  state.needs_full_save = true;
  state.is_view_new |= begun->had_view;
  std::swap(begun->removed, state.pending_removals);
  begun.reset();
}

WorldSaver::WorldSaver() : impl_(std::make_unique<Impl>()) {}
WorldSaver::WorldSaver(WorldSaver&&) noexcept = default;
WorldSaver& WorldSaver::operator=(WorldSaver&&) noexcept = default;
WorldSaver::~WorldSaver() = default;

Result<SaveTicket> WorldSaver::save(WorldStore& world, const Scene& scene, WorldChanges more,
                                    std::function<void(const Status&)> on_saved) {
  if (const auto done = begin(world, scene, std::move(more), std::move(on_saved)); !done) return done.error();
  const auto ticket = step(world, std::numeric_limits<double>::infinity());
  if (!ticket) return ticket.error();
  QUOIN_ASSERT(ticket->has_value(), "a step without a limit is the last one");
  return **ticket;
}

void WorldSaver::follow(const Scene& scene, FunctionRef<void(GridHandle, std::optional<IVec3>)> on_edit) {
  QUOIN_ASSERT(impl_ != nullptr, "a saver that was not moved from");
  impl_->follow(scene, on_edit);
}

Status WorldSaver::begin(WorldStore& world, const Scene& scene, WorldChanges more,
                         std::function<void(const Status&)> on_saved) {
  QUOIN_ASSERT(impl_ != nullptr && world.is_writable(), "a saver, and a world opened for writing");
  QUOIN_ASSERT(!is_begun(), "one save in steps at a time");
  follow(scene);
  SaveInSteps& begun = impl_->begun.emplace();
  begun.changes = std::move(more);
  begun.on_saved = std::move(on_saved);
  try {
    Status put = Save(world, scene, impl_->state, begun).run();
    if (!put) impl_->give_back();
    return put;
  } catch (...) {
    impl_->give_back();
    throw;
  }
}

bool WorldSaver::is_begun() const {
  return impl_->begun.has_value();
}

Result<std::optional<SaveTicket>> WorldSaver::step(WorldStore& world, double seconds) {
  QUOIN_ASSERT(impl_ != nullptr && world.is_writable(), "a saver, and a world opened for writing");
  if (!is_begun()) return std::optional<SaveTicket>();
  try {
    SaveInSteps& save = *impl_->begun;
    StepTime time(seconds);
    const Result<bool> copied = save.is_copied ? true : copy_some(impl_->state, save, time);
    if (!copied) {
      impl_->give_back();
      return copied.error();
    }
    save.is_copied = *copied;
    if (!save.is_copied || !time.has_begun_only()) return std::optional<SaveTicket>();
    const auto ticket = world.save(std::move(save.changes), std::move(save.on_saved));
    if (!ticket) {
      impl_->give_back();
      return ticket.error();
    }
    impl_->begun.reset();
    return std::optional(*ticket);
  } catch (...) {
    impl_->give_back();
    throw;
  }
}

void WorldSaver::set_view(WorldView view) {
  impl_->state.view = std::move(view);
  impl_->state.is_view_new = true;
}

namespace {

// Maximum number of damage lines, for readable reports on broken worlds.
constexpr std::size_t kMaxWarnings = 20;

/// Loads a world's parts and chunks into a scene.
class Load {
 public:
  enum class Chunks : std::uint8_t { All, OfWholeGrids, None };

  Load(const WorldStore& world, Chunks chunks, const WholeGridLimit& limit, const LoadOptions& options,
       LoadedScene& loaded, SaverState& state)
      : world_(world),
        wanted_(chunks),
        limit_(limit),
        options_(options),
        scene_(loaded.scene),
        loaded_(loaded),
        state_(state) {}

  Status run(Threads threads, const Progress& progress) {
    auto types = world_.types();
    if (!types) return types.error();
    scene_.types = std::move(*types);
    for (std::string& line : WorldParts::damage(world_)) add_line(std::move(line));
    const auto grids = world_.grids();
    if (!grids) return grids.error();
    std::size_t done = 0;
    for (const auto& [number, header] : *grids) {
      const auto share = [&] { return static_cast<double>(done) / static_cast<double>(grids->size()); };
      if (progress && !progress(share())) return make_error(ErrorCode::Cancelled, "cancelled", world_.path().string());
      if (auto read = read_grid(number, header, threads, progress, share()); !read) return read;
      ++done;
    }
    if (auto read = read_parts(); !read) return read;
    report_rest();
    if (wanted_ == Chunks::All && scene_.environment) {
      std::string warning = scene_json::read_sky_image(world_.path(), options_, scene_.environment->sky);
      if (!warning.empty()) loaded_.warnings.push_back(std::move(warning));
    }
    remember();
    return {};
  }

 private:
  void add_line(std::string line) {
    if (lines_++ < kMaxWarnings) loaded_.warnings.push_back(std::move(line));
  }
  void report_rest() {
    if (lines_ > kMaxWarnings) {
      loaded_.warnings.push_back("and " + std::to_string(lines_ - kMaxWarnings) + " more (quoin world check)");
    }
  }

  Status read_grid(std::uint32_t number, const WorldGrid& header, Threads threads, const Progress& progress,
                   double share) {
    SceneGrid grid;
    grid.name = header.name;
    grid.pivot = header.pivot;
    grid.canvas = header.canvas;
    grid.field = DensityGrid(header.band);
    grid.whole = header.whole;
    SavedGrid saved;
    saved.number = number;
    saved.header = header;
    if (wanted_ == Chunks::None || (wanted_ == Chunks::OfWholeGrids && !header.whole)) {
      grid.grid.make_partial();
      grid.field.make_partial();
      add_grid(number, std::move(grid), std::move(saved));
      return {};
    }
    bool is_cancelled = false;
    bool is_too_large = false;
    Status read =
        WorldParts::each_chunk(world_, number, 0, threads, [&](const ChunkAddress& place, Result<StoredChunk> chunk) {
          if (!chunk) {
            add_line(chunk.error().message);
            saved.unread.push_back(place.chunk);
            return true;
          }
          bytes_ += chunk->voxels.bytes() + (chunk->densities ? chunk->densities->bytes() : 0);
          is_too_large = bytes_ > limit_.bytes;
          if (is_too_large) return false;
          if (chunk->voxels.uniform() != kAir) grid.grid.put_chunk(place.chunk, std::move(chunk->voxels));
          if (chunk->densities) grid.field.put_chunk(place.chunk, std::move(*chunk->densities));
          is_cancelled = progress && (++chunks_ & 255U) == 0 && !progress(share);
          return !is_cancelled;
        });
    if (is_cancelled) return make_error(ErrorCode::Cancelled, "cancelled", world_.path().string());
    if (is_too_large) return limit_.error(world_, number, header.name, bytes_);
    if (!read) {
      // If the tables themselves are damaged, the parts read so far are kept.
      if (read.error().code != ErrorCode::BadFormat) return read;
      saved.is_partly_read = true;
      add_line("grid " + std::to_string(number) + ": read in part: " + read.error().message);
    }
    add_grid(number, std::move(grid), std::move(saved));
    return {};
  }

  void add_grid(std::uint32_t number, SceneGrid grid, SavedGrid saved) {
    QUOIN_ASSERT(!handles_.contains(number), "each grid is loaded once");
    const GridHandle handle = scene_.add_grid(std::move(grid));
    handles_[number] = handle;
    state_.grids.emplace(handle, std::move(saved));
  }

  // Reads the parts of a kind; reports and skips damaged parts.
  template <class T, class Put>
  Status each(const char* kind, Put put) {
    return WorldParts::each(world_, kind, [&](const Part& part, bool is_sound) {
      const auto* const number = std::get_if<std::int64_t>(&part.key.id);
      const std::string name = name_of(part.key);
      const bool is_number = number != nullptr && *number >= 0 && *number <= kMaxPartNumber;
      if (is_number) last_[kind] = std::max(last_[kind], *number);
      if (is_number && kind == std::string_view(part::kLamp)) lamp_numbers_.push_back(*number);
      if (!is_sound || !is_number) {
        add_line(name + " is damaged");
        return;
      }
      auto content = part_from<T>(part.body, name);
      if (!content) {
        add_line(content.error().message);
        return;
      }
      put(*number, std::move(*content));
    });
  }

  Status read_parts() {
    if (auto read = read_hierarchy(); !read) return read;
    if (auto read = read_instances(); !read) return read;
    Status read = each<Lamp>(part::kLamp, [&](std::int64_t, Lamp lamp) { scene_.lamps.push_back(std::move(lamp)); });
    if (!read) return read;
    read = each<DVec3>(part::kSun, [&](std::int64_t, DVec3 sun) {
      if (sun != DVec3(0.0)) scene_.environment = Environment::natural(sun);
    });
    if (!read) return read;
    read = each<Environment>(part::kEnvironment, [&](std::int64_t, Environment environment) {
      scene_.environment = std::move(environment);
    });
    if (!read) return read;
    read = each<Camera>(part::kView, [&](std::int64_t, Camera camera) { loaded_.camera = camera; });
    if (!read) return read;
    return each<FileCamera>(part::kCamera, [&](std::int64_t, FileCamera camera) { loaded_.cameras.push_back(camera); });
  }

  Status read_hierarchy() {
    Status read = each<SceneLayer>(part::kLayer, [&](std::int64_t number, SceneLayer layer) {
      const LayerHandle handle = scene_.add_layer(std::move(layer));
      layers_[number] = handle;
      state_.layers.add(handle, number);
    });
    if (!read) return read;
    std::vector<std::pair<GroupHandle, std::int64_t>> parents;
    read = each<SceneFile::Group>(part::kGroup, [&](std::int64_t number, SceneFile::Group part) {
      part.group.layer = named(layers_, part.layer);
      const GroupHandle handle = scene_.add_group(std::move(part.group));
      groups_[number] = handle;
      state_.groups.add(handle, number);
      if (part.parent) parents.emplace_back(handle, static_cast<std::int64_t>(*part.parent));
    });
    for (const auto& [handle, parent] : parents) {
      scene_.edit(handle).parent = named(groups_, static_cast<std::size_t>(parent));
    }
    return read;
  }

  Status read_instances() {
    return each<SceneFile::Placement>(part::kInstance, [&](std::int64_t number, SceneFile::Placement part) {
      QUOIN_ASSERT(part.grid.has_value(), "a placement that was read has a grid");
      const auto grid = handles_.find(static_cast<std::int64_t>(*part.grid));
      if (grid == handles_.end()) {
        add_line("instance " + std::to_string(number) + ": its grid is lost");
        return;
      }
      part.instance.grid = grid->second;
      part.instance.group = named(groups_, part.group);
      part.instance.layer = named(layers_, part.layer);
      state_.instances.add(scene_.add_instance(std::move(part.instance)), number);
    });
  }

  template <class T>
  static Handle<T> named(const std::map<std::int64_t, Handle<T>>& handles, std::optional<std::size_t> number) {
    if (!number) return {};
    const auto found = handles.find(static_cast<std::int64_t>(*number));
    return found == handles.end() ? Handle<T>{} : found->second;
  }

  void remember() {
    state_.scene = scene_.cursor();
    state_.types = scene_.types.cursor();
    for (auto& [handle, saved] : state_.grids) {
      const SceneGrid& grid = scene_.grids()[handle];
      saved.voxels = saved.data = grid.grid.cursor();
      saved.densities = grid.field.cursor();
    }
    // The numbers of damaged parts stay reserved.
    const auto after = [&](const char* kind) { return last_.contains(kind) ? last_[kind] + 1 : 0; };
    state_.instances.next = after(part::kInstance);
    state_.groups.next = after(part::kGroup);
    state_.layers.next = after(part::kLayer);
    state_.lamps = scene_.lamps;
    for (std::size_t i = 0; i < lamp_numbers_.size(); ++i) {
      state_.needs_lamp_save |= lamp_numbers_[i] != static_cast<std::int64_t>(i);
    }
    state_.needs_lamp_save |= lamp_numbers_.size() != scene_.lamps.size();
    state_.lamp_numbers = std::move(lamp_numbers_);
    state_.environment = scene_.environment;
    state_.view = {loaded_.camera, loaded_.cameras};
    state_.saved_cameras = loaded_.cameras.size();
    state_.is_begun = true;
    state_.is_partial = wanted_ != Chunks::All;
  }

  const WorldStore& world_;
  const Chunks wanted_;
  const WholeGridLimit limit_;  // of the chunks that are loaded
  const LoadOptions& options_;
  Scene& scene_;
  LoadedScene& loaded_;
  SaverState& state_;
  std::map<std::int64_t, GridHandle> handles_;
  std::map<std::int64_t, LayerHandle> layers_;
  std::map<std::int64_t, GroupHandle> groups_;
  std::map<std::string, std::int64_t> last_;  // greatest number of each kind
  std::vector<std::int64_t> lamp_numbers_;
  std::size_t lines_ = 0;
  std::size_t chunks_ = 0;
  std::uint64_t bytes_ = 0;  // of loaded chunks
};

Result<LoadedWorld> load(const WorldStore& world, Load::Chunks chunks, const WholeGridLimit& limit, LoadedWorld result,
                         SaverState& state, const LoadOptions& options, Threads threads, const Progress& progress) {
  result.loaded.format = "world";
  Load load(world, chunks, limit, options, result.loaded, state);
  if (auto done = load.run(threads, progress); !done)
    return with_world(Result<LoadedWorld>(done.error()), world.path());
  if (options.show_hidden) show_all(result.loaded.scene);
  return result;
}

}  // namespace

// The address of the saver's state is stable when the saver is moved.
Result<LoadedWorld> load_world(const WorldStore& world, const LoadOptions& options, Threads threads,
                               const Progress& progress) {
  LoadedWorld result;
  SaverState& state = result.saver.impl().state;
  return load(world, Load::Chunks::All, {}, std::move(result), state, options, threads, progress);
}

Result<LoadedWorld> load_partial_world(const WorldStore& world, const LoadOptions& options,
                                       std::uint64_t max_whole_bytes) {
  WholeGridLimit limit;
  if (max_whole_bytes != 0) {
    limit = WholeGridLimit::of(max_whole_bytes);
    if (auto fits = check_whole_grids(world, limit); !fits) return fits.error();
  }
  LoadedWorld result;
  SaverState& state = result.saver.impl().state;
  const auto chunks = max_whole_bytes == 0 ? Load::Chunks::None : Load::Chunks::OfWholeGrids;
  return load(world, chunks, limit, std::move(result), state, options, {}, {});
}

std::optional<std::uint32_t> WorldSaver::number_of(GridHandle grid) const {
  const auto found = impl_->state.grids.find(grid);
  return found == impl_->state.grids.end() ? std::nullopt : std::optional(found->second.number);
}

}  // namespace quoin
