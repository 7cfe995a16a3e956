// quoin-small.wasm reads only .vox, for pages that show blocks quickly. Its other functions are those of quoin.wasm.

#include <quoin/io/formats.h>
#include <quoin/io/vox.h>

#include "handles.h"

#define QUOIN_EXPORT(name) __attribute__((export_name(name)))

namespace quoin::c {

// Returns 1 if this module can read these bytes. quoin.wasm lacks this function, since it reads all formats.
QUOIN_EXPORT("quoin_web_reads") std::int32_t reads(const std::byte* data, std::size_t bytes) {
  return detect_format(std::span(data, bytes)) == FileFormat::Vox ? 1 : 0;
}

QUOIN_EXPORT("quoin_scene_load_bytes_with")
quoin_status load_bytes(const std::byte* data, std::size_t bytes, const quoin_load_options* options, quoin_scene* out) {
  return guarded([&] {
    if (data == nullptr || out == nullptr) return fail(QUOIN_INVALID_ARGUMENT, "data or out is null");
    const auto wanted = load_options_of(options);
    if (!wanted) return fail(wanted.error());
    auto loaded = read_vox(std::span(data, bytes), *wanted, progress());
    if (!loaded) return fail(loaded.error());
    auto body = std::make_shared<SceneBody>();
    body->loaded = std::move(*loaded);
    number(*body);
    *out = handles().put(std::move(body));
    return QUOIN_OK;
  });
}

}  // namespace quoin::c
