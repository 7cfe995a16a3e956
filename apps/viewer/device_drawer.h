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

/// What a graphics device draws of a scene: one picture a call, as large as the time of a frame allows while the view
/// moves and then finer ones. Surfaces are meshed by workers.
///
/// Threads: one at a time. The scene is read by `read_scene` and by `draw` where `draws_from_scene`.
class DeviceDrawer {
 public:
  /// `scene` must outlive it. `on_surfaces` is called from workers: there is more to draw, or less to mesh.
  DeviceDrawer(const Scene& scene, const DeviceBackendOptions& options, OpenDevice open_device,
               std::function<void()> on_surfaces);

  /// From now on this is wanted.
  void want(const ViewRequest& request);
  /// The scene was edited.
  void note_edit();

  /// Whether `draw` would have something to draw; perhaps not before `rests_until`.
  [[nodiscard]] bool wants_frames() const;
  /// When the view counts as still, so that a picture may take longer than a frame; nothing where it does already.
  [[nodiscard]] std::optional<std::chrono::steady_clock::time_point> rests_until() const;

  /// Opens the device where that was not done yet. The scene is not read.
  [[nodiscard]] Status open();
  /// Takes over what was edited and what workers made of it. Requires: it is open.
  [[nodiscard]] Status read_scene();
  [[nodiscard]] bool needs_voxels() const;
  [[nodiscard]] bool draws_from_scene() const;
  /// The next picture, if there is to be one. Requires: `read_scene` was called since the last edit.
  [[nodiscard]] Result<std::optional<ViewFrame>> draw();
  /// As read_scene, then draw; memory or threads that run out are errors.
  [[nodiscard]] Result<std::optional<ViewFrame>> read_and_draw();

  [[nodiscard]] const VulkanRenderer* renderer() const { return renderer_.get(); }
  [[nodiscard]] bool is_processor() const { return renderer_ && renderer_->device().kind == "cpu"; }
  /// Chunks that are meshed, and those that were to be when there was last nothing left to mesh; 0 of 0: none are.
  [[nodiscard]] std::pair<std::size_t, std::size_t> meshing() const;
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> stats() const;
  /// Of meshes, in the device's memory, and of what pictures by paths remember.
  [[nodiscard]] std::size_t picture_bytes() const {
    return path_memory_.bytes() + (meshes_ ? meshes_->renderer.stats().bytes : 0);
  }
  /// Whether the device has the scene's voxels.
  [[nodiscard]] bool has_scene() const { return renderer_ != nullptr && !is_scene_new_; }
  /// Whether pictures of the mode took longer than options allow when they were as small as they get, or the first of a
  /// processor that acts as a device ten times as long.
  [[nodiscard]] bool is_slow(DrawMode mode) const { return is_slow_.at(static_cast<std::size_t>(mode)); }

 private:
  using Clock = std::chrono::steady_clock;
  /// Meshes of one style, and what draws them.
  struct Meshes {
    SurfaceStyle style;
    SmoothOcclusionOptions occlusion;
    std::unique_ptr<LiveMeshes> live;
    VulkanMeshRenderer renderer;
    bool is_scene_new = true;
    std::size_t to_mesh = 0;
  };

  /// What of a picture by rays or paths is drawn at once.
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
  [[nodiscard]] MeshPictureOptions mesh_picture() const;
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
  Clock::time_point wanted_at_ = Clock::now();  // the request that is wanted now
  Clock::time_point mode_since_ = Clock::now();
  bool is_mode_drawn_ = false;
  std::array<bool, kDrawModes> is_slow_{};

  std::shared_ptr<VulkanRenderer> renderer_;
  bool is_scene_new_ = true;  // to the renderer
  std::shared_ptr<VulkanPicture> picture_;
  std::unique_ptr<VulkanPathPicture> paths_;  // null: the mode is another
  PathMemory path_memory_;
  int shown_samples_ = 0;  // of these
  std::unique_ptr<Meshes> meshes_;
  int divisor_ = 1;
  int samples_ = 1;
  bool waits_ = false;                       // for impostors
  std::map<int, DetailSelector> selectors_;  // by divisor: pictures of another size are another view
  double seconds_per_sample_ = 0.0;          // and pixel, of rays or of paths; 0: not known
  std::map<int, double> mesh_seconds_;       // of moving pictures, by divisor
  bool has_shaders_ = false;                 // for what these are of
};

}  // namespace quoin::viewer
