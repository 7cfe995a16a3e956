#pragma once

#include <cstddef>
#include <memory>

#include <quoin/core/result.h>
#include <quoin/render/path_tracer.h>

namespace quoin {

class VulkanRenderer;
namespace vulkan {
struct Access;
}

/// The samples of a picture by paths, which stay in device memory, so that more can be added to them: it converges while
/// one looks at it.
///
/// Memory:   80 bytes a pixel of the device's, 112 with layers, and 180 besides with PathOptions::denoise.
/// Lifetime: the renderer it was made for must outlive it.
/// Threads:  that renderer's.
class VulkanPathPicture {
 public:
  /// Of no size yet: VulkanRenderer::draw_paths decides.
  explicit VulkanPathPicture(VulkanRenderer& renderer);
  VulkanPathPicture(VulkanPathPicture&&) noexcept;
  VulkanPathPicture& operator=(VulkanPathPicture&&) noexcept;
  ~VulkanPathPicture();

  [[nodiscard]] int width() const;
  [[nodiscard]] int height() const;
  [[nodiscard]] int samples() const;        ///< a pixel, so far; 0: nothing is to be seen yet
  [[nodiscard]] std::size_t bytes() const;  ///< of device memory

  /// What the samples so far come to, to be developed: PathTracer::render's picture with as many. With
  /// PathOptions::denoise its noise is taken out here, on the processor.
  ///
  /// Errors: InvalidArgument when nothing was drawn; those of VulkanRenderer.
  [[nodiscard]] Result<PathPicture> read(Threads threads = {}) const;

 private:
  friend struct vulkan::Access;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
