#include "io/minecraft/signs.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include "core/bytes/text.h"
#include "io/minecraft/sections.h"

namespace quoin::minecraft {

namespace {

constexpr int kMaxTextDepth = 32;
constexpr std::size_t kMaxLineBytes = 1'024;  // a line of the game has some 100
constexpr std::size_t kMaxLines = 4;          // of a side

/// Text beyond this is not looked at, with its formatting codes.
constexpr std::size_t kMaxStored = 4 * kMaxLineBytes;

// Text components: a string, a list of components, or an object with "text" and more components in "extra". Translated
// texts and selectors have no text of their own.

void add_text(const nlohmann::json& component, std::string& text) {
  if (text.size() > kMaxStored) return;
  if (component.is_string()) {
    text += component.get_ref<const std::string&>();
  } else if (component.is_array()) {
    for (const auto& each : component) add_text(each, text);
  } else if (component.is_object()) {
    if (const auto own = component.find("text"); own != component.end()) add_text(*own, text);
    if (const auto more = component.find("extra"); more != component.end()) add_text(*more, text);
  }
}

void add_text(nbt::Value component, int depth, std::string& text) {
  if (text.size() > kMaxStored) return;
  if (const auto own = component.text()) {
    text += *own;
  } else if (depth < kMaxTextDepth && component.tag() == nbt::Tag::List) {
    component.for_each([&](nbt::Value each) { add_text(each, depth + 1, text); });
  } else if (depth < kMaxTextDepth && component.tag() == nbt::Tag::Compound) {
    // A component without other properties in a list of compounds has an empty name.
    add_text(component[component["text"] ? "text" : ""], depth + 1, text);
    add_text(component["extra"], depth + 1, text);
  }
}

std::string text_of_json(std::string_view text) {
  const bool is_component = text.starts_with('{') || text.starts_with('"') || text.starts_with('[');
  if (!is_component || json_extent(text).depth > kMaxTextDepth) return std::string(text == "null" ? "" : text);
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (json.is_discarded()) return std::string(text);
  std::string found;
  add_text(json, found);
  return found;
}

/// Returns the lines of one side of a sign.
std::string text_of_side(const std::vector<nbt::Value>& lines) {
  std::string text;
  for (std::size_t i = 0; i < lines.size(); ++i) text += (i > 0 ? "\n" : "") + text_of_line(lines[i]);
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return text;
}

std::string text_of_sign(nbt::Value sign) {
  std::vector<nbt::Value> lines;
  if (!sign["front_text"]) {
    for (const char* const key : {"Text1", "Text2", "Text3", "Text4"}) lines.push_back(sign[key]);
    return text_of_side(lines);
  }
  std::string text;
  for (const char* const side : {"front_text", "back_text"}) {
    lines.clear();
    sign[side]["messages"].for_each([&](nbt::Value line) {
      if (lines.size() < kMaxLines) lines.push_back(line);
    });
    const std::string own = text_of_side(lines);
    if (!own.empty()) text += (text.empty() ? "" : "\n") + own;
  }
  return text;
}

}  // namespace

std::string text_of_line(nbt::Value line) {
  std::string text;
  if (const auto stored = line.text()) {
    text = text_of_json(stored->substr(0, kMaxStored));
  } else {
    add_text(line, 0, text);
  }
  // Old formatting codes: a section sign and a letter.
  constexpr std::string_view kSectionSign = "\xC2\xA7";
  std::string plain;
  for (std::size_t at = 0; at < text.size() && plain.size() < kMaxLineBytes;) {
    const std::size_t code = std::min(text.find(kSectionSign, at), text.size());
    plain.append(text, at, std::min(code - at, kMaxLineBytes - plain.size()));
    at = code + kSectionSign.size() + 1;
  }
  return printable(plain);
}

void add_signs(nbt::Value root, std::vector<SourceSign>& signs) {
  const nbt::Value level = chunk_content(root);
  nbt::first_of(level, "block_entities", "TileEntities").for_each([&](nbt::Value entity) {
    const std::string_view id = entity["id"].text().value_or("");
    if (id != "Sign" && !id.ends_with(":sign") && !id.ends_with(":hanging_sign")) return;
    const auto x = entity["x"].integer();
    const auto y = entity["y"].integer();
    const auto z = entity["z"].integer();
    const auto is_place = [](const std::optional<std::int64_t>& at) {
      constexpr std::int64_t kFarthest = std::int64_t{1} << 30;
      return at && *at >= -kFarthest && *at < kFarthest;
    };
    if (!is_place(x) || !is_place(y) || !is_place(z)) return;
    std::string text = text_of_sign(entity);
    if (text.empty()) return;
    signs.push_back({{static_cast<int>(*x), static_cast<int>(*y), static_cast<int>(*z)}, std::move(text)});
  });
}

}  // namespace quoin::minecraft
