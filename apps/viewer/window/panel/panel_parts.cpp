#include "panels.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "viewer/settings.h"
#include "viewer/window/process_memory.h"

namespace quoin::viewer {

namespace {

bool command_button(Command command, const char* label, MenuChoice& choice) {
  const bool is_pressed = ImGui::Button(label);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s (%s)", info_of(command).name, info_of(command).keys);
  if (is_pressed) choice.commands.push_back(command);
  return is_pressed;
}

ImVec4 colour_of(const VoxelProperties& properties) {
  const Rgba8 c = properties.colour;
  return {static_cast<float>(c.r) / 255.0F, static_cast<float>(c.g) / 255.0F, static_cast<float>(c.b) / 255.0F, 1.0F};
}

void describe_type(const Scene& scene, VoxelType type) {
  const VoxelProperties& properties = scene.types[type];
  const Rgba8 c = properties.colour;
  ImGui::BeginTooltip();
  ImGui::Text("type %d   #%02X%02X%02X %s", type, c.r, c.g, c.b, properties.name.c_str());
  if (properties.visibility == Visibility::Transparent) ImGui::TextUnformatted("transparent");
  if (properties.emission > 0.0F) ImGui::TextUnformatted("glows");
  ImGui::EndTooltip();
}

void draw_palette(ViewState& state) {
  const Scene& scene = state.scene();
  if (scene.types.size() <= 1) {
    ImGui::TextDisabled("no types yet");
    return;
  }
  const float edge = ImGui::GetFrameHeight() * 0.78F;
  const float gap = 3.0F;
  const int across = std::max(1, static_cast<int>((ImGui::GetContentRegionAvail().x - 16.0F) / (edge + gap)));
  const std::size_t shown = std::min<std::size_t>(scene.types.size() - 1, 1'024);
  const int rows = static_cast<int>((shown + static_cast<std::size_t>(across) - 1) / static_cast<std::size_t>(across));
  const float height = static_cast<float>(std::min(rows, 6)) * (edge + gap) + 2.0F;
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {gap, gap});
  ImGui::BeginChild("palette", {0.0F, height});
  for (std::size_t i = 1; i <= shown; ++i) {
    const auto type = static_cast<VoxelType>(i);
    if ((i - 1) % static_cast<std::size_t>(across) != 0) ImGui::SameLine();
    ImGui::PushID(static_cast<int>(i));
    const ImGuiColorEditFlags flags = ImGuiColorEditFlags_NoTooltip | ImGuiColorEditFlags_NoDragDrop;
    if (ImGui::ColorButton("type", colour_of(scene.types[type]), flags, {edge, edge})) state.brush.choose(type);
    if (ImGui::IsItemHovered()) describe_type(scene, type);
    if (type == state.brush.type) {
      // Scrolls to a type that was chosen elsewhere.
      if (state.palette_shows != type) ImGui::SetScrollHereY();
      state.palette_shows = type;
      ImGui::GetWindowDrawList()->AddRect(ImGui::GetItemRectMin(), ImGui::GetItemRectMax(), IM_COL32_WHITE, 3.0F, 0,
                                          2.0F);
    }
    ImGui::PopID();
  }
  ImGui::EndChild();
  ImGui::PopStyleVar();
}

/// Draws a switch between turning to the face and the picked state, for types that their state turns.
void draw_turns(ViewState& state) {
  Brush& brush = state.brush;
  if (!state.scene().types.is_turned_by_state(brush.type)) return;
  ImGui::Checkbox("turn to the face", &brush.turns);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("off: places the state of the picked voxel");
  if (brush.turns) return;
  ImGui::SameLine();
  ImGui::TextDisabled("state %u", brush.state);
}

/// Selects a type of that colour for the brush. Pauses rendering, because the type registry is part of the scene.
void choose_new_type(ViewState& state, Rgba8 colour, float emission) {
  const ScenePause pause(*state.open.backend);
  state.stats.is_settled = false;
  const auto type = state.open.document->type_of_colour(colour, emission);
  if (!type) return state.report(type.error());
  state.brush.choose(*type);
  const char* what = emission > 0.0F ? "selected lamp type " : "selected colour type ";
  state.report(what + std::to_string(*type));
}

/// Draws the buttons that add a colour or a lamp to the palette.
void draw_new_colour(ViewState& state) {
  static constexpr const char* kPopup = "new colour";
  static std::array<float, 3> colour{0.8F, 0.5F, 0.3F};
  static float emission = 0.0F;
  if (ImGui::Button("New colour...") && state.can_edit()) ImGui::OpenPopup(kPopup);
  ImGui::SameLine();
  constexpr Rgba8 kTorch{255, 178, 90, 255};
  constexpr float kTorchEmission = 24.0F;
  if (ImGui::Button("Torch") && state.can_edit()) choose_new_type(state, kTorch, kTorchEmission);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("a voxel that lights its surroundings");
  if (!ImGui::BeginPopup(kPopup)) return;
  ImGui::ColorPicker3("##colour", colour.data(), ImGuiColorEditFlags_NoSidePreview);
  ImGui::SliderFloat("emits", &emission, 0.0F, 64.0F, emission > 0.0F ? "%.1f" : "nothing",
                     ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic);
  if (ImGui::Button("Add") && state.can_edit()) {
    const auto byte = [](float value) { return static_cast<std::uint8_t>(std::lround(value * 255.0F)); };
    choose_new_type(state, {byte(colour[0]), byte(colour[1]), byte(colour[2]), 255}, emission);
    ImGui::CloseCurrentPopup();
  }
  ImGui::EndPopup();
}

void row(const char* name, const char* format, double value) {
  ImGui::TextDisabled("%s", name);
  ImGui::SameLine(0.5F * ImGui::GetWindowWidth());
  ImGui::Text(format, value);
}

void draw_sun(Environment& environment, LightOptions& light, bool has_rays) {
  SunAngles sun = sun_angles(environment.sun.direction);
  auto azimuth = static_cast<float>(sun.azimuth);
  auto elevation = static_cast<float>(sun.elevation);
  const bool is_turned =
      ImGui::SliderFloat("azimuth", &azimuth, -180.0F, 180.0F, "%.0f°", ImGuiSliderFlags_AlwaysClamp);
  const double lowest = lowest_sun(environment);
  const bool is_raised = ImGui::SliderFloat("elevation", &elevation, static_cast<float>(lowest), 90.0F, "%.0f°",
                                            ImGuiSliderFlags_AlwaysClamp);
  if (is_turned || is_raised) {
    // At the zenith the azimuth would be lost.
    environment.sun.direction = sun_direction({azimuth, std::clamp(static_cast<double>(elevation), lowest, 89.5)});
  }
  bool follows_sun = environment.sky.model != SkyModel::Fixed;
  if (ImGui::Checkbox("sky follows the sun", &follows_sun)) {
    environment.sky.model = follows_sun ? SkyModel::Gradient : SkyModel::Fixed;
  }
  ImGui::Checkbox("glass mirrors the sky", &light.glass_surfaces);
  if (!has_rays && ImGui::IsItemHovered()) {
    ImGui::SetTooltip(
        "without a graphics card, glass in meshes is one voxel thick, and only smooth meshes mirror, until the view\n"
        "is still; ray marching (F5) shows all of it");
  }
}

void draw_file_cameras(const std::vector<FileCamera>& cameras, MenuChoice& choice) {
  if (cameras.empty()) return;
  ImGui::TextUnformatted("from the file:");
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (i % 5 != 0) ImGui::SameLine();
    ImGui::PushID(static_cast<int>(i));
    if (ImGui::SmallButton(std::to_string(cameras[i].number).c_str())) choice.camera = cameras[i].camera;
    ImGui::PopID();
  }
}

// Notes the missing light in images of meshes. Before the device has drawn, its abilities are unknown.
void report_plain_light(const ViewState& state) {
  if (!state.open.backend || state.open.backend->stats().empty()) return;
  if (state.open.backend->traces_light(state.settings.mode)) return;
  ImGui::TextWrapped(
      "Without a graphics card, smooth meshes of large scenes have no shadows, lamps or glass depth. Use F5 or F6.");
}

}  // namespace

