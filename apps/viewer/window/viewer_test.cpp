#include "viewer.h"

#include <SDL.h>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <utility>

#include <unistd.h>

#include <gtest/gtest.h>
#include <quoin/io/file.h>
#include <quoin/io/image_files.h>
#include <quoin/io/scene_file.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/render/path_tracer.h>

#include "core/work/nightly_for_tests.h"
#include "io/zip.h"
#include "viewer/settings.h"
#include "viewer/viewer_fixture.h"
#include "viewer/window/process_facts_for_tests.h"

namespace quoin::viewer {
namespace {

/// Changes the working folder, in which the viewer saves images and opens its file dialogue, and restores it.
class WorkingFolder {
 public:
  explicit WorkingFolder(const std::filesystem::path& folder) : before_(std::filesystem::current_path()) {
    std::filesystem::current_path(folder);
  }
  WorkingFolder(const WorkingFolder&) = delete;
  WorkingFolder& operator=(const WorkingFolder&) = delete;
  ~WorkingFolder() {
    std::error_code ignored;
    std::filesystem::current_path(before_, ignored);
  }

 private:
  std::filesystem::path before_;
};

/// A viewer with an invisible window.
class ViewerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ::setenv("SDL_VIDEODRIVER", "dummy", 1);
    ::setenv("SDL_RENDER_DRIVER", "software", 1);
    std::vector<std::string> warnings;
    ASSERT_TRUE(small_document().write(folder_.file("hill.vox"), warnings));
  }

  [[nodiscard]] ViewerOptions options(int width, int height) {
    ViewerOptions options;
    options.file = folder_.file("hill.vox");
    options.width = width;
    options.height = height;
    options.is_bare = true;
    options.screenshot = folder_.file("shot.png");
    return options;
  }

  ScratchFolder folder_{"window"};
};

TEST_F(ViewerTest, ScreenshotMatchesRendererImage) {
  const ViewerOptions given = options(333, 250);
  const Status status = run_viewer(given);
  ASSERT_TRUE(status) << to_string(status.error());
  const auto document = Document::open(given.file);
  ASSERT_TRUE(document);
  const Scene& scene = (*document)->scene();
  RenderOptions render;
  render.width = 333;
  render.height = 250;
  render.samples = 16;
  render.light = natural_light();
  render.environment = Environment::natural();
  const auto image = CpuRenderer(scene).render(frame_scene(scene, View::Iso, 333.0 / 250.0), render);
  ASSERT_TRUE(image);
  const auto shot = read_png(given.screenshot);
  ASSERT_TRUE(shot) << to_string(shot.error());
  EXPECT_EQ(shot->rgb, image->colour.rgb);
}

TEST_F(ViewerTest, LeaksNothingOverManyStarts) {
  const ViewerOptions given = options(64, 48);
  for (int start = 0; start < 3; ++start) ASSERT_TRUE(run_viewer(given));
  const std::size_t files = open_files();
  const std::size_t threads_before = threads();
  const double memory = held_megabytes();
  const int starts = cases(8, 16);
  for (int start = 0; start < starts; ++start) {
    std::filesystem::remove(given.screenshot);
    const Status status = run_viewer(given);
    ASSERT_TRUE(status) << to_string(status.error());
    ASSERT_TRUE(std::filesystem::exists(given.screenshot));
  }
  EXPECT_EQ(open_files(), files);
  EXPECT_LE(threads_after_joining(threads_before), threads_before) << "a thread of a closed window still runs";
  // The fonts and images of a window take more than 1 MB, so a leak in each start would show. The records of the thread
  // sanitizer take some memory too.
#if defined(__SANITIZE_THREAD__)
  constexpr double kMegabytesPerStart = 15.0 / 16.0;
#else
  constexpr double kMegabytesPerStart = 10.0 / 16.0;
#endif
  EXPECT_LT(held_megabytes() - memory, kMegabytesPerStart * starts);
}

TEST_F(ViewerTest, DrawsPanelsAtAnyWindowSize) {
  ::setenv("XDG_CONFIG_HOME", folder_.file("config").c_str(), 1);
  for (const auto& [width, height] : {std::pair{320, 240}, std::pair{900, 500}}) {
    ViewerOptions given = options(width, height);
    given.is_bare = false;
    const Status status = run_viewer(given);
    ASSERT_TRUE(status) << to_string(status.error());
    const auto shot = read_png(given.screenshot);
    ASSERT_TRUE(shot);
    EXPECT_LT(shot->width, width) << "the panel is next to the image";
    EXPECT_GT(shot->width, 0);
  }
  EXPECT_TRUE(std::filesystem::exists(folder_.file("config/quoin/viewer.json")));
}

