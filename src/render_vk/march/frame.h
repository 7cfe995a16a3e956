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
  DVec3 view_origin{0.0};  ///< origin of view space, in the world, relative to the camera
};

/// Makes an image's data. World positions become relative to the camera, in double precision. Cost: O(instances).
[[nodiscard]] FrameData make_frame(const Placement& scene, const Camera& camera, const RenderOptions& options);

/// Sets a frame's grids and type surfaces. Requires: `placement` belongs to `scene`.
void put_scene(const DeviceScene& scene, const Placement& placement, FrameData& data);

/// Lights a frame by lamps. Returns the lamps, which the caller stores for the shaders.
/// Requires: `lamps` has a table in device memory; `data` was made for `camera`.
[[nodiscard]] std::vector<ShaderLamp> put_lamps(const DeviceLamps& lamps, const Camera& camera, FrameData& data);

/// Lights a frame by light levels. Requires: `levels` has a table of `scene` in device memory; `data` was made for
/// `placement`.
void put_levels(const DeviceLevels& levels, const Scene& scene, const Placement& placement, const LightOptions& light,
                FrameData& data);

/// Returns a table's lamps, relative to the origin of view space in the world.
[[nodiscard]] std::vector<ShaderLamp> shader_lamps(const LampTable& table, DVec3 camera, DVec3 view_origin);

/// Sets the sample number that shaders take of every pixel. `occlusion_rays`: as in LightOptions.
void set_sample(int sample, int occlusion_rays, ShaderPush& push);

/// Returns the minimum light of each byte except the first: SrgbEncoder as a table.
[[nodiscard]] std::vector<float> srgb_thresholds();

}  // namespace quoin::vulkan