bool heading(const char* name, bool is_open) {
  return ImGui::CollapsingHeader(name, is_open ? ImGuiTreeNodeFlags_DefaultOpen : ImGuiTreeNodeFlags_None);
}

void draw_tool_part(ViewState& state, MenuChoice& choice) {
  if (!heading("Tool")) return;
  constexpr std::array<std::pair<Tool, const char*>, 6> kTools = {{{Tool::Look, "Look"},
                                                                   {Tool::Place, "Place"},
                                                                   {Tool::Remove, "Remove"},
                                                                   {Tool::Paint, "Paint"},
                                                                   {Tool::Smooth, "Smooth"},
                                                                   {Tool::Flatten, "Flatten"}}};
  for (const auto& [tool, name] : kTools) {
    if (tool != Tool::Look && tool != Tool::Smooth) ImGui::SameLine(0.0F, 4.0F);
    const bool is_chosen = state.tool == tool;
    if (is_chosen) ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(ImGuiCol_ButtonActive));
    if (ImGui::Button(name)) state.tool = tool;
    if (is_chosen) ImGui::PopStyleColor();
  }
  int shape = static_cast<int>(state.brush.shape);
  if (ImGui::Combo("shape", &shape, "box\0sphere\0")) state.brush.shape = static_cast<BrushShape>(shape);
  ImGui::SliderInt("radius", &state.brush.radius, 0, kMaxBrush, "%d", ImGuiSliderFlags_AlwaysClamp);
  draw_palette(state);
  draw_new_colour(state);
  draw_turns(state);  // below the palette, which thus stays in its place
  const EditHistory& history = state.open.document->history();
  ImGui::BeginDisabled(!history.can_undo());
  command_button(Command::Undo, "Undo", choice);
  ImGui::EndDisabled();
  ImGui::SameLine();
  ImGui::BeginDisabled(!history.can_redo());
  command_button(Command::Redo, "Redo", choice);
  ImGui::EndDisabled();
}

