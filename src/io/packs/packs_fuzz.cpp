#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "io/minecraft/block_types.h"
#include "io/packs/pack_files.h"
#include "io/packs/pack_looks.h"

namespace {

using namespace quoin;

/// Returns the type of a block with some properties.
VoxelProperties type_of(std::string_view name, const std::vector<minecraft::Property>& properties) {
  minecraft::BlockTypes types;
  const auto block = types.block(name, properties);
  QUOIN_ASSERT(block && block->type != kAir, "a block without a tint");
  return types.types()[block->type];
}

/// Gives some blocks the looks of a pack. The types must be valid, and their shapes must have models in all states.
void apply(std::shared_ptr<const packs::PackFiles> files) {
  static const std::vector<VoxelProperties> types = {
      type_of("minecraft:stone", {{"facing", "east"}, {"half", "top"}, {"north", "true"}, {"power", "3"}}),
      type_of("minecraft:oak_fence", {}), type_of("minecraft:redstone_wire", {{"north", "side"}, {"power", "7"}}),
      type_of("minecraft:lava", {{"level", "2"}})};
  packs::BlockLooks looks(std::move(files));
  for (const VoxelProperties& type : types) {
    const VoxelProperties made = looks.applied(type);
    if (!validate_type(made)) {
      std::fprintf(stderr, "an invalid type\n");
      std::abort();
    }
    if (made.shapes.empty()) continue;
    for (std::uint32_t state = 0; state < 64; ++state) {
      static_cast<void>(made.shapes.model(state, made.orientations.of(state), {}));
    }
  }
  static_cast<void>(to_string(looks.report()));
}

}  // namespace

/// Any bytes must give looks or errors: as a zip file, and as texts of a block state and models, separated by NUL.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes(reinterpret_cast<const std::byte*>(data), size);
  if (auto zip = packs::open_pack(std::vector<std::byte>(bytes.begin(), bytes.end()))) apply(*zip);
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
  apply(std::move(files));
  return 0;
}
