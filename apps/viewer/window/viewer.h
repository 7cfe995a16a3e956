#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include <quoin/core/parallel.h>
#include <quoin/core/result.h>
#include <quoin/io/vox.h>

#include "viewer/view_backend.h"
#include "viewer/world_window.h"

namespace quoin::viewer {

/// The renderer that marches rays and shows the window.
enum class ViewerBackend : std::uint8_t {
  Auto,       ///< a graphics card if there is one, else the processor
  Processor,  ///< the processor; meshes are still drawn by a device
  Vulkan,     ///< any Vulkan device, including software devices
};

struct ViewerOptions {
  std::filesystem::path file;  ///< empty: an empty window
  LoadOptions load;
  bool uses_own_packs = false;  ///< `load.packs` replaces the pack of the settings until the user chooses another
  WorldOptions world;           ///< of worlds on disk
  Threads threads;
  ViewerBackend backend = ViewerBackend::Auto;
  std::string device;               ///< as VulkanOptions::device
  std::optional<DrawMode> mode;     ///< initial draw mode; by default the last one used
  std::optional<LightModel> light;  ///< initial light model; by default the last one used
  int width = 0;                    ///< window size; 0: the last one used
  int height = 0;
  bool is_bare = false;              ///< shows only the image, without panels and bars, and saves no settings
  std::filesystem::path screenshot;  ///< if not empty: written once the image has settled; then the viewer ends
  /// Called instead of returning if work that cannot be stopped would delay the return: all files are written and the
  /// window is closed. Should end the process without destructors. If empty, run_viewer waits for the work.
  std::function<void()> leave_at_once;

  [[nodiscard]] InstanceFilter instances() const {
    return load.show_hidden ? InstanceFilter::All : InstanceFilter::Visible;
  }
};

/// Opens a window for a file and returns when the user closes it.
///
/// `is_interrupted` is polled some times per second; the viewer ends once it returns true.
/// Errors: Unsupported without a display or the requested device; those of reading `file` and writing `screenshot`.
/// Later errors are shown in the window.
[[nodiscard]] Status run_viewer(const ViewerOptions& options, const std::function<bool()>& is_interrupted = {});

}  // namespace quoin::viewer
