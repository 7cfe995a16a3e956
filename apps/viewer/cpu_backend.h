#pragma once

#include <cstddef>
#include <memory>

#include <quoin/core/parallel.h>

#include "view_backend.h"

namespace quoin::viewer {

struct CpuBackendOptions {
  InstanceFilter instances = InstanceFilter::Visible;
  Threads threads;
  /// How long the first picture after a change of the camera may take, by the time that pixels have taken so far: it
  /// is as large as that allows, of a quarter of the width and height at least. 0: always that.
  double first_frame_seconds = 0.05;
  /// Of the densities that stand for voxels in pictures of smooth surfaces.
  std::size_t max_density_bytes = std::size_t{1} << 30;
};

/// Pictures by CpuRenderer on a thread of its own: a quarter of the size, or a third, half, whole; then of 4, 16 ...
/// samples a pixel up to what was asked for. A settled frame is CpuRenderer's picture to the byte. Where full light
/// would make the first picture smaller than a half it is a draft: with few lamps, and the occlusion of vertices.
///
/// A new request ends the image under way, except the coarsest one of the same mode: however fast requests come, some
/// are seen.
///
/// DrawMode::Paths goes the same way, without noise within surfaces (PathOptions::denoise), up to 256 samples; what it
/// needs is made before the first such picture, and let go of likewise. After an edit what it did not change stays as
/// it was while the rest converges anew (PathHistory).
///
/// DrawMode::Smooth is marched as well, through the fields of a SmoothScene: these are made before the first such
/// picture, follow edits, and are let go of with the first picture of another mode.
class CpuBackend final : public ViewBackend {
 public:
  /// `scene` must outlive it in its place. `on_frame` is called from the backend's thread when there is a frame to take
  /// or something went wrong; it may be empty. Cost: that of a CpuRenderer.
  CpuBackend(const Scene& scene, const CpuBackendOptions& options, std::function<void()> on_frame);
  /// Waits for the end of what is under way, which is stopped.
  ~CpuBackend() override;

  [[nodiscard]] std::string name() const override;
  void show(const ViewRequest& request) override;
  [[nodiscard]] std::optional<ViewFrame> take() override;
  [[nodiscard]] std::size_t bytes() const override;
  [[nodiscard]] std::string activity() const override;
  [[nodiscard]] std::optional<Error> fault() override;
  /// Why the scene cannot be marched as DrawMode::Smooth, if that was tried since the last edit: its densities take
  /// too much memory.
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