void draw_camera_part(ViewState& state, MenuChoice& choice) {
  if (!heading("Camera")) return;
  constexpr std::array<std::pair<CameraMode, const char*>, 3> kModes = {
      {{CameraMode::Orbit, "orbit"}, {CameraMode::Fly, "fly"}, {CameraMode::Walk, "walk"}}};
  for (const auto& [mode, name] : kModes) {
    if (mode != CameraMode::Orbit) ImGui::SameLine();
    if (ImGui::RadioButton(name, state.camera.mode == mode)) state.set_camera_mode(mode);
  }
  constexpr std::array<std::pair<Command, const char*>, 6> kViews = {{{Command::ViewIso, "All"},
                                                                      {Command::ViewFront, "Front"},
                                                                      {Command::ViewBack, "Back"},
                                                                      {Command::ViewLeft, "Left"},
                                                                      {Command::ViewRight, "Right"},
                                                                      {Command::ViewTop, "Top"}}};
  for (std::size_t i = 0; i < kViews.size(); ++i) {
    if (i % 3 != 0) ImGui::SameLine();
    command_button(kViews[i].first, kViews[i].second, choice);
  }
  draw_file_cameras(state.open.document->loaded().cameras, choice);
}

void draw_slice_place(SlicePlane& slice) {
  ImGui::Combo("axis", &slice.axis, "x\0y\0z\0");
  auto at = static_cast<float>(slice.at);
  if (ImGui::SliderFloat("position", &at, 0.0F, 1.0F, "%.3f of the fields", ImGuiSliderFlags_AlwaysClamp)) {
    slice.at = static_cast<double>(at);
  }
}

