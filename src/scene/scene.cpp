#include <quoin/scene/scene.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "core/change_journal.h"
#include "core/edit_notices.h"
#include "scene/instance_axes.h"

namespace quoin {

namespace {

/// The rotation's matrix, exact for quarter turns, whose quaternions hold the irrational square root of one half.
glm::dmat3 exact_matrix(const DQuat& rotation) {
  constexpr double kRounding = 1e-12;
  glm::dmat3 matrix = glm::mat3_cast(unit_rotation(rotation));
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) {
      const double nearest = std::round(matrix[column][row]);
      if (std::abs(matrix[column][row] - nearest) < kRounding) matrix[column][row] = nearest;
    }
  }
  return matrix;
}

}  // namespace

DQuat made_unit(const DQuat& q) {
  if (q.x == 0.0 && q.y == 0.0 && q.z == 0.0 && q.w == 0.0) return {1.0, 0.0, 0.0, 0.0};
  // Scaled first: the square of a very small or large number is 0 or infinite.
  const double largest = std::max({std::abs(q.x), std::abs(q.y), std::abs(q.z), std::abs(q.w)});
  const DQuat scaled = q / largest;
  return scaled / std::sqrt(glm::dot(scaled, scaled));
}

glm::dmat3 world_axes(const Instance& instance) {
  glm::dmat3 axes = exact_matrix(instance.rotation);
  if (instance.mirrored) axes[0] = -axes[0];
  return axes;
}

bool has_place(const Instance& instance) {
  const DQuat& q = instance.rotation;
  return is_finite(instance.position) && is_finite({q.x, q.y, q.z}) && std::isfinite(q.w) &&
         std::isfinite(instance.voxel_size) && instance.voxel_size > 0.0;
}

namespace {

enum class Kind : std::uint8_t { Grid, Instance };

struct SceneRecord {
  Kind kind = Kind::Grid;
  std::uint32_t index = 0;
  std::uint32_t generation = 0;
  void merge(const SceneRecord&) {}
};

template <class T>
void sort_and_unite(std::vector<Handle<T>>& handles) {
  std::sort(handles.begin(), handles.end());
  handles.erase(std::unique(handles.begin(), handles.end()), handles.end());
}

}  // namespace

// What a scene knows of its changes. Edits of grids come as notices and are booked when somebody asks.
struct Scene::Book {
  Book() = default;
  Book(const Book& other) : journal(other.journal), grid_serials(other.grid_serials), serials(other.serials) {}

  std::mutex mutex;  // guards concurrent queries
  ChangeJournal<SceneRecord> journal;
  std::vector<std::uint64_t> grid_serials;  // by slot, of the last records in the journal
  std::vector<std::uint64_t> serials;       // likewise of instances
  EditNotices notices;
  std::vector<std::uint32_t> noticed;

  void note(GridHandle handle, std::size_t keys) {
    journal.note(grid_serials[handle.index], {Kind::Grid, handle.index, handle.generation}, keys);
  }
  void note(InstanceHandle handle, std::size_t keys) {
    journal.note(serials[handle.index], {Kind::Instance, handle.index, handle.generation}, keys);
  }
  static void make_room(std::vector<std::uint64_t>& of, std::uint32_t index) {
    if (index >= of.size()) of.resize(index + std::size_t{1});
  }
  // `keys` are grids and instances: they share a journal.
  void collect(const SlotMap<SceneGrid>& grids, std::size_t keys) {
    notices.take(noticed);
    for (const std::uint32_t index : noticed) {
      const auto handle = grids.handle_at(index);
      if (!handle.has_value()) continue;
      journal.begin_change();
      note(*handle, keys);
      follow(grids[*handle], index);
    }
    noticed.clear();
  }
  // Edits of either come under the grid's number.
  void follow(const SceneGrid& grid, std::uint32_t index) {
    notices.follow(grid.grid.notice_, index);
    notices.follow(grid.field.notice_, index);
  }
};

Scene::Scene() : book_(std::make_unique<Book>()) {}
Scene::Scene(Scene&&) noexcept = default;
Scene& Scene::operator=(Scene&&) noexcept = default;
Scene::~Scene() = default;

