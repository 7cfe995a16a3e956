#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include <quoin/render/cpu_renderer.h>
#include <quoin/render/path_tracer.h>
#include <quoin/render/vulkan_renderer.h>

#include "render/path_arguments.h"

namespace quoin::tool {

/// Renders path-traced images with the interface of CpuRenderer, and keeps the layers for .exr files.
class PathImages {
 public:
  /// `with_layers`: keeps the additional layers of .exr files.
  PathImages(const Scene& scene, InstanceFilter filter, Threads threads, PathPlan plan, bool with_layers);

  /// Renders on a Vulkan device, which has the scene. Requires: `device` outlives this.
  PathImages(VulkanRenderer& device, const Scene& scene, InstanceFilter filter, PathPlan plan, bool with_layers);

  /// Uses the exposure of the plan. An automatic exposure is computed from the first image and used for all images.
  [[nodiscard]] Result<RenderedImage> render(const Camera& camera, const RenderOptions& options, Threads threads,
                                             const Progress& progress);

  /// Writes the last image as .exr, or with alpha. Returns the file size.
  [[nodiscard]] Result<std::uint64_t> write(const std::filesystem::path& path) const;
  /// The exposure of the images. To continue a series, call set_exposure before the first image.
  [[nodiscard]] double exposure() const { return exposure_.value_or(1.0); }
  [[nodiscard]] bool is_transparent() const { return plan_.is_transparent; }
  void set_exposure(std::optional<double> exposure) { exposure_ = exposure; }

 private:
  std::optional<PathTracer> tracer_;  // nullopt: `device_` renders
  VulkanRenderer* device_ = nullptr;
  PathPlan plan_;
  bool with_layers_;
  DVec3 middle_{0.0};  // centre of the scene
  std::optional<double> exposure_;
  PathImage last_;
};

}  // namespace quoin::tool