void draw_image_part(ViewState& state) {
  if (!heading("Image")) return;
  Settings& settings = state.settings;
  int mode = static_cast<int>(settings.mode);
  if (ImGui::Combo("drawn as", &mode, "rays\0blocks\0smooth\0densities\0paths\0")) {
    const auto wanted = static_cast<DrawMode>(mode);
    const char* const why = state.why_not_drawn_as(wanted);
    why == nullptr ? void(settings.mode = wanted) : state.report(why);
  }
  if (settings.mode == DrawMode::Density) draw_slice_place(settings.slice);
  ImGui::Checkbox("coarser far away", &settings.detail_by_pixels);
  ImGui::BeginDisabled(!settings.detail_by_pixels);
  ImGui::SameLine();
  ImGui::Checkbox("in colours", &settings.detail_colours);
  ImGui::EndDisabled();
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", kDetailLegend);
  if (has_meshes(settings.mode)) {
    report_plain_light(state);
    int edges = static_cast<int>(settings.wireframe);
    if (ImGui::Combo("edges", &edges, "none\0over surfaces\0edges only\0")) {
      settings.wireframe = static_cast<Wireframe>(edges);
    }
  }
  constexpr std::array kSamples = {1, 4, 16, 64};
  const auto* const chosen = std::find(kSamples.begin(), kSamples.end(), state.settings.samples);
  int index = chosen == kSamples.end() ? -1 : static_cast<int>(chosen - kSamples.begin());
  if (ImGui::Combo("samples", &index, "1\0004\00016\00064\0")) {
    state.settings.samples = kSamples[static_cast<std::size_t>(index)];
  }
}

// Occlusion of smooth surfaces: from 27 density samples around a point.
void draw_smooth_occlusion(SmoothOcclusionOptions& options) {
  int form = static_cast<int>(options.method);
  if (ImGui::Combo("method", &form, "none\0share\0weighted\0weighted, published\0soft share\0")) {
    options.method = static_cast<SmoothOcclusion>(form);
  }
  ImGui::BeginDisabled(options.method == SmoothOcclusion::None);
  const ImGuiSliderFlags flags = ImGuiSliderFlags_AlwaysClamp;
  ImGui::SliderFloat("spread", &options.spread, 0.25F, 4.0F, "%.2f samples", flags);
  ImGui::EndDisabled();
  const bool is_weighted =
      options.method == SmoothOcclusion::Weighted || options.method == SmoothOcclusion::WeightedPublished;
  ImGui::BeginDisabled(!is_weighted);
  ImGui::SliderFloat("offset", &options.offset, 0.0F, 0.99F, "%.2f", flags);
  ImGui::SliderFloat("power", &options.power, 0.25F, 8.0F, "%.2f", flags | ImGuiSliderFlags_Logarithmic);
  ImGui::EndDisabled();
}

void draw_occlusion(LightOptions& light, bool has_rays) {
  int mode = static_cast<int>(light.occlusion_mode);
  if (ImGui::Combo("occlusion", &mode, "off\0ray-traced\0vertex\0smooth surfaces\0"))
    light.occlusion_mode = static_cast<OcclusionMode>(mode);
  if (!has_rays && ImGui::IsItemHovered()) ImGui::SetTooltip("meshes use vertex occlusion");
  ImGui::BeginDisabled(!has_rays || light.occlusion_mode != OcclusionMode::Rays);
  auto reach = static_cast<float>(light.occlusion_distance_voxels);
  if (ImGui::SliderFloat("ray length", &reach, 0.5F, 64.0F, "%.1f voxels",
                         ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic)) {
    light.occlusion_distance_voxels = reach;
  }
  ImGui::EndDisabled();
  ImGui::BeginDisabled(has_rays ? light.occlusion_mode != OcclusionMode::Smooth
                                : light.occlusion_mode == OcclusionMode::Off);
  draw_smooth_occlusion(light.smooth_occlusion);
  ImGui::EndDisabled();
}