/// Installs a client of Minecraft 1.21 in the folder home, whose stones have half the height. Returns its .jar.
std::filesystem::path install_client(const ScratchFolder& folder) {
  ZipFile zip;
  for (const auto& [name, text] : stone_pack(8)) {
    zip.begin(name);
    zip.put(text);
  }
  const auto bytes = zip.take();
  EXPECT_TRUE(bytes);
  const std::filesystem::path jar = folder.file("home/.minecraft/versions/1.21/1.21.jar");
  std::filesystem::create_directories(jar.parent_path());
  EXPECT_TRUE(write_file(*bytes, jar));
  return jar;
}

TEST_F(ViewerTest, UsesPackOfSettings) {
  ::setenv("XDG_CONFIG_HOME", folder_.file("config").c_str(), 1);
  const auto jar = install_client(folder_);
  ViewerOptions given = options(320, 240);
  given.file = write_house(folder_);
  given.is_bare = false;
  // Returns the image with the pack of the settings, which stay as they are.
  const auto image_with = [&](const std::string& pack) {
    Settings settings;
    settings.pack = pack;
    EXPECT_TRUE(write_settings(settings, settings_path()));
    const Status status = run_viewer(given);
    EXPECT_TRUE(status) << to_string(status.error());
    EXPECT_EQ(read_settings(settings_path()).pack, pack);
    const auto shot = read_png(given.screenshot);
    return shot ? shot->rgb : std::vector<std::uint8_t>();
  };
  const auto own = image_with(kBuiltinPack);
  const auto none = image_with(kNoPack);
  const auto client = image_with(jar.string());
  EXPECT_FALSE(client.empty());
  EXPECT_NE(own, none);
  EXPECT_NE(own, client);
  EXPECT_NE(none, client);
  EXPECT_EQ(image_with(folder_.file("absent.jar").string()), own) << "Quoin's own pack, with a warning";
  // Packs of the command line have priority.
  given.uses_own_packs = true;
  given.load.packs = packs_for_images({jar});
  EXPECT_EQ(image_with(kNoPack), client);
  given.load.packs = {folder_.file("absent.jar")};
  EXPECT_FALSE(run_viewer(given));
}

TEST_F(ViewerTest, OpensDroppedFile) {
  ViewerOptions given = options(320, 240);
  const std::string file = std::exchange(given.file, {}).string();
  int asked = 0;
  const Status status = run_viewer(given, [&] {
    if (asked++ == 0) {
      SDL_Event drop{};
      drop.type = SDL_DROPFILE;
      drop.drop.file = SDL_strdup(file.c_str());
      SDL_PushEvent(&drop);
    }
    return false;
  });
  ASSERT_TRUE(status) << to_string(status.error());
  EXPECT_TRUE(std::filesystem::exists(given.screenshot));
}

SDL_Event key(SDL_Keycode code, bool is_down, int modifiers = 0) {
  SDL_Event event{};
  event.type = is_down ? SDL_KEYDOWN : SDL_KEYUP;
  event.key.keysym.sym = code;
  event.key.keysym.scancode = SDL_GetScancodeFromKey(code);
  event.key.keysym.mod = static_cast<Uint16>(modifiers);
  return event;
}

void press(SDL_Keycode code, int modifiers = 0) {
  for (const bool is_down : {true, false}) {
    SDL_Event event = key(code, is_down, modifiers);
    SDL_PushEvent(&event);
  }
}

SDL_Event button(bool is_down, int x, int y, int clicks) {
  SDL_Event event{};
  event.type = is_down ? SDL_MOUSEBUTTONDOWN : SDL_MOUSEBUTTONUP;
  event.button = {event.type,
                  0,
                  0,
                  0,
                  SDL_BUTTON_LEFT,
                  static_cast<Uint8>(is_down ? SDL_PRESSED : SDL_RELEASED),
                  static_cast<Uint8>(clicks),
                  0,
                  x,
                  y};
  return event;
}

void click(int x, int y, int clicks) {
  SDL_Event motion{};
  motion.type = SDL_MOUSEMOTION;
  motion.motion.x = x;
  motion.motion.y = y;
  SDL_PushEvent(&motion);
  for (const bool is_down : {true, false}) {
    SDL_Event event = button(is_down, x, y, clicks);
    SDL_PushEvent(&event);
  }
}

bool is_open(const std::string& file) {
  for (Uint32 id = 1; id < 1000; ++id) {
    SDL_Window* const window = SDL_GetWindowFromID(id);
    if (window != nullptr && std::string(SDL_GetWindowTitle(window)).starts_with(file)) return true;
  }
  return false;
}

/// Ends a viewer that never reaches the state that a test waits for.
class Deadline {
 public:
  [[nodiscard]] bool is_over() const { return std::chrono::steady_clock::now() > end_; }

