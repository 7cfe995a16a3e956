#include <quoin/scene/scene_animation.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include <quoin/core/assert.h>

#include "scene/meshes/scene_mesh_parts.h"

namespace quoin {

namespace {

// Returns the object in the same slot of another map, or a null handle if the handle is invalid in its own map.
template <class T>
Handle<T> in_slot_of(Handle<T> handle, const SlotMap<T>& own, const SlotMap<T>& other) {
  if (own.find(handle) == nullptr) return {};
  return other.handle_at(handle.index).value_or(Handle<T>{});
}

}  // namespace

Status SceneAnimation::add(const Scene& frame, InstanceFilter filter) {
  const std::size_t count = frame.instances().size();
  if (frames_ == 0) {
    scene_ = frame.snapshot();
    for (const InstanceHandle handle : scene_.instances().handles()) scene_.remove_instance(handle);
    instances_.resize(count);
  }
  if (count != instances_.size() || !has_the_same_grids(frame)) {
    return make_error(
        ErrorCode::InvalidArgument,
        "frame " + std::to_string(frames_) + " must have the same instances and grids as the frames before it");
  }
  std::size_t index = 0;
  for (const InstanceHandle handle : frame.instances().handles()) {
    const Instance& instance = frame.instances()[handle];
    if (is_drawn(frame, instance, filter)) {
      show(shown_as(index, frame, instance), frames_, similarity_of(instance));
    }
    ++index;
  }
  ++frames_;
  return {};
}

bool SceneAnimation::has_the_same_grids(const Scene& frame) const {
  if (frame.grids().size() != scene_.grids().size()) return false;
  bool all_there = true;
  frame.grids().for_each(
      [&](GridHandle handle, const SceneGrid&) { all_there &= scene_.grids().handle_at(handle.index).has_value(); });
  return all_there;
}

SceneAnimation::Shown& SceneAnimation::shown_as(std::size_t index, const Scene& frame, const Instance& instance) {
  const Look look{in_slot_of(instance.grid, frame.grids(), scene_.grids()), instance.mirrored};
  QUOIN_ASSERT(index < instances_.size(), "one of the instances");
  auto& all = instances_[index];
  const auto known = std::ranges::find(all, look, &Shown::look);
  if (known != all.end()) return *known;
  Instance taken = instance;
  taken.visible = true;
  taken.grid = look.grid;
  taken.group = in_slot_of(instance.group, frame.groups(), scene_.groups());
  taken.layer = in_slot_of(instance.layer, frame.layers(), scene_.layers());
  return all.emplace_back(Shown{look, scene_.add_instance(std::move(taken)), {}});
}

void SceneAnimation::show(Shown& shown, std::size_t frame, const Similarity& world_from_grid) {
  auto& changes = shown.changes;
  QUOIN_ASSERT(shown.frames_until_last <= frame, "frames in their order");
  const bool was_hidden = !changes.empty() && shown.frames_until_last < frame;
  if (was_hidden) changes.push_back({shown.frames_until_last, std::nullopt});
  if (changes.empty() || changes.back().at != world_from_grid) changes.push_back({frame, world_from_grid});
  shown.frames_until_last = frame + 1;
}

// While hidden, it keeps its last placement, or its first one.
std::vector<MeshKey> SceneAnimation::keys_of(const Shown& shown, double frames_per_second) const {
  std::vector<MeshKey> keys;
  const auto add = [&](std::size_t frame, bool visible, const Similarity& place) {
    keys.push_back({static_cast<double>(frame) / frames_per_second, visible, place});
  };
  QUOIN_ASSERT(!shown.changes.empty() && shown.changes.front().at.has_value(), "an instance that a frame shows");
  const Change& first = shown.changes.front();
  if (first.frame > 0) add(0, false, *first.at);
  for (const Change& change : shown.changes) {
    add(change.frame, change.at.has_value(), change.at ? *change.at : keys.back().world_from_part);
  }
  if (shown.frames_until_last < frames_) add(shown.frames_until_last, false, keys.back().world_from_part);
  return keys;
}

void SceneAnimation::animate(SceneMeshes& meshes, double frames_per_second) const {
  QUOIN_ASSERT(frames_per_second > 0.0, "frames_per_second is positive");
  std::map<InstanceHandle, const Shown*> by_instance;
  for (const auto& all : instances_) {
    for (const Shown& shown : all) by_instance.emplace(shown.instance, &shown);
  }
  for (std::size_t i = 0; i < meshes.placements.size(); ++i) {
    MeshPlacement& placement = meshes.placements[i];
    const auto found = placement.instance ? by_instance.find(*placement.instance) : by_instance.end();
    QUOIN_ASSERT(found != by_instance.end(), "the meshes are those of the animation's scene");
    placement.keys = keys_of(*found->second, frames_per_second);
    placement.world_from_part = placement.keys.front().world_from_part;
    if (placement.keys.size() == 1) placement.keys.clear();
    if (!placement.keys.empty()) meshes.seconds = static_cast<double>(frames_) / frames_per_second;
  }
}

}  // namespace quoin
