#include "viewer.h"

#include "app.h"

namespace quoin::viewer {

Status run_viewer(const ViewerOptions& options, const std::function<bool()>& is_interrupted) {
  const std::filesystem::path path = options.is_bare ? std::filesystem::path() : settings_path();
  Settings settings = path.empty() ? Settings{} : read_settings(path);
  auto video = SdlVideo::start();
  if (!video) return tl::unexpected<Error>(video.error());
  const bool has_size = options.width > 0 && options.height > 0;
  auto window = SdlWindow::open(has_size ? options.width : settings.width, has_size ? options.height : settings.height);
  if (!window) return tl::unexpected<Error>(window.error());
  App app(options, std::move(settings), std::move(*window));
  if (Status status = app.run(is_interrupted); !status) return status;
  if (path.empty()) return {};
  return write_settings(app.settings(), path);
}

}  // namespace quoin::viewer
