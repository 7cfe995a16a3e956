#pragma once

#include <cstdint>
#include <memory>

#include <quoin/core/image.h>
#include <quoin/core/result.h>

namespace quoin {

class VulkanRenderer;

/// A picture that stays in device memory: drawn by the renderers of one device, shown by VulkanWindow, or read.
///
/// Lifetime: the renderer it was made for must outlive it.
/// Threads:  that renderer's.
class VulkanPicture {
 public:
  /// Of no size yet: whoever draws it decides.
  explicit VulkanPicture(VulkanRenderer& renderer);
  VulkanPicture(VulkanPicture&&) noexcept;
  VulkanPicture& operator=(VulkanPicture&&) noexcept;
  ~VulkanPicture();

  [[nodiscard]] int width() const;
  [[nodiscard]] int height() const;
  [[nodiscard]] int samples() const;        ///< a pixel, so far; 0: nothing is to be seen yet
  [[nodiscard]] std::int64_t rays() const;  ///< of every kind, for all samples so far
  [[nodiscard]] std::size_t bytes() const;  ///< of device memory

  /// Errors: InvalidArgument when nothing was drawn; those of VulkanRenderer.
  [[nodiscard]] Result<Image> read() const;

  /// Becomes a picture that was drawn elsewhere. Errors: InvalidArgument for one without pixels; those of
  /// VulkanRenderer.
  [[nodiscard]] Status write(const Image& image);

  struct Impl;
  [[nodiscard]] Impl& impl() { return *impl_; }
  [[nodiscard]] const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
