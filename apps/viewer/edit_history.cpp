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

}  // namespace

void EditHistory::begin(std::string name) {
  QUOIN_ASSERT(!open_, "the step before has ended");
  open_ = Step{};
  open_->name = std::move(name);
}

void EditHistory::touch(GridHandle handle, const Grid& grid, const IBox& box) {
  QUOIN_ASSERT(open_, "a step is under way");
  if (box.empty()) return;
  const IVec3 first = chunk_of(box.min);
  const IVec3 last = chunk_of(box.max - 1);
  for (int z = first.z; z <= last.z; ++z) {
    for (int y = first.y; y <= last.y; ++y) {
      for (int x = first.x; x <= last.x; ++x) {
        const IVec3 place{x, y, z};
        const bool is_known = std::any_of(open_->chunks.begin(), open_->chunks.end(), [&](const ChangedChunk& chunk) {
          return chunk.grid == handle && chunk.place == place;
        });
        if (is_known) continue;
        open_->chunks.push_back({handle, place, copy_of(grid, place), Chunk(kAir)});
      }
    }
  }
}

void EditHistory::end(const Scene& scene) {
  if (!open_) return;
  Step step = std::move(*open_);
  open_.reset();
  std::erase_if(step.chunks, [&](const ChangedChunk& chunk) {
    const SceneGrid* grid = scene.grids().find(chunk.grid);
    return grid == nullptr || chunk.before == copy_of(grid->grid, chunk.place);
  });
  if (step.chunks.empty()) return;
  for (ChangedChunk& chunk : step.chunks) {
    chunk.after = copy_of(scene.grids()[chunk.grid].grid, chunk.place);
    chunk.before.compact();
    chunk.after.compact();
    step.bytes += chunk.before.bytes() + chunk.after.bytes();
  }
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

void EditHistory::put(Scene& scene, const ChangedChunk& changed, const Chunk& voxels) {
  if (scene.grids().find(changed.grid) != nullptr) scene.edit(changed.grid).grid.put_chunk(changed.place, voxels);
}

bool EditHistory::undo(Scene& scene) {
  QUOIN_ASSERT(!open_, "no step is under way");
  if (!can_undo()) return false;
  --done_;
  for (const ChangedChunk& chunk : steps_[done_].chunks) {
    put(scene, chunk, chunk.before);
  }
  return true;
}

bool EditHistory::redo(Scene& scene) {
  QUOIN_ASSERT(!open_, "no step is under way");
  if (!can_redo()) return false;
  for (const ChangedChunk& chunk : steps_[done_].chunks) {
    put(scene, chunk, chunk.after);
  }
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