 private:
  std::chrono::steady_clock::time_point end_ = std::chrono::steady_clock::now() + std::chrono::seconds(200);
};

// The keys for the mode and for saving the image arrive within one frame.
TEST_F(ViewerTest, SavesImageOfJustChosenMode) {
  ViewerOptions given = options(320, 240);
  given.screenshot.clear();
  const WorkingFolder inside(folder_.file(""));
  const auto marched = folder_.file("hill-1.png");
  const auto traced = folder_.file("hill-2.png");
  const Deadline deadline;
  bool has_asked = false;
  bool has_asked_before = false;
  const Status status = run_viewer(given, [&] {
    if (!std::filesystem::exists(marched)) {
      if (is_open("hill.vox") && !std::exchange(has_asked_before, true)) press(SDLK_F12);
    } else if (!std::exchange(has_asked, true)) {
      press(SDLK_F3);
      press(SDLK_F12);
    }
    return std::filesystem::exists(traced) || deadline.is_over();
  });
  ASSERT_TRUE(status) << to_string(status.error());
  const auto shot = read_png(traced);
  ASSERT_TRUE(shot) << "nothing was saved";
  const auto document = Document::open(given.file);
  ASSERT_TRUE(document);
  const Scene& scene = (*document)->scene();
  ViewRequest request;
  request.mode = DrawMode::Paths;
  request.light = natural_light();
  const auto image = PathTracer(scene).render(frame_scene(scene, View::Iso, 320.0 / 240.0),
                                              path_options(request, 320, 240, kPathSamples, scene.bounds()));
  ASSERT_TRUE(image);
  EXPECT_EQ(shot->rgb, develop(*image, develop_options(request)).value().rgb);
}

/// Sets HOME to a folder during its lifetime.
class HomeFolder {
 public:
  explicit HomeFolder(const std::filesystem::path& home) {
    if (const char* const before = std::getenv("HOME")) before_ = before;
    ::setenv("HOME", home.c_str(), 1);
  }
  HomeFolder(const HomeFolder&) = delete;
  HomeFolder& operator=(const HomeFolder&) = delete;
  ~HomeFolder() { ::setenv("HOME", before_.c_str(), 1); }

 private:
  std::string before_;
};

/// Opens a file and chooses the only client in the menu Blocks. If `image` is not empty, then saves an image, which
/// must get that name.
Status choose_client(const ViewerOptions& given, const std::filesystem::path& image = {}) {
  using std::chrono::milliseconds;
  // The menu and its item with the usual font, and with others.
  constexpr std::array<std::array<int, 2>, 4> kPlaces{{{163, 88}, {163, 95}, {150, 85}, {180, 100}}};
  std::size_t clicks = 0;
  bool has_asked = false;
  auto start = std::chrono::steady_clock::now();
  const Deadline deadline;
  return run_viewer(given, [&] {
    if (clicks == 0 && !is_open(given.file.filename().string())) start = std::chrono::steady_clock::now();
    const auto passed = std::chrono::steady_clock::now() - start;
    if (clicks < 2 * kPlaces.size() && passed > milliseconds(300) * (clicks + 1)) {
      const auto [x, y] = kPlaces.at(clicks / 2);
      click(x, clicks++ % 2 == 0 ? 11 : y, 1);
    }
    const bool is_late = passed > milliseconds(300) * (2 * kPlaces.size() + 6);
    if (is_late && !image.empty() && !std::exchange(has_asked, true)) press(SDLK_F12);
    return (is_late && (image.empty() || std::filesystem::exists(image))) || deadline.is_over();
  });
}

TEST_F(ViewerTest, OffersInstalledClients) {
  ::setenv("XDG_CONFIG_HOME", folder_.file("config").c_str(), 1);
  const HomeFolder home(folder_.file("home"));
  const auto jar = install_client(folder_);
  ViewerOptions given = options(640, 400);
  given.file = write_house(folder_);
  given.is_bare = false;
  given.screenshot.clear();
  const Status status = choose_client(given);
  ASSERT_TRUE(status) << to_string(status.error());
  EXPECT_EQ(read_settings(settings_path()).pack, jar.string());
}

