/* Quoin for C99 and whatever speaks C: files of voxels, arrays, meshes, pictures and rays.
 *
 * Status:   every function that can fail returns QUOIN_OK or a code; quoin_last_error() then says why, in one line.
 *           No call ends the process, and no exception leaves it.
 * Handles:  scenes and meshes are numbers. One that was freed, or never given, is QUOIN_BAD_HANDLE. 0 is none.
 * Arrays:   the caller owns what he gives and what he has filled. What quoin_mesh_view shows belongs to the mesh, and
 *           lasts until that is freed.
 * Structs:  set `size` to sizeof the struct (QUOIN_INIT does). Later versions add to its end: a program that was made
 *           with an older header, whose struct is shorter, goes on as it was.
 * Axes:     right-handed, +Y up; a voxel (x, y, z) fills the cube from there to (x + 1, y + 1, z + 1).
 * Threads:  any thread may call. Any number read a scene at once; who changes it, or saves it, has it to himself
 *           meanwhile, and others wait.
 */
#ifndef QUOIN_C_H
#define QUOIN_C_H
/* NOLINTBEGIN(readability-*,modernize-*,performance-*,cppcoreguidelines-*): this is C */

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define QUOIN_API __attribute__((visibility("default")))
#else
#define QUOIN_API
#endif

/* An empty struct of `type`: every number 0, which means its default, but for three: of quoin_type alpha (0: nothing is
 * to be seen of it) and roughness (0: a mirror), of quoin_instance visible (0: hidden). */
#define QUOIN_INIT(type) \
  { .size = sizeof(type) }

typedef enum quoin_status {
  QUOIN_OK = 0,
  QUOIN_INVALID_ARGUMENT = 1, /* null, NaN, a size that cannot be, an index out of range */
  QUOIN_CANNOT_READ = 2,
  QUOIN_CANNOT_WRITE = 3,
  QUOIN_BAD_FORMAT = 4,
  QUOIN_UNSUPPORTED = 5,
  QUOIN_LIMIT_EXCEEDED = 6,
  QUOIN_CANCELLED = 7,
  QUOIN_DEVICE_LOST = 8,
  QUOIN_BAD_HANDLE = 9,
  QUOIN_OUT_OF_MEMORY = 10,
  QUOIN_INTERNAL = 11
} quoin_status;

typedef enum quoin_scalar {
  QUOIN_UINT8 = 0,
  QUOIN_INT8 = 1,
  QUOIN_UINT16 = 2,
  QUOIN_INT16 = 3,
  QUOIN_UINT32 = 4,
  QUOIN_INT32 = 5,
  QUOIN_UINT64 = 6,
  QUOIN_INT64 = 7,
  QUOIN_FLOAT32 = 8,
  QUOIN_FLOAT64 = 9
} quoin_scalar;

typedef uint64_t quoin_scene;
typedef uint64_t quoin_mesh;

/* A dense array of numbers; axes 0, 1 and 2 are x, y and z. */
typedef struct quoin_array {
  size_t size;
  const void* data;
  int32_t scalar; /* quoin_scalar */
  int64_t shape[3];
  int64_t strides[3]; /* bytes, of any sign; all three 0: without gaps, z fastest and x slowest */
  double spacing[3];  /* of neighbours; all three 0: 1 */
  double origin[3];   /* where sample (0, 0, 0) lies */
} quoin_array;

typedef struct quoin_grid_info {
  size_t size;
  char name[128]; /* UTF-8, cut off where it is longer */
  int64_t voxels;
  int32_t min[3]; /* of the tight box around its voxels, or its field's solid */
  int32_t extent[3];
  int32_t has_field; /* densities: the surface of a volume */
  double pivot[3];   /* the point about which instances turn it, in its voxels */
} quoin_grid_info;

typedef struct quoin_type {
  size_t size;
  uint8_t rgba[4]; /* sRGB; alpha below 255 makes a type transparent */
  float emission;  /* 0: none */
  float metalness; /* 0 to 1 */
  float roughness; /* 0 to 1; QUOIN_INIT's 0 is a mirror */
  char name[128];
  int32_t transparent; /* given: 0 is what rgba's alpha says */
  float ior;           /* index of refraction of what is transparent; given: 0 is 1.5 */
  float scattering;    /* of clouds: how often light is scattered on a voxel's length; 0: glass */
  float anisotropy;    /* of that: the mean cosine of the angle, -1 to 1 */
} quoin_type;