// The end of the slider means any distance.
void draw_shadow_distance(LightOptions& light) {
  constexpr float kEnd = 4096.0F;
  const bool is_any = !(light.shadow_distance_voxels < static_cast<double>(kEnd));
  float reach = is_any ? kEnd : static_cast<float>(light.shadow_distance_voxels);
  if (ImGui::SliderFloat("shadow range", &reach, 1.0F, kEnd, is_any ? "any distance" : "%.0f voxels",
                         ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic)) {
    light.shadow_distance_voxels = reach < kEnd ? static_cast<double>(reach) : LightOptions{}.shadow_distance_voxels;
  }
}

void draw_brightness(const char* name, double& value, float most) {
  auto shown = static_cast<float>(value);
  if (ImGui::SliderFloat(name, &shown, 0.0F, most, "%.2f",
                         ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic)) {
    value = shown;
  }
}

void draw_lamps(Environment& environment, LightOptions& light, bool has_rays) {
  draw_brightness("sun", environment.sun.brightness, 4.0F);
  draw_brightness("sky", environment.sky.brightness, 4.0F);
  if (light.model == LightModel::Propagated) {
    draw_brightness("lamps", environment.lamp_brightness, 64.0F);
    draw_brightness("minimum", light.least_light, 1.0F);
    return;
  }
  ImGui::BeginDisabled(!has_rays);
  bool has_lamps = light.max_lamps > 0;
  if (ImGui::Checkbox("lamp light", &has_lamps)) light.max_lamps = has_lamps ? natural_light().max_lamps : 0;
  ImGui::BeginDisabled(light.max_lamps == 0);
  draw_brightness("lamps", environment.lamp_brightness, 64.0F);
  ImGui::EndDisabled();
  ImGui::EndDisabled();
}

void draw_light_part(ViewState& state) {
  if (!heading("Light")) return;
  LightOptions& light = state.settings.light;
  Environment& environment = state.environment();
  int shading = static_cast<int>(light.shading);
  if (ImGui::Combo("shading", &shading, "lit\0unlit\0unlit + occlusion\0occlusion only\0normals\0")) {
    light.shading = static_cast<Shading>(shading);
  }
  ImGui::BeginDisabled(light.shading == Shading::Unlit || light.shading == Shading::Normals);
  draw_occlusion(light, state.settings.mode == DrawMode::Rays);
  ImGui::EndDisabled();
  ImGui::BeginDisabled(light.shading != Shading::Lit);
  int model = static_cast<int>(light.model);
  if (ImGui::Combo("light", &model, "ray-traced\0propagated\0")) light.model = static_cast<LightModel>(model);
  const bool is_by_rays = light.model == LightModel::Rays;
  const bool has_shadows = is_by_rays && state.open.backend && state.open.backend->traces_light(state.settings.mode);
  ImGui::BeginDisabled(!has_shadows);
  bool shows_shadows = light.shadows && has_shadows;
  if (ImGui::Checkbox("shadows", &shows_shadows)) light.shadows = shows_shadows;
  ImGui::EndDisabled();
  if (is_by_rays && !has_shadows && ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) {
    ImGui::SetTooltip(
        "smooth meshes of large scenes need a graphics card for shadows; ray marching (F5) and blocks (F6)\n"
        "always have them");
  }
  ImGui::BeginDisabled(!is_by_rays);
  bool is_all = light.occlusion_affects == OcclusionAffects::All;
  if (ImGui::Checkbox("occlude all light", &is_all)) {
    light.occlusion_affects = is_all ? OcclusionAffects::All : OcclusionAffects::Ambient;
  }
  ImGui::EndDisabled();
  ImGui::BeginDisabled(!shows_shadows);
  draw_shadow_distance(light);
  ImGui::EndDisabled();
  draw_sun(environment, light, has_shadows || !is_by_rays);
  auto exposure = static_cast<float>(state.settings.exposure);
  if (ImGui::SliderFloat("exposure", &exposure, 0.1F, 4.0F, "%.2f",
                         ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic)) {
    state.settings.exposure = exposure;
  }
  draw_lamps(environment, light, has_shadows);
  ImGui::EndDisabled();
  if (ImGui::Button("Reset light")) {
    light = natural_light();
    environment = state.scene().environment.value_or(Environment::natural());
    state.settings.exposure = 1.0;
  }
}

