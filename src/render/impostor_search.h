#pragma once

#include <array>
#include <cstdint>

#include <quoin/core/vec.h>
#include <quoin/render/impostor.h>

namespace quoin {

/// What a ray met of an impostor.
struct FoundTexel {
  double t = 0.0;
  std::int32_t view = 0;
  std::int32_t texel = 0;
};

/// Follows rays through the snapshots of an impostor.
///
/// Each snapshot says what it saw empty: whatever lies nearer to its camera than its depth. And each texel says exactly
/// which face of which voxel it saw: a ray that crosses that square meets it, wherever it was seen from. So a ray goes
/// on until it crosses a square that a view nearby has seen. Where it stays in what none of the nearest views saw
/// empty, and crosses no square of theirs, it ends at the face nearest to it.
/// Source: the search of F. Policarpo et al., "Real-time relief mapping on arbitrary polygonal surfaces" (2005), and
///         the carving of K. Kutulakos and S. Seitz, "A theory of shape by space carving" (2000), combined.
class ImpostorSearch {
 public:
  /// Views that are asked.
  static constexpr std::size_t kViews = 8;

  /// `towards_camera`: in the grid's frame, of any length; not zero and finite. `impostor` must outlive it.
  ImpostorSearch(const Impostor& impostor, DVec3 towards_camera);

  /// Whether a ray in the grid meets it from 0 to `max_t`, in lengths of `direction`.
  ///
  /// Requires: finite numbers, a direction that is not 0. Cost: a few tens of ns.
  [[nodiscard]] bool find(DVec3 origin, DVec3 direction, double max_t, FoundTexel& found) const;

 private:
  // A snapshot, ready to be looked up.
  struct Eye {
    SnapshotCamera camera;
    const float* depth = nullptr;
    const float* clear_depth = nullptr;
    const float* near_depth = nullptr;
    const Direction* faces = nullptr;
    std::int32_t view = 0;
  };
  // A ray as a snapshot's camera sees it: right and up, in texels at distance 1, and forward.
  struct Line {
    DVec3 origin{0.0};
    DVec3 direction{0.0};
    double lateral = 0.0;  // distance along the ray in which it crosses at most a texel
  };
  struct Look {
    std::int32_t texel = -1;
    bool is_near = false;  // a texel thereabouts saw something as near as this
    double distance = 0.0;
    double clear = 0.0;  // how far the ray may go on through what the snapshot saw empty; not more than 0: it did not
  };
  struct March;

  [[nodiscard]] Line line_of(const Eye& eye, const March& march) const;
  [[nodiscard]] static Look look(const Eye& eye, const Line& line, double at);
  [[nodiscard]] bool clip(DVec3 origin, const March& march, double& begin, double& end) const;
  // Whether the ray crosses the face that a texel saw, and where. Requires: it saw one.
  [[nodiscard]] bool crosses(const March& march, const Eye& eye, std::int32_t texel, double& at) const;
  // The texel's own face, or else the nearest of those about it.
  [[nodiscard]] bool crosses_nearby(const March& march, const Eye& eye, const Look& look, FoundTexel& found) const;
  // Which texel's voxel to show where none is crossed.
  void settle(const March& march, const std::array<Look, kViews>& looks, double at, FoundTexel& found) const;
  [[nodiscard]] bool walk(March& march, FoundTexel& found) const;

  const Impostor* impostor_;
  std::array<Eye, kViews> eyes_;
  double texel_ = 1.0;  // its side at the content's centre, in voxels
  double room_ = 0.0;   // how far from what a texel's ray met its face is taken to reach
  double about_ = 0.0;
  double step_ = 0.5;  // the least step, in voxels
};

}  // namespace quoin
