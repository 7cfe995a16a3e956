#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

#include <quoin/core/assert.h>

#include "io/minecraft/minecraft.h"

/// Any bytes must give a world or errors, as a region file, as level.dat and as a schematic. All voxels read must have
/// registered types.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes(reinterpret_cast<const std::byte*>(data), size);
  static_cast<void>(quoin::minecraft::parse_level_file(bytes));
  static_cast<void>(quoin::minecraft::read_schematic(bytes));
  const auto source = quoin::minecraft::open_minecraft(bytes);
  if (!source) return 0;
  for (std::size_t i = 0; i < (*source)->parts().size(); ++i) {
    const auto part = (*source)->read_part(i);
    if (!part) continue;
    const quoin::VoxelRegistry types = (*source)->types();
    for (const quoin::SourceChunk& each : part->chunks) {
      const bool is_sound = (*source)->parts()[i].contains(each.chunk) && each.voxels.types().back() < types.size();
      if (is_sound) continue;
      std::fprintf(stderr, "a chunk outside of its part, or of types that there are not\n");
      std::abort();
    }
  }
  return 0;
}
