#pragma once

// A small resource pack: cubes, logs, slabs, stairs, fences, flowers, grass, water, and more.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/core/image.h>
#include <quoin/grid/texture.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/io/image_files.h>

#include "io/minecraft/block_types.h"
#include "io/packs/pack_files.h"

namespace quoin::packs_test {

/// Returns a PNG of `size` texels per side whose texels are `colour(x, y)`; `frames` of them below each other.
inline std::string png(int size, const std::function<Rgba8(int x, int y)>& colour, int frames = 1) {
  AlphaImage image{size, size * frames, {}};
  for (int y = 0; y < size * frames; ++y) {
    for (int x = 0; x < size; ++x) {
      const Rgba8 c = colour(x, y);
      for (const std::uint8_t byte : {c.r, c.g, c.b, c.a}) image.rgba.push_back(byte);
    }
  }
  const auto bytes = write_png(image);
  EXPECT_TRUE(bytes);
  return {reinterpret_cast<const char*>(bytes->data()), bytes->size()};
}

inline std::string plain_png(Rgba8 colour, int size = 16) {
  return png(size, [colour](int, int) { return colour; });
}

/// Adds files in the form of resource packs.
class PackBuilder {
 public:
  void texture(std::string_view name, std::string png) {
    put("textures/" + std::string(name) + ".png", std::move(png));
  }
  void model(std::string_view name, std::string json) { put("models/" + std::string(name) + ".json", std::move(json)); }
  void states(std::string_view name, std::string json) {
    put("blockstates/" + std::string(name) + ".json", std::move(json));
  }
  void put(std::string_view path, std::string content) {
    pack_->put("assets/minecraft/" + std::string(path), std::move(content));
  }
  [[nodiscard]] std::shared_ptr<const packs::PackFiles> files() const { return pack_; }

 private:
  std::shared_ptr<packs::MemoryPack> pack_ = std::make_shared<packs::MemoryPack>();
};

/// Returns the properties of a block's type, as worlds have them, and the block's state.
struct TypeAndState {
  VoxelProperties type;
  std::uint32_t state = 0;
};
inline TypeAndState block(std::string_view name, const std::vector<minecraft::Property>& properties = {},
                          const minecraft::BiomeTints& tints = {}) {
  minecraft::BlockTypes types;
  const auto made = types.block(name, properties);
  EXPECT_TRUE(made);
  VoxelType type = made->type;
  if (made->tint != minecraft::Tint::None) type = *types.tinted(*made, tints);
  return {types.types()[type], made->state};
}

/// The parents of models that packs of today have, in short.
inline void add_parents(PackBuilder& pack) {
  const auto box = [](const std::string& from, const std::string& to, const std::string& faces) {
    return R"({"from": [)" + from + R"(], "to": [)" + to + R"(], "faces": {)" + faces + "}}";
  };
  std::string cube;
  for (const char* side : {"down", "up", "north", "south", "west", "east"}) {
    const std::string name = side;
    cube += (cube.empty() ? "" : ", ") +
            ("\"" + name + R"(": {"texture": "#)" + name + R"(", "cullface": ")" + name + "\"}");
  }
  pack.model("block/cube", R"({"elements": [)" + box("0, 0, 0", "16, 16, 16", cube) + "]}");
  pack.model("block/cube_all",
             R"({"parent": "block/cube", "textures": {"particle": "#all", "down": "#all", "up": "#all",
    "north": "#all", "east": "#all", "south": "#all", "west": "#all"}})");
  pack.model("block/cube_column", R"({"parent": "block/cube", "textures": {"particle": "#side", "down": "#end",
    "up": "#end", "north": "#side", "east": "#side", "south": "#side", "west": "#side"}})");
  const std::string sides = R"("up": {"texture": "#top"}, "down": {"texture": "#bottom"}, "north": {"texture": "#side"},
    "south": {"texture": "#side"}, "west": {"texture": "#side"}, "east": {"texture": "#side"})";
  pack.model("block/slab", R"({"elements": [)" + box("0, 0, 0", "16, 8, 16", sides) + "]}");
  pack.model("block/stairs", R"({"elements": [)" + box("0, 0, 0", "16, 8, 16", sides) + ", " +
                                 box("8, 8, 0", "16, 16, 16", sides) + "]}");
  pack.model("block/cross", R"({"elements": [
    {"from": [0.8, 0, 8], "to": [15.2, 16, 8], "shade": false,
     "rotation": {"origin": [8, 8, 8], "axis": "y", "angle": 45, "rescale": true},
     "faces": {"north": {"uv": [0, 0, 16, 16], "texture": "#cross"},
               "south": {"uv": [0, 0, 16, 16], "texture": "#cross"}}},
    {"from": [8, 0, 0.8], "to": [8, 16, 15.2], "shade": false,
     "rotation": {"origin": [8, 8, 8], "axis": "y", "angle": 45, "rescale": true},
     "faces": {"west": {"uv": [0, 0, 16, 16], "texture": "#cross"},
               "east": {"uv": [0, 0, 16, 16], "texture": "#cross"}}}]})");
  pack.model("block/fence_post", R"({"elements": [)" + box("6, 0, 6", "10, 16, 10", sides) + "]}");
  pack.model("block/fence_side",
             R"({"elements": [)" + box("7, 12, 0", "9, 15, 9", sides) + ", " + box("7, 6, 0", "9, 9, 9", sides) + "]}");
}

}  // namespace quoin::packs_test
