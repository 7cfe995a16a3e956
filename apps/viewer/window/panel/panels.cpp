#include "panels.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>

#include <glm/geometric.hpp>

namespace quoin::viewer {
namespace {

void menu_item(Command command, MenuChoice& choice, bool is_enabled = true, bool is_checked = false) {
  const CommandInfo& info = info_of(command);
  if (ImGui::MenuItem(info.name, info.keys, is_checked, is_enabled)) choice.commands.push_back(command);
}

/// Closes the current menu on Escape.
void close_on_escape() {
  if (ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape))) ImGui::CloseCurrentPopup();
}

void draw_file_menu(const ViewState& state, MenuChoice& choice) {
  if (!ImGui::BeginMenu("File")) return;
  close_on_escape();
  menu_item(Command::Open, choice);
  if (ImGui::BeginMenu("Open recent", !state.settings.recent.empty())) {
    for (const std::string& file : state.settings.recent) {
      if (ImGui::MenuItem(file.c_str())) choice.recent = file;
    }
    ImGui::EndMenu();
  }
  ImGui::Separator();
  menu_item(Command::Save, choice, state.can_edit());
  menu_item(Command::SaveAs, choice, state.can_edit());
  menu_item(Command::Screenshot, choice, state.open.backend != nullptr);
  ImGui::Separator();
  menu_item(Command::Quit, choice);
  ImGui::EndMenu();
}

void draw_edit_menu(const ViewState& state, MenuChoice& choice) {
  if (!ImGui::BeginMenu("Edit")) return;
  close_on_escape();
  const EditHistory& history = state.open.document->history();
  menu_item(Command::Undo, choice, state.can_edit() && history.can_undo());
  menu_item(Command::Redo, choice, state.can_edit() && history.can_redo());
  ImGui::Separator();
  for (const Command command : {Command::ToolLook, Command::ToolPlace, Command::ToolRemove, Command::ToolPaint,
                                Command::ToolSmooth, Command::ToolFlatten}) {
    const int index = static_cast<int>(command) - static_cast<int>(Command::ToolLook);
    menu_item(command, choice, true, static_cast<int>(state.tool) == index);
  }
  ImGui::Separator();
  for (const Command command : {Command::BrushSmaller, Command::BrushLarger, Command::BrushShape, Command::PickType}) {
    menu_item(command, choice);
  }
  ImGui::EndMenu();
}

void draw_view_menu(const ViewState& state, MenuChoice& choice) {
  if (!ImGui::BeginMenu("View")) return;
  close_on_escape();
  for (const Command command : {Command::ViewIso, Command::ViewFront, Command::ViewBack, Command::ViewLeft,
                                Command::ViewRight, Command::ViewTop}) {
    menu_item(command, choice, state.open.backend != nullptr);
  }
  ImGui::Separator();
  for (const Command command :
       {Command::DrawRays, Command::DrawBlocks, Command::DrawSmooth, Command::DrawDensity, Command::DrawPaths}) {
    const int index = static_cast<int>(command) - static_cast<int>(Command::DrawRays);
    menu_item(command, choice, state.open.backend != nullptr, static_cast<int>(state.settings.mode) == index);
  }
  menu_item(Command::NextWireframe, choice, true,
            has_meshes(state.settings.mode) && state.settings.wireframe != Wireframe::Off);
  menu_item(Command::NextShading, choice, true, state.settings.light.shading != Shading::Lit);
  menu_item(Command::DetailColours, choice, true, state.settings.detail_colours);
  ImGui::Separator();
  menu_item(Command::CameraMode, choice);
  menu_item(Command::Focus, choice);
  menu_item(Command::Panel, choice, true, state.settings.is_panel_shown);
  ImGui::EndMenu();
}

/// Returns the name of a pack in the menu: the version of an installed client, else its file name.
std::string pack_label(const ViewState& state, const std::string& pack) {
  if (state.clients) {
    const auto same = [&](const InstalledClient& client) { return client.jar == pack; };
    const auto found = std::ranges::find_if(*state.clients, same);
    if (found != state.clients->end()) return "Minecraft " + found->version;
  }
  return std::filesystem::path(pack).filename().string();
}

