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
  /// `light`: determines the lamp table. Lifetime: the scene must outlive it and must not be edited.
  /// Errors: those of VulkanRenderer::update; LimitExceeded beyond 1 GiB.
  [[nodiscard]] static Result<std::unique_ptr<ShaderScene>> of(const Scene& scene, InstanceFilter filter,
                                                               const LightOptions& light, Threads threads);

  /// Returns trees, chunk records, grids, types and lamp lists; addresses are relative to the first byte.
  [[nodiscard]] std::span<const std::byte> bytes() const { return memory_.bytes(); }
  [[nodiscard]] const Placement& placement() const { return scene_.placement(); }

  /// Returns an image's ShaderFrame, followed by its own tables: placed, tree, leaves, directions, turns, lamps and
  /// thresholds. Their addresses are relative to the frame's first byte; those of other tables are as in `bytes`.
  /// Requires: traced light, with the lamps at the time of construction.
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
