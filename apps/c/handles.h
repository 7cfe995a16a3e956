#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <shared_mutex>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/io/loaded_scene.h>
#include <quoin/mesh/array_surface.h>
#include <quoin/mesh/label_surfaces.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene_tracer.h>

#include "quoin.h"

/// What the functions of quoin.h share: handles, and how they fail.
namespace quoin::c {

/// What things of a scene are called by outside, and inside.
struct SceneNumbers {
  std::vector<GridHandle> grids;
  std::vector<InstanceHandle> instances;
  std::vector<GroupHandle> groups;  // from the top; the first has the number 1
  std::unordered_map<std::uint32_t, std::size_t> grid_of_slot;
  std::unordered_map<std::uint32_t, std::size_t> group_of_slot;  // from 1
};

/// What rays go through, brought up to date by the first who asks after a change.
struct KeptTracer {
  std::mutex mutex;
  std::optional<SceneTracer> tracer;
  ChangeCursor scene_cursor;
  ChangeCursor types_cursor;
};

struct SceneBody {
  std::shared_mutex mutex;  // shared by those who read
  LoadedScene loaded;
  std::vector<std::string> save_warnings;  // of the last save
  SceneNumbers numbers;
  KeptTracer kept;
};

/// A mesh of a grid, with vertices of all its surfaces.
struct GridMesh {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;
  std::vector<Rgba8> colours;
  std::vector<float> occlusion;
  std::vector<VoxelType> types;  // none where it is smooth
  std::vector<std::uint32_t> indices;
};
struct LabelMesh {
  LabelSurfaces surfaces;
  std::vector<std::int64_t> interfaces;
};
using MeshBody = std::variant<GridMesh, ArraySurface, LabelMesh>;

/// What handles stand for. Numbers are never given twice, so what was freed is known as such. Whoever found a thing
/// keeps it alive while he uses it, also when another thread frees it.
class Handles {
 public:
  using Thing = std::variant<std::shared_ptr<SceneBody>, std::shared_ptr<MeshBody>>;

  std::uint64_t put(Thing thing) {
    const std::lock_guard lock(mutex_);
    things_.emplace(next_, std::move(thing));
    return next_++;
  }
  bool remove(std::uint64_t handle) {
    Thing last;  // ends outside the lock
    const std::lock_guard lock(mutex_);
    const auto found = things_.find(handle);
    if (found == things_.end()) return false;
    last = std::move(found->second);
    things_.erase(found);
    return true;
  }
  /// Null where the handle is of nothing, or of something else.
  template <class Body>
  std::shared_ptr<Body> find(std::uint64_t handle) {
    const std::lock_guard lock(mutex_);
    const auto found = things_.find(handle);
    if (found == things_.end()) return nullptr;
    const auto* body = std::get_if<std::shared_ptr<Body>>(&found->second);
    return body == nullptr ? nullptr : *body;
  }

 private:
  std::mutex mutex_;
  std::unordered_map<std::uint64_t, Thing> things_;
  std::uint64_t next_ = 1;
};

Handles& handles();
quoin_status fail(quoin_status status, const char* why) noexcept;
quoin_status fail(const Error& error);

/// Runs what a function does, and turns what it throws into a status.
template <class Work>
quoin_status guarded(Work&& work) noexcept {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return fail(QUOIN_OUT_OF_MEMORY, "out of memory");
  } catch (const std::exception& error) {
    return fail(QUOIN_INTERNAL, error.what());
  } catch (...) {
    return fail(QUOIN_INTERNAL, "an unknown exception");
  }
}

enum class Use : std::uint8_t { Read, Change };

/// The same with a scene, for as long as `work` takes.
template <class Work>
quoin_status with_scene(quoin_scene handle, Use use, Work&& work) noexcept {
  return guarded([&] {
    const auto scene = handles().find<SceneBody>(handle);
    if (scene == nullptr) return fail(QUOIN_BAD_HANDLE, "no scene has this handle");
    if (use == Use::Read) {
      const std::shared_lock lock(scene->mutex);
      return work(*scene);
    }
    const std::unique_lock lock(scene->mutex);
    return work(*scene);
  });
}

