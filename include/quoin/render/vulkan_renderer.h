#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/render/vulkan_device.h>
#include <quoin/render/vulkan_image.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>

namespace [[gnu::visibility("default")]] quoin {

/// Default size of a renderer's device memory blocks.
inline constexpr std::uint64_t kVulkanBlockBytes = std::uint64_t{64} << 20;

struct VulkanOptions {
  /// Device to use, in the form that `choose_vulkan_device` accepts.
  std::string device{};
  /// Size of the device memory blocks for voxels; the renderer allocates as many as it needs. Requires: at least 64
  /// KiB.
  std::uint64_t block_bytes = kVulkanBlockBytes;
  /// Receives the messages of the validation layer. Setting it loads the layer; each message is a bug in Quoin. Called
  /// on any thread that uses the renderer.
  std::function<void(const std::string& message)> on_validation_message{};
};

/// Selects whether new samples are added to the existing samples of an image.
enum class Accumulation : std::uint8_t {
  Continue,  ///< add to the existing samples
  Restart,   ///< discard the existing samples
};

/// Renders the same images as CpuRenderer on a Vulkan device: its own device or the application's.
///
/// Equal:    options and errors are as in CpuRenderer, except that OcclusionMode::Smooth is Unsupported. Channels
///           differ by at most 2, except at silhouettes, where single precision can take a ray past another voxel, and
///           at edges of texels. This affects less than one pixel in a thousand, unless whole rows of rays run exactly
///           along voxel faces or edges of texels. Ray counts differ as little.
/// Detail:   grids are halved and impostors built on the CPU on first use, from the scene of the last update. Images
///           with `DetailOptions::policy`, and the first image with lamps or propagated light, require that this scene
///           still exists unedited.
/// Device:   computes in 32 bits relative to the camera, and addresses memory by pointers. It therefore needs Vulkan
///           1.2 with bufferDeviceAddress. Device memory limits the size of worlds; buffer size limits do not.
/// Errors:   LimitExceeded if memory is full; DeviceLost, after which a new renderer is needed; Unsupported for other
///           driver errors.
/// Lifetime: must outlive its images and mesh renderers. A borrowed device must outlive the renderer. The scene of the
///           last update must outlive the render calls that need it (see Detail).
/// Threads:  one at a time.
class VulkanRenderer {
 public:
  /// Creates a renderer on its own device.
  /// Errors: Unsupported, naming the missing part: Vulkan in this build, its loader, a driver, the selected device, a
  ///         feature of the device, or the validation layer.
  [[nodiscard]] static Result<VulkanRenderer> create(const VulkanOptions& options = {});

  /// Creates a renderer on the application's own device. Any number of renderers can share a device. The renderer
  /// submits to `device.queue`, guarded by `device.with_queue`, and waits for its own submissions only, never for the
  /// whole device.
  ///
  /// Requires: instance and device meet `vulkan_requirements`; `block_bytes` is at least 64 KiB.
  /// Errors:   InvalidArgument if a handle is null or the queue family does not exist; Unsupported as for the other
  ///           overload.
  [[nodiscard]] static Result<VulkanRenderer> create(const BorrowedVulkanDevice& device,
                                                     std::uint64_t block_bytes = kVulkanBlockBytes);
  VulkanRenderer(VulkanRenderer&&) noexcept;
  VulkanRenderer& operator=(VulkanRenderer&&) noexcept;
  ~VulkanRenderer();

  [[nodiscard]] const VulkanDeviceInfo& device() const;

  /// Uploads the current state of `scene`, which may be another scene each time. Draws the instances that `filter`
  /// accepts. The scene is not needed afterwards, except as described under Detail. The change journals of the scene
  /// and its grids determine the uploads.
  ///
  /// Cost:   O(chunks) the first time; then O(chunks of edited grids), plus uploads of the edited chunks.
  /// Errors: as the class, and Unsupported for grids that span more than 2^29 voxels; then the device holds no scene.
  /// Memory: a field takes 700 bytes per 4^3 cells at its surface, in addition to its tree.
  [[nodiscard]] Status update(const Scene& scene, InstanceFilter filter = InstanceFilter::Visible,
                              Threads threads = {});
  /// Sets the light, as CpuRenderer::use_light; also for the VulkanMeshRenderers of this renderer.
  void use_light(const SceneLight* light);
  /// Returns the number of bytes that the last `update` sent to the device.
  [[nodiscard]] std::uint64_t uploaded_bytes() const;

  /// Renders one image, as CpuRenderer::render; `threads` compute levels of detail.
  ///
  /// Cost: the first image of a kind also makes its pipelines: 0.1 to 3 s, with software drivers up to a minute.
  [[nodiscard]] Result<RenderedImage> render(const Camera& camera, const RenderOptions& options = {},
                                             Threads threads = {}, const Progress& progress = {});

  /// Draws into an image on the device: adds `options.samples` samples per pixel. Starts from scratch with
  /// Accumulation::Restart, if the size changes, or if another function drew or wrote the image. The accumulated image
  /// equals the result of `render` with as many samples, except that textures are smoother: samples of earlier calls
  /// show the mipmap levels for fewer samples. After an error, including Cancelled, the image has no samples.
  ///
  /// Requires: unless it starts from scratch, camera, light and scene are the same as for the existing samples; the
  ///           scene is not checked.
  /// Errors:   as `render`. LimitExceeded for more than 4,096 samples in total. InvalidArgument for an image of another
  ///           renderer. `options.depth` has no effect.
  [[nodiscard]] Status draw(VulkanImage& image, const Camera& camera, const RenderOptions& options,
                            Accumulation accumulation, Threads threads = {}, const Progress& progress = {});

  /// Path-traces one image, as PathTracer::render. Reads emissive faces from the scene of the last `update`, which must
  /// still exist unedited.
  ///
  /// Equal:  uses the same random numbers as PathTracer, so the image has the same light and the same noise. Paths
  ///         differ only where single precision takes a ray past another voxel.
  /// Errors: as PathTracer::render and as the class.
  /// Memory: as VulkanPathImage.
  [[nodiscard]] Result<PathImage> render_paths(const Camera& camera, const PathOptions& options = {},
                                               Threads threads = {}, const Progress& progress = {});

  /// Adds `options.samples` samples per pixel to a path-traced image. Starts from scratch with Accumulation::Restart,
  /// if the size changes, or after an error, including Cancelled.
  ///
  /// Requires: unless it starts from scratch, camera, scene and options (except the sample count) are the same as for
  ///           the existing samples; the scene is not checked.
  /// Errors:   as `render_paths`. LimitExceeded for more than 65,536 samples in total. InvalidArgument for an image of
  ///           another renderer.
  [[nodiscard]] Status draw_paths(VulkanPathImage& image, const Camera& camera, const PathOptions& options,
                                  Accumulation accumulation, const Progress& progress = {});

  // For Quoin's own sources.
  struct [[gnu::visibility("hidden")]] Impl;
  [[nodiscard]] Impl& impl() const { return *impl_; }

 private:
  explicit VulkanRenderer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
