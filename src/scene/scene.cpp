#include <quoin/scene/scene.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <type_traits>

#include <glm/common.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>

#include "core/change_journal.h"
#include "core/coordinates/unit_rotation.h"
#include "core/moved_from.h"
#include "scene/scene_follower.h"

namespace quoin {

namespace {

constexpr DVec3 kNowhere{std::numeric_limits<double>::quiet_NaN()};

}  // namespace

glm::dmat3 world_axes(const DQuat& rotation, bool mirrored) {
  constexpr double kRounding = 1e-12;
  glm::dmat3 axes = glm::mat3_cast(unit_rotation(rotation));
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) {
      const double nearest = std::round(axes[column][row]);
      if (std::abs(axes[column][row] - nearest) < kRounding) axes[column][row] = nearest;
    }
  }
  if (mirrored) axes[0] = -axes[0];
  return axes;
}

bool has_valid_transform(const Instance& instance) {
  const DQuat& q = instance.rotation;
  return is_finite(instance.position) && is_finite({q.x, q.y, q.z}) && std::isfinite(q.w) &&
         std::isfinite(instance.voxel_size) && instance.voxel_size > 0.0;
}

glm::dmat4 world_from_grid(const Instance& instance, const SceneGrid& grid) {
  glm::dmat4 matrix(world_axes(instance) * instance.voxel_size);
  matrix[3] = glm::dvec4(world_from_grid(instance, grid, DVec3(0.0)), 1.0);
  return matrix;
}

// Uses the inverse instead of the transpose: a quaternion may be slightly longer than 1, which matters far from the
// pivot.
DVec3 grid_from_world(const Instance& instance, const SceneGrid& grid, DVec3 point_in_world) {
  if (!has_valid_transform(instance)) return kNowhere;
  // The difference of two far positions is taken first: it is small, and mostly exact.
  const DVec3 offset = glm::inverse(world_axes(instance)) * (point_in_world - instance.position);
  return offset / instance.voxel_size + grid.pivot;
}

DVec3 world_from_grid_direction(const Instance& instance, DVec3 direction_in_grid) {
  return world_axes(instance) * (direction_in_grid * instance.voxel_size);
}

DVec3 grid_from_world_direction(const Instance& instance, DVec3 direction_in_world) {
  if (!has_valid_transform(instance)) return kNowhere;
  return glm::inverse(world_axes(instance)) * direction_in_world / instance.voxel_size;
}

DVec3 transformed_point(const Instance& before, const Instance& after, DVec3 point_in_world) {
  if (!has_valid_transform(before) || !has_valid_transform(after)) return point_in_world;
  const DVec3 in_grid = glm::inverse(world_axes(before)) * (point_in_world - before.position) / before.voxel_size;
  return after.position + world_axes(after) * (in_grid * after.voxel_size);
}

std::optional<IVec3> voxel_from_world(const Instance& instance, const SceneGrid& grid, DVec3 point_in_world) {
  const DVec3 voxel = glm::floor(grid_from_world(instance, grid, point_in_world));
  for (int axis = 0; axis < 3; ++axis) {
    // Rejects NaN.
    if (!(voxel[axis] >= std::numeric_limits<int>::min() && voxel[axis] <= std::numeric_limits<int>::max())) {
      return std::nullopt;
    }
  }
  return IVec3(voxel);
}

namespace {

enum class Kind : std::uint8_t { Grid, Instance, Group, Layer };

struct SceneRecord {
  Kind kind = Kind::Grid;
  std::uint32_t index = 0;
  std::uint64_t generation = 0;
  void merge(const SceneRecord&) {}
};

template <class T>
constexpr Kind kind_of() {
  if constexpr (std::is_same_v<T, SceneGrid>) return Kind::Grid;
  if constexpr (std::is_same_v<T, Instance>) return Kind::Instance;
  if constexpr (std::is_same_v<T, SceneGroup>) return Kind::Group;
  if constexpr (std::is_same_v<T, SceneLayer>) return Kind::Layer;
}

template <class T>
void sort_and_unite(std::vector<Handle<T>>& handles) {
  std::sort(handles.begin(), handles.end());
  handles.erase(std::unique(handles.begin(), handles.end()), handles.end());
}

}  // namespace

