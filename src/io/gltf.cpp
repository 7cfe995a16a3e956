#include <quoin/io/gltf.h>

#include "io/gltf_buffer.h"
#include "io/gltf_container.h"
#include "io/gltf_document.h"
#include "io/gltf_layout.h"

namespace quoin {

namespace {

using WriteContent = Result<std::uint64_t>(const GltfContent&, const std::filesystem::path&, const Progress&);

Result<std::uint64_t> write_with(WriteContent write, const Scene& scene, const SceneMeshes& meshes,
                                 const std::filesystem::path& path, const Progress& progress) {
  const auto layout = lay_out_gltf(scene, meshes);
  if (!layout) return fail(layout.error().code, layout.error().message, path.string());
  const GltfContent content{[&](std::string_view uri) { return gltf_json(scene, meshes, *layout, uri); },
                            layout->buffer_bytes, [&](BlockWriter& out) { write_gltf_buffer(*layout, out); }};
  return write(content, path, progress);
}

}  // namespace

Result<std::uint64_t> write_glb(const Scene& scene, const SceneMeshes& meshes, const std::filesystem::path& path,
                                const Progress& progress) {
  return write_with(write_glb_file, scene, meshes, path, progress);
}

Result<std::uint64_t> write_gltf(const Scene& scene, const SceneMeshes& meshes, const std::filesystem::path& path,
                                 const Progress& progress) {
  return write_with(write_gltf_files, scene, meshes, path, progress);
}

std::vector<std::filesystem::path> gltf_files(const SceneMeshes& meshes, const std::filesystem::path& path) {
  if (meshes.triangles == 0) return {path};
  return {path, gltf_buffer_path(path)};
}

}  // namespace quoin