Scene Scene::snapshot() const {
  Scene copy;
  const std::lock_guard lock(book_->mutex);
  book_->collect(grids_, grids_.size() + instances_.size());
  copy.types = types;
  copy.lamps = lamps;
  copy.grids_ = grids_.copied([](const SceneGrid& grid) {
    return SceneGrid{grid.name, grid.grid.snapshot(), grid.pivot, grid.canvas, grid.field.snapshot()};
  });
  copy.instances_ = instances_.copied([](const Instance& instance) { return instance; });
  copy.book_ = std::make_unique<Book>(*book_);
  copy.grids_.for_each([&](GridHandle handle, const SceneGrid& grid) { copy.book_->follow(grid, handle.index); });
  return copy;
}

GridHandle Scene::add_grid(SceneGrid grid) {
  // Whatever may throw comes first.
  book_->notices.make_room(grids_.next_index());
  Book::make_room(book_->grid_serials, grids_.next_index());
  const GridHandle handle = grids_.insert(std::move(grid));
  book_->journal.begin_change();
  book_->grid_serials[handle.index] = 0;  // records of another grid in this slot stay as they are
  book_->note(handle, grids_.size() + instances_.size());
  book_->follow(grids_[handle], handle.index);
  return handle;
}

InstanceHandle Scene::add_instance(Instance instance) {
  Book::make_room(book_->serials, instances_.next_index());
  const InstanceHandle handle = instances_.insert(std::move(instance));
  book_->journal.begin_change();
  book_->serials[handle.index] = 0;
  book_->note(handle, grids_.size() + instances_.size());
  return handle;
}

bool Scene::remove_grid(GridHandle handle) {
  if (!grids_.remove(handle)) return false;
  book_->journal.begin_change();
  book_->note(handle, grids_.size() + instances_.size());
  for (const InstanceHandle instance : instances_.handles()) {
    if (instances_[instance].grid == handle) remove_instance(instance);
  }
  return true;
}

bool Scene::remove_instance(InstanceHandle handle) {
  if (!instances_.remove(handle)) return false;
  book_->journal.begin_change();
  book_->note(handle, grids_.size() + instances_.size());
  return true;
}

SceneGrid& Scene::edit(GridHandle handle) {
  SceneGrid& grid = grids_[handle];
  book_->journal.begin_change();
  book_->note(handle, grids_.size() + instances_.size());
  return grid;
}

Instance& Scene::edit(InstanceHandle handle) {
  Instance& instance = instances_[handle];
  book_->journal.begin_change();
  book_->note(handle, grids_.size() + instances_.size());
  return instance;
}

SceneChanges Scene::changes_since(ChangeCursor& cursor) const {
  SceneChanges changes;
  const std::lock_guard lock(book_->mutex);
  book_->collect(grids_, grids_.size() + instances_.size());
  changes.all = !book_->journal.visit_since(cursor, [&](const SceneRecord& record) {
    if (record.kind == Kind::Grid) {
      changes.grids.push_back({record.index, record.generation});
    } else {
      changes.instances.push_back({record.index, record.generation});
    }
  });
  sort_and_unite(changes.grids);
  sort_and_unite(changes.instances);
  return changes;
}

bool Scene::has_changed_since(const ChangeCursor& cursor) const {
  const std::lock_guard lock(book_->mutex);
  book_->collect(grids_, grids_.size() + instances_.size());
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

DBox Scene::bounds(InstanceFilter filter) const {
  DBox box;
  for (const InstanceHandle handle : instances_.handles()) {
    const Instance& instance = instances_[handle];
    const SceneGrid* grid = grids_.find(instance.grid);
    if (grid == nullptr || !passes(filter, instance) || !has_place(instance)) continue;
    const IBox tight = grid->bounds();
    if (tight.empty()) continue;
    for (int corner = 0; corner < 8; ++corner) {
      const DVec3 point{(corner & 1) != 0 ? tight.max.x : tight.min.x, (corner & 2) != 0 ? tight.max.y : tight.min.y,
                        (corner & 4) != 0 ? tight.max.z : tight.min.z};
      box.extend(world_from_grid(instance, *grid, point));
    }
  }
  return box;
}

bool is_drawn(const Scene& scene, const Instance& instance, InstanceFilter filter) {
  return passes(filter, instance) && scene.grids().find(instance.grid) != nullptr;
}

DVec3 world_from_grid(const Instance& instance, const SceneGrid& grid, DVec3 point_in_grid) {
  DVec3 offset = (point_in_grid - grid.pivot) * instance.voxel_size;
  if (instance.mirrored) offset.x = -offset.x;
  return instance.position + exact_matrix(instance.rotation) * offset;
}

}  // namespace quoin
