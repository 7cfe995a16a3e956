#pragma once

// Resource packs for tests, benchmarks and fuzzing: a small one of cubes, slabs, stairs, fences and flowers, generated
// ones with as many textures and models as large packs have, and packs of any bytes.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/hash.h>
#include <quoin/core/image.h>
#include <quoin/grid/texture.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/io/image_files.h>

#include "core/bytes/bytes.h"
#include "io/minecraft/block_types.h"
#include "io/packs/pack_files.h"
#include "io/packs/pack_looks.h"
#include "io/zip.h"

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
  QUOIN_ASSERT(bytes, "an image that can be written");
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
    put_asset("minecraft/" + std::string(path), std::move(content));
  }
  /// `path`: below "assets", such as "mod/blockstates/lamp.json".
  void put_asset(std::string_view path, std::string content) {
    pack_->put("assets/" + std::string(path), std::move(content));
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
  QUOIN_ASSERT(made, "fewer types than a registry can have");
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

/// The numbers of files in a generated pack. The blocks "pack:b0", "pack:b1" and so on have a model each.
struct StackSize {
  int textures = 4'000;
  int texture_size = 256;
  int models = 3'000;  ///< at most as many as textures
};

/// Returns an image with one of three colours per texel, as if at random: a PNG of 256 x 256 has about 30 kB.
inline AlphaImage noise_image(int size, std::uint32_t seed) {
  AlphaImage image{size, size, {}};
  image.rgba.reserve(static_cast<std::size_t>(size) * static_cast<std::size_t>(size) * 4);
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(size * size); ++i) {
    const std::uint32_t colour = mix_bits(mix_bits(i) ^ seed) % 3 * 110 + seed % 16;
    for (const std::uint32_t byte : {colour, 255 - colour, colour / 2, 255U}) {
      image.rgba.push_back(static_cast<std::uint8_t>(byte));
    }
  }
  return image;
}

/// Returns the zip file of a pack. A third of the models are cubes, the others slabs and stairs with a second texture
/// on top. Textures repeat 16 images under different names.
inline std::vector<std::byte> pack_stack(const StackSize& size) {
  QUOIN_ASSERT(size.models > 0 && size.models <= size.textures, "0 < models <= textures");
  std::vector<std::string> images;
  for (std::uint32_t seed = 0; seed < 16; ++seed) {
    const auto png = write_png(noise_image(size.texture_size, seed));
    QUOIN_ASSERT(png, "an image that can be written");
    images.emplace_back(text_of(*png));
  }
  ZipFile zip;
  const auto put = [&](const std::string& name, const std::string& content) {
    zip.begin("assets/pack/" + name);
    zip.put(content);
  };
  for (int i = 0; i < size.textures; ++i) {
    put("textures/block/t" + std::to_string(i) + ".png", images[static_cast<std::size_t>(i) % images.size()]);
  }
  std::string faces;
  for (const char* const side : {"down", "up", "north", "south", "west", "east"}) {
    faces.append(faces.empty() ? "" : ", ").append("\"").append(side).append("\": {\"texture\": \"#");
    faces.append(side == std::string("up") ? "top" : "all").append("\"}");
  }
  const auto box = [&](const char* corners) { return std::string("{") + corners + ", \"faces\": {" + faces + "}}"; };
  const std::string lower = box(R"("from": [0, 0, 0], "to": [16, 8, 16])");
  put("models/block/cube.json", "{\"elements\": [" + box(R"("from": [0, 0, 0], "to": [16, 16, 16])") + "]}");
  put("models/block/slab.json", "{\"elements\": [" + lower + "]}");
  put("models/block/stairs.json",
      "{\"elements\": [" + lower + ", " + box(R"("from": [8, 8, 0], "to": [16, 16, 16])") + "]}");
  for (int i = 0; i < size.models; ++i) {
    const std::string name = "b" + std::to_string(i);
    const std::string all = "pack:block/t" + std::to_string(i);
    // The textures beyond the models' number are tops.
    const int other = size.models + i / 3;
    const bool has_top = i % 3 != 0 && other < size.textures;
    const std::string top = has_top ? "pack:block/t" + std::to_string(other) : all;
    constexpr const char* kParents[] = {"cube", "slab", "stairs"};
    put("models/block/" + name + ".json", std::string("{\"parent\": \"pack:block/") + kParents[i % 3] +
                                              "\", \"textures\": {\"all\": \"" + all + "\", \"top\": \"" + top +
                                              "\"}}");
    put("blockstates/" + name + ".json", R"({"variants": {"": {"model": "pack:block/)" + name + "\"}}}");
  }
  auto bytes = zip.take();
  QUOIN_ASSERT(bytes, "a zip file below 4 GiB");
  return std::move(*bytes);
}

