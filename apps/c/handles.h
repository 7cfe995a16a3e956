#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <string>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

#include <quoin/io/loaded_scene.h>
#include <quoin/mesh/array_surface.h>
#include <quoin/mesh/label_surfaces.h>

#include "quoin.h"

/// What the functions of quoin.h share: handles, and how they fail.
namespace quoin::c {

struct SceneBody {
  LoadedScene loaded;
  std::vector<GridHandle> grids;  // by their numbers
};

/// A mesh of a grid, with vertices of all its surfaces.
struct GridMesh {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;
  std::vector<Rgba8> colours;
  std::vector<float> occlusion;
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

/// The same with a scene.
template <class Work>
quoin_status with_scene(quoin_scene handle, Work&& work) noexcept {
  return guarded([&] {
    const auto scene = handles().find<SceneBody>(handle);
    return scene == nullptr ? fail(QUOIN_BAD_HANDLE, "no scene has this handle") : work(*scene);
  });
}

/// Copies a text with its end into room for `capacity` bytes; cut off between characters.
void copy_text(const std::string& text, char* to, std::size_t capacity);

}  // namespace quoin::c