// A scene's journal of its changes. Notifiers report grid edits, which are recorded at the next query.
struct Scene::Book {
  Book() = default;
  // A copy needs no serials: the first change of the copy makes its journal a separate one, in which no object has a
  // record. It follows its grids when one of them can be edited for the first time.
  Book(const Book& other) : journal(other.journal), follows_grids(false) {}

  std::mutex mutex;  // guards concurrent queries
  ChangeJournal<SceneRecord> journal;
  // By kind and slot, of the last records in the journal; 0: none.
  std::array<std::vector<std::uint64_t>, 4> serials;
  ChangeNotifiers notifiers;
  std::vector<std::uint32_t> notified;
  bool follows_grids = true;

  std::vector<std::uint64_t>& serials_of(Kind kind) { return serials[static_cast<std::size_t>(kind)]; }
  // `keys` are grids, instances, groups and layers: they share a journal.
  template <class T>
  void note(Handle<T> handle, std::size_t keys) {
    constexpr Kind kKind = kind_of<T>();
    QUOIN_ASSERT(handle.index < serials_of(kKind).size(), "room was made when it came");
    journal.note(serials_of(kKind)[handle.index], {kKind, handle.index, handle.generation}, keys);
  }
  void make_room(Kind kind, std::uint32_t index) {
    std::vector<std::uint64_t>& of = serials_of(kind);
    if (index >= of.size()) of.resize(index + std::size_t{1});
  }
  // Inserts an object and records the change. Steps that may throw come first.
  template <class T>
  Handle<T> insert(SlotMap<T>& into, T value, std::size_t keys) {
    make_room(kind_of<T>(), into.next_index());
    const Handle<T> handle = into.insert(std::move(value));
    journal.begin_change();
    serials_of(kind_of<T>())[handle.index] = 0;  // earlier records of this slot are not extended
    note(handle, keys + 1);
    return handle;
  }
  template <class T>
  bool remove(SlotMap<T>& from, Handle<T> handle, std::size_t keys) {
    if (from.find(handle) == nullptr) return false;
    make_room(kind_of<T>(), handle.index);
    from.remove(handle);
    journal.begin_change();
    note(handle, keys);
    return true;
  }
  template <class T>
  T& edit(SlotMap<T>& in, Handle<T> handle, std::size_t keys) {
    T& value = in[handle];
    make_room(kind_of<T>(), handle.index);
    journal.begin_change();
    note(handle, keys);
    return value;
  }
  void collect(const SlotMap<SceneGrid>& grids, std::size_t keys) {
    notifiers.take(notified);
    for (const std::uint32_t index : notified) {
      const auto handle = grids.handle_at(index);
      if (!handle.has_value()) continue;
      make_room(Kind::Grid, index);
      journal.begin_change();
      note(*handle, keys);
      follow(grids[*handle], index);
    }
    notified.clear();
  }
  // Call before the caller gets a grid to edit.
  void follow_all(const SlotMap<SceneGrid>& grids) {
    if (follows_grids) return;
    grids.for_each([&](GridHandle handle, const SceneGrid& grid) { follow(grid, handle.index); });
    follows_grids = true;
  }
  // Edits of either come under the grid's number.
  void follow(const SceneGrid& grid, std::uint32_t index) {
    notifiers.follow(grid.grid.notifier_, index);
    notifiers.follow(grid.field.notifier_, index);
  }
};

Scene::Scene() : book_(std::make_unique<Book>()) {}
Scene::Scene(const VoxelRegistry& with_types, std::unique_ptr<Book> book) : types(with_types), book_(std::move(book)) {}
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;
Scene::~Scene() = default;

