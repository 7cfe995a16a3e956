#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>

#include "light/lamp_table.h"
#include "render_vk/march/device_scene.h"
#include "render_vk/trees/shader_data.h"
#include "render_vk/trees/shader_memory.h"

namespace quoin::vulkan {

/// A scene for shaders outside this library, such as a browser's: the tables of shaders/data.glsl as bytes, with traced
/// light and all instances at full detail.
class ShaderScene {
 public:
  /// `light`: of whose lamps there is a table. Lifetime: the scene must outlive it, and is not edited meanwhile.
  /// Errors: those of VulkanRenderer::update; LimitExceeded beyond 1 GiB.
  [[nodiscard]] static Result<std::unique_ptr<ShaderScene>> of(const Scene& scene, InstanceFilter filter,
                                                               const LightOptions& light, Threads threads);

  /// Trees, records of chunks, grids, types and lists of lamps; addresses count from the first byte.
  [[nodiscard]] std::span<const std::byte> bytes() const { return memory_.bytes(); }
  [[nodiscard]] const Placement& placement() const { return scene_.placement(); }

  /// A picture's ShaderFrame, and behind it the tables that are its own: placed, tree, leaves, directions, turns,
  /// lamps and thresholds. Their addresses count from the frame's first byte, those of other tables as in `bytes`.
  /// Requires: the light is by rays, with the lamps of the time when this was made.
  /// Errors: those of CpuRenderer::render. Cost: O(instances + lamps).
  [[nodiscard]] Result<std::vector<std::byte>> frame(const Camera& camera, const RenderOptions& options) const;

 private:
  ShaderScene() = default;

  ShaderBytes memory_;
  DeviceScene scene_{memory_};
  LampCache lamp_cache_;
  DeviceLamps lamps_;
};

}  // namespace quoin::vulkan
