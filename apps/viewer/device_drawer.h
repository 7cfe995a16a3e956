#pragma once

#include <array>
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <quoin/live/live_meshes.h>

#include "device_backend.h"

namespace quoin::viewer {

/// Draws a scene on a graphics device, one image per call: while the view moves as large as the frame time allows, then
/// finer ones. Workers mesh surfaces.
///
/// Threads: one at a time. `read_scene` reads the scene, and `draw` does if `draws_from_scene`.
class DeviceDrawer {
 public:
  /// `scene` must outlive it. Workers call `on_surfaces` when there is more to draw or less to mesh.
  DeviceDrawer(const Scene& scene, const DeviceBackendOptions& options, OpenDevice open_device,
               std::function<void()> on_surfaces);

  /// Sets the request to draw.
  void want(const ViewRequest& request);
  /// Records an edit of the scene.
  void note_edit();

  /// Returns true if `draw` has something to draw, perhaps not before `rests_until`.
  [[nodiscard]] bool wants_frames() const;
  /// Returns when the view will count as still, so that an image may take longer than a frame; empty if it already
  /// does.
  [[nodiscard]] std::optional<std::chrono::steady_clock::time_point> rests_until() const;

  /// Opens the device if it is not open yet. Does not read the scene.
  [[nodiscard]] Status open();
  /// Applies edits and finished meshes. Requires: the device is open.
  [[nodiscard]] Status read_scene();
  [[nodiscard]] bool needs_voxels() const;
  [[nodiscard]] bool draws_from_scene() const;
  /// Draws the next image, if there is one to draw. Requires: `read_scene` was called since the last edit.
  [[nodiscard]] Result<std::optional<ViewFrame>> draw();
  /// Calls read_scene, then draw. Running out of memory or threads is an error.
  [[nodiscard]] Result<std::optional<ViewFrame>> read_and_draw();

  [[nodiscard]] const VulkanRenderer* renderer() const { return renderer_.get(); }
  [[nodiscard]] bool is_processor() const { return renderer_ && renderer_->device().kind == "cpu"; }
  /// Returns the number of meshed chunks and of chunks to mesh since meshing was last complete; 0 and 0 while idle.
  [[nodiscard]] std::pair<std::size_t, std::size_t> meshing() const;
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> stats() const;
  /// Returns the bytes of meshes on the device and of the path tracing history.
  [[nodiscard]] std::size_t image_bytes() const {
    return path_memory_.bytes() + (meshes_ ? meshes_->renderer.stats().bytes : 0);
  }
  /// Returns true if the device has the scene's voxels.
  [[nodiscard]] bool has_scene() const { return renderer_ != nullptr && !is_scene_new_; }
  /// Returns true if images of the mode took longer than `slow_seconds` at the smallest size, or if the first image of
  /// a software device took ten times as long.
  [[nodiscard]] bool is_slow(DrawMode mode) const { return is_slow_.at(static_cast<std::size_t>(mode)); }

 private:
  using Clock = std::chrono::steady_clock;
  /// Meshes of one style, and their renderer.
  struct Meshes {
    SurfaceStyle style;
    SmoothOcclusionOptions occlusion;
    std::unique_ptr<LiveMeshes> live;
    VulkanMeshRenderer renderer;
    bool is_scene_new = true;
    std::size_t to_mesh = 0;
  };

  /// One drawing step of a ray-marched or path-traced image.
  struct Stage {
    [[nodiscard]] double pixels() const { return static_cast<double>(width) * height; }

    int width = 0;
    int height = 0;
    Accumulation accumulation = Accumulation::Restart;
  };

  Status prepare_meshes(SurfaceStyle style);
  [[nodiscard]] std::unique_ptr<LiveMeshes> live_meshes(SurfaceStyle style,
                                                        const SmoothOcclusionOptions& occlusion) const;
  void renew_occlusion();
  Status update_renderer();
  Status take_surfaces();
  void count_pending();
  [[nodiscard]] MeshImageOptions mesh_image() const;
  Result<bool> draw_meshes();
  void note_mesh_seconds(double seconds, bool is_moving);
  [[nodiscard]] int moving_divisor() const;
  [[nodiscard]] double foreseen_seconds(int divisor) const;
  Result<bool> draw_rays();
  Status draw_stage();
  Result<bool> draw_path_stage();
  [[nodiscard]] int first_divisor() const;
  [[nodiscard]] Stage next_stage();
  [[nodiscard]] int samples_now(const Stage& stage, int before, int wanted) const;
  [[nodiscard]] ViewFrame frame(double seconds) const;

  const Scene* scene_;
  DeviceBackendOptions options_;
  OpenDevice open_device_;
  std::function<void()> on_surfaces_;

  std::optional<ViewRequest> request_;
  bool is_request_new_ = false;
  bool is_settled_ = false;
  Clock::time_point wanted_at_ = Clock::now();  // when `request_` was set
  Clock::time_point mode_since_ = Clock::now();
  bool is_mode_drawn_ = false;
  std::array<bool, kDrawModes> is_slow_{};

  std::shared_ptr<VulkanRenderer> renderer_;
  bool is_scene_new_ = true;  // not yet uploaded to the renderer
  std::shared_ptr<VulkanImage> image_;
  std::unique_ptr<VulkanPathImage> paths_;  // null in other modes
  PathMemory path_memory_;
  int shown_samples_ = 0;  // of `paths_`
  std::unique_ptr<Meshes> meshes_;
  int divisor_ = 1;
  int samples_ = 1;
  bool waits_ = false;                       // for impostors
  std::map<int, DetailSelector> selectors_;  // by divisor: images of another size are another view
  double seconds_per_sample_ = 0.0;          // per pixel, for rays or paths; 0: not known
  std::map<int, double> mesh_seconds_;       // of images in motion, by divisor
  bool has_shaders_ = false;                 // compiled for the measured times above
};

}  // namespace quoin::viewer