namespace {

// Returns a copy of a grid, whose implementations are made by `snapshot`.
template <class Snapshot>
SceneGrid copy_of(const SceneGrid& grid, Snapshot&& snapshot) {
  return {.name = grid.name,
          .grid = snapshot(grid.grid),
          .pivot = grid.pivot,
          .canvas = grid.canvas,
          .field = snapshot(grid.field),
          .saved = grid.saved,
          .whole = grid.whole};
}

constexpr auto kPlainCopy = [](const auto& value) { return value; };

}  // namespace

Scene Scene::snapshot() const {
  const std::lock_guard lock(book().mutex);
  book_->collect(grids_, keys());
  Scene copy(types, std::make_unique<Book>(*book_));
  copy.lamps = lamps;
  copy.environment = environment;
  BulkMemory memory(2 * grids_.size());
  copy.grids_ = grids_.copied([&](const SceneGrid& grid) {
    return copy_of(grid, [&](const auto& content) { return content.snapshot(memory); });
  });
  copy.instances_ = instances_.copied(kPlainCopy);
  copy.groups_ = groups_.copied(kPlainCopy);
  copy.layers_ = layers_.copied(kPlainCopy);
  return copy;
}

void Scene::update_snapshot(Scene& snapshot, SceneChanges& changes) const {
  ChangeCursor cursor = snapshot.book().journal.present();
  changes_since(cursor, changes);
  if (changes.all) {
    snapshot = this->snapshot();
    return;
  }
  if (types.has_changed_since(snapshot.types.cursor())) snapshot.types = types;
  if (snapshot.lamps != lamps) snapshot.lamps = lamps;
  if (snapshot.environment != environment) snapshot.environment = environment;
  grids_.update_copy(snapshot.grids_, changes.grids, [](const SceneGrid& grid) {
    return copy_of(grid, [](const auto& content) { return content.snapshot(); });
  });
  instances_.update_copy(snapshot.instances_, changes.instances, kPlainCopy);
  groups_.update_copy(snapshot.groups_, changes.groups, kPlainCopy);
  layers_.update_copy(snapshot.layers_, changes.layers, kPlainCopy);
  const std::lock_guard lock(book().mutex);
  snapshot.book_->journal.copy_again(book_->journal);
}

std::size_t Scene::keys() const {
  return grids_.size() + instances_.size() + groups_.size() + layers_.size();
}

Scene::Book& Scene::book() const {
  QUOIN_ASSERT(book_ != nullptr, "a scene that was not moved from");
  return *book_;
}

GridHandle Scene::add_grid(SceneGrid grid) {
  book().notifiers.make_room(grids_.next_index());
  const GridHandle handle = book().insert(grids_, std::move(grid), keys());
  book_->follow(grids_[handle], handle.index);
  return handle;
}

InstanceHandle Scene::add_instance(Instance instance) {
  return book().insert(instances_, std::move(instance), keys());
}

GroupHandle Scene::add_group(SceneGroup group) {
  return book().insert(groups_, std::move(group), keys());
}

LayerHandle Scene::add_layer(SceneLayer layer) {
  return book().insert(layers_, std::move(layer), keys());
}

bool Scene::remove_grid(GridHandle handle) {
  if (!book().remove(grids_, handle, keys())) return false;
  for (const InstanceHandle instance : instances_.handles()) {
    if (instances_[instance].grid == handle) remove_instance(instance);
  }
  return true;
}

bool Scene::remove_instance(InstanceHandle handle) {
  return book().remove(instances_, handle, keys());
}

bool Scene::remove_group(GroupHandle handle) {
  const SceneGroup* group = groups_.find(handle);
  if (group == nullptr) return false;
  const GroupHandle parent = group->parent;
  for (const GroupHandle each : groups_.handles()) {
    if (groups_[each].parent == handle) edit(each).parent = parent == each ? GroupHandle{} : parent;
  }
  for (const InstanceHandle each : instances_.handles()) {
    if (instances_[each].group == handle) edit(each).group = parent;
  }
  return book().remove(groups_, handle, keys());
}

