/* What JavaScript calls beside quoin.h: files as bytes, since there are no paths. */
#ifndef QUOIN_WEB_DOOR_H
#define QUOIN_WEB_DOOR_H
#include "quoin.h"
#ifdef __cplusplus
extern "C" {
#endif

/* A scene as the bytes of a file. `extension` is ".glb", ".ply", ".stl" or ".3mf", of blocks or, with options->smooth,
 * smooth surfaces, or ".vox". `out` lasts until quoin_web_release, or the next file. Errors: those of the format's
 * writer. */
QUOIN_API quoin_status quoin_web_write(quoin_scene scene, const char* extension, const quoin_mesh_options* options,
                                       const uint8_t** out, size_t* bytes);
QUOIN_API void quoin_web_release(void);
/* Whether JavaScript's quoin.told(fraction) is told how far the calls from now on have come; it returns whether to go
 * on: 0 ends the call with QUOIN_CANCELLED. */
QUOIN_API void quoin_web_listen(int32_t listens);
/* A quoin_mesh_options and so on, all 0 but its size, for whom structs are bytes: `kind` is 0 array, 1 grid_info,
 * 2 type, 3 mesh_data, 4 mesh_options, 5 render_options, 6 hits, 7 load_options; null: no memory, or another kind.
 * Freed with free(). */
QUOIN_API void* quoin_web_struct(int32_t kind);

/* A scene for shaders that march it (page/march.js), which lasts until quoin_web_march_free: what
 * src/render_vk/shaders/data.glsl declares, where addresses have 32 bits. The scene stays, and is not edited. */
typedef struct quoin_web_march quoin_web_march;
QUOIN_API quoin_status quoin_web_march_begin(quoin_scene scene, quoin_web_march** out);
/* What does not depend on the picture; in `has`, by bits: transparent voxels, fields, transparent ones of these. */
QUOIN_API quoin_status quoin_web_march_data(const quoin_web_march* march, const uint8_t** data, size_t* bytes,
                                            int32_t* has);
/* A picture's Frame, and behind it the tables that are its own, which count from there; until the next call. */
QUOIN_API quoin_status quoin_web_march_frame(quoin_web_march* march, const quoin_render_options* options,
                                             const uint8_t** out, size_t* bytes);
/* What shaders are pushed for a sample: 96 bytes, shaders/compute.glsl. */
QUOIN_API quoin_status quoin_web_march_sample(int32_t sample, uint8_t* out, size_t bytes);
QUOIN_API void quoin_web_march_free(quoin_web_march* march); /* null is none */

#ifdef __cplusplus
}
#endif
#endif
