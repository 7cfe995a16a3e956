#pragma once

#include <cstddef>
#include <cstdint>

#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/render/path_tracer.h>
#include <quoin/scene/camera.h>

namespace quoin::path {

/// Samples per pixel.
inline constexpr int kMaxPathSamples = 65'536;

/// Returns an error for arguments that PathTracer::render rejects. Requires: the camera's axes are perpendicular.
[[nodiscard]] Status check(const Camera& camera, const PathOptions& options);

/// Returns an image with buffers for all requested outputs.
[[nodiscard]] PathImage empty_image(const PathOptions& options);

/// The sums over a pixel's samples.
struct PixelSums {
  Vec3 background{0.0F};  ///< the visible part of the background
  Vec3 scene{0.0F};
  Vec3 caught{0.0F};  ///< background behind shadow-catching ground
  Vec3 lit{0.0F};     ///< the light on that ground
  Vec3 open{0.0F};    ///< the light it would have if it were empty
  float scene_share = 0.0F;
  float caught_share = 0.0F;
  Vec3 albedo{0.0F};
  Vec3 normal{0.0F};
  float depth = 0.0F;
  VoxelType type = kAir;
  std::uint32_t instance = 0;

  /// Writes the means to the image.
  void write_to(PathImage& image, std::size_t pixel, int samples) const;
};

}  // namespace quoin::path
