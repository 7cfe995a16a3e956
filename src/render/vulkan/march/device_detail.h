#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>

#include "render/shared/image_detail.h"
#include "render/vulkan/march/device_impostors.h"
#include "render/vulkan/march/device_scene.h"
#include "render/vulkan/trees/device_grid.h"
#include "scene/tracer/tree_cache.h"

namespace quoin::vulkan {

/// Halved grids and impostors in device memory, created when an image first requests them and kept for later images.
class DeviceDetail {
 public:
  static constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 30;

  explicit DeviceDetail(DeviceMemory& memory) : memory_(&memory), impostors_(memory) {}

  /// After an update of the device's scene: releases data of removed or replaced grids, and all data if types became
  /// transparent or opaque. The changed chunks of edited grids are rebuilt and sent at the next request.
  void look_at(const Scene& scene);
  void clear();

  /// Returns the scene's instances in their detail: traced in grids halved as often as `detail` requests, or less often
  /// if that would change a grid's volume too much (see SceneTracer::with_detail), or drawn from impostors. Beyond
  /// `max_bytes` of device memory for each kind, the least recently used entries are released, except those of this
  /// image.
  ///
  /// Requires: `device` was updated with `scene`, which has not changed since; no commands run.
  /// Errors:   as DeviceImpostors::draw; it is then empty.
  [[nodiscard]] Result<Placement> place(DeviceScene& device, const Scene& scene, const ImageDetail& detail,
                                        const Camera& camera, const RenderOptions& options, Threads threads,
                                        std::uint64_t max_bytes = kMaxBytes);

  /// The device memory of halved grids, and of impostors, in bytes.
  [[nodiscard]] std::uint64_t halved_bytes() const;
  [[nodiscard]] std::uint64_t impostor_bytes() const { return impostors_.bytes(); }

 private:
  struct Key {
    GridHandle grid;
    int level = 0;
    bool operator<(const Key& other) const { return grid != other.grid ? grid < other.grid : level < other.level; }
  };
  struct Level {
    DeviceGrid voxels;
    std::uint64_t last_use = 0;
    std::int32_t index = 0;  // in the table of the last image that used it
  };
  Status put_halved(const DeviceScene& device, const Scene& scene, std::span<const SelectedInstance> selected,
                    Threads threads, Placement& placement);
  Status put_level(const CoarseLevel& coarse, GridHandle grid, const VoxelRegistry& types,
                   std::vector<ShaderGrid>& table, const Level*& level);
  void drop_unused(std::uint64_t max_bytes);

  DeviceMemory* memory_;
  DeviceImpostors impostors_;
  HalvedGridCache coarse_;
  std::map<Key, Level> levels_;
  ChangeCursor followed_scene_;
  ChangeCursor followed_types_;
  std::uint64_t image_ = 0;
  Place table_place_;
  std::vector<ShaderGrid> table_;
};

}  // namespace quoin::vulkan