/// Draws the menu of resource packs: none, Quoin's own, and installed clients, the newest first.
void draw_pack_menu(ViewState& state, MenuChoice& choice) {
  if (!ImGui::BeginMenu("Blocks")) return;
  close_on_escape();
  if (!state.clients) state.clients = find_clients(usual_client_folders());
  const std::string& now = state.settings.pack;
  const bool is_enabled = state.can_choose_pack();
  bool has_current = state.has_named_packs;
  const auto item = [&](const std::string& label, const std::string& pack) {
    const bool is_current = !state.has_named_packs && now == pack;
    has_current |= is_current;
    if (ImGui::MenuItem(label.c_str(), nullptr, is_current, is_enabled)) choice.pack = pack;
    if (pack != kBuiltinPack && pack != kNoPack && ImGui::IsItemHovered()) ImGui::SetTooltip("%s", pack.c_str());
  };
  if (state.has_named_packs) ImGui::MenuItem("As on the command line", nullptr, true, false);
  item("Quoin's own pack", kBuiltinPack);
  item("None", kNoPack);
  ImGui::Separator();
  for (const InstalledClient& client : *state.clients) item("Minecraft " + client.version, client.jar.string());
  if (state.clients->empty()) ImGui::TextDisabled("no installed client of Minecraft found");
  if (!has_current) item(pack_label(state, now), now);
  if (state.open.document->world() != nullptr) {
    ImGui::Separator();
    ImGui::TextDisabled("this world stores its looks; a choice applies to the next file");
  }
  ImGui::EndMenu();
}

/// Returns the mode's label in the menu.
const char* mode_name(DrawMode mode) {
  return info_of(static_cast<Command>(static_cast<int>(Command::DrawRays) + static_cast<int>(mode))).name;
}

std::string hover_text(const ViewState& state) {
  if (state.loader) return state.loader->stage() + " " + state.loader->path().filename().string();
  if (!state.hover) return state.open.backend ? "" : "no file";
  const SceneHit& hit = *state.hover;
  const Instance* instance = state.scene().instances().find(hit.instance);
  if (instance == nullptr) return "";
  const SceneGrid* grid = state.scene().grids().find(instance->grid);
  if (grid == nullptr) return "";
  const VoxelType type = hit.in_field ? hit.type : grid->grid.get(hit.voxel);
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "%s %d, %d, %d   type %d", hit.in_field ? "sample" : "voxel", hit.voxel.x,
                hit.voxel.y, hit.voxel.z, type);
  std::string line = text.data();
  if (const std::uint32_t word = hit.in_field ? 0 : grid->grid.data(hit.voxel).state; word != 0) {
    line += " state " + std::to_string(word);
  }
  if (type < state.scene().types.size() && type != kAir) {
    const VoxelProperties& properties = state.scene().types[type];
    const Rgba8 colour = properties.colour;
    std::snprintf(text.data(), text.size(), " #%02X%02X%02X", colour.r, colour.g, colour.b);
    line += text.data();
    if (!properties.name.empty()) line += " " + properties.name;
  }
  const std::string& name = instance->name.empty() ? grid->name : instance->name;
  return name.empty() ? line : line + "   in " + name;
}

std::string image_text(const ViewState& state) {
  if (!state.open.backend) return "";
  if (std::string activity = state.open.backend->activity(); !activity.empty()) return activity;
  const FrameStats& stats = state.stats;
  if (stats.is_settled) return "done";
  if (stats.width < state.image_place.w) return "drawing";
  return "refining (" + std::to_string(stats.samples) + ")";
}

ImGuiWindowFlags bar_flags() {
  return ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
         ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus;
}

}  // namespace

float draw_menu(ViewState& state, MenuChoice& choice) {
  if (!ImGui::BeginMainMenuBar()) return 0.0F;
  draw_file_menu(state, choice);
  draw_edit_menu(state, choice);
  draw_view_menu(state, choice);
  draw_pack_menu(state, choice);
  if (ImGui::BeginMenu("Help")) {
    close_on_escape();
    menu_item(Command::Help, choice, true, state.is_help_shown);
    ImGui::EndMenu();
  }
  const float height = ImGui::GetWindowSize().y;
  ImGui::EndMainMenuBar();
  return height;
}