/* One placement of a grid in the world. */
typedef struct quoin_instance {
  size_t size;
  char name[128];             /* UTF-8; cut off at its end where it is longer */
  size_t grid;                /* its number; of an instance of no grid as many as there are */
  double world_from_grid[12]; /* three rows of four: takes a point (x, y, z, 1) of the grid, in voxels, to the world */
  int32_t visible;            /* its own switch */
  int32_t shown;              /* told: whether its groups and its layer show it too */
  size_t group;               /* that it belongs to, counted from 1; 0: none */
  char layer[128];            /* told: the name of its layer */
} quoin_instance;

/* Instances, and groups, that belong together. Places are those of the world, whatever the groups. */
typedef struct quoin_group {
  size_t size;
  char name[128];
  size_t parent; /* counted from 1, less than its own number; 0: none */
  int32_t shown;
  char layer[128];
} quoin_group;

/* A camera of the file. right, up and forward are unit, and perpendicular. */
typedef struct quoin_camera {
  size_t size;
  int32_t number;   /* that the file has it under */
  int32_t is_first; /* to be looked through at first */
  int32_t is_orthographic;
  double position[3];
  double right[3], up[3], forward[3];
  double vertical_fov_degrees; /* of perspective */
  double view_height;          /* of orthographic: world units from the picture's lower edge to its upper */
  double focus_distance;       /* 0: not said */
} quoin_camera;

/* A light without a body; types that emit are lights by themselves. */
typedef struct quoin_lamp {
  size_t size;
  char name[128];
  int32_t is_spot; /* else it shines into all directions alike */
  double position[3], direction[3];
  float colour[3];                                 /* linear */
  double intensity;                                /* the light of a white surface that faces it 1 world unit away */
  double range;                                    /* infinity: without an end */
  double inner_angle_degrees, outer_angle_degrees; /* of a spot, from its middle */
} quoin_lamp;

/* What a file says, or a scene is, as a whole. */
typedef struct quoin_scene_info {
  size_t size;
  char format[32]; /* "vox"; empty of a scene that was not read */
  double min[3];   /* the box around what is shown, in the world; all 0 where nothing is */
  double max[3];
  int32_t has_sun;
  double sun[3];      /* from the scene towards it */
  int64_t last_frame; /* of its animation */
} quoin_scene_info;

typedef struct quoin_format {
  size_t size;
  char name[32];
  char extensions[64]; /* ".kv6 .kvx" */
  char description[128];
  int32_t readable, writable;
  int32_t is_mesh; /* triangles */
} quoin_format;

/* What a mesh has; null where it has none. One entry a vertex, but for indices and interfaces. */
typedef struct quoin_mesh_data {
  size_t size;
  size_t vertex_count;
  size_t index_count;
  size_t interface_count;
  const float* positions;    /* [vertex_count][3] */
  const float* normals;      /* [vertex_count][3], unit */
  const uint8_t* colours;    /* [vertex_count][4], sRGB, without occlusion; of grids */
  const float* occlusion;    /* [vertex_count], 0 open to 1 dark; of grids */
  const uint32_t* indices;   /* three a triangle, counter-clockwise from outside */
  const int64_t* interfaces; /* [interface_count][4]: back label, front label, first index, count; of labels */
  const uint16_t* types;     /* [vertex_count], of grids meshed as blocks: first blocks, four vertices and six indices a
                                face (watertight: or more of both), then the surfaces of fields, whose type is 0 */
} quoin_mesh_data;

typedef struct quoin_mesh_options {
  size_t size;
  int32_t smooth;       /* 0: blocks; else smooth surfaces around them */
  int32_t no_occlusion; /* of blocks */
  int32_t threads;      /* 0: all */
  int32_t reserved;     /* not read: padding of earlier versions */
  int32_t watertight; /* of blocks: no corner of a face lies inside another's edge, so no gaps are seen there. Faces get
                           more triangles. Smooth surfaces always are */
} quoin_mesh_options;

/* How a picture says heights. */
typedef enum quoin_heights {
  QUOIN_HEIGHTS_NONE = 0,
  QUOIN_HEIGHTS_GREY = 1,     /* a height is a level, of 8 or 16 bits, times metres_per_level */
  QUOIN_HEIGHTS_MAPBOX = 2,   /* terrain-RGB: (65,536 R + 256 G + B) / 10 - 10,000 metres */
  QUOIN_HEIGHTS_TERRARIUM = 3 /* 256 R + G + B / 256 - 32,768 metres */
} quoin_heights;

