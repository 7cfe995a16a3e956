#include "app.h"

namespace quoin::viewer {

const char* ViewState::why_not_drawn_as(DrawMode mode) const {
  if (!open.backend) return nullptr;
  if (!open.backend->can_draw(mode)) return "cannot draw meshes: no graphics device";
  if (mode != DrawMode::Density) return nullptr;
  bool has_field = false;
  scene().grids().for_each([&](GridHandle, const SceneGrid& grid) { has_field |= grid.field.chunk_count() != 0; });
  return has_field ? nullptr : "cannot draw a density slice: the scene has no density field";
}

void App::draw_as(DrawMode mode) {
  if (const char* const why = state_.why_not_drawn_as(mode)) return state_.report(why);
  state_.settings.mode = mode;
}

// Shows the levels of detail in colours, and restores the settings afterwards.
void App::show_detail(bool is_shown) {
  Settings& settings = state_.settings;
  if (is_shown) {
    before_detail_ = BeforeDetail{settings.mode, settings.detail_by_pixels};
    settings.detail_by_pixels = true;
    draw_as(DrawMode::Rays);
    state_.report(kDetailLegend);
  } else if (before_detail_) {
    settings.detail_by_pixels = before_detail_->by_pixels;
    draw_as(before_detail_->mode);
    before_detail_.reset();
  }
  settings.detail_colours = is_shown;
}

bool App::run_draw_command(Command command) {
  Settings& settings = state_.settings;
  const auto next = [](auto value, int count) {
    return static_cast<decltype(value)>((static_cast<int>(value) + 1) % count);
  };
  switch (command) {
    case Command::DrawRays:
      draw_as(DrawMode::Rays);
      return true;
    case Command::DrawBlocks:
      draw_as(DrawMode::Blocks);
      return true;
    case Command::DrawSmooth:
      draw_as(DrawMode::Smooth);
      return true;
    case Command::DrawDensity:
      draw_as(DrawMode::Density);
      return true;
    case Command::DrawPaths:
      draw_as(DrawMode::Paths);
      return true;
    case Command::NextWireframe:
      settings.wireframe = next(settings.wireframe, 3);
      break;
    case Command::NextShading:
      settings.light.shading = next(settings.light.shading, 5);
      return true;
    case Command::DetailColours:
      show_detail(!settings.detail_colours);
      return true;
    default:
      return false;
  }
  if (!has_meshes(settings.mode)) {
    state_.report("switched to blocky meshes: only meshes have triangle edges");
    draw_as(DrawMode::Blocks);
  }
  return true;
}

}  // namespace quoin::viewer
