#include <imgui.h>

#include <array>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "panels.h"

namespace quoin::viewer {

namespace {

/// Draws world-space lines over the image.
class WorldLines {
 public:
  WorldLines(const ViewState& state, ImDrawList& list) : state_(&state), list_(&list) {}

  void draw(DVec3 from, DVec3 to, ImU32 colour) const {
    const auto a = project(from);
    const auto b = project(to);
    if (!a || !b) return;
    // A light line on a dark one is visible on any background.
    list_->AddLine(*a, *b, IM_COL32(0, 0, 0, 130), 3.0F);
    list_->AddLine(*a, *b, colour, 1.5F);
  }

 private:
  [[nodiscard]] std::optional<ImVec2> project(DVec3 point) const {
    const Camera& camera = state_->camera.camera();
    const SDL_Rect& place = state_->image_place;
    const DVec3 offset = point - camera.position;
    const double ahead = glm::dot(offset, camera.forward);
    const bool is_perspective = camera.projection == Camera::Projection::Perspective;
    if (is_perspective && ahead < 1e-3) return std::nullopt;
    const double height =
        is_perspective ? 2.0 * ahead * std::tan(camera.vertical_fov_radians / 2.0) : camera.view_height;
    const double pixels = place.h / height;
    const double x = place.x + 0.5 * place.w + glm::dot(offset, camera.right) * pixels;
    const double y = place.y + 0.5 * place.h - glm::dot(offset, camera.up) * pixels;
    if (!(std::abs(x) < 1e5 && std::abs(y) < 1e5)) return std::nullopt;
    return ImVec2(static_cast<float>(x / state_->pixels_per_unit), static_cast<float>(y / state_->pixels_per_unit));
  }

  const ViewState* state_;
  ImDrawList* list_;
};

ImU32 colour_of(Tool tool) {
  switch (tool) {
    case Tool::Place:
      return IM_COL32(120, 230, 120, 255);
    case Tool::Remove:
      return IM_COL32(255, 110, 100, 255);
    case Tool::Paint:
      return IM_COL32(255, 210, 90, 255);
    case Tool::Smooth:
      return IM_COL32(110, 190, 255, 255);
    case Tool::Flatten:
      return IM_COL32(210, 150, 255, 255);
    case Tool::Look:
      break;
  }
  return IM_COL32(255, 255, 255, 200);
}

void draw_box(const WorldLines& lines, const Instance& instance, const SceneGrid& grid, const DBox& box, ImU32 colour) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 4; ++side) {
      DVec3 from = box.min;
      from[(axis + 1) % 3] = (side & 1) != 0 ? box.max[(axis + 1) % 3] : box.min[(axis + 1) % 3];
      from[(axis + 2) % 3] = (side & 2) != 0 ? box.max[(axis + 2) % 3] : box.min[(axis + 2) % 3];
      DVec3 to = from;
      to[axis] = box.max[axis];
      lines.draw(world_from_grid(instance, grid, from), world_from_grid(instance, grid, to), colour);
    }
  }
}

void draw_sphere(const WorldLines& lines, const Instance& instance, const SceneGrid& grid, DVec3 centre, double radius,
                 ImU32 colour) {
  constexpr int kSteps = 48;
  for (int axis = 0; axis < 3; ++axis) {
    const auto point = [&](int step) {
      const double angle = 2.0 * std::numbers::pi * step / kSteps;
      DVec3 on = centre;
      on[(axis + 1) % 3] += radius * std::cos(angle);
      on[(axis + 2) % 3] += radius * std::sin(angle);
      return world_from_grid(instance, grid, on);
    };
    for (int step = 0; step < kSteps; ++step) lines.draw(point(step), point(step + 1), colour);
  }
}

}  // namespace

void draw_outline(const ViewState& state) {
  if (!state.hover || !state.mouse.is_over) return;
  const Instance* instance = state.scene().instances().find(state.hover->instance);
  const SceneGrid* grid = instance == nullptr ? nullptr : state.scene().grids().find(instance->grid);
  if (grid == nullptr) return;
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  const auto unit = static_cast<float>(1.0 / state.pixels_per_unit);
  const SDL_Rect& place = state.image_place;
  list.PushClipRect({place.x * unit, place.y * unit}, {(place.x + place.w) * unit, (place.y + place.h) * unit});
  const WorldLines lines(state, list);
  const ImU32 colour = colour_of(state.tool);
  const bool is_brush = state.tool != Tool::Look;
  const IVec3 voxel = state.tool == Tool::Place ? target_of(BrushAction::Place, state.hover->voxel, state.hover->face)
                                                : state.hover->voxel;
  const int radius = is_brush ? state.brush.radius : 0;
  if (const auto surface = SurfacePlace::of(*state.hover, *instance, *grid)) {
    const double reach = sculpt_radius(state.brush);
    if (state.brush.shape == BrushShape::Box) {
      draw_box(lines, *instance, *grid, {surface->point - reach, surface->point + reach}, colour);
    } else {
      draw_sphere(lines, *instance, *grid, surface->point, reach, colour);
    }
  } else if (is_brush && state.brush.shape == BrushShape::Sphere && radius > 0) {
    draw_sphere(lines, *instance, *grid, DVec3(voxel) + 0.5, radius + 0.5, colour);
  } else {
    draw_box(lines, *instance, *grid, {DVec3(voxel - radius), DVec3(voxel + radius + 1)}, colour);
  }
  list.PopClipRect();
}

}  // namespace quoin::viewer
