#pragma once

#include <algorithm>
#include <array>
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

/// Shared by the functions of quoin.h: handles, error reporting and struct conversion.
namespace quoin::c {

/// Maps the numbers of quoin.h to a scene's handles, and back.
struct SceneNumbers {
  std::vector<GridHandle> grids;
  std::vector<InstanceHandle> instances;
  std::vector<GroupHandle> groups;  // parents first; numbered from 1
  std::unordered_map<std::uint32_t, std::size_t> grid_of_slot;
  std::unordered_map<std::uint32_t, std::size_t> group_of_slot;  // from 1
};

/// The scene's ray tracer. The first query after a change updates it.
struct KeptTracer {
  std::mutex mutex;
  std::optional<SceneTracer> tracer;
  ChangeCursor scene_cursor;
  ChangeCursor types_cursor;
};

struct SceneBody {
  std::shared_mutex mutex;  // readers share it
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
  std::vector<VoxelType> types;  // empty for smooth meshes
  std::vector<std::uint32_t> indices;
  // Empty without textures:
  std::vector<std::uint32_t> textures;
  std::vector<std::array<float, 2>> texture_uvs;
  std::vector<Rgba8> tints;
  std::vector<std::uint8_t> emission_shares;
};
struct LabelMesh {
  LabelSurfaces surfaces;
  std::vector<std::int64_t> interfaces;
};
using MeshBody = std::variant<GridMesh, ArraySurface, LabelMesh>;

/// The textures of a scene's types when they were numbered. Never changes.
struct TexturesBody {
  VoxelRegistry types;
  TextureSet set;
};

/// Maps handles to objects. Handles are never reused, so freed ones are detected. find() returns shared ownership: the
/// object stays alive while in use, even if another thread frees its handle.
class Handles {
 public:
  using Thing =
      std::variant<std::shared_ptr<SceneBody>, std::shared_ptr<MeshBody>, std::shared_ptr<const TexturesBody>>;

  std::uint64_t put(Thing thing) {
    const std::lock_guard lock(mutex_);
    things_.emplace(next_, std::move(thing));
    return next_++;
  }
  bool remove(std::uint64_t handle) {
    Thing last;  // destroyed outside the lock
    const std::lock_guard lock(mutex_);
    const auto found = things_.find(handle);
    if (found == things_.end()) return false;
    last = std::move(found->second);
    things_.erase(found);
    return true;
  }
  /// Returns null if the handle is unknown or refers to another kind of object.
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

/// Runs `work`; turns exceptions into a status.
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

/// Runs `work` with a scene, locked for reading or for changes.
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

/// Writes a count of a scene's objects.
template <class Count>
quoin_status report_count(quoin_scene handle, std::size_t* out, Count&& count) noexcept {
  return with_scene(handle, Use::Read, [&](SceneBody& scene) {
    if (out == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "out is null");
    *out = count(scene);
    return QUOIN_OK;
  });
}

// Structs have grown at their ends. This is the size of each struct's first version.
template <class Struct>
inline constexpr std::size_t kFirstSize = sizeof(Struct);
template <>
inline constexpr std::size_t kFirstSize<quoin_grid_info> = offsetof(quoin_grid_info, pivot);
template <>
inline constexpr std::size_t kFirstSize<quoin_instance> = offsetof(quoin_instance, unsaved);
template <>
inline constexpr std::size_t kFirstSize<quoin_group> = offsetof(quoin_group, unsaved);
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
template <>
inline constexpr std::size_t kFirstSize<quoin_shape_condition> = offsetof(quoin_shape_condition, position_count);
template <>
inline constexpr std::size_t kFirstSize<quoin_shapes> = offsetof(quoin_shapes, fluid_groups);

template <class Struct>
bool has_fit_size(const Struct* given) {
  return given != nullptr && given->size >= kFirstSize<Struct> && given->size <= sizeof(Struct);
}

/// Copies a caller's struct, which may be shorter, into one of this version. Returns nothing if it is null or its size
/// is invalid.
template <class Struct>
std::optional<Struct> taken(const Struct* given) {
  if (!has_fit_size(given)) return std::nullopt;
  Struct whole{};
  std::memcpy(&whole, given, given->size);
  return whole;
}
/// Copies an array struct. Strides of 0 become those of a contiguous array, z fastest and x slowest.
std::optional<quoin_array> taken_array(const quoin_array* given);
/// Copies options; null gives the defaults.
template <class Struct>
std::optional<Struct> taken_or_default(const Struct* given) {
  return given == nullptr ? Struct{} : taken(given);
}

/// Writes as much of `whole` as the caller's struct has room for.
template <class Struct>
quoin_status report(Struct whole, Struct* out) {
  if (!has_fit_size(out)) return fail(QUOIN_INVALID_ARGUMENT, "out is null, or its size");
  whole.size = out->size;
  std::memcpy(out, &whole, out->size);
  return QUOIN_OK;
}

/// Writes a struct that describes a scene's object number `index`.
template <class Struct, class Count, class Describe>
quoin_status report_item(quoin_scene handle, std::size_t index, Struct* out, Count&& count,
                         Describe&& describe) noexcept {
  return with_scene(handle, Use::Read, [&](SceneBody& scene) {
    if (index >= count(scene)) return fail(QUOIN_INVALID_ARGUMENT, "index out of range");
    Struct whole{};
    describe(scene, whole);
    return report(whole, out);
  });
}

/// Returns this thread's progress callback.
Progress progress();

/// Returns the caller's thread count, clamped to the valid range.
Threads threads_of(std::int32_t count);

/// Assigns numbers to the grids, instances and groups of a loaded scene.
void number(SceneBody& scene);

/// Places a new grid without rotation, its minimum corner at `position`. `out` receives the grid's number if not null.
void place(SceneBody& scene, SceneGrid grid, DVec3 position, std::size_t* out);

/// Converts load options. Errors: InvalidArgument for invalid values or an invalid struct size.
Result<LoadOptions> load_options_of(const quoin_load_options* given);

VoxelProperties properties_of(const quoin_type& type);
/// Returns the reason that a type is invalid; null if it is valid.
const char* validate_type(const quoin_type& type);

/// The camera and the options of a render. Errors: InvalidArgument for invalid values.
struct ImageTaking {
  Camera camera;
  RenderOptions options;
};
Result<ImageTaking> taking_of(const Scene& scene, const quoin_render_options& options);

/// Copies a text, with its terminator, into `capacity` bytes; truncates between characters.
void copy_text(std::string_view text, char* to, std::size_t capacity);
template <std::size_t Size>
void copy_text(std::string_view text, char (&to)[Size]) {
  copy_text(text, to, Size);
}
/// Returns the text of a fixed-size field, which may lack a terminator.
template <std::size_t Size>
std::string text_in(const char (&from)[Size]) {
  return {from, strnlen(from, Size)};
}

}  // namespace quoin::c
