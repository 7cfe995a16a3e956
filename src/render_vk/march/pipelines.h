#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "render_vk/device/device.h"
#include "render_vk/trees/shader_data.h"

namespace quoin::vulkan {

/// The passes of a sample of a tile, in their order, and of a finished tile.
enum class Pass : std::uint8_t {
  FarDepths,  ///< of the nearest faces of impostors
  FarFaces,   ///< which these are
  Primary,    ///< the nearest opaque voxel of each pixel
  Glass,      ///< the transparent bodies before it
  Light,
  LightWithGlass,
  PrimaryWithFields,  ///< these where grids have fields
  LightWithFields,
  LightWithGlassAndFields,
  FieldGlass,  ///< these where something of fields is transparent
  LightWithFieldGlass,
  Resolve,  ///< the samples' mean as bytes
  Swap,     ///< swaps red and blue of a whole image
};
constexpr std::size_t kPassCount = 13;

/// A pass as it is where grids have fields.
[[nodiscard]] constexpr Pass with_fields(Pass pass) {
  if (pass == Pass::Primary) return Pass::PrimaryWithFields;
  if (pass == Pass::Light) return Pass::LightWithFields;
  return pass == Pass::LightWithGlass ? Pass::LightWithGlassAndFields : pass;
}

/// A pass as it is where something of grids' fields is transparent.
[[nodiscard]] constexpr Pass with_field_glass(Pass pass) {
  if (pass == Pass::Glass) return Pass::FieldGlass;
  return pass == Pass::LightWithGlass ? Pass::LightWithFieldGlass : with_fields(pass);
}

class Pipelines {
 public:
  [[nodiscard]] static Result<std::unique_ptr<Pipelines>> create(Device& device);
  ~Pipelines();
  /// Makes the pipelines of `with_fields`, once.
  [[nodiscard]] Status add_fields();
  /// Makes the additional pipelines of `with_field_glass`, once.
  [[nodiscard]] Status add_field_glass();
  Pipelines(const Pipelines&) = delete;
  Pipelines& operator=(const Pipelines&) = delete;

  /// Records the pass over a tile, after which its results may be read.
  void dispatch(VkCommandBuffer commands, Pass pass, const ShaderPush& push) const;
  /// The same over impostors: ShaderPush::far_groups workgroups.
  void dispatch_far(VkCommandBuffer commands, Pass pass, const ShaderPush& push) const;
  /// Records a copy of an image's words with red and blue swapped, after which it may be read.
  void swap_red_and_blue(VkCommandBuffer commands, const SwapPush& push) const;

 private:
  explicit Pipelines(Device& device) : device_(&device) {}
  VkResult make(Pass pass);
  Status add(bool (*is_wanted)(Pass));
  void dispatch(VkCommandBuffer commands, Pass pass, std::span<const std::byte> push, std::uint32_t across,
                std::uint32_t down) const;

  Device* device_;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  std::array<VkPipeline, kPassCount> pipelines_{};
};

}  // namespace quoin::vulkan
