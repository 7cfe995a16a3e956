#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <map>
#include <memory>

#include "render/vulkan/device/device.h"
#include "render/vulkan/raster/mesh_shader_data.h"

namespace quoin::vulkan {

constexpr VkFormat kMeshColour = VK_FORMAT_R8G8B8A8_SRGB;  // so that blending and resolving are linear
constexpr VkFormat kMeshDepth = VK_FORMAT_D32_SFLOAT;

/// The light of a fragment.
enum class MeshLight : std::uint8_t {
  Plain,              ///< unblocked light
  Traced,             ///< by rays: shadows, lamps
  TracedThroughGlass  ///< the scene has glass
};

/// A variant of drawing meshes.
struct MeshWay {
  enum class What : std::uint8_t { Sky, Blocky, Smooth, Far };
  What what = What::Sky;
  /// As in ShaderMeshPush: surfaces, edges over them, edges alone, a channel of glass, or a step of the nearest glass.
  std::uint32_t mode = 0;
  bool mirrored = false;  ///< smooth: the instance turns triangles round; blocky faces are culled by their shader
  bool ordered = false;   ///< blocky: quads of many chunks, in the order stored in memory
  MeshFaces faces = MeshFaces::Quads;  ///< blocky
  MeshLight light = MeshLight::Plain;
  bool glass_by_rays = false;  ///< the nearest glass includes everything visible through it
  bool fields = false;         ///< rays may meet fields
  bool textures = false;       ///< the textures of types are read
  bool shapes = false;         ///< rays may meet shapes
  bool cells = false;          ///< rays may meet transparent types with textures
  std::uint32_t samples = 1;

  auto operator<=>(const MeshWay&) const = default;
};

/// Pipelines and render passes by purpose, each made at first use.
class MeshPipelines {
 public:
  [[nodiscard]] static Result<std::unique_ptr<MeshPipelines>> create(Device& device);
  ~MeshPipelines();
  MeshPipelines(const MeshPipelines&) = delete;
  MeshPipelines& operator=(const MeshPipelines&) = delete;

  [[nodiscard]] VkPipelineLayout layout() const { return layout_; }
  /// Attachments: with one sample colour and depth; otherwise these and the resolved colour. Attachments to be read end
  /// in a layout for copying.
  [[nodiscard]] Result<VkRenderPass> render_pass(std::uint32_t samples);
  [[nodiscard]] Result<VkPipeline> pipeline(const MeshWay& way);

 private:
  static constexpr std::size_t kShaders = 13;

  explicit MeshPipelines(Device& device) : device_(&device) {}
  VkResult make_pass(std::uint32_t samples, VkRenderPass& pass) const;
  VkResult make(const MeshWay& way, VkRenderPass pass, VkPipeline& pipeline) const;

  Device* device_;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  std::array<VkShaderModule, kShaders> shaders_{};
  std::map<std::uint32_t, VkRenderPass> passes_;
  std::map<MeshWay, VkPipeline> pipelines_;
};

}  // namespace quoin::vulkan