bool Scene::remove_layer(LayerHandle handle) {
  if (layers_.find(handle) == nullptr) return false;
  for (const GroupHandle each : groups_.handles()) {
    if (groups_[each].layer == handle) edit(each).layer = {};
  }
  for (const InstanceHandle each : instances_.handles()) {
    if (instances_[each].layer == handle) edit(each).layer = {};
  }
  return book().remove(layers_, handle, keys());
}

SceneGrid& Scene::edit(GridHandle handle) {
  book().follow_all(grids_);
  return book().edit(grids_, handle, keys());
}
Instance& Scene::edit(InstanceHandle handle) {
  return book().edit(instances_, handle, keys());
}
SceneGroup& Scene::edit(GroupHandle handle) {
  return book().edit(groups_, handle, keys());
}
SceneLayer& Scene::edit(LayerHandle handle) {
  return book().edit(layers_, handle, keys());
}

SceneChanges Scene::changes_since(ChangeCursor& cursor) const {
  SceneChanges changes;
  changes_since(cursor, changes);
  return changes;
}

void Scene::changes_since(ChangeCursor& cursor, SceneChanges& changes) const {
  changes.grids.clear();
  changes.instances.clear();
  changes.groups.clear();
  changes.layers.clear();
  const std::lock_guard lock(book().mutex);
  book_->collect(grids_, keys());
  ChangeCursor end = cursor;
  changes.all = !book_->journal.visit_since(end, [&](const SceneRecord& record, std::uint64_t) {
    switch (record.kind) {
      case Kind::Grid:
        changes.grids.push_back({record.index, record.generation});
        break;
      case Kind::Instance:
        changes.instances.push_back({record.index, record.generation});
        break;
      case Kind::Group:
        changes.groups.push_back({record.index, record.generation});
        break;
      case Kind::Layer:
        changes.layers.push_back({record.index, record.generation});
        break;
    }
  });
  sort_and_unite(changes.groups);
  sort_and_unite(changes.layers);
  add_instances_below(*this, changes);
  sort_and_unite(changes.grids);
  sort_and_unite(changes.instances);
  cursor = end;
}

bool Scene::has_changed_since(const ChangeCursor& cursor) const {
  const std::lock_guard lock(book().mutex);
  book_->collect(grids_, keys());
  return book_->journal.has_changed_since(cursor);
}

ChangeCursor Scene::cursor() const {
  ChangeCursor cursor;
  (void)changes_since(cursor);
  return cursor;
}

std::int64_t Scene::voxel_count() const {
  std::int64_t count = 0;
  for (const GridHandle handle : grids_.handles()) count += grids_[handle].grid.voxel_count();
  return count;
}

const Environment& environment_of(const Scene& scene) {
  static const Environment reference = Environment::reference();
  return scene.environment ? *scene.environment : reference;
}

DBox Scene::bounds(InstanceFilter filter) const {
  DBox box;
  for (const InstanceHandle handle : instances_.handles()) {
    const Instance& instance = instances_[handle];
    const SceneGrid* grid = grids_.find(instance.grid);
    if (grid == nullptr || !passes(filter, *this, instance) || !has_valid_transform(instance)) continue;
    const IBox tight = grid->bounds();
    if (tight.empty()) continue;
    for (int i = 0; i < 8; ++i) box.extend(world_from_grid(instance, *grid, box_corner(tight, i)));
  }
  return box;
}

bool is_drawn(const Scene& scene, const Instance& instance, InstanceFilter filter) {
  return passes(filter, scene, instance) && scene.grids().find(instance.grid) != nullptr;
}

std::vector<GridHandle> drawn_grids(const Scene& scene, InstanceFilter filter) {
  std::vector<GridHandle> grids;
  scene.instances().for_each([&](InstanceHandle, const Instance& instance) {
    if (is_drawn(scene, instance, filter)) grids.push_back(instance.grid);
  });
  sort_and_unite(grids);
  return grids;
}

DVec3 world_from_grid(const Instance& instance, const SceneGrid& grid, DVec3 point_in_grid) {
  return instance.position + world_axes(instance) * ((point_in_grid - grid.pivot) * instance.voxel_size);
}

}  // namespace quoin
