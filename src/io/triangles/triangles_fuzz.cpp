#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

#include "io/format_driver.h"
#include "io/triangles/triangles.h"

namespace {

/// Any bytes must give a mesh that can be voxelised, or an error.
void check(const quoin::FormatDriver& driver, std::span<const std::byte> bytes) {
  quoin::triangles::SidecarReader nothing;
  auto loaded = driver.read_mesh(bytes, nothing);
  if (!loaded) return;
  if (!quoin::check_mesh(loaded->mesh)) {
    std::fprintf(stderr, "an unsound mesh was read\n");
    std::abort();
  }
  quoin::MeshLoadOptions options;
  options.size = 8;
  (void)quoin::triangles::scene_from_mesh(std::move(*loaded), options, "mesh", {1}, {});
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes(reinterpret_cast<const std::byte*>(data), size);
  using quoin::FileFormat;
  for (const FileFormat format : {FileFormat::Stl, FileFormat::Ply, FileFormat::Off, FileFormat::ThreeMf}) {
    check(quoin::driver_of(format), bytes);
  }
  // Readers based on libraries receive only input of their own format.
  for (const FileFormat format : {FileFormat::Obj, FileFormat::Gltf, FileFormat::Glb}) {
    if (quoin::driver_of(format).detect(bytes)) check(quoin::driver_of(format), bytes);
  }
  return 0;
}
