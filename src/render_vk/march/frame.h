#pragma once

#include <vector>

#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/camera.h>

#include "light/lamp_table.h"
#include "render_vk/march/device_scene.h"
#include "render_vk/trees/shader_data.h"

namespace quoin::vulkan {

/// The shader data of one image, without memory addresses.
struct FrameData {
  ShaderFrame frame;
  std::vector<ShaderPlaced> placed;
  std::vector<Vec4> tree;
  std::vector<Vec4> leaves;
  std::vector<Vec4> directions;
  std::vector<Vec4> turns;
  DVec3 view_origin{0.0};  ///< of view space, in the world, from the camera
};

/// All that is in the world is made relative to the camera here, in double precision. Cost: O(instances).
[[nodiscard]] FrameData make_frame(const Placement& scene, const Camera& camera, const RenderOptions& options);

/// Has a frame show a scene's grids in the colours of its types. Requires: `placement` is of `scene`.
void put_scene(const DeviceScene& scene, const Placement& placement, FrameData& data);

/// Has a frame lit by lamps, which the shaders are to find where the result is put.
/// Requires: `lamps` has a table, in device memory; `data` is of `camera`.
[[nodiscard]] std::vector<ShaderLamp> put_lamps(const DeviceLamps& lamps, const Camera& camera, FrameData& data);

/// Has a frame lit by levels. Requires: `levels` has a table of `scene`, in device memory; `data` is of `placement`.
void put_levels(const DeviceLevels& levels, const Scene& scene, const Placement& placement, const LightOptions& light,
                FrameData& data);

/// A table's lamps, from where view space has its origin in the world.
[[nodiscard]] std::vector<ShaderLamp> shader_lamps(const LampTable& table, DVec3 camera, DVec3 view_origin);

/// Has shaders take a sample of every pixel, the `sample`-th. `occlusion_rays`: as LightOptions has them.
void set_sample(int sample, int occlusion_rays, ShaderPush& push);

/// The least light of each byte but the first: SrgbEncoder as a table.
[[nodiscard]] std::vector<float> srgb_thresholds();

}  // namespace quoin::vulkan