/// Returns the types of the first blocks of such a pack, as worlds have them.
inline VoxelRegistry stack_types(int count) {
  minecraft::BlockTypes types;
  for (int i = 0; i < count; ++i) {
    const auto block = types.block("pack:b" + std::to_string(i), {});
    QUOIN_ASSERT(block, "fewer types than a registry can have");
  }
  return types.types();
}

/// Gives some blocks the looks of a pack. Returns false if a type is invalid, or if the report does not count the types
/// and those that keep their look, or names none of these. Shapes are made in some states.
inline bool makes_valid_looks(std::shared_ptr<const packs::PackFiles> files) {
  static const std::vector<VoxelProperties> types = [] {
    const auto type_of = [](std::string_view name, const std::vector<minecraft::Property>& properties) {
      minecraft::BlockTypes all;
      const auto block = all.block(name, properties);
      QUOIN_ASSERT(block && block->type != kAir, "a block without a tint");
      return all.types()[block->type];
    };
    return std::vector{
        type_of("minecraft:stone", {{"facing", "east"}, {"half", "top"}, {"north", "true"}, {"power", "3"}}),
        type_of("minecraft:oak_fence", {}), type_of("minecraft:redstone_wire", {{"north", "side"}, {"power", "7"}}),
        type_of("minecraft:lava", {{"level", "2"}})};
  }();
  packs::BlockLooks looks(std::move(files));
  std::size_t unchanged = 0;
  for (const VoxelProperties& type : types) {
    const VoxelProperties made = looks.applied(type);
    if (!validate_type(made)) return false;
    if (made == type) ++unchanged;
    if (made.shapes.empty()) continue;
    for (std::uint32_t state = 0; state < 64; ++state) {
      const auto position = static_cast<std::uint16_t>(state % made.shapes.position_count());
      static_cast<void>(made.shapes.model(state, made.orientations.of(state), {.position = position}));
    }
  }
  const BlockPackReport report = looks.report();
  return report.types == types.size() && report.without_look == unchanged && (unchanged == 0 || !report.names.empty());
}

/// Reads any bytes as a zip file, and as the texts of a block state and of models, then a texture, separated by NUL.
/// Returns false if they make an invalid type.
inline bool reads_any_pack(std::span<const std::byte> bytes) {
  if (auto zip = packs::open_pack(std::vector<std::byte>(bytes.begin(), bytes.end()))) {
    if (!makes_valid_looks(*zip)) return false;
  }
  auto files = std::make_shared<packs::MemoryPack>();
  std::string_view rest = text_of(bytes);
  const auto next = [&rest] {
    const std::size_t end = rest.find('\0');
    const std::string_view text = rest.substr(0, end);
    rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
    return std::string(text);
  };
  const std::string states = next();
  for (const char* block : {"stone", "oak_fence", "redstone_wire"}) {
    files->put(std::string("assets/minecraft/blockstates/").append(block).append(".json"), states);
  }
  for (const char* model : {"a", "b", "c"}) {
    files->put(std::string("assets/minecraft/models/block/").append(model).append(".json"), next());
  }
  const std::string image = next();
  for (const char* texture : {"t", "lava_still"}) {
    files->put(std::string("assets/minecraft/textures/block/").append(texture).append(".png"), image);
    files->put(std::string("assets/minecraft/textures/block/").append(texture).append(".png.mcmeta"), states);
  }
  files->put("assets/minecraft/textures/colormap/grass.png", image);
  return makes_valid_looks(std::move(files));
}

}  // namespace quoin::packs_test
