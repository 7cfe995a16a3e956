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

/// The viewer's main loop: handles events and draws frames.
class App {
 public:
  App(const ViewerOptions& options, Settings settings, std::unique_ptr<Screen> screen);
  ~App();
  App(const App&) = delete;
  App& operator=(const App&) = delete;

  /// Runs until the user quits or `is_interrupted` returns true.
  [[nodiscard]] Status run(const std::function<bool()>& is_interrupted);
  [[nodiscard]] const Settings& settings() const { return state_.settings; }
  /// Closes the window. Returns true if the destructor would wait for work that cannot be stopped: a drawing device or
  /// a file being read.
  [[nodiscard]] bool ends_late();

 private:
  void close();

  using Clock = std::chrono::steady_clock;
  /// The action to take once unsaved changes are saved or discarded.
  struct Leaving {
    bool is_quit = false;
    std::filesystem::path open;  ///< empty: ask for the file
  };

  // Events and frames.
  void wait_and_process();
  [[nodiscard]] int patience_milliseconds() const;
  [[nodiscard]] bool is_moving() const;
  [[nodiscard]] bool is_animating() const;
  void process(const SDL_Event& event);
  void frame();
  void place_image(float left_top, float right, float bottom);
  [[nodiscard]] ViewRequest request_now() const;
  void ask_for_image();
  void take_image();
  /// Returns true if the settled image of the last request is shown.
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
  void draw_unsupported();
  void draw_leaving();
  void update_hover();
  void update_title();
  void note_size();
  void forget_slow_mode();

  // Worlds on disk.
  void stream_world();
  void report_world(const Status& saving);
  void frame_world();
  /// Saves the edits of a world on disk and returns once that is done. Shows errors.
  Status save_world();
  [[nodiscard]] bool is_streaming() const;
  [[nodiscard]] bool has_ground() const;

  // Commands.
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
  void save(const std::filesystem::path& path, bool accepts_unsupported = false);
  void take_saved();
  void choose_pack(const std::string& pack);
  void take_packed();
  void ask_where_to_save();
  void want_image();
  [[nodiscard]] std::optional<Result<Image>> image_in_mode(DrawMode mode) const;
  void save_wanted_images();
  void save_image(const Result<Image>& image);
  void write_screenshot(const std::filesystem::path& path);

  /// A save that waits for the user's consent because it would lose something.
  struct LossySave {
    std::filesystem::path path;
    std::vector<std::string> losses;
  };

  /// An image to save once its request has settled. If the view changes before that, `shown` is saved: the image on the
  /// screen when the user pressed the key, or the first one of the request's mode if the mode had just changed.
  struct WantedImage {
    ViewRequest request;
    ChangeCursor scene;
    std::optional<Result<Image>> shown;
  };

  /// Settings to restore after showing the levels of detail.
  struct BeforeDetail {
    DrawMode mode;
    bool by_pixels;
  };

  ViewerOptions options_;
  std::unique_ptr<Screen> screen_;
  std::unique_ptr<Gui> gui_;
  std::shared_ptr<VulkanRenderer> renderer_;  // for meshes if the screen has none; opened on demand
  ViewState state_;
  Input input_;
  FileChooser chooser_;
  std::optional<BeforeDetail> before_detail_;
  std::optional<Leaving> leaving_;
  std::optional<LossySave> lossy_save_;
  std::uint64_t documents_ = 0;                     // opened so far
  std::uint64_t packed_ = 0;                        // the document that the pack loader makes looks for
  std::vector<std::unique_ptr<Loader>> abandoned_;  // their threads end by themselves
  bool is_running_ = true;
  std::vector<WantedImage> wanted_;
  std::optional<ViewRequest> asked_;
  bool has_seen_chunks_ = true;        // an image arrived since chunks of the world were last moved
  std::optional<Camera> unframed_;     // the camera of a small world until all of it is loaded
  std::optional<Camera> kept_camera_;  // of a file that is read again
  std::string reported_saving_;        // the current error of saving the world, already shown
  std::string reported_error_;         // the current error of the backend, already shown; empty: none
  std::optional<SDL_Event> postponed_;
  int frames_left_ = 3;
  Clock::time_point last_frame_ = Clock::now();
  bool was_idle_ = true;
  Status status_;
};

}  // namespace quoin::viewer
