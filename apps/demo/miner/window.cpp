// The game in a window.
#include <SDL.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>

#include "game.h"

namespace miner {
namespace {

using Clock = std::chrono::steady_clock;
using Draw = std::function<quoin::Result<quoin::RenderedImage>(const quoin::Camera&, const quoin::RenderOptions&)>;

// Renders with a graphics card or the processor.
quoin::Result<Draw> drawn_by(Game& game, const std::string& name) {
  const auto devices = quoin::vulkan_devices();
  const auto best = devices ? quoin::choose_vulkan_device(*devices, name) : devices.error();
  if (name == "cpu" || (name.empty() && (!best || (*devices)[*best].kind == "cpu"))) {
    auto processor = std::make_shared<quoin::CpuRenderer>(game.scene());
    processor->use_light(&game.light().shown());
    return Draw([processor](const quoin::Camera& camera, const quoin::RenderOptions& options) {
      processor->update();
      return processor->render(camera, options);
    });
  }
  auto made = quoin::VulkanRenderer::create({.device = name});
  if (!made) return made.error();
  auto card = std::make_shared<quoin::VulkanRenderer>(std::move(*made));
  card->use_light(&game.light().shown());
  return Draw([card, &game](const quoin::Camera& camera, const quoin::RenderOptions& options) {
    const quoin::Status updated = card->update(game.scene());
    return updated ? card->render(camera, options) : updated.error();
  });
}

void show(SDL_Window* window, quoin::Image& image) {
  SDL_Surface* const screen = SDL_GetWindowSurface(window);
  SDL_Surface* const rendered = SDL_CreateRGBSurfaceWithFormatFrom(image.rgb.data(), image.width, image.height, 24,
                                                                   3 * image.width, SDL_PIXELFORMAT_RGB24);
  SDL_BlitScaled(rendered, nullptr, screen, nullptr);
  SDL_FreeSurface(rendered);
  const SDL_Rect cross{screen->w / 2 - 2, screen->h / 2 - 2, 5, 5};
  SDL_FillRect(screen, &cross, ~Uint32{0});
  SDL_UpdateWindowSurface(window);
}

// Reads the input since the last frame. Returns false to quit.
bool take_events(Input& input) {
  for (SDL_Event event; SDL_PollEvent(&event) != 0;) {
    const SDL_Keycode key = event.type == SDL_KEYDOWN ? event.key.keysym.sym : 0;
    if (event.type == SDL_QUIT || key == SDLK_ESCAPE) return false;
    if (event.type == SDL_MOUSEMOTION) {
      input.yaw -= 0.003 * event.motion.xrel;
      input.pitch = std::clamp(input.pitch - 0.003 * event.motion.yrel, -1.57, 1.57);
    }
    const int button = event.type == SDL_MOUSEBUTTONDOWN ? event.button.button : 0;
    input.digs |= button == SDL_BUTTON_LEFT;
    input.places |= button == SDL_BUTTON_RIGHT;
    if (key >= SDLK_1 && key <= SDLK_3) input.torch = key - SDLK_1;
    input.slides |= key == SDLK_l;
    if (key == SDLK_HOME) input.pitch = 0.0;
  }
  const Uint8* held = SDL_GetKeyboardState(nullptr);
  const auto push = [&](SDL_Scancode plus, SDL_Scancode minus) { return double(held[plus]) - double(held[minus]); };
  input.ahead = push(SDL_SCANCODE_W, SDL_SCANCODE_S);
  input.aside = push(SDL_SCANCODE_D, SDL_SCANCODE_A);
  input.jumps = held[SDL_SCANCODE_SPACE] != 0;
  return true;
}

}  // namespace

quoin::Status play_in_window(Game& game, const std::string& device) {
  const auto draw = drawn_by(game, device);
  if (!draw) return draw.error();
  SDL_Init(SDL_INIT_VIDEO);
  SDL_Window* const window =
      SDL_CreateWindow("Miner", SDL_WINDOWPOS_UNDEFINED, SDL_WINDOWPOS_UNDEFINED, 960, 540, SDL_WINDOW_RESIZABLE);
  if (window == nullptr) return quoin::make_error(quoin::ErrorCode::Unsupported, SDL_GetError());
  SDL_SetRelativeMouseMode(SDL_TRUE);
  quoin::RenderOptions options;
  options.light.model = quoin::LightModel::Propagated;
  options.light.occlusion_mode = quoin::OcclusionMode::Vertex;
  options.light.least_light = 0.002;
  Input input;
  int coarse = 2;  // window pixels per image pixel
  const auto step = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(kFrame));
  auto last = Clock::now();
  while (take_events(input)) {
    // Steps for the elapsed time, at most six, because more would never be caught up.
    last = std::max(last, Clock::now() - 6 * step);
    for (int i = 0; i < 6 && Clock::now() - last > step; ++i, last += step) {
      game.step(input);
      input.digs = input.places = input.slides = false;
      input.torch = -1;
    }
    SDL_GetWindowSize(window, &options.width, &options.height);
    options.width = std::max(options.width / coarse, 1);
    options.height = std::max(options.height / coarse, 1);
    const auto began = Clock::now();
    auto image = (*draw)(game.camera(), options);
    if (!image) return image.error();
    const auto took = Clock::now() - began;
    coarse = std::clamp(coarse + int(took > 4 * step) - int(took < step), 1, 8);
    show(window, image->colour);
    SDL_SetWindowTitle(window, game.status().c_str());
  }
  SDL_Quit();
  return {};
}

}  // namespace miner