typedef struct quoin_load_options {
  size_t size;
  int32_t threads;     /* 0: all */
  int32_t show_hidden; /* what is hidden becomes visible */
  int32_t frame;       /* of an animation */
  int32_t radius;      /* of a world that is read by chunks: of 64 voxels, around its spawn; 0: 4 */
  int32_t has_iso;     /* of a volume: what is above `iso` is solid; else a value is found */
  float iso;
  int32_t mesh_voxels;  /* of a file of triangles: voxels along its longest side; 0: 128 */
  double voxel_size;    /* or of this size, in the file's unit */
  int32_t raw_shape[3]; /* the file holds values alone, so many along each axis, the first one fastest; all 0: it is
                            another file */
  int32_t raw_scalar;   /* quoin_scalar, of these */
  int32_t raw_big_endian;
  int32_t heights;             /* quoin_heights: the file is a picture (PNG) of the heights of a landscape */
  double metres_per_level;     /* 0: 1 */
  double metres_per_pixel;     /* between neighbouring heights; 0: 1, with a warning */
  double metres_per_voxel;     /* 0: metres_per_pixel */
  double exaggeration;         /* heights times this; 0: 1 */
  int32_t ground_depth;        /* voxels of ground below the lowest height, up to 4,096; 0: 8 */
  int32_t smooth_ground;       /* densities, whose surface is smooth, rather than voxels */
  int32_t allow_outside_files; /* the file may name files outside its folder: for input from a trusted source only */
  const char* dimension; /* of a Minecraft world: "overworld", "nether", "end" or "NAMESPACE:NAME"; null or "": the
                                  overworld, or the first that the world has. Other files ignore it */
} quoin_load_options;

typedef enum quoin_fill {
  QUOIN_FILL_ALL = 0,    /* what the triangles enclose, and what they pass through: thin parts stay */
  QUOIN_FILL_SOLID = 1,  /* voxels whose centre they enclose */
  QUOIN_FILL_SURFACE = 2 /* voxels that they pass through; hollow */
} quoin_fill;

/* Triangles to become voxels. Any soup will do. */
typedef struct quoin_triangles {
  size_t size;
  size_t vertex_count, triangle_count;
  const float* positions;    /* [vertex_count][3] */
  const uint32_t* indices;   /* [triangle_count][3], counter-clockwise from outside */
  const float* colours;      /* [vertex_count][4], linear light and alpha, times the materials'; null: white. Where
                                alpha is 0 there is no surface, below 1 the voxels are transparent */
  const uint32_t* materials; /* [triangle_count], of `types`; null: 0 */
  const quoin_type* types;   /* [type_count], from the first on, each with its size; null: one, light grey */
  size_t type_count;
} quoin_triangles;

typedef struct quoin_voxelize_options {
  size_t size;
  double voxel_size; /* in the unit of positions; 0: 1 */
  int32_t fill;      /* quoin_fill */
  int32_t max_types; /* that are added: near colours are merged, also of types that differ in colour alone; 0: as many
                        as there can be */
  int32_t threads;
} quoin_voxelize_options;

typedef struct quoin_render_options {
  size_t size;
  int32_t width, height; /* 0: 1280 x 720 */
  int32_t samples;       /* a pixel; 0: 4, of paths 64 */
  int32_t paths;         /* 0: light by rays; else paths of light */
  int32_t threads;       /* 0: all */
  int32_t has_camera;    /* 0: the whole scene, seen from in front, the right and above */
  double camera[3], look_at[3];
  double fov_degrees; /* vertical; 0: 45 */
  int32_t has_sun;    /* 0: beside the camera that is in front, the right and above */
  double sun[3];      /* from the scene towards the sun; any length but 0. The sky follows it */
} quoin_render_options;

/* What rays met; arrays of the caller, of one entry a ray; null: not wanted. */
typedef struct quoin_hits {
  size_t size;
  double* t;      /* in lengths of the direction; infinity: nothing was met */
  int32_t* voxel; /* [count][3], in its grid */
  uint16_t* type;
  double* normal; /* [count][3], in the world */
} quoin_hits;

/* Told how far a long call has come, 0 to 1. Returns whether to go on: 0 ends the call with QUOIN_CANCELLED. Any thread
 * calls it, one at a time, and it is to call nothing of Quoin's. */
typedef int32_t (*quoin_progress)(double fraction, void* user);

QUOIN_API const char* quoin_version(void);
/* Of this thread's last call that failed. Lasts until its next call. Never null. */
QUOIN_API const char* quoin_last_error(void);
/* Of the calls that this thread makes from now on; null: nobody is told. `user` is handed through. */
QUOIN_API quoin_status quoin_set_progress(quoin_progress progress, void* user);
/* Frees a scene or a mesh; 0 is none, and fine. */
QUOIN_API quoin_status quoin_free(uint64_t handle);

