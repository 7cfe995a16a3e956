#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "render/vulkan/device/device.h"
#include "render/vulkan/trees/shader_data.h"

namespace quoin::vulkan {

/// The passes of a tile's sample, in order, and those of a finished tile.
enum class Pass : std::uint8_t {
  FarDepths,  ///< depths of the nearest impostor faces
  FarFaces,   ///< numbers of these faces
  Primary,    ///< the nearest opaque voxel of each pixel
  Glass,      ///< the transparent bodies in front of it
  Light,
  LightWithGlass,
  PrimaryWithFields,  ///< the same passes, if grids have fields
  LightWithFields,
  LightWithGlassAndFields,
  FieldGlass,  ///< the same passes, if fields have transparent parts
  LightWithFieldGlass,
  Resolve,  ///< the samples' mean as bytes
  Swap,     ///< swaps red and blue of a whole image
};
constexpr std::size_t kPassCount = 13;

/// Returns the variant of a pass for grids with fields.
[[nodiscard]] constexpr Pass with_fields(Pass pass) {
  if (pass == Pass::Primary) return Pass::PrimaryWithFields;
  if (pass == Pass::Light) return Pass::LightWithFields;
  return pass == Pass::LightWithGlass ? Pass::LightWithGlassAndFields : pass;
}

/// Returns the variant of a pass for fields with transparent parts.
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

  /// Records the pass over a tile, and a barrier before its results are read.
  void dispatch(VkCommandBuffer commands, Pass pass, const ShaderPush& push) const;
  /// As `dispatch`, over impostors: ShaderPush::far_groups workgroups.
  void dispatch_far(VkCommandBuffer commands, Pass pass, const ShaderPush& push) const;
  /// Records a copy of an image's words with red and blue swapped, and a barrier before it is read.
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
