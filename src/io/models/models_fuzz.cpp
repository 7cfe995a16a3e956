#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

#include "io/format_driver.h"

namespace {

/// Any bytes must give a scene whose voxels are of registered types, or an error.
void check(quoin::FileFormat format, std::span<const std::byte> bytes) {
  const quoin::FormatInput input{{}, bytes, {}, {1}, {}};
  const auto loaded = quoin::driver_of(format).read(input);
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
  using quoin::FileFormat;
  for (const FileFormat format : {FileFormat::Binvox, FileFormat::CubeWorld, FileFormat::Voxlap, FileFormat::Qubicle,
                                  FileFormat::Goxel, FileFormat::LuantiSchematic}) {
    check(format, bytes);
  }
  return 0;
}