/* Scenes. `path` is UTF-8. */
QUOIN_API quoin_status quoin_scene_create(quoin_scene* out);
QUOIN_API quoin_status quoin_scene_load(const char* path, quoin_scene* out);
QUOIN_API quoin_status quoin_scene_load_bytes(const void* data, size_t bytes, quoin_scene* out);
/* The same with options; null: none. */
QUOIN_API quoin_status quoin_scene_load_with(const char* path, const quoin_load_options* options, quoin_scene* out);
QUOIN_API quoin_status quoin_scene_load_bytes_with(const void* data, size_t bytes, const quoin_load_options* options,
                                                   quoin_scene* out);
QUOIN_API quoin_status quoin_scene_get_info(quoin_scene scene, quoin_scene_info* out);
/* What files can be read and written. */
QUOIN_API quoin_status quoin_format_count(size_t* out);
QUOIN_API quoin_status quoin_format_get(size_t index, quoin_format* out);
/* By the name's ending: .quoin, .json, .vox and others hold voxels; .glb, .gltf, .obj, .ply, .stl and .3mf their
 * meshes, of blocks. quoin_format_get tells all. */
QUOIN_API quoin_status quoin_scene_save(quoin_scene scene, const char* path);
/* One line each: first of what reading left out, and voxelizing merged, then of what the last save left out. */
QUOIN_API quoin_status quoin_scene_warning_count(quoin_scene scene, size_t* out);
QUOIN_API quoin_status quoin_scene_warning(quoin_scene scene, size_t index, char* text, size_t capacity);

/* Types of voxels: 0 is air, others count up from 1. */
QUOIN_API quoin_status quoin_type_count(quoin_scene scene, size_t* out);
QUOIN_API quoin_status quoin_type_get(quoin_scene scene, size_t index, quoin_type* out);
QUOIN_API quoin_status quoin_type_add(quoin_scene scene, const quoin_type* type, uint16_t* out);

/* Grids, by number. */
QUOIN_API quoin_status quoin_grid_count(quoin_scene scene, size_t* out);
QUOIN_API quoin_status quoin_grid_get_info(quoin_scene scene, size_t grid, quoin_grid_info* out);
/* Writes the types of the voxels from `min` on, shape[0] x shape[1] x shape[2] of them, x slowest and z fastest, as
 * uint16_t[capacity]. */
QUOIN_API quoin_status quoin_grid_read(quoin_scene scene, size_t grid, const int32_t min[3], const int32_t shape[3],
                                       uint16_t* out, size_t capacity);
/* Adds a grid of an array of types (QUOIN_UINT8 or QUOIN_UINT16), all of which the scene has, and shows it at
 * array->origin, which is rounded down to whole voxels. `name` may be null, and `out`, its number. */
QUOIN_API quoin_status quoin_grid_add(quoin_scene scene, const quoin_array* array, const char* name, size_t* out);

/* Makes voxels of triangles, and shows them where these are, in units of a voxel: what fills the cube from
 * voxel_size * (x, y, z) on becomes the voxel at (x, y, z) of the world. Adds the types that it takes.
 * `options`, `name` and `out` may be null. */
QUOIN_API quoin_status quoin_grid_voxelize(quoin_scene scene, const quoin_triangles* triangles,
                                           const quoin_voxelize_options* options, const char* name, size_t* out);

/* Where grids stand, which group each place belongs to, and what else files hold; by number. */
QUOIN_API quoin_status quoin_instance_count(quoin_scene scene, size_t* out);
QUOIN_API quoin_status quoin_instance_get(quoin_scene scene, size_t index, quoin_instance* out);
/* Places a grid once more, or puts an instance elsewhere. world_from_grid turns, mirrors, moves and scales, alike along
 * all axes. Who adds is to say that it is visible. `out` may be null. */
QUOIN_API quoin_status quoin_instance_add(quoin_scene scene, const quoin_instance* instance, size_t* out);
QUOIN_API quoin_status quoin_instance_set(quoin_scene scene, size_t index, const quoin_instance* instance);
QUOIN_API quoin_status quoin_group_count(quoin_scene scene, size_t* out);
QUOIN_API quoin_status quoin_group_get(quoin_scene scene, size_t number, quoin_group* out); /* from 1 */
QUOIN_API quoin_status quoin_camera_count(quoin_scene scene, size_t* out);
QUOIN_API quoin_status quoin_camera_get(quoin_scene scene, size_t index, quoin_camera* out);
QUOIN_API quoin_status quoin_lamp_count(quoin_scene scene, size_t* out);
QUOIN_API quoin_status quoin_lamp_get(quoin_scene scene, size_t index, quoin_lamp* out);

