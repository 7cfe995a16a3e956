#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>

#include "render/light/lamp_table.h"
#include "render/vulkan/march/device_scene.h"
#include "render/vulkan/trees/shader_data.h"
#include "render/vulkan/trees/shader_memory.h"

namespace quoin::vulkan {

/// The shader data of one image, without memory addresses.
struct FrameData {
  ShaderFrame frame;
  std::vector<ShaderPlaced> placed;
  std::vector<Vec4> tree;
  std::vector<Vec4> leaves;
  std::vector<Vec4> directions;
  std::vector<Vec4> turns;
  DVec3 view_origin{0.0};  ///< origin of view space, in the world, relative to the camera
};

/// Makes an image's data. World positions become relative to the camera, in double precision. Cost: O(instances).
/// Requires: the options have an environment.
[[nodiscard]] FrameData make_frame(const Placement& scene, const Camera& camera, const RenderOptions& options);

/// Sets a frame's grids and type surfaces. Requires: `placement` belongs to `scene`.
void put_scene(const DeviceScene& scene, const Placement& placement, FrameData& data);

/// Lights a frame by lamps. Returns the lamps, which the caller stores for the shaders.
/// Requires: `lamps` has a table in device memory; `data` was made for `camera`.
[[nodiscard]] std::vector<ShaderLamp> put_lamps(const DeviceLamps& lamps, const Camera& camera, FrameData& data);

/// Lights a frame by light levels. Requires: `levels` has a table of `scene` in device memory; `data` was made for
/// `placement`.
void put_levels(const DeviceLevels& levels, const Scene& scene, const Placement& placement,
                const RenderOptions& options, FrameData& data);

/// Returns a table's lamps, relative to the origin of view space in the world.
[[nodiscard]] std::vector<ShaderLamp> shader_lamps(const LampTable& table, DVec3 camera, DVec3 view_origin);

/// Sets the sample number that shaders take of every pixel. `occlusion_rays`: as in LightOptions.
void set_sample(int sample, int occlusion_rays, ShaderPush& push);

/// Returns the minimum light of each byte except the first: SrgbEncoder as a table.
[[nodiscard]] std::vector<float> srgb_thresholds();

/// ShaderMemory as bytes, for devices outside this library: addresses start at the first byte. It is filled once:
/// released parts are not reused.
class ShaderBytes final : public ShaderMemory {
 public:
  /// The largest size that 32-bit programs can hold, including its growth.
  static constexpr std::uint64_t kMost = std::uint64_t{1} << 30;

  [[nodiscard]] Result<Place> allocate(std::uint64_t size, const std::string& doing) override;
  void release(Place& place) override { place = {}; }
  [[nodiscard]] Status write(const Place& place, std::span<const std::byte> bytes, std::uint64_t offset = 0) override;
  [[nodiscard]] Status flush() override { return {}; }
  void discard() override {}

  [[nodiscard]] std::span<const std::byte> bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_ = std::vector<std::byte>(kAlignment);  // no table has the address 0
};

/// A scene for shaders outside this library, such as a browser's: the tables of shaders/data.glsl as bytes, with traced
/// light and all instances at full detail.
class ShaderScene {
 public:
  /// `light`, with the brightness of lamps in the scene's environment: determines the lamp table. Lifetime: the scene
  /// must outlive it and must not be edited.
  /// Errors: those of VulkanRenderer::update; LimitExceeded beyond 1 GiB.
  [[nodiscard]] static Result<std::unique_ptr<ShaderScene>> of(const Scene& scene, InstanceFilter filter,
                                                               const LightOptions& light, Threads threads);

  /// Returns trees, chunk records, grids, types and lamp lists; addresses are relative to the first byte.
  [[nodiscard]] std::span<const std::byte> bytes() const { return memory_.bytes(); }
  [[nodiscard]] const Placement& placement() const { return scene_.placement(); }

  /// Returns an image's ShaderFrame, followed by its own tables: placed, tree, leaves, directions, turns, lamps and
  /// thresholds. Their addresses are relative to the frame's first byte; those of other tables are as in `bytes`.
  /// Requires: traced light, with the lamps at the time of construction.
  /// Errors: those of CpuRenderer::render. Cost: O(instances + lamps).
  [[nodiscard]] Result<std::vector<std::byte>> frame(const Camera& camera, const RenderOptions& options) const;

 private:
  explicit ShaderScene(const Scene& scene) : content_(&scene) {}

  const Scene* content_;
  ShaderBytes memory_;
  DeviceScene scene_{memory_};
  LampCache lamp_cache_;
  DeviceLamps lamps_;
};

}  // namespace quoin::vulkan
