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
  LightWithGlass,  ///< Light, for scenes with transparent bodies
  Resolve,         ///< the samples' mean as bytes
  Swap,            ///< swaps red and blue of a whole image
};
constexpr std::size_t kPassCount = 8;

/// The features of a scene that passes are compiled with. Passes that do not depend on a feature have one pipeline.
struct PassFeatures {
  bool fields = false;
  bool field_glass = false;  ///< fields have transparent parts
  bool textures = false;     ///< opaque types have textures
  bool shapes = false;       ///< voxels have shapes
  bool cells = false;        ///< transparent types have textures

  static constexpr std::size_t kCount = 32;
  /// Returns a number below kCount.
  [[nodiscard]] constexpr std::size_t index() const {
    return (fields ? 1U : 0U) + (field_glass ? 2U : 0U) + (textures ? 4U : 0U) + (shapes ? 8U : 0U) +
           (cells ? 16U : 0U);
  }
  /// Returns the features that a pass depends on.
  [[nodiscard]] constexpr PassFeatures of(Pass pass) const {
    const bool is_light = pass == Pass::Light || pass == Pass::LightWithGlass;
    const bool in_glass = pass == Pass::Glass || pass == Pass::LightWithGlass;
    PassFeatures used;
    used.field_glass = field_glass && in_glass;
    used.fields = used.field_glass || (fields && (is_light || pass == Pass::Primary));
    used.textures = textures && is_light;
    used.cells = cells && in_glass;
    used.shapes = shapes && (is_light || in_glass || pass == Pass::Primary);
    return used;
  }
};

class Pipelines {
 public:
  /// Makes the small pipelines of Resolve and Swap. `add` makes those that a scene needs, since drivers take seconds
  /// for each.
  [[nodiscard]] static Result<std::unique_ptr<Pipelines>> create(Device& device);
  ~Pipelines();
  /// Makes the missing pipelines of scenes with these features. `has_glass`: scenes with transparent bodies. `has_far`:
  /// images with impostors.
  [[nodiscard]] Status add(const PassFeatures& features, bool has_glass, bool has_far);
  Pipelines(const Pipelines&) = delete;
  Pipelines& operator=(const Pipelines&) = delete;

  /// Records the pass over a tile, and a barrier before its results are read.
  /// Requires: `add` made the pipelines of these features.
  void dispatch(VkCommandBuffer commands, Pass pass, const ShaderPush& push, const PassFeatures& features = {}) const;
  /// As `dispatch`, over impostors: ShaderPush::far_groups workgroups.
  void dispatch_far(VkCommandBuffer commands, Pass pass, const ShaderPush& push) const;
  /// Records a copy of an image's words with red and blue swapped, and a barrier before it is read.
  void swap_red_and_blue(VkCommandBuffer commands, const SwapPush& push) const;

 private:
  using Variants = std::array<VkPipeline, PassFeatures::kCount>;

  explicit Pipelines(Device& device) : device_(&device) {}
  VkResult make(Pass pass, const PassFeatures& features);
  void dispatch(VkCommandBuffer commands, VkPipeline pipeline, std::span<const std::byte> push, std::uint32_t across,
                std::uint32_t down) const;
  [[nodiscard]] VkPipeline pipeline(Pass pass, const PassFeatures& features) const {
    return pipelines_[static_cast<std::size_t>(pass)][features.of(pass).index()];
  }

  Device* device_;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  std::array<Variants, kPassCount> pipelines_{};
};

}  // namespace quoin::vulkan
