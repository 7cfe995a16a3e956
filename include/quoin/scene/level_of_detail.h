#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/grid/grid.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// How an instance is drawn.
enum class Detail : std::uint8_t {
  Near,  ///< every voxel
  Mid,   ///< coarser cells, where none of them is larger than a pixel
  Far,   ///< an impostor
};

/// The sphere around a grid's content: about the centre of the tight box of its voxels and its field's solid, through
/// that box's corners.
struct ContentSphere {
  DVec3 centre{0.0};    ///< grid coordinates
  double radius = 0.0;  ///< voxels; 0 for an empty grid
};

/// Cost: O(chunks).
[[nodiscard]] ContentSphere content_sphere(const Grid& grid);
[[nodiscard]] ContentSphere content_sphere(const SceneGrid& grid);
/// Of what has these tight bounds.
[[nodiscard]] ContentSphere content_sphere(const IBox& bounds);

/// Which detail is chosen.
struct DetailPolicy {
  enum class Rule : std::uint8_t {
    ByRadius,  ///< by the distance from the content's centre, in radii of the content
    ByPixels,  ///< by what a voxel and the whole grid span in the picture
  };
  Rule rule = Rule::ByPixels;
  double near_radii = 1.0;    ///< ByRadius: Near up to and including
  double mid_radii = 10.0;    ///< ByRadius: Mid up to and including
  double voxel_pixels = 1.0;  ///< ByPixels: Mid once a voxel projects to less than this
  /// Mid: a grid is halved as long as its cells project to at most this. Tuned on a ship and a terrain: at 0.5 pictures
  /// with 64 samples differ by up to 6.0 / 255, at 1 by up to 9 (docs/decisions/archive/026).
  double cell_pixels = 0.4;
  int far_pixels = 128;  ///< ByPixels: Far once the grid's diameter projects to at most this; the snapshots' size
  /// A detail, or a level, is left only once the measure is beyond its threshold by this share. 0: no memory of the
  /// last choice.
  double hysteresis = 0.1;
  InstanceFilter instances = InstanceFilter::Visible;  ///< of which it is chosen
};

/// What `ByRadius` decides, from the distance between camera and content centre, in the units of `radius`. R = 0: Near
/// at distance 0, else Far; NaN is Far.
[[nodiscard]] Detail detail_by_radius(double distance, double radius, const DetailPolicy& policy = {});

/// What `ByPixels` decides on.
struct ScreenSize {
  double voxel_pixels = 0.0;     ///< that one voxel spans at the content's nearest point
  double diameter_pixels = 0.0;  ///< that the whole content spans at its centre's distance
};
/// What `ByPixels` decides. Numbers that are not finite count as nothing to see: Far.
[[nodiscard]] Detail detail_by_pixels(const ScreenSize& size, const DetailPolicy& policy = {});

/// One instance that may be in the picture.
struct SelectedInstance {
  InstanceHandle instance;
  Detail detail = Detail::Near;
  /// The level at which the grid is to be traced: cells of (2^level)^3 voxels, 0 to kMaxGridLevel. Near: 0.
  /// Mid: by DetailPolicy::cell_pixels; ByRadius at least 1. Far: what stands in for the voxels in shadows and the
  /// like.
  int level = 0;
  double distance = 0.0;  ///< from the camera to the content's centre, world units
};

/// The coarsest level at which grids are traced.
inline constexpr int kMaxGridLevel = 4;

class DetailSelector;

/// How a picture draws instances in levels of detail.
struct DetailOptions {
  /// Which detail each instance is drawn in; without, all are Near. Whether hidden instances are drawn is for the
  /// renderer to say, not the policy.
  std::optional<DetailPolicy> policy{};
  /// Of the view that the picture is of: remembers what was chosen in the one before, so that models do not tremble
  /// between two details. Null: a picture knows nothing of any other, and there is no hysteresis. Pictures that share
  /// one are taken one after another, of one scene; it must outlive the call.
  DetailSelector* selector = nullptr;
  /// For how long a picture waits for impostors that are missing or older than their grid. Threads of the renderer's
  /// own build them, whatever is drawn meanwhile; grids whose are not ready are traced, or shown as they were. Only
  /// without a limit is a picture the same whenever it is taken; 0 is for frames. Their occlusion by rays is that of
  /// nine rays of 6 voxels within the grid.
  double impostor_seconds = std::numeric_limits<double>::infinity();
  int impostor_edge = 128;  ///< texels a side of an impostor's finest snapshots, 16 to 1,024: ImpostorOptions::edge
  /// Whether instances have colours that tell their detail instead of their own: Near green, Mid yellow to orange the
  /// more often halved, Far blue.
  bool colours = false;
};

/// Chooses what is drawn, and how, in one view (a window, a split screen's half, a mirror): remembers the last choice
/// of each instance there (hysteresis), and each grid's content.
/// Lifetime: the scene is only read within calls.
class DetailSelector {
 public:
  DetailSelector();
  DetailSelector(DetailSelector&&) noexcept;
  DetailSelector& operator=(DetailSelector&&) noexcept;
  ~DetailSelector();

  /// Replaces `out` by the instances of `policy.instances` whose content sphere meets the camera's frustum, in the
  /// order of their handles. Empty grids and instances whose numbers are not finite or whose size is not positive are
  /// left out.
  ///
  /// Sizes in pixels are those at the picture's centre; towards the edges of a wide angle things are stretched.
  ///
  /// Requires: width and height are positive. What is not checked: `camera` is valid for rendering; it is always the
  ///           same scene or its snapshots, edited between calls as you like.
  /// Cost: O(instances), under 50 ns each; a grid's content is looked at again only when it was edited.
  void select(const Scene& scene, const Camera& camera, int width, int height, const DetailPolicy& policy,
              std::vector<SelectedInstance>& out);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
