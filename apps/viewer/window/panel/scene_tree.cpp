#include "scene_tree.h"

#include <imgui.h>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "panels.h"

namespace quoin::viewer {

HiddenParts hidden_parts(const Scene& scene) {
  HiddenParts hidden;
  scene.layers().for_each([&](LayerHandle, const SceneLayer& layer) { hidden.layers += layer.visible ? 0 : 1; });
  scene.instances().for_each(
      [&](InstanceHandle, const Instance& instance) { hidden.instances += is_shown(scene, instance) ? 0 : 1; });
  return hidden;
}

void SceneTree::update(const Scene& scene) {
  const SceneChanges changes = scene.changes_since(cursor_);
  if (!changes.all && changes.instances.empty() && changes.groups.empty() && changes.layers.empty()) return;
  hidden_ = hidden_parts(scene);
  below_.clear();
  for (const GroupHandle group : groups_from_top(scene)) below_[parent_of(scene, group)].groups.push_back(group);
  scene.instances().for_each([&](InstanceHandle handle, const Instance& instance) {
    const bool is_below = scene.groups().find(instance.group) != nullptr;
    below_[is_below ? instance.group : GroupHandle{}].instances.push_back(handle);
  });
}

namespace {

/// A switch that the user clicked; applied once the list is drawn.
struct Switched {
  SceneNode node;
  bool is_visible = false;
};

class SceneList {
 public:
  SceneList(const Scene& scene, const SceneTree& tree) : scene_(scene), tree_(tree) {}

  void draw_layers() {
    if (scene_.layers().empty()) return;
    const HiddenParts& hidden = tree_.hidden();
    // Unfolded, because users look here for hidden parts.
    if (hidden.layers > 0) ImGui::SetNextItemOpen(true, ImGuiCond_Once);
    const auto all = static_cast<int>(scene_.layers().size());
    const bool is_open = hidden.layers > 0
                             ? ImGui::TreeNode("layers", "Layers (%d, %d hidden)", all, static_cast<int>(hidden.layers))
                             : ImGui::TreeNode("layers", "Layers (%d)", all);
    if (!is_open) return;
    int number = 0;
    for (const LayerHandle handle : scene_.layers().handles()) {
      const SceneLayer& layer = scene_.layers()[handle];
      ImGui::PushID(number);
      draw_switch(handle, layer.visible, true);
      ImGui::SameLine();
      draw_name(layer.name, "layer " + std::to_string(number));
      ImGui::PopID();
      ++number;
    }
    ImGui::TreePop();
  }

  void draw_below(GroupHandle group) {
    const SceneTree::Below* below = tree_.find(group);
    if (below == nullptr) return;
    for (const GroupHandle each : below->groups) draw_group(each);
    ImGuiListClipper clipper;  // there may be thousands
    const std::vector<InstanceHandle>& instances = below->instances;
    clipper.Begin(static_cast<int>(instances.size()));
    while (clipper.Step()) {
      for (int i = clipper.DisplayStart; i < clipper.DisplayEnd; ++i) {
        draw_instance(instances[static_cast<std::size_t>(i)]);
      }
    }
  }

  [[nodiscard]] const std::optional<Switched>& switched() const { return switched_; }

 private:
  /// `is_reached`: no parent hides the node.
  void draw_switch(const SceneNode& node, bool is_visible, bool is_reached) {
    bool is_on = is_visible;
    if (!is_reached) ImGui::PushStyleVar(ImGuiStyleVar_Alpha, 0.5F);
    if (ImGui::Checkbox("##shown", &is_on)) switched_ = Switched{node, is_on};
    if (!is_reached) ImGui::PopStyleVar();
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", is_reached ? "shown" : "hidden by a group or layer");
  }

  /// Draws the name, or a substitute in grey. A tooltip shows names that are cut off.
  static void draw_name(const std::string& name, const std::string& stands_for_it) {
    if (name.empty()) {
      ImGui::TextDisabled("%s", stands_for_it.c_str());
    } else {
      ImGui::TextUnformatted(name.c_str());
    }
    report_cut(name);
  }

  static void report_cut(const std::string& name) {
    const ImVec2 size = ImGui::CalcTextSize(name.c_str());
    const float end = ImGui::GetItemRectMax().x;
    const float room = ImGui::GetWindowPos().x + ImGui::GetWindowContentRegionMax().x;
    if (size.x > 0.0F && end > room && ImGui::IsItemHovered()) ImGui::SetTooltip("%s", name.c_str());
  }

  void draw_group(GroupHandle handle) {
    const SceneGroup& group = scene_.groups()[handle];
    ImGui::PushID(static_cast<int>(handle.index));
    // There may be thousands: groups that are folded and out of sight only reserve their space.
    const ImVec2 row{1.0F, ImGui::GetFrameHeight()};
    const bool is_folded = ImGui::GetStateStorage()->GetInt(ImGui::GetID("group")) == 0;
    if (is_folded && !ImGui::IsRectVisible(row)) {
      ImGui::Dummy(row);
    } else {
      draw_switch(handle, group.visible, is_shown(scene_, group) == group.visible);
      ImGui::SameLine();
      const char* name = group.name.empty() ? "group" : group.name.c_str();
      const bool is_open = ImGui::TreeNode("group", "%s", name);
      report_cut(group.name);
      if (is_open) {
        draw_below(handle);
        ImGui::TreePop();
      }
    }
    ImGui::PopID();
  }

  void draw_instance(InstanceHandle handle) {
    const Instance& instance = scene_.instances()[handle];
    ImGui::PushID("instance");
    ImGui::PushID(static_cast<int>(handle.index));
    draw_switch(handle, instance.visible, is_shown(scene_, instance) == instance.visible);
    ImGui::SameLine();
    const SceneGrid* grid = scene_.grids().find(instance.grid);
    const std::string& name = instance.name.empty() && grid != nullptr ? grid->name : instance.name;
    draw_name(name, "object " + std::to_string(handle.index));
    ImGui::PopID();
    ImGui::PopID();
  }

  const Scene& scene_;
  const SceneTree& tree_;
  std::optional<Switched> switched_;
};

}  // namespace

void draw_scene_part(ViewState& state) {
  const Scene& scene = state.scene();
  const bool says_something = scene.instances().size() > 1 || !scene.groups().empty() || !scene.layers().empty();
  if (!says_something) return;
  state.scene_tree.update(scene);
  const HiddenParts& hidden = state.scene_tree.hidden();
  if (!heading("Scene", !scene.groups().empty() || hidden.layers > 0 || hidden.instances > 0)) return;
  SceneList list(scene, state.scene_tree);
  const std::size_t layers = scene.layers().empty() ? 1 : 2 + (hidden.layers > 0 ? scene.layers().size() : 0);
  const std::size_t entries = scene.instances().size() + scene.groups().size() + layers;
  const auto rows = static_cast<float>(std::clamp<std::size_t>(entries, 4, 10));
  // Scrolls, because names can be long and groups deeply nested.
  ImGui::BeginChild("scene", {0.0F, rows * ImGui::GetFrameHeightWithSpacing()}, true,
                    ImGuiWindowFlags_HorizontalScrollbar);
  list.draw_layers();
  list.draw_below({});
  ImGui::EndChild();
  if (!list.switched() || !state.can_edit()) return;
  const ScenePause pause(*state.open.backend);
  state.stats.is_settled = false;
  state.edited_at = std::chrono::steady_clock::now();
  state.open.document->show(list.switched()->node, list.switched()->is_visible);
}

}  // namespace quoin::viewer
