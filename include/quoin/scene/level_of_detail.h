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

namespace [[gnu::visibility("default")]] quoin {

/// Level of detail of one instance.
enum class Detail : std::uint8_t {
  Near,  ///< every voxel
  Mid,   ///< coarser cells, none larger than a pixel
  Far,   ///< an impostor
};

/// The bounding sphere of a grid's content. Its centre is the centre of the tight box around the voxels and the field's
/// solid; the sphere passes through the corners of that box.
struct ContentSphere {
  DVec3 centre{0.0};    ///< grid coordinates
  double radius = 0.0;  ///< voxels; 0 for an empty grid
};

/// Returns the bounding sphere of a grid's voxels. Cost: O(chunks).
[[nodiscard]] ContentSphere content_sphere(const Grid& grid);
[[nodiscard]] ContentSphere content_sphere(const SceneGrid& grid);
/// Returns the bounding sphere of content with these tight bounds.
[[nodiscard]] ContentSphere content_sphere(const IBox& bounds);

/// Thresholds for choosing the level of detail.
struct DetailPolicy {
  enum class Rule : std::uint8_t {
    ByRadius,  ///< by distance from the content's centre, in content radii
    ByPixels,  ///< by the projected size of a voxel and of the whole grid
  };
  Rule rule = Rule::ByPixels;
  double near_radii = 1.0;    ///< ByRadius: Near up to and including this distance
  double mid_radii = 10.0;    ///< ByRadius: Mid up to and including this distance
  double voxel_pixels = 1.0;  ///< ByPixels: Mid if a voxel projects to less than this
  /// For Mid, the grid is halved while its cells project to at most this many pixels. Tuned on a ship and a terrain
  /// with 64 samples: images differ by up to 6.0 / 255 at 0.5, and by up to 9 / 255 at 1 (docs/decisions/archive/026).
  double cell_pixels = 0.4;
  /// ByPixels: Far if the grid's diameter projects to at most this; also the impostor image size.
  int far_pixels = 128;
  /// The detail or level changes only when the distance or size passes its threshold by this fraction of it. 0 disables
  /// hysteresis.
  double hysteresis = 0.1;
  InstanceFilter instances = InstanceFilter::Visible;  ///< the instances to select from
};

/// Returns the detail that `ByRadius` chooses for a distance between camera and content centre, in the same units as
/// `radius`. A radius of 0 gives Near at distance 0 and Far otherwise. NaN gives Far.
[[nodiscard]] Detail detail_by_radius(double distance, double radius, const DetailPolicy& policy = {});

/// The projected sizes that `ByPixels` compares.
struct ScreenSize {
  double voxel_pixels = 0.0;     ///< size of one voxel at the content's nearest point
  double diameter_pixels = 0.0;  ///< size of the whole content at its centre's distance
};
/// Returns the detail that `ByPixels` chooses. Sizes that are not finite give Far.
[[nodiscard]] Detail detail_by_pixels(const ScreenSize& size, const DetailPolicy& policy = {});

/// An instance that may be visible in the image.
struct SelectedInstance {
  InstanceHandle instance;
  Detail detail = Detail::Near;
  /// The traced level of the grid: cells of (2^level)^3 voxels, 0 to kMaxGridLevel.
  /// Near: 0.
  /// Mid: chosen by DetailPolicy::cell_pixels; at least 1 with ByRadius.
  /// Far: the level that replaces the voxels where no impostor is used, such as in shadows.
  int level = 0;
  double distance = 0.0;  ///< from the camera to the content's centre, in world units
};

/// The coarsest level of traced grids.
inline constexpr int kMaxGridLevel = 4;

class DetailSelector;

/// Level-of-detail settings of a rendered image.
struct DetailOptions {
  /// Chooses each instance's detail. Without a policy, all instances are Near. The renderer, not the policy, decides if
  /// hidden instances are drawn.
  std::optional<DetailPolicy> policy{};
  /// The selector of this view. It remembers the previous image's choices, so that models do not flicker between two
  /// details. Null disables hysteresis. Images that share a selector must be rendered one after another, from one
  /// scene. The selector must outlive the call.
  DetailSelector* selector = nullptr;
  /// Maximum time to wait, in seconds, for impostors that are missing or older than their grid. The renderer's own
  /// threads build them in the background. A grid whose impostor is not ready is traced, or shown with its old
  /// impostor. Only an infinite wait gives reproducible images; use 0 for interactive frames. Impostors store ambient
  /// occlusion from nine rays of 6 voxels within the grid.
  double impostor_seconds = std::numeric_limits<double>::infinity();
  int impostor_edge = 128;  ///< texels per side of an impostor's finest images, 16 to 1,024: ImpostorOptions::edge
  /// Shows each instance in the colour of its detail: Near green; Mid yellow to orange as levels get coarser; Far
  /// blue.
  bool colours = false;
};

/// Selects the instances to draw and their detail in one view (a window, half of a split screen, a mirror). It
/// remembers each instance's last choice (hysteresis) and each grid's content sphere.
/// Lifetime: the scene is only read during calls.
class DetailSelector {
 public:
  DetailSelector();
  DetailSelector(DetailSelector&&) noexcept;
  DetailSelector& operator=(DetailSelector&&) noexcept;
  ~DetailSelector();

  /// Replaces `out` with the instances of `policy.instances` whose content sphere intersects the camera's frustum, in
  /// handle order. Skips empty grids, and instances with a non-finite transform or a size that is not positive.
  ///
  /// Projected sizes are those at the image centre; wide angles stretch objects towards the edges.
  ///
  /// Requires: width and height are positive. Not checked: `camera` is valid for rendering, and every call passes the
  ///           same scene or its snapshots. The scene may be edited between calls.
  /// Cost:     O(instances), under 50 ns each; a grid's content is measured again only after an edit.
  void select(const Scene& scene, const Camera& camera, int width, int height, const DetailPolicy& policy,
              std::vector<SelectedInstance>& out);

 private:
  struct [[gnu::visibility("hidden")]] Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
