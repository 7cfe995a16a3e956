#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include <quoin/render/vulkan_renderer.h>

#include "render/light/light_model.h"
#include "render/light/surface/light_bricks.h"
#include "render/shared/image_detail.h"
#include "render/vulkan/device/device.h"
#include "render/vulkan/device/device_memory.h"
#include "render/vulkan/march/device_detail.h"
#include "render/vulkan/march/device_scene.h"
#include "render/vulkan/march/pipelines.h"

namespace quoin {

namespace vulkan {
struct PathScene;
using RendererImpl = VulkanRenderer::Impl;
}  // namespace vulkan

/// The state shared by a renderer, its images and its mesh renderers.
struct VulkanRenderer::Impl {
  static constexpr std::uint64_t kLeastBlock = std::uint64_t{64} << 10;

  /// Requires: `block_bytes` is at least `kLeastBlock`.
  [[nodiscard]] static Result<std::unique_ptr<Impl>> create(Result<std::unique_ptr<vulkan::Device>> device,
                                                            std::uint64_t block_bytes);

  Impl(std::unique_ptr<vulkan::Device> of_device, std::unique_ptr<vulkan::Pipelines> with_pipelines,
       std::uint64_t block_bytes)
      : device(std::move(of_device)),
        pipelines(std::move(with_pipelines)),
        memory(*device, block_bytes),
        scene(memory, texels),
        textures(memory, texels),
        detail(memory) {}

  /// Sets the current scene; null: none.
  void look_at(const Scene* updated, InstanceFilter filter) {
    const ChangeCursor before = std::exchange(at_update, updated != nullptr ? updated->cursor() : ChangeCursor{});
    const bool is_same = updated == voxels && before.shares_container_with(at_update);
    if (chooser == nullptr || !is_same) chooser = std::make_unique<DetailChooser>();
    voxels = updated;
    environment = updated != nullptr ? environment_of(*updated) : Environment::reference();
    instances = filter;
    lamps.update();
    levels.update();
    ++update_count;
    if (updated == nullptr) return detail.clear();
    chooser->update_types(updated->types);
    detail.look_at(*updated);
  }

  /// Returns the features of images of a placement of the current scene.
  [[nodiscard]] vulkan::PassFeatures features_of(const vulkan::Placement& placement) const {
    return {placement.has_fields, placement.has_field_glass, !textures.empty(), placement.has_shapes,
            placement.has_transparent && textures.has_cells()};
  }

  std::unique_ptr<vulkan::Device> device;
  std::unique_ptr<vulkan::Pipelines> pipelines;
  vulkan::DeviceMemory memory;
  vulkan::KnownTexels texels;  ///< of this renderer and its mesh renderers
  vulkan::DeviceScene scene;
  vulkan::DeviceTextures textures;
  vulkan::DeviceDetail detail;
  /// The source of levels of detail, as of the last update; null before the first.
  const Scene* voxels = nullptr;
  Environment environment = Environment::reference();  ///< of the scene of the last update
  ChangeCursor at_update;                              ///< its state then; detects another scene at the same address
  InstanceFilter instances = InstanceFilter::Visible;
  std::unique_ptr<DetailChooser> chooser;  // for `voxels`
  /// Returns the lamp table; sends it to the device if it changed.
  [[nodiscard]] Result<vulkan::DeviceLamps> lamp_table(const RenderOptions& options, Threads threads) {
    const LightOptions& light = options.light;
    if (light.max_lamps == 0 || is_propagated(light) || voxels == nullptr) return vulkan::DeviceLamps{};
    auto table = lamps.table(*voxels, light, options.environment->lamp_brightness, threads,
                             [this] { return scene.lamp_places(*voxels); });
    if (Status done = sent_lamps.put(memory, std::move(table)); !done) return done.error();
    return sent_lamps;
  }

  /// Returns the light levels; sends them to the device if they changed.
  [[nodiscard]] Result<vulkan::DeviceLevels> level_table(const LightOptions& light, Threads threads) {
    if (!is_propagated(light) || voxels == nullptr) return vulkan::DeviceLevels{};
    if (Status done = sent_levels.put(memory, levels.bricks(*voxels, threads)); !done) return done.error();
    return sent_levels;
  }

  [[nodiscard]] Result<vulkan::DeviceLight> light_tables(const RenderOptions& options, Threads threads) {
    auto of_lamps = lamp_table(options, threads);
    if (!of_lamps) return of_lamps.error();
    auto of_levels = level_table(options.light, threads);
    if (!of_levels) return of_levels.error();
    return vulkan::DeviceLight{std::move(*of_lamps), *of_levels};
  }

  LampCache lamps;
  vulkan::DeviceLamps sent_lamps;
  LightCache levels;
  vulkan::DeviceLevels sent_levels;
  std::uint64_t update_count = 0;            ///< number of updates
  std::shared_ptr<vulkan::PathScene> paths;  ///< null: no path-traced image was drawn
  std::uint64_t uploaded = 0;
};

namespace vulkan {

/// The content of an image: the scene's instances, or their levels of detail.
class Subject {
 public:
  /// Selects the content as VulkanRenderer::render does, for validated arguments.
  [[nodiscard]] static Result<Subject> of(RendererImpl& impl, const Camera& camera, const RenderOptions& options,
                                          Threads threads);

  [[nodiscard]] const Placement& placement() const { return detailed_ ? *detailed_ : *plain_; }

 private:
  explicit Subject(const Placement& plain) : plain_(&plain) {}

  const Placement* plain_;
  std::optional<Placement> detailed_;
};

}  // namespace vulkan
}  // namespace quoin
