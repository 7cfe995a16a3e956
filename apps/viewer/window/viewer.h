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

/// What marches rays and shows the window.
enum class ViewerBackend : std::uint8_t {
  Auto,       ///< a graphics card where there is one, else the processor
  Processor,  ///< meshes are still drawn by a device
  Vulkan,     ///< whatever device there is, processors that act as one too
};

struct ViewerOptions {
  std::filesystem::path file;  ///< empty: an empty window
  LoadOptions load;
  WorldOptions world;  ///< of worlds on disk
  Threads threads;
  ViewerBackend backend = ViewerBackend::Auto;
  std::string device;               ///< of Vulkan, as VulkanOptions::device
  std::optional<DrawMode> mode;     ///< what the scene is drawn as at first; without, as it was last
  std::optional<LightModel> light;  ///< likewise
  int width = 0;                    ///< of the window; 0: as it was last
  int height = 0;
  bool is_bare = false;              ///< the picture alone, neither panels nor bars, and nothing remembered
  std::filesystem::path screenshot;  ///< not empty: written once the picture has settled, which ends the viewer
  /// Called instead of coming back where that would take long, since something draws that cannot be stopped: all is
  /// written, and the window is gone. It should end the process, without destructors. Empty: that is waited for.
  std::function<void()> leave_at_once;

  [[nodiscard]] InstanceFilter instances() const {
    return load.show_hidden ? InstanceFilter::All : InstanceFilter::Visible;
  }
};

/// Opens a window on a file and comes back when the user closes it.
///
/// `is_interrupted` is asked some times a second whether to end at once.
/// Errors: Unsupported without a display, or without a device that was asked for; those of reading `file` and of
/// writing `screenshot`. Whatever goes wrong later is shown in the window.
[[nodiscard]] Status run_viewer(const ViewerOptions& options, const std::function<bool()>& is_interrupted = {});

}  // namespace quoin::viewer
