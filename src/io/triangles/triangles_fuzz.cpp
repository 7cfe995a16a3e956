#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

#include "io/triangles/triangles.h"

namespace {

using Read = quoin::Result<quoin::LoadedMesh> (*)(std::span<const std::byte>, quoin::triangles::SidecarReader&);

/// Any bytes must give a mesh that can be voxelised, or an error.
void check(Read read, std::span<const std::byte> bytes) {
  quoin::triangles::SidecarReader nothing;
  auto loaded = read(bytes, nothing);
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
  for (const Read read : {quoin::triangles::read_stl, quoin::triangles::read_ply, quoin::triangles::read_off,
                          quoin::triangles::read_three_mf}) {
    check(read, bytes);
  }
  // Readers based on libraries receive only input of their own format.
  if (quoin::triangles::is_obj(bytes)) check(quoin::triangles::read_obj, bytes);
  if (quoin::triangles::is_gltf(bytes) || quoin::triangles::is_glb(bytes)) check(quoin::triangles::read_gltf, bytes);
  return 0;
}
