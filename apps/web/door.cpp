#include "door.h"

#include <cstdlib>
#include <cstring>

#include <quoin/io/mesh_file.h>
#include <quoin/io/vox.h>
#include <quoin/scene/scene_meshes.h>

#include "handles.h"

namespace quoin::c {
namespace {

quoin_status give(std::span<const std::byte> bytes, std::uint8_t** out, std::size_t* count) {
  *out = static_cast<std::uint8_t*>(std::malloc(bytes.size()));
  if (*out == nullptr) return fail(QUOIN_OUT_OF_MEMORY, "out of memory");
  std::memcpy(*out, bytes.data(), bytes.size());
  *count = bytes.size();
  return QUOIN_OK;
}

quoin_status write(SceneBody& body, const char* extension, const quoin_mesh_options& options, std::uint8_t** out,
                   std::size_t* count) {
  const auto format = format_for_writing(std::string("scene") + extension);
  if (!format) return fail(format.error());
  if (format->format == FileFormat::Vox) {
    auto written = write_vox(body.loaded);
    if (!written) return fail(written.error());
    body.loaded.warnings = std::move(written->warnings);
    return give(written->bytes, out, count);
  }
  const auto meshes = options.smooth != 0 ? mesh_scene_smoothly(body.loaded.scene) : mesh_scene(body.loaded.scene);
  if (!meshes) return fail(meshes.error());
  const auto written = write_mesh(*meshes, format->format);
  return written ? give(*written, out, count) : fail(written.error());
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
                             std::uint8_t** out, std::size_t* bytes) {
  return with_scene(scene, Use::Change, [&](SceneBody& body) {
    if (extension == nullptr || out == nullptr || bytes == nullptr)
      return fail(QUOIN_INVALID_ARGUMENT, "extension, out or bytes is null");
    return write(body, extension, options == nullptr ? quoin_mesh_options{} : *options, out, bytes);
  });
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
    default:
      return nullptr;
  }
}
