#pragma once

#include <cstddef>
#include <memory>

#include <quoin/core/parallel.h>

#include "view_backend.h"

namespace quoin::viewer {

struct CpuBackendOptions {
  InstanceFilter instances = InstanceFilter::Visible;
  Threads threads;
  /// Time limit for the first image after the camera changed. Its size follows from the measured time per pixel, but
  /// is at least a quarter of the width and height; 0: always a quarter.
  double first_frame_seconds = 0.05;
  /// Limit for the densities made from voxels to draw smooth surfaces.
  std::size_t max_density_bytes = std::size_t{1} << 30;
};

/// Renders with CpuRenderer on its own thread: at a quarter of the size, a third, half, full size; then with 4, 16 ...
/// samples per pixel up to the requested number. A settled frame equals CpuRenderer's image byte for byte. If full
/// light would make the first image smaller than a half, it is a draft with few lamps and vertex occlusion.
///
/// A new request cancels the image in progress, except the coarsest one of the same mode, so that some images are shown
/// however fast requests come.
///
/// DrawMode::Paths works the same way, denoised within surfaces (PathOptions::denoise), up to 256 samples. Its data is
/// built before the first path-traced image and freed with the first image of another mode except Density. After an
/// edit, unchanged parts keep their samples while the rest converges again (PathHistory).
///
/// DrawMode::Smooth is also ray-marched, through the fields of a SmoothScene. These are built before the first smooth
/// image, follow edits, and are freed with the first image of another mode except Density.
class CpuBackend final : public ViewBackend {
 public:
  /// `scene` must outlive the backend and not move. The backend's thread calls `on_frame` when there is a frame to take
  /// or an error; it may be empty. Cost: that of a CpuRenderer.
  CpuBackend(const Scene& scene, const CpuBackendOptions& options, std::function<void()> on_frame);
  /// Stops the image in progress and waits for the thread.
  ~CpuBackend() override;

  [[nodiscard]] std::string name() const override;
  void show(const ViewRequest& request) override;
  [[nodiscard]] std::optional<ViewFrame> take() override;
  [[nodiscard]] std::size_t bytes() const override;
  [[nodiscard]] std::string activity() const override;
  [[nodiscard]] std::optional<Error> fault() override;
  /// Returns the error if drawing as DrawMode::Smooth failed since the last edit because the densities take too much
  /// memory.
  [[nodiscard]] std::optional<Error> smooth_refusal() const;
  double pause() override;
  void resume(bool changed) override;
  [[nodiscard]] std::optional<SlideResult> slide(const OrientedBox& box, DVec3 displacement,
                                                 const SlideOptions& options) override;
  [[nodiscard]] std::optional<SceneHit> pick(const Camera& camera, double x, double y, int width, int height) override;
  [[nodiscard]] bool is_up_to_date() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin::viewer
