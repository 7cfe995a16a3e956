#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

#include "io/models/models.h"

namespace {

using Read = quoin::Result<quoin::LoadedScene> (*)(std::span<const std::byte>);

/// Any bytes must give a scene whose voxels are of registered types, or an error.
void check(Read read, std::span<const std::byte> bytes) {
  const auto loaded = read(bytes);
  if (!loaded) return;
  for (const quoin::GridHandle handle : loaded->scene.grids().handles()) {
    loaded->scene.grids()[handle].grid.for_each_row([&](quoin::IVec3, std::span<const quoin::VoxelType> types) {
      for (const quoin::VoxelType type : types) {
        if (type < loaded->scene.types.size()) continue;
        std::fprintf(stderr, "a type that there is not\n");
        std::abort();
      }
    });
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes(reinterpret_cast<const std::byte*>(data), size);
  for (const Read read : {quoin::models::read_binvox, quoin::models::read_cub, quoin::models::read_kv6,
                          quoin::models::read_kvx, quoin::models::read_slab6, quoin::models::read_vxl,
                          quoin::models::read_qubicle, quoin::models::read_goxel, quoin::models::read_mts}) {
    check(read, bytes);
  }
  return 0;
}
