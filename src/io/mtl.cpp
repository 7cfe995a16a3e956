#include "io/mtl.h"

#include <algorithm>
#include <array>
#include <charconv>

namespace quoin {

namespace {

std::string shortest(float value) {
  std::array<char, 64> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

}  // namespace

std::string mtl_name(const SurfaceMaterial& material) {
  std::string name = material.name;
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

std::string mtl_text(const MaterialPalette& palette, const std::string& texture, const std::string& emissive_texture) {
  std::string text = "# Quoin " QUOIN_VERSION "\n";
  for (const SurfaceMaterial& material : palette.materials()) {
    text.append("\nnewmtl ").append(mtl_name(material)).append("\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\n");
    text.append("map_Kd ").append(texture).append("\n");
    if (material.is_transparent()) text.append("map_d -imfchan m ").append(texture).append("\n");
    if (material.is_emissive()) {
      const std::string strength = shortest(material.emission);
      text.append("Ke ").append(strength).append(" ").append(strength).append(" ").append(strength);
      text.append("\nmap_Ke ").append(emissive_texture).append("\n");
    }
  }
  return text;
}

}  // namespace quoin