/// Writes a number that a scene has.
template <class Count>
quoin_status tell_count(quoin_scene handle, std::size_t* out, Count&& count) noexcept {
  return with_scene(handle, Use::Read, [&](SceneBody& scene) {
    if (out == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "out is null");
    *out = count(scene);
    return QUOIN_OK;
  });
}

// Structs have grown at their ends: how large each was at first.
template <class Struct>
inline constexpr std::size_t kFirstSize = sizeof(Struct);
template <>
inline constexpr std::size_t kFirstSize<quoin_grid_info> = offsetof(quoin_grid_info, pivot);
template <>
inline constexpr std::size_t kFirstSize<quoin_type> = offsetof(quoin_type, transparent);
template <>
inline constexpr std::size_t kFirstSize<quoin_mesh_data> = offsetof(quoin_mesh_data, types);
template <>
inline constexpr std::size_t kFirstSize<quoin_mesh_options> = offsetof(quoin_mesh_options, watertight);
template <>
inline constexpr std::size_t kFirstSize<quoin_load_options> = offsetof(quoin_load_options, raw_shape);
template <>
inline constexpr std::size_t kFirstSize<quoin_render_options> = offsetof(quoin_render_options, has_sun);

template <class Struct>
bool has_fit_size(const Struct* given) {
  return given != nullptr && given->size >= kFirstSize<Struct> && given->size <= sizeof(Struct);
}

/// A struct as this version has it, of one that may be shorter; nothing where it is null, or its size is of no version.
template <class Struct>
std::optional<Struct> taken(const Struct* given) {
  if (!has_fit_size(given)) return std::nullopt;
  Struct whole{};
  std::memcpy(&whole, given, given->size);
  return whole;
}
/// The same of an array, with strides: where it has none its numbers lie without gaps, z fastest and x slowest.
std::optional<quoin_array> taken_array(const quoin_array* given);
/// The same of options, which may be left out.
template <class Struct>
std::optional<Struct> taken_or_default(const Struct* given) {
  return given == nullptr ? Struct{} : taken(given);
}

/// Fills in as much of a struct as there is room for.
template <class Struct>
quoin_status tell(Struct whole, Struct* out) {
  if (!has_fit_size(out)) return fail(QUOIN_INVALID_ARGUMENT, "out is null, or its size");
  whole.size = out->size;
  std::memcpy(out, &whole, out->size);
  return QUOIN_OK;
}

/// Writes a struct about the index-th of `count` things of a scene.
template <class Struct, class Count, class Describe>
quoin_status tell_of(quoin_scene handle, std::size_t index, Struct* out, Count&& count, Describe&& describe) noexcept {
  return with_scene(handle, Use::Read, [&](SceneBody& scene) {
    if (index >= count(scene)) return fail(QUOIN_INVALID_ARGUMENT, "nothing of the scene has this number");
    Struct whole{};
    describe(scene, whole);
    return tell(whole, out);
  });
}

/// What this thread has set.
Progress progress();

/// As many threads as the caller says; none less than 0, and not more than there may be.
Threads threads_of(std::int32_t count);

/// Numbers what is in a scene that was read.
void number(SceneBody& scene);

/// Shows a new grid unturned, its least corner at a point of the world; its number is told in `out`, if that is any.
void place(SceneBody& scene, SceneGrid grid, DVec3 position, std::size_t* out);

/// What a file is read with. Errors: InvalidArgument for what no file is, or where the size is none of the struct's.
Result<LoadOptions> load_options_of(const quoin_load_options* given);

VoxelProperties properties_of(const quoin_type& type);
/// What is wrong with a type; null where nothing is.
const char* what_is_wrong(const quoin_type& type);

/// What a picture by rays is taken with. Errors: InvalidArgument for what no picture has.
struct PictureTaking {
  Camera camera;
  RenderOptions options;
};
Result<PictureTaking> taking_of(const Scene& scene, const quoin_render_options& options);

/// Copies a text with its end into room for `capacity` bytes; cut off between characters.
void copy_text(std::string_view text, char* to, std::size_t capacity);
template <std::size_t Size>
void copy_text(std::string_view text, char (&to)[Size]) {
  copy_text(text, to, Size);
}
/// The text in such room, whether it has an end or not.
template <std::size_t Size>
std::string text_in(const char (&from)[Size]) {
  return {from, strnlen(from, Size)};
}

}  // namespace quoin::c
