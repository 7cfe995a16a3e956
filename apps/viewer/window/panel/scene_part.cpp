#include <imgui.h>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "panel_parts.h"

namespace quoin::viewer {

namespace {

/// What the user switched, if anything: done once the list is drawn.
struct Switched {
  SceneNode node;
  bool is_visible = false;
};

class SceneList {
 public:
  SceneList(const Scene& scene, const SceneTree& tree) : scene_(scene), tree_(tree) {}

  void draw_layers() {
    if (scene_.layers().empty()) return;
    if (!ImGui::TreeNode("layers", "Layers (%d)", static_cast<int>(scene_.layers().size()))) return;
    int number = 0;
    for (const LayerHandle handle : scene_.layers().handles()) {
      const SceneLayer& layer = scene_.layers()[handle];
      ImGui::PushID(number);
      draw_switch(handle, layer.visible, true);
      ImGui::SameLine();
      if (layer.name.empty()) {
        ImGui::TextDisabled("layer %d", number);
      } else {
        ImGui::TextUnformatted(layer.name.c_str());
      }
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
  /// `is_reached`: nothing above hides it.
  void draw_switch(const SceneNode& node, bool is_visible, bool is_reached) {
    bool is_on = is_visible;
    if (!is_reached) ImGui::PushStyleVar(ImGuiStyleVar_Alpha, 0.5F);
    if (ImGui::Checkbox("##shown", &is_on)) switched_ = Switched{node, is_on};
    if (!is_reached) ImGui::PopStyleVar();
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", is_reached ? "shown" : "hidden by what it belongs to");
  }

  void draw_group(GroupHandle handle) {
    const SceneGroup& group = scene_.groups()[handle];
    ImGui::PushID(static_cast<int>(handle.index));
    draw_switch(handle, group.visible, is_shown(scene_, group) == group.visible);
    ImGui::SameLine();
    const char* name = group.name.empty() ? "group" : group.name.c_str();
    if (ImGui::TreeNode("group", "%s", name)) {
      draw_below(handle);
      ImGui::TreePop();
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
    if (name.empty()) {
      ImGui::TextDisabled("object %u", handle.index);
    } else {
      ImGui::TextUnformatted(name.c_str());
    }
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
  if (!says_something || !heading("Scene", !scene.groups().empty())) return;
  state.scene_tree.update(scene);
  SceneList list(scene, state.scene_tree);
  const std::size_t entries = scene.instances().size() + scene.groups().size() + (scene.layers().empty() ? 1 : 2);
  const auto rows = static_cast<float>(std::clamp<std::size_t>(entries, 4, 10));
  ImGui::BeginChild("scene", {0.0F, rows * ImGui::GetFrameHeightWithSpacing()}, true);
  list.draw_layers();
  list.draw_below({});
  ImGui::EndChild();
  if (!list.switched() || !state.can_edit()) return;
  const ScenePause pause(*state.open.backend);
  state.stats.is_settled = false;
  state.open.document->show(list.switched()->node, list.switched()->is_visible);
}

}  // namespace quoin::viewer