float draw_status(const ViewState& state) {
  const ImVec2 room = ImGui::GetIO().DisplaySize;
  const float height = ImGui::GetTextLineHeight() + 10.0F;
  ImGui::SetNextWindowPos({0.0F, room.y - height});
  ImGui::SetNextWindowSize({room.x, height});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {10.0F, 5.0F});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, {1.0F, 1.0F});
  ImGui::PushStyleColor(ImGuiCol_WindowBg, ImGui::GetStyleColorVec4(ImGuiCol_MenuBarBg));
  ImGui::Begin("status", nullptr, bar_flags());
  ImGui::TextUnformatted(hover_text(state).c_str());
  std::string right = image_text(state) + "   orbit";
  if (state.camera.mode == CameraMode::Fly) {
    std::array<char, 64> speed{};
    std::snprintf(speed.data(), speed.size(), "   fly, %.3g voxels per second", state.camera.speed());
    right = image_text(state) + speed.data();
  }
  if (state.camera.mode == CameraMode::Walk) {
    std::array<char, 64> body{};
    std::snprintf(body.data(), body.size(), "   walk, %.3g voxels tall", state.walker.height());
    right = image_text(state) + body.data();
  }
  // Face counts of a world would cover only the loaded chunks.
  const WorldWindow* const world = state.open.document->world();
  const std::string faces = (world ? world->text() : to_string(state.open.document->faces())) + "   ";
  const auto width = [](const std::string& text) { return ImGui::CalcTextSize(text.c_str()).x; };
  if (width(hover_text(state)) + width(faces + right) + 48.0F < room.x) right.insert(0, faces);
  ImGui::SameLine(room.x - ImGui::CalcTextSize(right.c_str()).x - 12.0F);
  ImGui::TextDisabled("%s", right.c_str());
  ImGui::End();
  ImGui::PopStyleColor();
  ImGui::PopStyleVar(2);
  return height;
}

float draw_panel(ViewState& state, float scale, float top, float bottom, MenuChoice& choice) {
  const ImVec2 room = ImGui::GetIO().DisplaySize;
  const float width = std::min(272.0F * scale, 0.6F * room.x);
  ImGui::SetNextWindowPos({room.x - width, top});
  ImGui::SetNextWindowSize({width, std::max(room.y - top - bottom, 1.0F)});
  ImGui::Begin("panel", nullptr, bar_flags() & ~ImGuiWindowFlags_NoScrollbar);
  ImGui::PushItemWidth(-0.36F * width);
  draw_tool_part(state, choice);
  draw_scene_part(state);
  draw_image_part(state);
  draw_camera_part(state, choice);
  draw_light_part(state);
  draw_statistics_part(state);
  ImGui::PopItemWidth();
  ImGui::End();
  return width;
}

void draw_help(ViewState& state, float scale) {
  if (!state.is_help_shown) return;
  if (ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape))) state.is_help_shown = false;
  const ImVec2 room = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({room.x * 0.5F, room.y * 0.5F}, ImGuiCond_Appearing, {0.5F, 0.5F});
  ImGui::SetNextWindowSizeConstraints({0.0F, 0.0F}, {room.x - 8.0F, room.y - 8.0F});
  const ImGuiWindowFlags flags =
      ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_HorizontalScrollbar;
  if (ImGui::Begin("Keys and mouse", &state.is_help_shown, flags)) draw_help_table(scale);
  ImGui::End();
}

void draw_message(ViewState& state, float bottom) {
  const Message& message = *state.message;
  const float unit = static_cast<float>(1.0 / state.pixels_per_unit);
  const SDL_Rect& place = state.image_place;
  const float middle = (static_cast<float>(place.x) + 0.5F * static_cast<float>(place.w)) * unit;
  ImGui::SetNextWindowPos({middle, ImGui::GetIO().DisplaySize.y - bottom - 12.0F}, ImGuiCond_Always, {0.5F, 1.0F});
  ImGui::SetNextWindowBgAlpha(0.92F);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 6.0F);
  const ImVec4 colour = message.is_error ? ImVec4{0.45F, 0.13F, 0.12F, 1.0F} : ImVec4{0.16F, 0.2F, 0.27F, 1.0F};
  ImGui::PushStyleColor(ImGuiCol_WindowBg, colour);
  ImGui::Begin("message", nullptr,
               bar_flags() | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoFocusOnAppearing);
  ImGui::PushTextWrapPos(std::max(static_cast<float>(place.w) * unit - 60.0F, 120.0F));
  ImGui::TextUnformatted(message.text.c_str());
  ImGui::PopTextWrapPos();
  const bool is_clicked = ImGui::IsWindowHovered() && ImGui::IsMouseClicked(ImGuiMouseButton_Left);
  ImGui::End();
  ImGui::PopStyleColor();
  ImGui::PopStyleVar();
  if (is_clicked) state.message.reset();
}

