#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "app.h"

namespace quoin::viewer {

namespace {

constexpr ImGuiWindowFlags kBox = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                                  ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_AlwaysAutoResize |
                                  ImGuiWindowFlags_NoScrollbar;

/// Begins a box in the middle of the window. Paired with end_box.
void begin_box(const char* name) {
  const ImVec2 room = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({room.x * 0.5F, room.y * 0.5F}, ImGuiCond_Always, {0.5F, 0.5F});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 6.0F);
  ImGui::PushStyleColor(ImGuiCol_WindowBg, ImGui::GetStyleColorVec4(ImGuiCol_PopupBg));
  ImGui::Begin(name, nullptr, kBox);
}

void end_box() {
  ImGui::End();
  ImGui::PopStyleColor();
  ImGui::PopStyleVar();
}

/// Begins a modal question in the middle of the window.
bool begin_question(const char* title) {
  if (!ImGui::IsPopupOpen(title)) ImGui::OpenPopup(title);
  const ImVec2 room = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({room.x * 0.5F, room.y * 0.5F}, ImGuiCond_Always, {0.5F, 0.5F});
  return ImGui::BeginPopupModal(title, nullptr, ImGuiWindowFlags_AlwaysAutoResize);
}

/// Draws a bar for work of unknown progress.
void waiting_bar(double seconds, float width) {
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float height = 6.0F;
  ImDrawList& list = *ImGui::GetWindowDrawList();
  list.AddRectFilled(at, {at.x + width, at.y + height}, ImGui::GetColorU32(ImGuiCol_FrameBg), 3.0F);
  const auto swing = static_cast<float>(0.5 - 0.5 * std::cos(2.5 * seconds));
  const float left = at.x + swing * 0.7F * width;
  list.AddRectFilled({left, at.y}, {left + 0.3F * width, at.y + height}, ImGui::GetColorU32(ImGuiCol_PlotHistogram),
                     3.0F);
  ImGui::Dummy({width, height});
}

}  // namespace

void App::draw_gui() {
  if (state_.message && state_.message->is_old()) state_.message.reset();
  if (options_.is_bare) {
    draw_bare();
  } else {
    draw_bars();
  }
  update_hover();
  if (!options_.is_bare && state_.tool != Tool::Look) draw_outline(state_);
  draw_loading();
  draw_saving();
  draw_unsupported();
  draw_leaving();
  if (const auto path = chooser_.draw(static_cast<float>(gui_->scale()))) {
    chooser_.purpose() == FileChooser::Purpose::Open ? load(*path) : save(*path);
  }
}

// Draws only progress and errors over the image.
void App::draw_bare() {
  place_image(0.0F, 0.0F, 0.0F);
  draw_progress(state_, static_cast<float>(gui_->scale()), 0.0F);
  if (state_.message && !state_.message->is_error) state_.message.reset();
  if (state_.message) draw_message(state_, 0.0F);
}

void App::draw_bars() {
  MenuChoice choice;
  const auto scale = static_cast<float>(gui_->scale());
  const float top = draw_menu(state_, choice);
  const float bottom = draw_status(state_);
  const float right = state_.settings.is_panel_shown ? draw_panel(state_, scale, top, bottom, choice) : 0.0F;
  place_image(top, right, bottom);
  draw_help(state_, scale);
  if (!state_.open.backend && !state_.loader && !chooser_.is_shown()) draw_welcome(state_, choice);
  draw_progress(state_, scale, top);
  if (state_.message) draw_message(state_, bottom);
  for (const Command command : choice.commands) run_command(command);
  if (choice.recent) leave({false, *choice.recent});
  if (choice.camera) look_through(*choice.camera);
  if (choice.pack) choose_pack(*choice.pack);
}

void App::draw_loading() {
  if (!state_.loader || state_.loader->seconds() < 0.15) return;
  const float width = 280.0F * static_cast<float>(gui_->scale());
  begin_box("loading");
  ImGui::Text("%s %s", state_.loader->stage().c_str(), state_.loader->path().filename().string().c_str());
  if (const auto fraction = state_.loader->fraction()) {
    ImGui::ProgressBar(static_cast<float>(*fraction), {width, 0.0F});
  } else {
    waiting_bar(state_.loader->seconds(), width);
  }
  if (ImGui::Button("Cancel")) {
    state_.loader->cancel();
    abandoned_.push_back(std::move(state_.loader));
  } else {
    ImGui::SameLine();
    ImGui::TextDisabled("%.1f s", state_.loader->seconds());
  }
  end_box();
}

void App::draw_saving() {
  if (!state_.saver) return;
  begin_box("saving");
  ImGui::Text("saving %s", state_.saver->path().filename().string().c_str());
  const float width = 280.0F * static_cast<float>(gui_->scale());
  ImGui::ProgressBar(static_cast<float>(state_.saver->fraction()), {width, 0.0F});
  if (ImGui::Button("Cancel")) state_.saver->cancel();
  end_box();
}

void App::draw_unsupported() {
  if (!lossy_save_ || state_.saver) return;
  const LossySave lossy = *lossy_save_;
  if (!begin_question("Saving loses data")) return;
  ImGui::Text("Saving %s loses:", lossy.path.filename().string().c_str());
  for (const std::string& line : lossy.losses) ImGui::BulletText("%s", line.c_str());
  ImGui::Spacing();
  const std::string kept = state_.open.document->kept_as(lossy.path).filename().string();
  if (!kept.empty()) ImGui::TextDisabled("The existing file is kept as %s.", kept.c_str());
  ImGui::Spacing();
  enum class Answer { None, SaveAs, Save, Stay } answer = Answer::None;
  if (ImGui::Button("Save as...")) answer = Answer::SaveAs;
  ImGui::SameLine();
  if (ImGui::Button("Save anyway")) answer = Answer::Save;
  ImGui::SameLine();
  if (ImGui::Button("Cancel") || ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape))) answer = Answer::Stay;
  if (answer != Answer::None) {
    ImGui::CloseCurrentPopup();
    lossy_save_.reset();
  }
  ImGui::EndPopup();
  if (answer == Answer::SaveAs) ask_where_to_save();
  if (answer == Answer::Stay) leaving_.reset();
  if (answer == Answer::Save) {
    state_.open.document->accept_unsupported(lossy.losses);
    save(lossy.path, true);
  }
}

void App::draw_leaving() {
  if (!leaving_ || state_.saver || lossy_save_ || chooser_.is_shown()) return;
  // Asks again if the user cancelled saving.
  if (!begin_question("Unsaved changes")) return;
  ImGui::Text("%s has changes that are not saved.", state_.open.document->name().c_str());
  ImGui::Spacing();
  enum class Answer { None, Save, Discard, Stay } answer = Answer::None;
  if (ImGui::Button("Save")) answer = Answer::Save;
  ImGui::SameLine();
  if (ImGui::Button("Discard")) answer = Answer::Discard;
  ImGui::SameLine();
  if (ImGui::Button("Cancel") || ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape))) answer = Answer::Stay;
  if (answer != Answer::None) ImGui::CloseCurrentPopup();
  ImGui::EndPopup();
  if (answer == Answer::Save) run_file_command(Command::Save);
  if (answer == Answer::Discard) go_on_leaving();
  if (answer == Answer::Stay) leaving_.reset();
}

}  // namespace quoin::viewer