/* Meshes; `options` may be null. Of arrays nothing is copied. */
QUOIN_API quoin_status quoin_grid_mesh(quoin_scene scene, size_t grid, const quoin_mesh_options* options,
                                       quoin_mesh* out);
/* Where the array has the value `iso`. solid_below: what is less than it is solid, as of signed distances. */
QUOIN_API quoin_status quoin_surface_nets(const quoin_array* array, double iso, int32_t solid_below, int32_t threads,
                                          quoin_mesh* out);
/* The surfaces between whole numbers; relaxation steps, 0 to 1,000, smooth their stairs. */
QUOIN_API quoin_status quoin_mesh_labels(const quoin_array* array, int64_t background, int32_t relaxation_steps,
                                         int32_t threads, quoin_mesh* out);
QUOIN_API quoin_status quoin_mesh_view(quoin_mesh mesh, quoin_mesh_data* out);

/* A picture, rows from the top, three bytes a pixel (sRGB), into rgb[capacity]. `options` may be null. */
QUOIN_API quoin_status quoin_scene_render(quoin_scene scene, const quoin_render_options* options, uint8_t* rgb,
                                          size_t capacity);
/* The nearest voxel or surface along each ray: origins[count][3] and directions[count][3], in the world. The first call
 * builds a tree, which the scene keeps and brings up to date. */
QUOIN_API quoin_status quoin_scene_rays(quoin_scene scene, size_t count, const double* origins,
                                        const double* directions, double max_t, const quoin_hits* out);

/* Changes the voxels of a grid from array->origin on, in its own voxels, rounded down: all of the box of the array
 * become the types (QUOIN_UINT8 or QUOIN_UINT16) that it holds, 0 air. What quoin_grid_read read goes back so. Where
 * the scene has not all of its types nothing changes. */
QUOIN_API quoin_status quoin_grid_write(quoin_scene scene, size_t grid, const quoin_array* array);

/* What is put into a scene beside its grids. Which of it a format holds, and what saving left out, warnings say. */

/* Instances and groups that are shown and hidden together, wherever they stand. Layers are known by their names; of
 * several with one name the first is meant. */
typedef struct quoin_layer {
  size_t size;
  char name[128];
  int32_t visible;
} quoin_layer;

/* The one sun of a scene, infinitely far away. */
typedef struct quoin_sun {
  size_t size;
  double direction[3];  /* from the scene towards it, of any length but 0 */
  double brightness;    /* that of a white surface that faces it; 0: there is no sun */
  float colour[3];      /* linear */
  double angle_degrees; /* of its disc, across; 0: a point */
} quoin_sun;

QUOIN_API quoin_status quoin_layer_count(quoin_scene scene, size_t* out);
QUOIN_API quoin_status quoin_layer_get(quoin_scene scene, size_t index, quoin_layer* out);
/* Adds a layer, or shows or hides that of this name, which is not to be empty. */
QUOIN_API quoin_status quoin_layer_set(quoin_scene scene, const quoin_layer* layer);
/* Puts an instance on the layer of this name, which the scene has; null or empty: on none. */
QUOIN_API quoin_status quoin_instance_set_layer(quoin_scene scene, size_t index, const char* layer);
/* Adds a group, into which quoin_instance_set and _add put instances. `shown` is its own switch here, and `layer` the
 * name of one that the scene has, or empty. `out`, its number, may be null. */
QUOIN_API quoin_status quoin_group_add(quoin_scene scene, const quoin_group* group, size_t* out);
/* Adds a camera under its number, which no other has. right is forward x up. */
QUOIN_API quoin_status quoin_camera_add(quoin_scene scene, const quoin_camera* camera);
/* Adds a lamp. A range of 0 is one without an end; an outer angle of 0 that of 45 degrees. */
QUOIN_API quoin_status quoin_lamp_add(quoin_scene scene, const quoin_lamp* lamp);
/* Of a scene without a sun the brightness is 0, and all else. What a file does not say is as usual: white, of
 * brightness 1 and half a degree. */
QUOIN_API quoin_status quoin_sun_get(quoin_scene scene, quoin_sun* out);
QUOIN_API quoin_status quoin_sun_set(quoin_scene scene, const quoin_sun* sun);

#ifdef __cplusplus
}
#endif
/* NOLINTEND(readability-*,modernize-*,performance-*,cppcoreguidelines-*) */
#endif
