#include "file_chooser.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cstdio>

#include <quoin/io/formats.h>

#include "viewer/document.h"

namespace quoin::viewer {

namespace {

// Replaces imgui_stdlib, which Debian compiles for one standard library only.
int resize_text(ImGuiInputTextCallbackData* data) {
  if (data->EventFlag != ImGuiInputTextFlags_CallbackResize) return 0;
  auto* text = static_cast<std::string*>(data->UserData);
  text->resize(static_cast<std::size_t>(data->BufTextLen));
  data->Buf = text->data();
  return 0;
}

bool input_text(const char* label, std::string& text, ImGuiInputTextFlags flags) {
  return ImGui::InputText(label, text.data(), text.capacity() + 1, flags | ImGuiInputTextFlags_CallbackResize,
                          resize_text, &text);
}

constexpr std::size_t kMaxEntries = 5'000;

std::string lower(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

// Includes compressed volumes: NAME.nii.gz.
bool is_readable_name(const std::string& name) {
  std::filesystem::path file = lower(name);
  const bool is_packed = file.extension() == ".gz";
  if (is_packed) file = file.stem();
  const auto format = format_with_extension(file, FormatCapability::Read);
  return format && (format->can(FormatCapability::Volume) || !is_packed);
}

std::string size_text(std::uintmax_t bytes) {
  std::array<char, 32> text{};
  if (bytes < 1'000'000) {
    std::snprintf(text.data(), text.size(), "%.0f kB", std::max(static_cast<double>(bytes) / 1e3, 1.0));
  } else {
    std::snprintf(text.data(), text.size(), "%.1f MB", static_cast<double>(bytes) / 1e6);
  }
  return text.data();
}

}  // namespace

void FileChooser::show(Purpose purpose, const std::filesystem::path& start) {
  purpose_ = purpose;
  is_shown_ = is_new_ = true;
  problem_.clear();
  asked_about_.clear();
  name_ = start.filename().string();
  default_extension_ = can_write(start) ? start.extension().string() : "";
  std::error_code error;
  std::filesystem::path folder = std::filesystem::absolute(start, error).parent_path();
  if (error || !std::filesystem::is_directory(folder, error)) folder = std::filesystem::current_path(error);
  enter(folder);
}

void FileChooser::enter(const std::filesystem::path& folder) {
  std::error_code error;
  std::vector<Entry> found;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (found.size() >= kMaxEntries) break;
    std::error_code odd;
    Entry entry{at->path().filename().string(), at->is_directory(odd), 0};
    if (entry.name.empty() || entry.name.front() == '.') continue;
    if (!entry.is_folder) entry.bytes = at->file_size(odd);
    found.push_back(std::move(entry));
  }
  if (error) {
    problem_ = folder.string() + ": " + error.message();
    return;
  }
  std::sort(found.begin(), found.end(), [](const Entry& a, const Entry& b) {
    return a.is_folder != b.is_folder ? a.is_folder : lower(a.name) < lower(b.name);
  });
  folder_ = folder.lexically_normal();
  entries_ = std::move(found);
  problem_.clear();
}

bool FileChooser::is_listed(const Entry& entry) const {
  if (entry.is_folder || shows_all_) return true;
  return purpose_ == Purpose::Open ? is_readable_name(entry.name) : can_write(entry.name);
}

void FileChooser::draw_folder_line() {
  if (ImGui::Button("Up")) enter(folder_.parent_path());
  ImGui::SameLine();
  ImGui::AlignTextToFramePadding();
  ImGui::TextUnformatted(folder_.string().c_str());
}

bool FileChooser::draw_entries(float height) {
  bool is_chosen = false;
  std::optional<std::filesystem::path> next;
  ImGui::BeginChild("entries", {0.0F, height}, true);
  int shown = 0;
  for (const Entry& entry : entries_) {
    if (!is_listed(entry)) continue;
    ++shown;
    const std::string label = entry.is_folder ? entry.name + "/" : entry.name;
    if (ImGui::Selectable(label.c_str(), name_ == entry.name, ImGuiSelectableFlags_AllowDoubleClick)) {
      if (entry.is_folder) {
        next = folder_ / entry.name;
      } else {
        name_ = entry.name;
        is_chosen = ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left) && purpose_ == Purpose::Open;
      }
    }
    if (entry.is_folder) continue;
    const std::string size = size_text(entry.bytes);
    ImGui::SameLine(ImGui::GetWindowContentRegionMax().x - ImGui::CalcTextSize(size.c_str()).x);
    ImGui::TextDisabled("%s", size.c_str());
  }
  if (shown == 0)
    ImGui::TextDisabled("no files here that the viewer %s", purpose_ == Purpose::Open ? "reads" : "writes");
  ImGui::EndChild();
  if (next) enter(*next);
  return is_chosen;
}

std::optional<std::filesystem::path> FileChooser::accept() {
  if (name_.empty()) return std::nullopt;
  std::filesystem::path path = folder_ / name_;  // an absolute name replaces the folder
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    enter(path);
    name_.clear();
    return std::nullopt;
  }
  if (purpose_ == Purpose::Open) {
    if (std::filesystem::exists(path, error)) return path;
    problem_ = "no such file: " + path.string();
    return std::nullopt;
  }
  if (path.extension().empty()) path += default_extension_.empty() ? ".vox" : default_extension_;
  if (!can_write(path)) {
    problem_ = "the name must end in .quoin, .vox, .json or .glb";
    return std::nullopt;
  }
  if (std::filesystem::exists(path, error) && asked_about_ != path.string()) {
    asked_about_ = path.string();
    problem_ = path.filename().string() + " exists; save again to replace it";
    return std::nullopt;
  }
  return path;
}

std::optional<std::filesystem::path> FileChooser::draw(float scale) {
  if (!is_shown_) return std::nullopt;
  const char* title = purpose_ == Purpose::Open ? "Open a file" : "Save as";
  if (!ImGui::IsPopupOpen(title)) ImGui::OpenPopup(title);
  const ImVec2 room = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({room.x * 0.5F, room.y * 0.5F}, ImGuiCond_Always, {0.5F, 0.5F});
  ImGui::SetNextWindowSize({std::min(640.0F * scale, room.x - 20.0F), std::min(480.0F * scale, room.y - 20.0F)});
  std::optional<std::filesystem::path> chosen;
  if (!ImGui::BeginPopupModal(title, &is_shown_, ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove)) return chosen;
  draw_folder_line();
  const float lines = 3.0F * ImGui::GetFrameHeightWithSpacing();
  bool is_accepted = draw_entries(ImGui::GetContentRegionAvail().y - lines);
  if (is_new_) ImGui::SetKeyboardFocusHere();
  is_new_ = false;
  ImGui::SetNextItemWidth(-1.0F);
  is_accepted |= input_text("##name", name_, ImGuiInputTextFlags_EnterReturnsTrue);
  ImGui::TextColored({1.0F, 0.65F, 0.4F, 1.0F}, "%s", problem_.c_str());
  is_accepted |= ImGui::Button(purpose_ == Purpose::Open ? "Open" : "Save");
  ImGui::SameLine();
  if (ImGui::Button("Cancel") || ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape))) is_shown_ = false;
  ImGui::SameLine();
  ImGui::Checkbox("all files", &shows_all_);
  if (is_accepted) chosen = accept();
  // Keeps the focus, so that Enter works again.
  if (is_accepted && !chosen) is_new_ = true;
  if (chosen) is_shown_ = false;
  if (!is_shown_) ImGui::CloseCurrentPopup();
  ImGui::EndPopup();
  return chosen;
}

}  // namespace quoin::viewer
