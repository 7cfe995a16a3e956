#pragma once

#include <unistd.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <quoin/io/file.h>
#include <quoin/io/mesh_file.h>

#include "io/image/image_codecs.h"

namespace quoin {

/// A GLB parsed from the specification alone, for tests; an invalid file gives an empty document.
struct ParsedGlb {
  nlohmann::json document;
  std::vector<std::byte> binary;

  template <class T>
  [[nodiscard]] std::vector<T> array(std::size_t accessor) const {
    const auto& entry = document["accessors"][accessor];
    const auto& view = document["bufferViews"][entry["bufferView"].get<std::size_t>()];
    std::vector<T> values(entry["count"].get<std::size_t>());
    std::memcpy(values.data(), binary.data() + view["byteOffset"].get<std::size_t>(), values.size() * sizeof(T));
    return values;
  }

  [[nodiscard]] std::vector<std::uint32_t> indices(const nlohmann::json& primitive) const {
    const std::size_t accessor = primitive["indices"];
    if (document["accessors"][accessor]["componentType"] == 5125) return array<std::uint32_t>(accessor);
    const auto narrow = array<std::uint16_t>(accessor);
    return {narrow.begin(), narrow.end()};
  }

  [[nodiscard]] std::vector<Vec3> vectors(const nlohmann::json& primitive, const char* attribute) const {
    return array<Vec3>(primitive["attributes"][attribute].get<std::size_t>());
  }

  [[nodiscard]] PngImage image(std::size_t index) const {
    const auto& view = document["bufferViews"][document["images"][index]["bufferView"].get<std::size_t>()];
    const std::span bytes(binary);
    return decode_png(bytes.subspan(view["byteOffset"], view["byteLength"])).value_or(PngImage{});
  }

  /// The texel that a vertex's texture coordinate points at.
  [[nodiscard]] std::array<int, 4> texel(const PngImage& image, const nlohmann::json& primitive,
                                         std::size_t vertex) const {
    const auto uv = array<std::array<float, 2>>(primitive["attributes"]["TEXCOORD_0"].get<std::size_t>())[vertex];
    const auto x = static_cast<std::size_t>(uv[0] * static_cast<float>(image.width));
    const auto y = static_cast<std::size_t>(uv[1] * static_cast<float>(image.height));
    const std::uint8_t* at = image.pixels.data() + (y * image.width + x) * 4;
    return {at[0], at[1], at[2], at[3]};
  }
};

inline ParsedGlb parse_glb(const std::vector<std::byte>& file) {
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    if (at + 4 <= file.size()) std::memcpy(&value, file.data() + at, 4);
    return value;
  };
  ParsedGlb glb;
  const std::size_t json_bytes = word(12);
  if (word(0) != 0x46546C67 || word(4) != 2 || word(8) != file.size() || 20 + json_bytes > file.size()) return glb;
  const auto* text = reinterpret_cast<const char*>(file.data()) + 20;
  glb.document = nlohmann::json::parse(text, text + json_bytes, nullptr, false);
  if (file.size() > 20 + json_bytes)
    glb.binary.assign(file.begin() + static_cast<std::ptrdiff_t>(28 + json_bytes), file.end());
  return glb;
}

/// A folder of its own for one test, removed with the object.
class TestFolder {
 public:
  explicit TestFolder(const std::string& name)
      : path_(std::filesystem::temp_directory_path() / ("quoin_" + name + "_" + std::to_string(getpid()))) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TestFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;

  [[nodiscard]] std::filesystem::path file(const std::string& name) const { return path_ / name; }
  [[nodiscard]] std::size_t count() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(path_), {}));
  }

 private:
  std::filesystem::path path_;
};

}  // namespace quoin
