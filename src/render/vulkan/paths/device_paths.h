#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <quoin/render/path_tracer.h>

#include "render/path/path_lamps.h"
#include "render/path/sky_light.h"
#include "render/vulkan/device/device_memory.h"
#include "render/vulkan/march/device_scene.h"
#include "render/vulkan/paths/path_data.h"
#include "scene/surfaces.h"

namespace quoin::vulkan {

/// The lookup data of path tracing in device memory: types' materials, the sky, gloss reflectance, and the lamp of each
/// face. Sent again when it changes.
class DevicePaths {
 public:
  /// Sets the current scene; null: none. Rebuilds the lamps.
  void look_at(const Scene* scene);

  /// Sends the data that an image of `placement` needs and refers to it in the frame, except the lamps' relative
  /// positions. Errors: LimitExceeded; it is then empty. Requires: the scene was not edited since `look_at`.
  [[nodiscard]] Status put(DeviceMemory& memory, const Placement& placement, const PathOptions& options,
                           ShaderPathFrame& frame);

  [[nodiscard]] const path::PathLamps* lamps() const { return lamps_.get(); }  ///< of the last `put`; null: no scene

  [[nodiscard]] std::uint64_t surfaces_address() const { return surfaces_place_.address; }
  [[nodiscard]] std::uint32_t last_surface() const { return last_surface_; }
  [[nodiscard]] bool has_clouds() const { return surfaces_ && surfaces_->has_clouds(); }
  [[nodiscard]] const path::SkyLight& sky() const { return *sky_; }  ///< of the last `put`

 private:
  Status try_put(DeviceMemory& memory, const Placement& placement, const PathOptions& options, ShaderPathFrame& frame);
  Status put_surfaces(DeviceMemory& memory);
  Status put_sky(DeviceMemory& memory, const Environment& environment);
  void find_lamps(const Placement& placement, double brightness);
  Status put_faces(DeviceMemory& memory);

  const Scene* scene_ = nullptr;
  std::optional<Surfaces> surfaces_;
  bool has_sent_surfaces_ = false;
  std::uint32_t last_surface_ = 0;
  Place surfaces_place_;
  std::optional<Environment> environment_;  // the settings of the sky that was sent
  std::unique_ptr<const path::SkyLight> sky_;
  Place sky_pixels_;
  Place sky_rows_;
  Place sky_columns_;
  Place gloss_;
  path::PathLampCache cache_;
  std::shared_ptr<const path::PathLamps> lamps_;  // null: out of date
  double brightness_ = 0.0;
  std::shared_ptr<const path::PathLamps> of_faces_;  // the lamps whose faces and tree paths were sent
  Place lamp_ways_;
  Place face_keys_;
  Place face_lamps_;
};

/// An image's lamps in shader form, relative to the world position of view space's origin. `texels` has the textures of
/// all types.
struct LampTables {
  std::vector<ShaderPathLamp> lamps;
  std::vector<ShaderLampNode> nodes;
};
[[nodiscard]] LampTables lamp_tables(const path::PathLamps& lamps, const KnownTexels& texels, DVec3 view_origin);

}  // namespace quoin::vulkan
