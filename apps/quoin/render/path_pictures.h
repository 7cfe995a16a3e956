#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include <quoin/render/cpu_renderer.h>
#include <quoin/render/path_tracer.h>
#include <quoin/render_vk/vulkan_renderer.h>

#include "render/path_arguments.h"

namespace quoin::tool {

/// Takes pictures by paths where others take them of CpuRenderer, and keeps what files of linear light hold besides.
class PathPictures {
 public:
  /// `with_layers`: whether what .exr files hold besides light is kept.
  PathPictures(const Scene& scene, InstanceFilter filter, Threads threads, PathPlan plan, bool with_layers);

  /// By a device, which has the scene and must outlive it.
  PathPictures(VulkanRenderer& device, const Scene& scene, InstanceFilter filter, PathPlan plan, bool with_layers);

  /// With the plan's exposure, or that of the first picture where it is automatic: those of a film
  /// have one.
  [[nodiscard]] Result<Picture> render(const Camera& camera, const RenderOptions& options, Threads threads,
                                       const Progress& progress);

  /// The last picture as .exr, or with alpha. Returns the file's size.
  [[nodiscard]] Result<std::uint64_t> write(const std::filesystem::path& path) const;
  /// That of the pictures. To be set before the first of them where others were taken before.
  [[nodiscard]] double exposure() const { return exposure_.value_or(1.0); }
  [[nodiscard]] bool is_transparent() const { return plan_.is_transparent; }
  void set_exposure(std::optional<double> exposure) { exposure_ = exposure; }

 private:
  std::optional<PathTracer> tracer_;  // none: a device draws
  VulkanRenderer* device_ = nullptr;
  PathPlan plan_;
  bool with_layers_;
  DVec3 middle_{0.0};  // of the scene
  std::optional<double> exposure_;
  PathPicture last_;
};

}  // namespace quoin::tool