void draw_progress(ViewState& state, float scale, float top) {
  constexpr std::chrono::milliseconds kShort{250};  // shorter notes would only flicker
  const bool has_image = state.open.backend != nullptr && state.stats.width > 0;
  const bool is_stand_in = has_image && state.image.mode != state.settings.mode;
  const auto progress = has_image ? state.open.backend->progress() : std::nullopt;
  if (!is_stand_in && !progress) {
    state.waiting_since.reset();
    return;
  }
  const auto now = std::chrono::steady_clock::now();
  if (!state.waiting_since) state.waiting_since = now;
  if (now - *state.waiting_since < kShort) return;
  const auto unit = static_cast<float>(1.0 / state.pixels_per_unit);
  const SDL_Rect& place = state.image_place;
  const float middle = (static_cast<float>(place.x) + 0.5F * static_cast<float>(place.w)) * unit;
  ImGui::SetNextWindowPos({middle, top + 12.0F}, ImGuiCond_Always, {0.5F, 0.0F});
  ImGui::SetNextWindowBgAlpha(0.92F);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 6.0F);
  ImGui::Begin("progress", nullptr,
               bar_flags() | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoFocusOnAppearing |
                   ImGuiWindowFlags_NoInputs);
  const std::string activity = state.open.backend->activity();
  ImGui::Text("%s: %s", mode_name(state.settings.mode), activity.empty() ? "drawing" : activity.c_str());
  if (progress) ImGui::ProgressBar(static_cast<float>(*progress), {220.0F * scale, 6.0F * scale}, "");
  if (is_stand_in) ImGui::TextDisabled("shown meanwhile: %s", mode_name(state.image.mode));
  ImGui::End();
  ImGui::PopStyleVar();
}

void draw_welcome(const ViewState& state, MenuChoice& choice) {
  const float unit = static_cast<float>(1.0 / state.pixels_per_unit);
  const SDL_Rect& place = state.image_place;
  ImGui::SetNextWindowPos({(static_cast<float>(place.x) + 0.5F * static_cast<float>(place.w)) * unit,
                           (static_cast<float>(place.y) + 0.5F * static_cast<float>(place.h)) * unit},
                          ImGuiCond_Always, {0.5F, 0.5F});
  ImGui::SetNextWindowBgAlpha(0.0F);
  ImGui::Begin("welcome", nullptr, bar_flags() | ImGuiWindowFlags_AlwaysAutoResize);
  ImGui::TextUnformatted("Drop a file here, or open one.");
  ImGui::Spacing();
  if (ImGui::Button("Open a file (Ctrl+O)")) choice.commands.push_back(Command::Open);
  for (const std::string& file : state.settings.recent) {
    std::string label = std::filesystem::path(file).filename().string();
    label.append("##").append(file);
    if (ImGui::Selectable(label.c_str())) choice.recent = file;
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", file.c_str());
  }
  ImGui::End();
}

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

/// Returns the shape of the voxel under the mouse, or of the one that the tool would place in front of it (null: a
/// cube). A placed shape is shown without connections to its neighbours.
const ShapeModel* outlined_shape(const ViewState& state, const Instance& instance, const SceneGrid& grid) {
  const SceneHit& hit = *state.hover;
  const VoxelRegistry& types = state.scene().types;
  if (state.tool != Tool::Place) return shape_at(grid.grid, types, hit.voxel);
  Brush brush = state.brush;
  brush.action = BrushAction::Place;
  if (!types.is_shaped(brush.type)) return nullptr;
  const SDL_Rect& place = state.image_place;
  const Ray ray = ray_through(state.camera.camera(), {state.mouse.x, state.mouse.y, place.w, place.h});
  const std::uint32_t voxel_state = state_of(brush, hit, ray.direction, instance, grid, types);
  const VoxelProperties& type = types[brush.type];
  const std::uint32_t position = position_number(hit.voxel + normal_of(hit.face)) % type.shapes.position_count();
  return &type.shapes.model(voxel_state, type.orientations.of(voxel_state),
                            {.position = static_cast<std::uint16_t>(position)});
}

void draw_shape(const WorldLines& lines, const Instance& instance, const SceneGrid& grid, IVec3 voxel,
                const ShapeModel& model, ImU32 colour) {
  for (const ModelFace& face : model.faces) {
    if (face.is_inner) continue;
    for (std::size_t i = 0; i < face.corners.size(); ++i) {
      const auto corner = [&](std::size_t number) {
        return world_from_grid(instance, grid, DVec3(voxel) + DVec3(face.corners[number % face.corners.size()]));
      };
      if (face.corners[i] != face.corners[(i + 1) % 4]) lines.draw(corner(i), corner(i + 1), colour);
    }
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
  } else if (const ShapeModel* const model = radius == 0 ? outlined_shape(state, *instance, *grid) : nullptr;
             model != nullptr && !model->faces.empty()) {
    draw_shape(lines, *instance, *grid, voxel, *model, colour);
  } else {
    draw_box(lines, *instance, *grid, {DVec3(voxel - radius), DVec3(voxel + radius + 1)}, colour);
  }
  list.PopClipRect();
}

}  // namespace quoin::viewer
