#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <quoin/render/impostor.h>
#include <quoin/scene/scene_tracer.h>

#include "render/impostor_search.h"

namespace quoin {

/// Of the lanes whose bit is set, what an impostor's texel says beside what SceneHits hold.
struct FarTexels {
  std::uint32_t found = 0;
  RayPacket::Lanes<VoxelType> type{};
  RayPacket::Lanes<float> openness{};
};

/// The indices of those far instances that a tracer holds, in SceneTracer::placed.
[[nodiscard]] std::vector<std::int32_t> placed_of(const SceneTracer& tracer, std::span<const FarInstance> far);

/// The far instances of one picture: which may show in which part of it, and what rays meet of them.
class ImpostorPass {
 public:
  static constexpr int kTile = 32;  ///< pixels; blocks of rays lie in one tile

  /// All arguments but the camera must outlive it. Cost: O(far instances + tiles that they touch).
  ImpostorPass(const SceneTracer& tracer, std::span<const FarInstance> far, const Camera& camera, int width,
               int height);

  /// Whether anything may show in the tile from (`column`, `row`), multiples of kTile.
  [[nodiscard]] bool may_show(int column, int row) const { return !bin_of(column, row).empty(); }

  /// Puts what is nearer than `hits` into them: for the 4x4 pixels from (`column`, `row`), whose rays from the camera
  /// these are. Faces are as if traced; voxels are those behind the faces.
  void find(int column, int row, const RayPacket& rays_in_view, SceneHits& hits, FarTexels& texels) const;

 private:
  // Pixels, `right` and `bottom` exclusive.
  struct Area {
    int left = 0;
    int top = 0;
    int right = 0;
    int bottom = 0;
  };
  struct Drawn {
    std::int32_t placed = 0;
    const Impostor* impostor = nullptr;
    Area area;
    double near_t = 0.0;  // nothing of it is nearer
    DVec3 centre{0.0};    // of the sphere around it, in view space
    double radius_squared = 0.0;
    glm::dmat3 axes{1.0};
    DVec3 offset{0.0};  // a point p of the view is axes * p + offset in the grid
    ImpostorSearch search;
  };

  struct Screen;
  void add(const Screen& screen, const PlacedGrid& placed, std::int32_t index, const Impostor& impostor);
  void fill_bins();
  [[nodiscard]] const std::vector<std::uint32_t>& bin_of(int column, int row) const;
  static void find_one(const Drawn& drawn, const RayPacket& rays, SceneHits& hits, FarTexels& texels);

  int across_;
  int down_;
  std::vector<Drawn> drawn_;  // nearest first
  std::vector<std::vector<std::uint32_t>> bins_;
};

}  // namespace quoin
