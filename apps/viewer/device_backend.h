#pragma once

#include <memory>

#include <quoin/render_vk/vulkan_renderer.h>

#include "cpu_backend.h"
#include "view_backend.h"

namespace quoin::viewer {

/// The graphics device that draws, opened when it is first needed.
using OpenDevice = std::function<Result<std::shared_ptr<VulkanRenderer>>()>;

struct DeviceBackendOptions {
  CpuBackendOptions cpu;
  /// Whether rays are marched on the device, which is then the one that shows the window: `take` draws, and pictures
  /// stay there. Else the processor marches them, which is faster than a device that is a processor in truth; meshes
  /// are drawn on a thread of their own, and come back as bytes.
  bool rays_on_device = false;
  /// How long a picture may take when the camera has moved: it is as fine as that allows, and of meshes a quarter of
  /// the size at least.
  double frame_seconds = 0.025;
  double slow_seconds = 0.1;  ///< pictures that take longer though they are that small make their mode a slow one
};

/// Pictures by a graphics device: ray-marched ones get better sample by sample, meshes follow edits as workers finish
/// them. What is pointed at is found by the processor, which also draws where the device cannot, and rays until the
/// device has drawn the first meshed chunks. Where a processor acts as the device, meshes have no light that takes
/// rays; once the view rests the processor draws them by rays: blocks, fields, and smooth meshes of voxels through the
/// fields that these are made from. Where the latter take too much memory their picture stays the device's, and
/// `activity` says so.
///
/// After a fault of the device it is not used again.
class DeviceBackend final : public ViewBackend {
 public:
  /// `scene` must outlive it in its place. `on_frame` as CpuBackend's. Cost: that of a CpuBackend: the device gets the
  /// scene with the first picture that it draws.
  DeviceBackend(const Scene& scene, const DeviceBackendOptions& options, OpenDevice open_device,
                std::function<void()> on_frame);
  ~DeviceBackend() override;

  [[nodiscard]] std::string name() const override;
  [[nodiscard]] bool can_draw(DrawMode mode) const override;
  [[nodiscard]] bool traces_light(DrawMode mode) const override;
  void show(const ViewRequest& request) override;
  [[nodiscard]] std::optional<ViewFrame> take() override;
  [[nodiscard]] bool wants_frames() const override;
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> stats() const override;
  [[nodiscard]] std::size_t bytes() const override;
  [[nodiscard]] std::string activity() const override;
  [[nodiscard]] std::optional<double> progress() const override;
  [[nodiscard]] bool is_slow(DrawMode mode) const override;
  [[nodiscard]] bool ends_late() const override;
  [[nodiscard]] std::optional<Error> fault() override;
  double pause() override;
  void resume(bool changed) override;
  [[nodiscard]] std::optional<SlideResult> slide(const OrientedBox& box, DVec3 displacement,
                                                 const SlideOptions& options) override;
  [[nodiscard]] std::optional<SceneHit> pick(const Camera& camera, double x, double y, int width, int height) override;
  [[nodiscard]] bool is_up_to_date() override;

  /// The processor stands in for it from now on.
  void forget_device() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin::viewer
