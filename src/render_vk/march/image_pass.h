#pragma once

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/progress.h>
#include <quoin/render/cpu_renderer.h>

#include "render_vk/device/memory.h"
#include "render_vk/march/device_image.h"
#include "render_vk/march/device_impostors.h"
#include "render_vk/march/device_scene.h"
#include "render_vk/march/frame.h"
#include "render_vk/march/pipelines.h"

namespace quoin::vulkan {

/// Draws one image tile by tile: each tile is drawn in device memory and then read back, or stays there.
class ImagePass {
 public:
  /// Requires: `placement` and `light` belong to `scene`. `content`: the source of that scene; null: empty.
  ImagePass(Device& device, DeviceMemory& memory, const Pipelines& pipelines, const DeviceScene& scene,
            const Placement& placement, DeviceLight light, const Scene* content)
      : device_(&device),
        memory_(&memory),
        pipelines_(&pipelines),
        scene_(&scene),
        placement_(&placement),
        light_(std::move(light)),
        content_(content),
        places_(memory, "drawing") {}
  ImagePass(const ImagePass&) = delete;
  ImagePass& operator=(const ImagePass&) = delete;

  /// Renders as VulkanRenderer::render, for validated arguments.
  [[nodiscard]] Result<RenderedImage> render(const Camera& camera, const RenderOptions& options,
                                             const Progress& progress);

  /// Draws as VulkanRenderer::draw, for validated arguments.
  [[nodiscard]] Status draw(ImageImpl& image, const Camera& camera, const RenderOptions& options,
                            const Progress& progress);

 private:
  struct Tile {
    std::int32_t x, y, width, height;
    FarTiles::Range far;
  };

  Status put_frame(const Camera& camera, const RenderOptions& options);
  Status put_far(const RenderOptions& options);
  [[nodiscard]] int most_lamps() const { return light_.lamps.table == nullptr ? 0 : light_.lamps.table->longest; }
  void find_hits(VkCommandBuffer commands, const ShaderPush& push) const;
  Status begin(const Camera& camera, const RenderOptions& options);
  Status make_tile_buffers(const RenderOptions& options);
  [[nodiscard]] std::vector<Tile> tiles_of(const RenderOptions& options) const;
  [[nodiscard]] ShaderPush push_for_sample(const Tile& tile, int sample) const;
  Status take_sample(const Tile& tile, int sample);
  Status add_samples(ImageImpl& image, const RenderOptions& options, const Progress& progress);
  Status take_sample(std::span<const Tile> tiles, int sample);
  Status resolve(std::span<const Tile> tiles);
  Status finish_glass(ShaderPush push);
  [[nodiscard]] Pass variant_of(Pass pass) const {
    if (placement_->has_field_glass) return with_field_glass(pass);
    return placement_->has_fields ? with_fields(pass) : pass;
  }
  Status read_tile(const Tile& tile, RenderedImage& image);
  Status read_counters(ShaderCounters& counters);
  [[nodiscard]] ShaderPush push_for(const Tile& tile) const;

  Device* device_;
  DeviceMemory* memory_;
  const Pipelines* pipelines_;
  const DeviceScene* scene_;
  const Placement* placement_;
  DeviceLight light_;
  const Scene* content_;
  const ImageImpl* target_ = nullptr;  // null: the image is read back
  Places places_;
  ShaderFrame frame_;
  std::uint64_t frame_address_ = 0;
  std::int32_t tile_edge_ = 0;
  int occlusion_rays_ = 0;
  std::vector<FarTiles::Range> far_;  // of the tiles
  Place far_place_;                   // depths and numbers of a tile's impostors, half each
  Buffer output_;                     // colours, depths, counters
  Buffer results_;                    // their copy for the CPU
};

}  // namespace quoin::vulkan