TEST_F(ViewerTest, ReadsSceneFilesAgainForAnotherPack) {
  ::setenv("XDG_CONFIG_HOME", folder_.file("config").c_str(), 1);
  const HomeFolder home(folder_.file("home"));
  const WorkingFolder inside(folder_.file(""));
  const auto jar = install_client(folder_);
  write_house(folder_);
  write_stone_pack(folder_, "textures", 16);
  std::filesystem::remove_all(folder_.file("textures/assets/minecraft/models"));
  std::filesystem::remove_all(folder_.file("textures/assets/minecraft/blockstates"));
  SceneFile file;
  file.sources.push_back({"house", "house.schem", {{"textures"}}});
  file.placements.push_back({.instance = {}, .source = "house"});
  ViewerOptions given = options(640, 400);
  given.file = folder_.file("scene.json");
  ASSERT_TRUE(write_scene_file(file, given.file));
  given.is_bare = false;
  given.screenshot.clear();
  // Returns an image after opening the file with the pack of the settings.
  const auto image_of = [&](const std::filesystem::path& path, const std::string& pack) {
    Settings settings;
    settings.pack = pack;
    EXPECT_TRUE(write_settings(settings, settings_path()));
    bool has_asked = false;
    const Deadline deadline;
    EXPECT_TRUE(run_viewer(given, [&] {
      if (is_open("scene.json") && !std::exchange(has_asked, true)) press(SDLK_F12);
      return std::filesystem::exists(path) || deadline.is_over();
    }));
    const auto image = read_png(path);
    EXPECT_TRUE(image);
    return image ? image->rgb : std::vector<std::uint8_t>();
  };
  const auto own = image_of(folder_.file("scene-1.png"), kBuiltinPack);
  ASSERT_TRUE(choose_client(given, folder_.file("scene-2.png")));
  const auto chosen = read_png(folder_.file("scene-2.png"));
  ASSERT_TRUE(chosen);
  EXPECT_EQ(read_settings(settings_path()).pack, jar.string());
  EXPECT_NE(chosen->rgb, own);
  EXPECT_EQ(chosen->rgb, image_of(folder_.file("scene-3.png"), jar.string())) << "as after opening it again";
}

// SDL detects double clicks, however long frames take.
TEST_F(ViewerTest, OpensDoubleClickedFile) {
  using std::chrono::milliseconds;
  const WorkingFolder inside(folder_.file(""));
  ::setenv("XDG_CONFIG_HOME", folder_.file("config").c_str(), 1);
  ViewerOptions given = options(480, 320);
  given.file.clear();
  given.is_bare = false;
  // Clicks within one frame, and clicks further apart than ImGui allows but SDL accepts.
  for (const milliseconds pause : {milliseconds(0), milliseconds(400)}) {
    std::filesystem::remove(given.screenshot);
    const auto start = std::chrono::steady_clock::now();
    int clicks = 0;
    const Status status = run_viewer(given, [&] {
      constexpr milliseconds kPause(800);
      // Rows tried: the file's with the usual font, then all from the bottom up; the last is just below the button.
      constexpr std::array kRows{115, 129, 122, 108, 101, 94, 87, 80, 73, 66};
      const auto row = static_cast<std::size_t>(clicks / 2);
      const int y = kRows.at(std::min(row, kRows.size() - 1));
      if (clicks == 0) press(SDLK_o, KMOD_CTRL);
      if (is_open("hill.vox")) return std::chrono::steady_clock::now() - start > std::chrono::seconds(60);
      const auto due = (clicks / 2 + 1) * kPause + (clicks % 2) * pause;
      if (std::chrono::steady_clock::now() - start < due) return false;
      click(240, y, 1 + clicks++ % 2);
      if (clicks % 2 == 1 && pause == milliseconds(0)) click(240, y, 1 + clicks++ % 2);
      return row >= kRows.size();
    });
    ASSERT_TRUE(status) << to_string(status.error());
    EXPECT_TRUE(std::filesystem::exists(given.screenshot)) << "clicks " << pause.count() << " ms apart open nothing";
  }
}

TEST_F(ViewerTest, EndsAtOnceWhenInterrupted) {
  ViewerOptions given = options(200, 100);
  given.screenshot.clear();
  int asked = 0;
  EXPECT_TRUE(run_viewer(given, [&asked] { return ++asked > 3; }));
  EXPECT_EQ(asked, 4);
}

TEST_F(ViewerTest, ReportsUnreadableAndUnwritableFiles) {
  ViewerOptions given = options(200, 100);
  given.file = folder_.file("absent.vox");
  const Status absent = run_viewer(given);
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().code, ErrorCode::CannotRead);
  given = options(200, 100);
  given.screenshot = folder_.file("no/folder/shot.png");
  const Status unwritable = run_viewer(given);
  ASSERT_FALSE(unwritable);
  EXPECT_EQ(unwritable.error().code, ErrorCode::CannotWrite);
}

TEST_F(ViewerTest, ReportsMissingDisplay) {
  ::setenv("SDL_VIDEODRIVER", "no_such_driver", 1);
  const Status status = run_viewer(options(200, 100));
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().message.find("no display"), std::string::npos) << status.error().message;
}

}  // namespace
}  // namespace quoin::viewer
