#include "bindings.h"

#include <cstdlib>
#include <cstring>

#include <quoin/io/mesh_file.h>
#include <quoin/io/vox.h>
#include <quoin/scene/scene_meshes.h>

#include "handles.h"

extern "C" __attribute__((import_module("quoin"), import_name("report"))) std::int32_t quoin_web_report(
    double fraction);

namespace quoin::c {
namespace {

// The last file written. JavaScript copies it from here.
std::vector<std::byte> file;

quoin_status give(std::vector<std::byte> bytes, const std::uint8_t** out, std::size_t* count) {
  file = std::move(bytes);
  *out = reinterpret_cast<const std::uint8_t*>(file.data());
  *count = file.size();
  return QUOIN_OK;
}

quoin_status write(SceneBody& body, const char* extension, const quoin_mesh_options& options, const std::uint8_t** out,
                   std::size_t* count) {
  const auto format = format_for_writing(std::string("scene") + extension);
  if (!format) return fail(format.error());
  if (format->format == FileFormat::Vox) {
    auto written = write_vox(body.loaded, progress());
    if (!written) return fail(written.error());
    body.loaded.warnings = std::move(written->warnings);
    return give(std::move(written->bytes), out, count);
  }
  const Progress on_progress = progress();
  const Progress meshing = part_of(on_progress, 0.0, 0.5);
  BlockySceneOptions blocks;
  blocks.mesh.watertight = options.watertight != 0;
  const auto meshes = options.smooth != 0 ? mesh_scene_smoothly(body.loaded.scene, {}, {}, meshing)
                                          : mesh_scene(body.loaded.scene, blocks, {}, meshing);
  if (!meshes) return fail(meshes.error());
  auto written = write_mesh(*meshes, format->format, {}, part_of(on_progress, 0.5, 1.0));
  return written ? give(std::move(*written), out, count) : fail(written.error());
}

template <class Struct>
void* empty_struct() {
  auto* made = static_cast<Struct*>(std::calloc(1, sizeof(Struct)));
  if (made != nullptr) made->size = sizeof(Struct);
  return made;
}

}  // namespace
}  // namespace quoin::c

using namespace quoin::c;

quoin_status quoin_web_write(quoin_scene scene, const char* extension, const quoin_mesh_options* options,
                             const std::uint8_t** out, std::size_t* bytes) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    if (extension == nullptr || out == nullptr || bytes == nullptr)
      return fail(QUOIN_INVALID_ARGUMENT, "extension, out or bytes is null");
    return write(body, extension, options == nullptr ? quoin_mesh_options{} : *options, out, bytes);
  });
}

void quoin_web_release() {
  file = {};
}

void quoin_web_listen(std::int32_t listens) {
  quoin_set_progress(
      listens == 0 ? nullptr : [](double fraction, void*) { return quoin_web_report(fraction); }, nullptr);
}

void* quoin_web_struct(std::int32_t kind) {
  switch (kind) {
    case 0:
      return empty_struct<quoin_array>();
    case 1:
      return empty_struct<quoin_grid_info>();
    case 2:
      return empty_struct<quoin_type>();
    case 3:
      return empty_struct<quoin_mesh_data>();
    case 4:
      return empty_struct<quoin_mesh_options>();
    case 5:
      return empty_struct<quoin_render_options>();
    case 6:
      return empty_struct<quoin_hits>();
    case 7:
      return empty_struct<quoin_load_options>();
    default:
      return nullptr;
  }
}
