#pragma once

#include <memory>

#include <quoin/render/vulkan_renderer.h>

#include "cpu_backend.h"
#include "view_backend.h"

namespace quoin::viewer {

/// Opens the graphics device that draws; called when it is first needed.
using OpenDevice = std::function<Result<std::shared_ptr<VulkanRenderer>>()>;

struct DeviceBackendOptions {
  CpuBackendOptions cpu;
  /// Marches rays on the device, which must also show the window: `take` draws, and images stay on the device.
  /// Otherwise the processor marches rays, which is faster than a software device; meshes are drawn on their own thread
  /// and copied back.
  bool rays_on_device = false;
  /// Time limit for an image after the camera moved: it is as fine as that allows, meshes at least at a quarter of the
  /// size.
  double frame_seconds = 0.025;
  double slow_seconds = 0.1;  ///< a mode is slow if its smallest images take longer
};

/// Renders on a graphics device. Ray-marched images improve sample by sample; meshes follow edits as workers finish
/// them. The processor does picking, draws modes that the device cannot draw, and marches rays until the device has
/// drawn the first meshed chunks. On a software device meshes have no ray-traced light; once the view is still, the
/// processor ray-marches the same image: blocks, fields, and smooth meshes of voxels through the fields they are made
/// from. If those fields take too much memory, the device's image stays and `activity` reports it.
///
/// A device is not used again after a fault.
class DeviceBackend final : public ViewBackend {
 public:
  /// `scene` must outlive the backend and not move. `on_frame` is as for CpuBackend. Cost: that of a CpuBackend; the
  /// scene is uploaded with the first image that the device draws.
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

  /// Releases the device; the processor draws from now on.
  void forget_device() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin::viewer
