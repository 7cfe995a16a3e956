#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <vector>

#include "file_chooser.h"
#include "gui.h"
#include "input.h"
#include "screen.h"
#include "viewer.h"
#include "viewer/window/panel/panels.h"

namespace quoin::viewer {

/// The viewer in its window: events in, a frame out.
class App {
 public:
  App(const ViewerOptions& options, Settings settings, std::unique_ptr<Screen> screen);
  ~App();
  App(const App&) = delete;
  App& operator=(const App&) = delete;

  /// Until the user quits, or `is_interrupted`.
  [[nodiscard]] Status run(const std::function<bool()>& is_interrupted);
  [[nodiscard]] const Settings& settings() const { return state_.settings; }
  /// Closes the window. Whether the destructor would wait for what cannot be stopped: a device that draws, or a file
  /// that is read.
  [[nodiscard]] bool ends_late();

 private:
  void close();

  using Clock = std::chrono::steady_clock;
  /// What to do once unsaved changes are saved or given up.
  struct Leaving {
    bool is_quit = false;
    std::filesystem::path open;  ///< empty: ask which
  };

  // Events and frames.
  void wait_and_process();
  [[nodiscard]] int patience_milliseconds() const;
  [[nodiscard]] bool is_moving() const;
  [[nodiscard]] bool is_animating() const;
  void process(const SDL_Event& event);
  void frame();
  void place_picture(float left_top, float right, float bottom);
  [[nodiscard]] ViewRequest request_now() const;
  void ask_for_picture();
  void take_picture();
  /// Whether what is shown is all that was asked for last.
  [[nodiscard]] bool is_settled() const;
  void take_frame(ViewFrame frame);
  void take_fault();
  void stand_in(const Error& why);
  [[nodiscard]] Result<std::shared_ptr<VulkanRenderer>> open_device();
  void end_with(const Error& error);
  void pace();
  void draw_gui();
  void draw_bars();
  void draw_bare();
  void draw_loading();
  void draw_saving();
  void draw_losses();
  void draw_leaving();
  void update_hover();
  void update_title();
  void note_size();
  void forget_slow_mode();

  // Worlds on disk.
  void stream_world();
  void tell_of_world(const Status& saving);
  void frame_world();
  /// Saves what was edited in a world on disk, and returns once that is done. What goes wrong is told.
  Status save_world();
  [[nodiscard]] bool is_streaming() const;
  [[nodiscard]] bool has_ground() const;

  // What commands do.
  void run_command(Command command);
  bool run_draw_command(Command command);
  void draw_as(DrawMode mode);
  void show_detail(bool is_shown);
  void run_file_command(Command command);
  void show_from(View view);
  void look_through(const Camera& camera);
  void pick_type();

  // Files.
  void leave(Leaving leaving);
  void go_on_leaving();
  void load(const std::filesystem::path& path);
  void take_loaded();
  void close_document();
  void adopt(OpenDocument opened);
  void save(const std::filesystem::path& path, bool accepts_losses = false);
  void take_saved();
  void ask_where_to_save();
  void want_picture();
  [[nodiscard]] std::optional<Result<Image>> image_in_mode(DrawMode mode) const;
  void save_wanted_pictures();
  void save_picture(const Result<Image>& picture);
  void write_screenshot(const std::filesystem::path& path);

  /// A save that was not done, since it would lose something: the user is asked.
  struct LossySave {
    std::filesystem::path path;
    std::vector<std::string> losses;
  };

  /// An image to be saved once its request has settled. If the view changes before that, `shown` is saved: the image on
  /// the screen when the user pressed the key, or the first one of the request's mode if the mode had just changed.
  struct WantedPicture {
    ViewRequest request;
    ChangeCursor scene;
    std::optional<Result<Image>> shown;
  };

  /// What a look at the levels of detail changed.
  struct BeforeDetail {
    DrawMode mode;
    bool by_pixels;
  };

  ViewerOptions options_;
  std::unique_ptr<Screen> screen_;
  std::unique_ptr<Gui> gui_;
  std::shared_ptr<VulkanRenderer> renderer_;  // for meshes, where the screen has none; opened when it is needed
  ViewState state_;
  Input input_;
  FileChooser chooser_;
  std::optional<BeforeDetail> before_detail_;
  std::optional<Leaving> leaving_;
  std::optional<LossySave> lossy_save_;
  std::vector<std::unique_ptr<Loader>> abandoned_;  // their threads end by themselves
  bool is_running_ = true;
  std::vector<WantedPicture> wanted_;
  std::optional<ViewRequest> asked_;
  bool has_seen_chunks_ = true;     // a picture came since chunks of the world were moved last
  std::optional<Camera> unframed_;  // a small world is looked through this until all of it is there
  std::string told_saving_;         // of the world, what went wrong as long as it lasts
  std::string told_fault_;          // of the backend, as long as it lasts; empty: none
  std::optional<SDL_Event> postponed_;
  int frames_left_ = 3;
  Clock::time_point last_frame_ = Clock::now();
  bool was_idle_ = true;
  Status status_;
};

}  // namespace quoin::viewer
