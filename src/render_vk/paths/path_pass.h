#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <quoin/core/progress.h>

#include "render_vk/march/renderer_impl.h"
#include "render_vk/paths/device_path_image.h"
#include "render_vk/paths/device_paths.h"
#include "render_vk/paths/path_pipelines.h"

namespace quoin::vulkan {

/// The data shared by the path-traced images of one renderer.
struct PathScene {
  explicit PathScene(std::unique_ptr<PathPipelines> made) : pipelines(std::move(made)) {}

  std::unique_ptr<PathPipelines> pipelines;
  DevicePaths tables;
  std::uint64_t update_count = 0;  ///< of the renderer, when the tables were last updated
};

/// Adds samples to a path-traced image, tile by tile.
///
///   tile: begin -> [ some steps of every pixel's path; the next sample's path starts when one ends ] until all end
class PathPass {
 public:
  PathPass(RendererImpl& renderer, PathImageImpl& image);
  PathPass(const PathPass&) = delete;
  PathPass& operator=(const PathPass&) = delete;

  /// Adds `samples` samples. After an error the image has none.
  [[nodiscard]] Status draw(int samples, const Progress& progress);

 private:
  struct Tile {
    std::int32_t x, y, width, height;
  };
  Status put_frame(int samples);
  Status put_lamps(DVec3 view_origin, ShaderPathFrame& paths);
  Status put_tile_buffers(int samples, ShaderFrame& frame, ShaderPathFrame& paths);
  Status add_samples(int samples, const Progress& progress);
  Status take(const Tile& tile, int first, int count, const Progress& progress, double done_before);

  RendererImpl* renderer_;
  PathImageImpl* image_;
  Places places_;
  std::uint64_t frame_address_ = 0;
  std::int32_t tile_edge_ = 0;
  Buffer counters_;  // on the device
  Buffer results_;   // their copy for the CPU
};

}  // namespace quoin::vulkan