namespace {

void draw_world_rows(const WorldWindow* world) {
  if (world == nullptr) return;
  const StreamStats& stats = world->stats();
  row("chunks in memory", "%.0f", static_cast<double>(stats.loaded_chunks));
  row("chunks loading", "%.0f", static_cast<double>(stats.missing_chunks));
  row("complete within", "%.0f voxels", stats.complete_radius);
  row("chunks read", "%.0f", static_cast<double>(stats.chunks_read));
  row("chunks generated", "%.0f", static_cast<double>(stats.chunks_made));
  row("chunks unloaded", "%.0f", static_cast<double>(stats.chunks_unloaded));
  row("world memory", "%.0f MB", static_cast<double>(stats.loaded_bytes + stats.other_bytes) / 1e6);
}

}  // namespace

void draw_statistics_part(const ViewState& state) {
  if (!heading("Statistics")) return;
  const FrameStats& stats = state.stats;
  row("frame", "%.1f ms", state.frame_seconds * 1e3);
  row("image", "%.1f ms", stats.seconds * 1e3);
  row("rays per second", "%.1f million",
      stats.seconds > 0.0 ? static_cast<double>(stats.rays) / stats.seconds / 1e6 : 0.0);
  row("samples per pixel", "%.0f", stats.samples);
  row("flight speed", "%.3g voxels/s", state.camera.speed());
  row("memory", "%.0f MB", resident_megabytes());
  row("history", "%.1f MB", static_cast<double>(state.open.document->history().bytes()) / 1e6);
  row("last edit wait", "%.2f ms", state.last_wait_seconds * 1e3);
  row("longest edit wait", "%.2f ms", state.longest_wait_seconds * 1e3);
  draw_world_rows(state.open.document->world());
  if (state.open.backend) {
    for (const auto& [what, value] : state.open.backend->stats()) {
      ImGui::TextDisabled("%s", what.c_str());
      ImGui::SameLine(0.5F * ImGui::GetWindowWidth());
      ImGui::TextUnformatted(value.c_str());
    }
  }
  // Wrapped, because device names are long.
  ImGui::TextDisabled("drawn by");
  ImGui::TextWrapped("%s", state.open.backend ? state.open.backend->name().c_str() : "-");
}

void draw_help_table(float scale) {
  constexpr std::array<std::pair<const char*, const char*>, 11> kMouse = {
      {{"Left button", "uses the tool; turns with Look or Alt"},
       {"Right button", "turns: around the point under the mouse, or in place"},
       {"Middle button", "moves sideways"},
       {"Shift + right button", "moves the sun"},
       {"Wheel", "orbit: distance; fly: speed; walk: body size"},
       {"W A S D or arrows", "forward, left, back, right"},
       {"Q E, space", "down, up; space jumps when walking"},
       {"Shift", "four times as fast"},
       {"Drop a file", "opens it"},
       {"Torch (F2)", "selects a voxel type that lights its surroundings"},
       {"Light (F2)", "sun, sky, lamps; range of occlusion and shadows"}}};
  const float column = 170.0F * scale;
  for (const auto& [what, does] : kMouse) {
    ImGui::TextUnformatted(what);
    ImGui::SameLine(column);
    ImGui::TextDisabled("%s", does);
  }
  ImGui::Separator();
  // In two columns, to fit small windows.
  if (!ImGui::BeginTable("keys", 4, ImGuiTableFlags_SizingFixedFit)) return;
  const auto all = commands();
  const std::size_t rows = (all.size() + 1) / 2;
  for (std::size_t i = 0; i < rows; ++i) {
    ImGui::TableNextRow();
    for (std::size_t side = 0; side < 2; ++side) {
      const std::size_t index = i + side * rows;
      if (index >= all.size()) continue;
      ImGui::TableNextColumn();
      ImGui::TextUnformatted(all[index].keys);
      ImGui::TableNextColumn();
      ImGui::TextDisabled("%s   ", all[index].name);
    }
  }
  ImGui::EndTable();
}

}  // namespace quoin::viewer
