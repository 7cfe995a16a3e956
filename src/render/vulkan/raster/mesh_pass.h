#pragma once

#include <memory>
#include <vector>

#include "render/vulkan/device/device_memory.h"
#include "render/vulkan/raster/mesh_frame.h"
#include "render/vulkan/raster/mesh_pipelines.h"

namespace quoin::vulkan {

/// A render target: an image of one layer with its own memory.
class Attachment {
 public:
  struct Kind {
    VkFormat format = VK_FORMAT_UNDEFINED;
    VkImageUsageFlags usage = 0;
    VkImageAspectFlags aspect = 0;
  };

  Attachment() = default;
  /// Errors: LimitExceeded if the device's memory is full.
  [[nodiscard]] static Result<Attachment> create(const Device& device, const Kind& kind, VkExtent2D size,
                                                 std::uint32_t samples, const std::string& doing);
  Attachment(Attachment&& other) noexcept { swap(other); }
  Attachment& operator=(Attachment&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Attachment();

  [[nodiscard]] VkImage image() const { return image_; }
  [[nodiscard]] VkImageView view() const { return view_; }

 private:
  void swap(Attachment& other) noexcept;

  const Device* device_ = nullptr;
  VkImage image_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  VkImageView view_ = VK_NULL_HANDLE;
};

/// The render targets for an image of meshes.
class MeshTarget {
 public:
  MeshTarget() = default;
  /// `pass`: of MeshPipelines, for that many samples. Errors: LimitExceeded.
  [[nodiscard]] static Result<MeshTarget> create(const Device& device, VkRenderPass pass, VkExtent2D size,
                                                 std::uint32_t samples);
  MeshTarget(MeshTarget&& other) noexcept { swap(other); }
  MeshTarget& operator=(MeshTarget&& other) noexcept {
    swap(other);
    return *this;
  }
  ~MeshTarget();

  [[nodiscard]] bool is_of(VkExtent2D size, std::uint32_t samples) const {
    return framebuffer_ != VK_NULL_HANDLE && size_.width == size.width && size_.height == size.height &&
           samples_ == samples;
  }
  [[nodiscard]] VkExtent2D size() const { return size_; }
  [[nodiscard]] std::uint32_t samples() const { return samples_; }
  [[nodiscard]] VkFramebuffer framebuffer() const { return framebuffer_; }
  /// Returns the drawn image, with one sample per pixel.
  [[nodiscard]] VkImage image() const { return samples_ > 1 ? resolved_.image() : colour_.image(); }

 private:
  void swap(MeshTarget& other) noexcept;

  const Device* device_ = nullptr;
  VkExtent2D size_{};
  std::uint32_t samples_ = 0;
  Attachment colour_;
  Attachment depth_;
  Attachment resolved_;  // with several samples
  VkFramebuffer framebuffer_ = VK_NULL_HANDLE;
};

/// Draws the content of MeshFrameData, and keeps its memory for later images.
class MeshPass {
 public:
  /// Errors: Unsupported if the device cannot draw meshes.
  [[nodiscard]] static Result<std::unique_ptr<MeshPass>> create(Device& device, DeviceMemory& memory);
  ~MeshPass();
  MeshPass(const MeshPass&) = delete;
  MeshPass& operator=(const MeshPass&) = delete;

  /// Returns the largest sample count of the device up to `wanted`.
  [[nodiscard]] std::uint32_t samples_for(int wanted) const;
  /// Returns the largest width and height of an image.
  [[nodiscard]] std::uint32_t largest_edge() const { return largest_edge_; }
  [[nodiscard]] int subpixels() const { return subpixels_; }

  /// Writes the pixels of `data` into `colours`. `data.image` has the addresses of types, trees and lamp tables.
  [[nodiscard]] Status draw(MeshFrameData& data, VkExtent2D size, std::uint32_t samples, Wireframe wireframe,
                            MeshLight light, const Buffer& colours);

 private:
  struct Step;

  MeshPass(Device& device, DeviceMemory& memory) : device_(&device), memory_(&memory) {}
  Status open();
  Status put_corners();
  Status prepare(MeshFrameData& data, VkExtent2D size, std::uint32_t samples);
  Status put_frame(MeshFrameData& data);
  Status grow(VkDeviceSize bytes);
  [[nodiscard]] std::vector<Step> steps_for(const MeshFrameData& data, Wireframe wireframe, MeshLight light) const;
  Status find_pipelines(std::vector<Step>& steps, std::uint32_t samples, MeshLight light, const MeshFrameData& data);
  void record(VkCommandBuffer commands, const MeshFrameData& data, const std::vector<Step>& steps,
              const Buffer& colours) const;
  void record_step(VkCommandBuffer commands, const MeshFrameData& data, const Step& step) const;
  // Draws the step's chunks; `values` has the shared push constants.
  void draw_chunks(VkCommandBuffer commands, const MeshFrameData& data, const Step& step, ShaderMeshPush values) const;
  // Draws quads of transparent types that hide the background, and shapes.
  void draw_others(VkCommandBuffer commands, const MeshFrameData& data, const Step& step, MeshFaces faces) const;
  void draw_far(VkCommandBuffer commands, const MeshFrameData& data, const Step& step) const;
  void draw_mesh(VkCommandBuffer commands, const MeshDraw& draw, const Step& step) const;
  void draw_quads(VkCommandBuffer commands, std::uint32_t first, std::uint32_t end) const;
  void bind_corners(VkCommandBuffer commands) const;
  void push(VkCommandBuffer commands, const ShaderMeshPush& values) const;
  void copy_frame(VkCommandBuffer commands) const;
  void copy_image(VkCommandBuffer commands, const Buffer& colours) const;

  Device* device_;
  DeviceMemory* memory_;
  std::unique_ptr<MeshPipelines> pipelines_;
  MeshTarget target_;
  Place corners_;  // indices of the triangles of many quads
  Buffer staging_;
  Buffer frame_;
  VkDeviceSize frame_bytes_ = 0;
  std::uint64_t frame_address_ = 0;
  std::uint32_t sample_counts_ = 1;
  std::uint32_t largest_edge_ = 0;
  int subpixels_ = 16;
};

}  // namespace quoin::vulkan
