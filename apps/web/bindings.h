/* Functions for JavaScript in addition to quoin.h. Files are bytes, since there are no paths. */
#ifndef QUOIN_WEB_DOOR_H
#define QUOIN_WEB_DOOR_H
#include "quoin.h"
#ifdef __cplusplus
extern "C" {
#endif

/* Writes a scene as the bytes of a file. `extension` is ".glb", ".ply", ".stl" or ".3mf", for blocks or (with
 * options->smooth) smooth surfaces, or ".vox". `out` is valid until quoin_web_release or the next file. Errors: as the
 * format's writer. */
QUOIN_API quoin_status quoin_web_write(quoin_scene scene, const char* extension, const quoin_mesh_options* options,
                                       const uint8_t** out, size_t* bytes);
QUOIN_API void quoin_web_release(void);
/* Turns progress reports of later calls to JavaScript's quoin.report(fraction) on or off. If that returns 0, the call
 * fails with QUOIN_CANCELLED. */
QUOIN_API void quoin_web_listen(int32_t listens);
/* Allocates a struct with its size set and all else 0, since JavaScript handles structs as bytes. `kind` is 0 array,
 * 1 grid_info, 2 type, 3 mesh_data, 4 mesh_options, 5 render_options, 6 hits, 7 load_options. Returns null if out of
 * memory or the kind is unknown. Free it with free(). */
QUOIN_API void* quoin_web_struct(int32_t kind);

/* Prepares a scene for ray-marching shaders (page/march.js), until quoin_web_march_free: the tables declared in
 * src/render/shaders/data.glsl, with 32-bit addresses. The scene stays alive and must not be edited. Fails if its types
 * have shapes, which the shaders lack. */
typedef struct quoin_web_march quoin_web_march;
QUOIN_API quoin_status quoin_web_march_begin(quoin_scene scene, quoin_web_march** out);
/* Returns the data shared by all images. `has` receives bits: transparent voxels, fields, transparent fields. */
QUOIN_API quoin_status quoin_web_march_data(const quoin_web_march* march, const uint8_t** data, size_t* bytes,
                                            int32_t* has);
/* Returns an image's Frame followed by its tables, whose addresses count from there. Valid until the next call. */
QUOIN_API quoin_status quoin_web_march_frame(quoin_web_march* march, const quoin_render_options* options,
                                             const uint8_t** out, size_t* bytes);
/* Writes the push constants of a sample: 96 bytes, shaders/compute.glsl. */
QUOIN_API quoin_status quoin_web_march_sample(int32_t sample, uint8_t* out, size_t bytes);
QUOIN_API void quoin_web_march_free(quoin_web_march* march); /* ignores null */

#ifdef __cplusplus
}
#endif
#endif
