#include "edit_history.h"

#include <algorithm>
#include <utility>

#include <quoin/core/assert.h>

namespace quoin::viewer {

namespace {

Chunk copy_of(const Grid& grid, IVec3 place) {
  const Chunk* chunk = grid.find_chunk(place);
  return chunk == nullptr ? Chunk(kAir) : *chunk;
}

DensityChunk copy_of(const DensityGrid& field, IVec3 place) {
  const DensityChunk* chunk = field.find_chunk(place);
  return chunk == nullptr ? DensityChunk(field.neighbourhood(place).outside) : *chunk;
}

const Grid& content_of(const SceneGrid& grid, const Chunk&) {
  return grid.grid;
}
const DensityGrid& content_of(const SceneGrid& grid, const DensityChunk&) {
  return grid.field;
}

bool is_same(const Chunk& a, const Chunk& b) {
  return a == b;
}
bool is_same(const DensityChunk& a, const DensityChunk& b) {
  return a.shares_storage_with(b) || a.content_hash() == b.content_hash();
}

void set_visibility(Scene& scene, const SceneNode& node, bool is_visible) {
  if (!visibility_of(scene, node)) return;
  std::visit([&](const auto& handle) { scene.edit(handle).visible = is_visible; }, node);
}

}  // namespace

std::optional<bool> visibility_of(const Scene& scene, const SceneNode& node) {
  const auto of = [](const auto* found) { return found == nullptr ? std::nullopt : std::optional(found->visible); };
  if (const auto* instance = std::get_if<InstanceHandle>(&node)) return of(scene.instances().find(*instance));
  if (const auto* group = std::get_if<GroupHandle>(&node)) return of(scene.groups().find(*group));
  return of(scene.layers().find(std::get<LayerHandle>(node)));
}

void EditHistory::show(Scene& scene, const SceneNode& node, bool is_visible) {
  QUOIN_ASSERT(!open_ && visibility_of(scene, node), "no step is under way, and the node exists");
  Step step;
  step.name = is_visible ? "show" : "hide";
  step.switched = node;
  step.is_visible_after = is_visible;
  step.bytes = sizeof(Step);
  set_visibility(scene, node, is_visible);
  keep(std::move(step));
}

void EditHistory::begin(std::string name) {
  QUOIN_ASSERT(!open_, "no step is under way");
  open_ = Step{};
  open_->name = std::move(name);
}

void EditHistory::touch(GridHandle handle, const Grid& grid, const IBox& box) {
  QUOIN_ASSERT(open_, "a step is under way");
  touch_chunks(open_->chunks, handle, grid, box);
}

void EditHistory::touch(GridHandle handle, const DensityGrid& field, const IBox& box) {
  QUOIN_ASSERT(open_, "a step is under way");
  touch_chunks(open_->samples, handle, field, box);
}

template <class Content, class Grid>
void EditHistory::touch_chunks(std::vector<Changed<Content>>& known, GridHandle handle, const Grid& grid,
                               const IBox& box) {
  if (box.empty()) return;
  const IVec3 first = chunk_of(box.min);
  const IVec3 last = chunk_of(box.max - 1);
  for (int z = first.z; z <= last.z; ++z) {
    for (int y = first.y; y <= last.y; ++y) {
      for (int x = first.x; x <= last.x; ++x) {
        const IVec3 place{x, y, z};
        const bool is_known = std::any_of(known.begin(), known.end(), [&](const Changed<Content>& chunk) {
          return chunk.grid == handle && chunk.place == place;
        });
        if (is_known) continue;
        Content before = copy_of(grid, place);
        known.push_back({handle, place, before, before});
      }
    }
  }
}

// Drops chunks that were touched but not changed.
template <class Content>
void EditHistory::finish(const Scene& scene, std::vector<Changed<Content>>& changed, std::size_t& bytes) {
  std::erase_if(changed, [&](Changed<Content>& chunk) {
    const SceneGrid* grid = scene.grids().find(chunk.grid);
    if (grid == nullptr) return true;
    chunk.after = copy_of(content_of(*grid, chunk.before), chunk.place);
    return is_same(chunk.before, chunk.after);
  });
  for (Changed<Content>& chunk : changed) {
    chunk.before.compact();
    chunk.after.compact();
    bytes += chunk.before.bytes() + chunk.after.bytes();
  }
}

void EditHistory::end(const Scene& scene) {
  if (!open_) return;
  Step step = std::move(*open_);
  open_.reset();
  finish(scene, step.chunks, step.bytes);
  finish(scene, step.samples, step.bytes);
  if (step.chunks.empty() && step.samples.empty()) return;
  keep(std::move(step));
}

void EditHistory::keep(Step step) {
  for (; steps_.size() > done_; steps_.pop_back()) bytes_ -= steps_.back().bytes;
  step.state = ++last_state_;
  bytes_ += step.bytes;
  steps_.push_back(std::move(step));
  done_ = steps_.size();
  while (bytes_ > max_bytes_ && !steps_.empty()) {
    base_state_ = steps_.front().state;
    bytes_ -= steps_.front().bytes;
    steps_.pop_front();
    --done_;
  }
}

std::string EditHistory::undo_name() const {
  return can_undo() ? steps_[done_ - 1].name : "";
}

std::string EditHistory::redo_name() const {
  return can_redo() ? steps_[done_].name : "";
}

bool EditHistory::is_loaded(const Scene& scene, const Step& step) {
  const auto is_there = [&](const auto& chunk) {
    const SceneGrid* const grid = scene.grids().find(chunk.grid);
    return grid == nullptr || content_of(*grid, chunk.before).is_loaded(chunk.place);
  };
  return std::ranges::all_of(step.chunks, is_there) && std::ranges::all_of(step.samples, is_there);
}

void EditHistory::put(Scene& scene, const Step& step, bool after) {
  for (const ChangedChunk& chunk : step.chunks) {
    if (scene.grids().find(chunk.grid) == nullptr) continue;
    scene.edit(chunk.grid).grid.put_chunk(chunk.place, after ? chunk.after : chunk.before);
  }
  if (step.switched) set_visibility(scene, *step.switched, after == step.is_visible_after);
  for (const ChangedSamples& chunk : step.samples) {
    if (scene.grids().find(chunk.grid) == nullptr) continue;
    scene.edit(chunk.grid).field.put_chunk(chunk.place, after ? chunk.after : chunk.before);
  }
}

bool EditHistory::undo(Scene& scene) {
  QUOIN_ASSERT(!open_, "no step is under way");
  if (!can_undo() || !is_loaded(scene, steps_[done_ - 1])) return false;
  --done_;
  put(scene, steps_[done_], false);
  return true;
}

bool EditHistory::redo(Scene& scene) {
  QUOIN_ASSERT(!open_, "no step is under way");
  if (!can_redo() || !is_loaded(scene, steps_[done_])) return false;
  put(scene, steps_[done_], true);
  ++done_;
  return true;
}

void EditHistory::clear() {
  open_.reset();
  steps_.clear();
  done_ = 0;
  bytes_ = 0;
  base_state_ = ++last_state_;
}

}  // namespace quoin::viewer
