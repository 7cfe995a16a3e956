/* Quoin's C99 interface, for C and languages that call C: voxel files, arrays, meshes, images and rays.
 *
 * Status:   every function that can fail returns QUOIN_OK or an error code. After an error, quoin_last_error() returns
 *           the reason in one line. No call ends the process or throws an exception.
 * Handles:  scenes, meshes and textures are numbers, never 0. A freed or unknown handle gives QUOIN_BAD_HANDLE.
 * Arrays:   the caller owns its input and output arrays. Arrays from quoin_mesh_view and quoin_textures_faces belong to
 *           the mesh or the textures, and are valid until these are freed.
 * Structs:  set `size` to sizeof the struct (QUOIN_INIT does). Later versions add fields at the end; programs compiled
 *           with an older header, whose structs are shorter, keep working.
 * Axes:     right-handed, +Y up. Voxel (x, y, z) is the cube from (x, y, z) to (x + 1, y + 1, z + 1).
 * Threads:  any thread may call any function. Any number of threads can read a scene at the same time. A change or a
 *           save has exclusive access: it waits for running calls, and later calls wait for it. */
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

/* Initialises a struct of `type`: sets `size`, and all other fields to 0: their default. Set four fields yourself:
 * quoin_type alpha (0: invisible), quoin_type roughness (0: a mirror), quoin_instance visible (0: hidden), and
 * quoin_shapes groups (0: connects to no type, not even its own). */
#define QUOIN_INIT(type) \
  { .size = sizeof(type) }

typedef enum quoin_status {
  QUOIN_OK = 0,
  QUOIN_INVALID_ARGUMENT = 1, /* null, NaN, invalid size, index out of range */
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
typedef uint64_t quoin_textures;

/* A dense array of numbers; axes 0, 1 and 2 are x, y and z. */
typedef struct quoin_array {
  size_t size;
  const void* data;
  int32_t scalar; /* quoin_scalar */
  int64_t shape[3];
  int64_t strides[3]; /* in bytes, of any sign; all 0: contiguous, z fastest, x slowest */
  double spacing[3];  /* between samples; all 0: 1 */
  double origin[3];   /* position of sample (0, 0, 0) */
} quoin_array;

typedef struct quoin_grid_info {
  size_t size;
  char name[128]; /* UTF-8, truncated if longer */
  int64_t voxels;
  int32_t min[3]; /* minimum corner of the tight box around the grid's voxels or its field's solid */
  int32_t extent[3];
  int32_t has_field; /* has a density field: the surface of a volume */
  double pivot[3];   /* centre of rotation for instances, in voxels */
  int32_t unsaved;   /* 1: world files (.quoin) leave out the grid and its instances */
  int32_t whole;     /* 1: streamed worlds load all of the grid when the file is opened */
} quoin_grid_info;

typedef struct quoin_type {
  size_t size;
  uint8_t rgba[4]; /* sRGB; alpha below 255 makes a type transparent */
  float emission;  /* 0: none */
  float metalness; /* 0 to 1 */
  float roughness; /* 0 to 1; QUOIN_INIT's 0 is a mirror */
  char name[128];
  int32_t transparent; /* 1: transparent even if alpha is 255; input 0: transparent if alpha is below 255 */
  float ior;           /* index of refraction of transparent types; input 0: 1.5 */
  float scattering;    /* clouds: mean number of scatterings per voxel length; 0: glass */
  float anisotropy;    /* clouds: mean cosine of the scattering angle, -1 to 1 */
  int32_t light_cost;  /* levels of propagated light that a step into it costs, 0 to 15; 1: water, leaves */
  /* 1: yes, -1: no, 0: yes unless transparent. blocks_light: propagated light does not leave it. occludes: it darkens
   * corners of faces; a transparent type cannot. */
  int32_t blocks_light;
  int32_t occludes;
  int32_t reserved;   /* ignored; was padding in earlier versions */
  int32_t state_bits; /* number of bits of its voxels' states, from the lowest bit up, 0 to 32 */
  int32_t passable;   /* 1: does not stop moving bodies */
} quoin_type;

enum {
  QUOIN_FACE_OPAQUE = 0,     /* the texture has no transparent texels */
  QUOIN_FACE_CUTOUT = 1,     /* texels with an alpha of at least 128 are visible, others are not: leaves, fences */
  QUOIN_FACE_TRANSLUCENT = 2 /* alpha blends the face with the background: stained glass */
};
/* The number of a texture that quoin_face and quoin_mesh_data do not have. */
#define QUOIN_NO_TEXTURE 0xFFFFFFFFu

/* One face of a type: a texture that covers the face of a voxel once. Turn 0 shows the texture to a viewer outside like
 * this: on the four sides, its top is at +Y; on +Y its right is at +Z and its top at +X; on -Y its right is at +X and
 * its top at +Z. */
typedef struct quoin_face {
  size_t size;
  char name[128];             /* of the texture; UTF-8, truncated if longer */
  const uint8_t* rgba;        /* [texels][texels][4]: rows from the top, sRGB with linear alpha, not premultiplied */
  int32_t texels;             /* per side of the texture: 16, 32, 64, 128, 256, 512 or 1,024 */
  int32_t turn;               /* clockwise quarter turns for a viewer outside, 0 to 3 */
  int32_t mirrored;           /* 1: exchanges left and right, before the turn */
  int32_t alpha;              /* QUOIN_FACE_... */
  int32_t has_tint;           /* 0: white */
  uint8_t tint[4];            /* sRGB; multiplies the texture in linear light. The fourth number has no effect */
  uint32_t texture;           /* output of quoin_textures_faces: the number of its texture, layer + 65,536 * array */
  int32_t reserved;           /* ignored; was padding in earlier versions */
  int32_t has_emission_share; /* 0: the face has all of the type's emission */
  int32_t emission_share;     /* its share of the type's emission, in 255ths: 0 none, 255 all */
} quoin_face;

/* Textures of one size, for a device's texture array. */
typedef struct quoin_texture_array {
  size_t size;
  int32_t texels; /* per side */
  int32_t levels; /* of mipmaps, down to one texel: 5 for 16 texels */
  size_t layers;
} quoin_texture_array;

/* Directions are numbered 0 (+X), 1 (-X), 2 (+Y), 3 (-Y), 4 (+Z) and 5 (-Z). Orientations turn by multiples of 90
 * degrees, and can mirror. Their numbers, 0 to 47, are 8 * order, plus 1, 2 and 4 if the turned x, y and z are negated.
 * order has the axes that become x, y and z: 0 xyz, 1 yzx, 2 zxy, 3 yxz, 4 xzy, 5 zyx. 0 turns nothing;
 * quoin_orientation_turn gives the others. */

enum {
  QUOIN_ORIENTATIONS_LISTED = 0,                 /* those of by_value */
  QUOIN_ORIENTATIONS_ABOUT_Y = 1,                /* 0, 1, 2 and 3 quarter turns about y: a furnace */
  QUOIN_ORIENTATIONS_ALONG_AXES = 2,             /* +Y to +Y, +X and +Z: a log */
  QUOIN_ORIENTATIONS_TO_DIRECTIONS = 3,          /* +Y to +X, -X, +Y, -Y, +Z and -Z: a torch at any face */
  QUOIN_ORIENTATIONS_ABOUT_Y_AND_UPSIDE_DOWN = 4 /* four turns about y, then the same upside down: stairs */
};

/* The orientations that a type's state selects. They turn faces and shapes. */
typedef struct quoin_orientations {
  size_t size;
  int32_t kind;      /* QUOIN_ORIENTATIONS_...; except LISTED, it sets by_value and count */
  int32_t first_bit; /* the lowest bit of the state that selects */
  int32_t front; /* the direction of its front before it is turned: the door of a furnace, the high side of stairs */
  int32_t count; /* 0: never turned; at most 48 */
  uint8_t by_value[48]; /* by the value of the state's bits */
} quoin_orientations;

enum {
  QUOIN_LOOK_NONE = -1,  /* the side is not drawn */
  QUOIN_LOOK_OF_TYPE = 0 /* the type's face of the side's direction, or the type's colour */
};

/* A box of a shape, with a look per side. Lengths are sixteenths: a voxel spans 0 to 16 on each axis, and a box may
 * reach from -16 to 32, also after its turn. */
typedef struct quoin_shape_element {
  size_t size;
  float min[3], max[3]; /* equal along one axis: a plate */
  int32_t has_turn;
  int32_t turn_axis;     /* 0 x, 1 y, 2 z */
  float turn_degrees;    /* counter-clockwise, seen from the positive end of the axis */
  float turn_origin[3];  /* a point of the axis */
  int32_t turn_rescales; /* 1: stretches the box across the axis by 1 / cos(turn_degrees) */
  int32_t passable;      /* 1: bodies pass */
  int32_t looks[6];   /* by direction, before the turn: QUOIN_LOOK_..., or the number in quoin_shapes.looks, from 1 */
  uint32_t has_parts; /* a bit per direction; 0: the part of the texture that a full cube shows at this place */
  float parts[6][4];  /* left, top, right, bottom of the part of the texture, in sixteenths */
  int32_t reserved;   /* ignored */
} quoin_shape_element;

/* A condition of a voxel's state, neighbours and position. Directions are those of the unturned type. */
typedef struct quoin_shape_condition {
  size_t size;
  uint32_t state_mask;  /* the bits of the state that are compared */
  uint32_t state;       /* their values */
  uint32_t connected;   /* a bit per direction: sides with a connection */
  uint32_t unconnected; /* sides without one */
  int32_t corner;       /* QUOIN_CORNER_... */
  int32_t reserved;     /* ignored */
  /* A share of all voxels, selected by their positions as if at random: those whose number, which depends only on the
   * position in the grid, is at least position_first and less than position_end after division by position_count. */
  uint32_t position_count; /* 0: all voxels; at most 4096 */
  uint32_t position_first;
  uint32_t position_end;
  uint32_t reserved_too; /* ignored */
} quoin_shape_condition;

enum { /* the corner that stairs form with their neighbours; left and right of a person who walks up */
       QUOIN_CORNER_ANY = 0,
       QUOIN_CORNER_STRAIGHT = 1,
       QUOIN_CORNER_OUTER_LEFT = 2,
       QUOIN_CORNER_OUTER_RIGHT = 3,
       QUOIN_CORNER_INNER_LEFT = 4,
       QUOIN_CORNER_INNER_RIGHT = 5
};

/* A part of a type's shape: the next elements and conditions of quoin_shapes. It is present if any of its conditions
 * holds, and always if it has none. */
typedef struct quoin_shape_part {
  size_t size;
  size_t element_count; /* 1 to 128 */
  size_t condition_count;
  int32_t orientation; /* turns the part, before the state's orientation */
  int32_t reserved;    /* ignored */
} quoin_shape_part;

enum {
  QUOIN_NEIGHBOURS_NONE = 0,
  QUOIN_NEIGHBOURS_CONNECTED = 1, /* fences, panes: connected to types of a common group, and to full sides */
  QUOIN_NEIGHBOURS_STAIRS = 2,    /* stairs whose unturned high side is at +X form corners */
  QUOIN_NEIGHBOURS_FLUID =
      3 /* needs no parts. State bits 0 to 2: the level, 0 is a source; bit 3: falls, fills its voxel */
};

/* The shapes of a type. `size` is set in each element of the arrays. */
typedef struct quoin_shapes {
  size_t size;
  const quoin_shape_part* parts;
  size_t part_count;                       /* at most 64 */
  const quoin_shape_element* elements;     /* of all parts, one after another */
  size_t element_count;                    /* at most 512 */
  const quoin_shape_condition* conditions; /* of all parts, one after another, then those of the fluid */
  size_t condition_count;
  /* Looks that sides refer to by number. Without texels (rgba null, texels 0), a look has the colour of its tint. */
  const quoin_face* looks;
  size_t look_count;
  int32_t neighbours; /* QUOIN_NEIGHBOURS_... */
  /* A bit per group: types with a common bit connect. Set it: usually 1. A fluid has exactly one bit. Fluids with the
   * same bit are one body: give unrelated fluids, such as water and lava, different bits. */
  uint32_t groups;
  int32_t ignores_full_sides; /* 1: does not connect to sides of other types that are covered wholly */
  int32_t reserved;           /* ignored */
  /* A fluid in the rest of the voxel, such as the water around a fence. It is present if any of its conditions holds,
   * and always if it has none; they may only use the state. */
  uint32_t fluid_groups;        /* as `groups` of the fluid; 0: no fluid */
  uint32_t reserved_too;        /* ignored */
  size_t fluid_condition_count; /* how many of the last `conditions` are the fluid's */
} quoin_shapes;

enum { /* rules for the front of a placed voxel */
       QUOIN_FRONT_BY_SHAPE =
           0, /* AWAY_FROM_PLAYER for stairs, AWAY_FROM_WALL for torches at a wall, else TOWARDS_PLAYER */
       QUOIN_FRONT_TOWARDS_PLAYER = 1,
       QUOIN_FRONT_AWAY_FROM_PLAYER = 2,
       QUOIN_FRONT_AWAY_FROM_WALL =
           3 /* the direction of the face that was hit, if it is a side; else towards the player */
};

/* A player's hit on the face of a voxel, next to the voxel to place. Vectors are in the grid's space. */
typedef struct quoin_placing {
  size_t size;
  int32_t face;     /* the direction of the face */
  int32_t front;    /* QUOIN_FRONT_... */
  float point[3];   /* the point that was hit, in voxels from the hit voxel's minimum corner */
  int32_t reserved; /* ignored */
  double look[3];   /* direction of the player's view, of any length */
} quoin_placing;

/* One placement of a grid in the world. */
typedef struct quoin_instance {
  size_t size;
  char name[128]; /* UTF-8, truncated if longer */
  size_t grid;    /* grid number; equal to the grid count if the instance has no grid */
  /* Three rows of four: transforms a point (x, y, z, 1) from the grid, in voxels, to the world. */
  double world_from_grid[12];
  int32_t visible; /* the instance's own flag */
  int32_t shown;   /* output: also considers its groups and layer */
  size_t group;    /* parent group, counted from 1; 0: none */
  char layer[128]; /* output: layer name */
  int32_t unsaved; /* the instance's own flag; 1: world files (.quoin) leave it out */
} quoin_instance;

/* A group of instances and other groups. All transforms are in world space, independent of groups. */
typedef struct quoin_group {
  size_t size;
  char name[128];
  size_t parent; /* counted from 1, less than the group's own number; 0: none */
  int32_t shown;
  char layer[128];
  int32_t reserved; /* ignored; was padding in earlier versions */
  int32_t unsaved;  /* the group's own flag; 1: world files (.quoin) leave out the group and everything below it */
} quoin_group;

/* A camera of a scene. right, up and forward are perpendicular unit vectors. */
typedef struct quoin_camera {
  size_t size;
  int32_t number;   /* number in the file */
  int32_t is_first; /* the initial camera */
  int32_t is_orthographic;
  double position[3];
  double right[3], up[3], forward[3];
  double vertical_fov_degrees; /* perspective */
  double view_height;          /* orthographic: world units from the image's bottom edge to its top edge */
  double focus_distance;       /* 0: not stored */
} quoin_camera;

/* A light without geometry. Voxel types with emission also emit light but are not lamps. */
typedef struct quoin_lamp {
  size_t size;
  char name[128];
  int32_t is_spot; /* 0: shines equally in all directions */
  double position[3], direction[3];
  float colour[3];  /* linear */
  double intensity; /* light received by a white surface facing the lamp, 1 world unit away */
  double range;     /* infinity: unlimited */
  double inner_angle_degrees, outer_angle_degrees; /* of a spot, from its axis */
} quoin_lamp;

/* Properties of a scene or its file. */
typedef struct quoin_scene_info {
  size_t size;
  char format[32]; /* "vox"; empty if the scene was not loaded */
  double min[3];   /* bounds of everything visible, in world space; all 0 if empty */
  double max[3];
  int32_t has_sun;
  double sun[3];      /* from the scene towards the sun */
  int64_t last_frame; /* of the animation */
} quoin_scene_info;

typedef struct quoin_format {
  size_t size;
  char name[32];
  char extensions[64]; /* ".kv6 .kvx" */
  char description[128];
  int32_t readable, writable;
  int32_t is_mesh; /* contains triangles */
} quoin_format;

/* The arrays of a mesh; null if absent. Arrays have one entry per vertex, except indices and interfaces. */
typedef struct quoin_mesh_data {
  size_t size;
  size_t vertex_count;
  size_t index_count;
  size_t interface_count;
  const float* positions;  /* [vertex_count][3] */
  const float* normals;    /* [vertex_count][3], unit */
  const uint8_t* colours;  /* [vertex_count][4], sRGB, without occlusion; for grids */
  const float* occlusion;  /* [vertex_count], 0 open to 1 dark; for grids */
  const uint32_t* indices; /* three per triangle, counter-clockwise seen from outside */
  /* [interface_count][4]: back label, front label, first index, index count; for labels. */
  const int64_t* interfaces;
  /* [vertex_count], for grids meshed as blocks. Blocks come first, with four vertices and six indices per face, also
   * of shapes (watertight: possibly more). The surfaces of fields follow, with type 0. */
  const uint16_t* types;
  /* For grids meshed as blocks, if any type of the scene has faces or shapes. A face shows tint times texture. */
  const uint32_t* textures; /* [vertex_count]: numbers as in quoin_face; QUOIN_NO_TEXTURE: the tint is the colour */
  const float* texture_uvs; /* [vertex_count][2]: rightwards and downwards, 1 per voxel; the texture repeats */
  const uint8_t* tints;     /* [vertex_count][4], sRGB */
  const uint8_t* emission_shares; /* [vertex_count]: the face's share of its type's emission, in 255ths */
} quoin_mesh_data;

typedef struct quoin_mesh_options {
  size_t size;
  int32_t smooth;       /* 0: blocks; else smooth surfaces */
  int32_t no_occlusion; /* blocks only */
  int32_t threads;      /* 0: all */
  int32_t reserved;     /* ignored; was padding in earlier versions */
  /* Blocks only: keeps face corners off the inside of other faces' edges. This avoids visible gaps but makes more
   * triangles. Smooth surfaces are always watertight. */
  int32_t watertight;
  /* Numbers the textures of faces; 0: as quoin_scene_textures with a limit of 0 numbers those of the scene. */
  quoin_textures textures;
} quoin_mesh_options;

/* The encoding of heights in an image. */
typedef enum quoin_heights {
  QUOIN_HEIGHTS_NONE = 0,
  QUOIN_HEIGHTS_GREY = 1,     /* height = level (8 or 16 bits) * metres_per_level */
  QUOIN_HEIGHTS_MAPBOX = 2,   /* terrain-RGB: (65,536 R + 256 G + B) / 10 - 10,000 metres */
  QUOIN_HEIGHTS_TERRARIUM = 3 /* 256 R + G + B / 256 - 32,768 metres */
} quoin_heights;

typedef struct quoin_load_options {
  size_t size;
  int32_t threads;     /* 0: all */
  int32_t show_hidden; /* shows hidden instances, groups and layers */
  int32_t frame;       /* animation frame */
  /* For worlds read by chunks: chunks (64 voxels) to load on each side of the spawn point; 0: 4. */
  int32_t radius;
  int32_t has_iso; /* volumes: 1: values above `iso` are solid; 0: automatic threshold */
  float iso;
  int32_t mesh_voxels; /* triangle files: voxels along the longest side; 0: 128 */
  double voxel_size;   /* overrides mesh_voxels; in the file's unit */
  /* Number of raw values along each axis, the first axis fastest. All 0: the file is not a volume of raw values. */
  int32_t raw_shape[3];
  int32_t raw_scalar; /* quoin_scalar of the raw values */
  int32_t raw_big_endian;
  int32_t heights;         /* quoin_heights: encoding of a height map (PNG) */
  double metres_per_level; /* 0: 1 */
  double metres_per_pixel; /* between neighbouring samples; 0: 1, with a warning */
  double metres_per_voxel; /* 0: metres_per_pixel */
  double exaggeration;     /* factor on heights; 0: 1 */
  int32_t ground_depth;    /* voxels of ground below the lowest height, up to 4,096; 0: 8 */
  int32_t smooth_ground;   /* makes a density field with a smooth surface instead of voxels */
  /* 1: also opens files outside the file's folder that the file names. Only for input from a trusted source. */
  int32_t allow_outside_files;
  /* For Minecraft worlds: "overworld", "nether", "end" or "NAMESPACE:NAME". Null or "": the overworld, or the first
   * dimension if there is none. Other files ignore it. */
  const char* dimension;
  /* Resource packs of Minecraft for the shapes and textures of its blocks, the lowest first; at most 1,024. Paths of
   * folders, zip files or .jar files, UTF-8; "builtin" is Quoin's own pack, which gives a look to blocks that the other
   * packs lack. A pack that cannot be read is an error. */
  const char* const* packs;
  size_t pack_count;
  /* The bytes of more packs (zip files), above `packs`; at most 1,024. They are copied. */
  const void* const* pack_zips;
  const size_t* pack_zip_bytes;
  size_t pack_zip_count;
  /* 1: does not use the packs that a scene file names for its files. */
  int32_t ignore_scene_packs;
} quoin_load_options;

typedef enum quoin_fill {
  QUOIN_FILL_ALL = 0,    /* voxels that are enclosed or touched by triangles; keeps thin parts */
  QUOIN_FILL_SOLID = 1,  /* voxels whose centre is enclosed */
  QUOIN_FILL_SURFACE = 2 /* voxels touched by triangles; the inside stays empty */
} quoin_fill;

/* Triangles to voxelise. They may be open, intersect each other or overlap. */
typedef struct quoin_triangles {
  size_t size;
  size_t vertex_count, triangle_count;
  const float* positions;  /* [vertex_count][3] */
  const uint32_t* indices; /* [triangle_count][3], counter-clockwise seen from outside */
  /* [vertex_count][4], linear light and alpha, multiplied by the material's; null: white. Alpha 0 makes no
   * voxels; other alpha below 1 makes transparent voxels. */
  const float* colours;
  const uint32_t* materials; /* [triangle_count], indices into `types`; null: 0 */
  /* [type_count]; `size` is set in each element. Null: a single light grey type. */
  const quoin_type* types;
  size_t type_count;
} quoin_triangles;

typedef struct quoin_voxelize_options {
  size_t size;
  double voxel_size; /* in the unit of positions; 0: 1 */
  int32_t fill;      /* quoin_fill */
  /* Maximum number of added types; 0: no limit. To meet it, similar colours are merged, also between types that differ
   * only in colour. */
  int32_t max_types;
  int32_t threads;
} quoin_voxelize_options;

typedef struct quoin_render_options {
  size_t size;
  int32_t width, height; /* 0: 1280 x 720 */
  int32_t samples;       /* per pixel; 0: 4, or 64 for path tracing */
  int32_t paths;         /* 0: ray casting; 1: path tracing */
  int32_t threads;       /* 0: all */
  int32_t has_camera;    /* 0: shows the whole scene from the front, right and above */
  double camera[3], look_at[3];
  double fov_degrees; /* vertical; 0: 45 */
  int32_t has_sun;    /* 0: the scene's sun, or (-0.48, 0.72, 0.5) */
  /* From the scene towards the sun; any non-zero length. */
  double sun[3];
} quoin_render_options;

/* Ray hits: caller-owned arrays with one entry per ray. Null arrays are not filled. */
typedef struct quoin_hits {
  size_t size;
  double* t;      /* in multiples of the direction's length; infinity: no hit */
  int32_t* voxel; /* [count][3], in its grid */
  uint16_t* type;
  double* normal; /* [count][3], in world space */
} quoin_hits;

/* Progress callback: receives the finished fraction of a long call, 0 to 1. Return 0 to cancel the call, which then
 * returns QUOIN_CANCELLED. Quoin may call it from any thread, but never from two threads at once. The callback must not
 * call Quoin functions. */
typedef int32_t (*quoin_progress)(double fraction, void* user);

QUOIN_API const char* quoin_version(void);
/* Returns the error of this thread's last failed call. Valid until this thread's next call. Never null. */
QUOIN_API const char* quoin_last_error(void);
/* Sets the progress callback for later calls of this thread; null removes it. `user` is passed to the callback. */
QUOIN_API quoin_status quoin_set_progress(quoin_progress progress, void* user);
/* Frees a scene, a mesh or textures; ignores 0. */
QUOIN_API quoin_status quoin_free(uint64_t handle);

/* Scenes. `path` is UTF-8. */
QUOIN_API quoin_status quoin_scene_create(quoin_scene* out);
QUOIN_API quoin_status quoin_scene_load(const char* path, quoin_scene* out);
QUOIN_API quoin_status quoin_scene_load_bytes(const void* data, size_t bytes, quoin_scene* out);
/* Loads a scene with options; null: defaults. */
QUOIN_API quoin_status quoin_scene_load_with(const char* path, const quoin_load_options* options, quoin_scene* out);
QUOIN_API quoin_status quoin_scene_load_bytes_with(const void* data, size_t bytes, const quoin_load_options* options,
                                                   quoin_scene* out);
QUOIN_API quoin_status quoin_scene_get_info(quoin_scene scene, quoin_scene_info* out);
/* Formats that can be read or written. */
QUOIN_API quoin_status quoin_format_count(size_t* out);
QUOIN_API quoin_status quoin_format_get(size_t index, quoin_format* out);
/* Saves a scene in the format of the extension. .quoin, .json, .vox and others store voxels; .glb, .gltf, .obj, .ply,
 * .stl and .3mf store blocky meshes. quoin_format_get lists all formats. */
QUOIN_API quoin_status quoin_scene_save(quoin_scene scene, const char* path);
/* Warnings, one line each: first from loading and voxelising, then from the last save. */
QUOIN_API quoin_status quoin_scene_warning_count(quoin_scene scene, size_t* out);
QUOIN_API quoin_status quoin_scene_warning(quoin_scene scene, size_t index, char* text, size_t capacity);

/* Voxel types: 0 is air, others are numbered from 1. */
QUOIN_API quoin_status quoin_type_count(quoin_scene scene, size_t* out);
QUOIN_API quoin_status quoin_type_get(quoin_scene scene, size_t index, quoin_type* out);
QUOIN_API quoin_status quoin_type_add(quoin_scene scene, const quoin_type* type, uint16_t* out);
/* Replaces the properties of a type. Its faces, orientations and shapes stay. So do the states of its voxels:
 * quoin_scene_save refuses those with more than state_bits. Set the blocks_light of a type with shapes after its
 * shapes: by default, shapes let light through where they leave a side open. */
QUOIN_API quoin_status quoin_type_set(quoin_scene scene, size_t index, const quoin_type* type);

/* Sets the textures of a type: six faces, in the order +X, -X, +Y, -Y, +Z, -Z. `size` is set in each element. Copies
 * the texels. The type's colour becomes the mean of its faces. An opaque type has opaque faces; cutout and translucent
 * faces need a transparent type. Null removes the textures, and the type keeps its colour. */
QUOIN_API quoin_status quoin_type_set_faces(quoin_scene scene, size_t type, const quoin_face* faces);

/* Gets or sets the orientations that a type's state selects. The type's state_bits must contain their bits. Null: the
 * type is never turned. */
QUOIN_API quoin_status quoin_type_get_orientations(quoin_scene scene, size_t type, quoin_orientations* out);
QUOIN_API quoin_status quoin_type_set_orientations(quoin_scene scene, size_t type,
                                                   const quoin_orientations* orientations);
/* Turns an orientation further, by quarter turns about an axis (0 x, 1 y, 2 z): counter-clockwise, seen from the
 * positive end of the axis. */
QUOIN_API quoin_status quoin_orientation_turn(int32_t orientation, int32_t axis, int32_t quarter_turns, int32_t* out);
/* Gets the state of a voxel after it was turned, such as in a copy. Other bits stay as they were. */
QUOIN_API quoin_status quoin_type_turned_state(quoin_scene scene, size_t type, uint32_t state, int32_t orientation,
                                               uint32_t* out);
/* Gets the state of a voxel that a player places: the orientation that fits the face best, with the other bits of
 * `state`. Torches point away from the face, slabs and stairs go into the half that was hit, fronts follow the
 * player. */
QUOIN_API quoin_status quoin_type_placed_state(quoin_scene scene, size_t type, const quoin_placing* placing,
                                               uint32_t state, uint32_t* out);
/* Sets the shapes of a type, which state and neighbours select; null: the type is a cube. Copies the arrays. The type's
 * `transparent` is that of the material: stairs of stone are opaque. Errors name the part and the element. */
QUOIN_API quoin_status quoin_type_set_shapes(quoin_scene scene, size_t type, const quoin_shapes* shapes);

/* Numbers the textures of all types, each once, as layers of arrays: one array per size, and more if a size has more
 * textures than `max_layers`, the limit of a device (0: 2,048). Later changes of the scene do not affect the result.
 * Adding types keeps the numbers of the textures before them. */
QUOIN_API quoin_status quoin_scene_textures(quoin_scene scene, size_t max_layers, quoin_textures* out);
QUOIN_API quoin_status quoin_textures_array_count(quoin_textures textures, size_t* out);
QUOIN_API quoin_status quoin_textures_array_get(quoin_textures textures, size_t index, quoin_texture_array* out);
/* Copies a mipmap level of all layers of an array, one layer after another: rgba[layers][n][n][4], where n is
 * texels >> level. Fails if that is more than `capacity` bytes. Mipmaps are means in linear light, weighted by
 * alpha. */
QUOIN_API quoin_status quoin_textures_read(quoin_textures textures, size_t array, int32_t level, uint8_t* rgba,
                                           size_t capacity);
/* Gets the six faces of a type, and their number, 6, or 0 for a type without textures. Set the size of the first
 * element of `out`: it is the size of each. */
QUOIN_API quoin_status quoin_textures_faces(quoin_textures textures, size_t type, quoin_face* out, size_t* count);
/* Gets the shapes of a type: all fields except the arrays, which are null. A cube has no parts and neighbours of
 * QUOIN_NEIGHBOURS_NONE. */
QUOIN_API quoin_status quoin_textures_shapes(quoin_textures textures, size_t type, quoin_shapes* out);
/* Copies the arrays of a type's shapes, which have the counts that quoin_textures_shapes gives. Set the size of each
 * array's first element: it is the size of each. Null arrays are not filled. Equal looks of a type have one number. */
QUOIN_API quoin_status quoin_textures_read_shapes(quoin_textures textures, size_t type, quoin_shape_part* parts,
                                                  quoin_shape_element* elements, quoin_shape_condition* conditions,
                                                  quoin_face* looks);

/* Grids, by number. */
QUOIN_API quoin_status quoin_grid_count(quoin_scene scene, size_t* out);
QUOIN_API quoin_status quoin_grid_get_info(quoin_scene scene, size_t grid, quoin_grid_info* out);
/* Writes the voxel types of a box into uint16_t out[capacity]. The box starts at `min` and has shape[0] x shape[1] x
 * shape[2] voxels; x is slowest, z fastest. */
QUOIN_API quoin_status quoin_grid_read(quoin_scene scene, size_t grid, const int32_t min[3], const int32_t shape[3],
                                       uint16_t* out, size_t capacity);
/* Adds a grid from an array of types (QUOIN_UINT8 or QUOIN_UINT16), which must exist in the scene. Places it at
 * array->origin, rounded down to whole voxels. `name` may be null. `out` receives the grid's number and may be null. */
QUOIN_API quoin_status quoin_grid_add(quoin_scene scene, const quoin_array* array, const char* name, size_t* out);

/* Every voxel except air has a state, 32 bits, 0 by default. It selects among the orientations and shapes of the
 * voxel's type. Setting a voxel to another type makes its state 0; setting it to the same type keeps the state. */

/* Writes the states of a box into uint32_t out[capacity]; otherwise as quoin_grid_read. */
QUOIN_API quoin_status quoin_grid_read_states(quoin_scene scene, size_t grid, const int32_t min[3],
                                              const int32_t shape[3], uint32_t* out, size_t capacity);
/* Replaces the states of a box with an array of QUOIN_UINT8, QUOIN_UINT16 or QUOIN_UINT32, otherwise as
 * quoin_grid_write. Air ignores them. If it fails, nothing changes: also if a state has bits beyond its type's
 * state_bits. */
QUOIN_API quoin_status quoin_grid_write_states(quoin_scene scene, size_t grid, const quoin_array* array);

/* Sets how world files (.quoin) store a grid: the fields `unsaved` and `whole` of quoin_grid_info. */
QUOIN_API quoin_status quoin_grid_set_storage(quoin_scene scene, size_t grid, int32_t unsaved, int32_t whole);

/* Voxelises triangles into a new grid and adds the required types to the scene. The cube with minimum corner
 * voxel_size * (x, y, z) becomes the world's voxel (x, y, z). `options`, `name` and `out` may be null. */
QUOIN_API quoin_status quoin_grid_voxelize(quoin_scene scene, const quoin_triangles* triangles,
                                           const quoin_voxelize_options* options, const char* name, size_t* out);

/* Instances, groups, cameras and lamps, by number. */
QUOIN_API quoin_status quoin_instance_count(quoin_scene scene, size_t* out);
QUOIN_API quoin_status quoin_instance_get(quoin_scene scene, size_t index, quoin_instance* out);
/* Adds or replaces a placement of a grid. world_from_grid may rotate, mirror, translate and scale uniformly. Set
 * `visible` to show it. `out` may be null. */
QUOIN_API quoin_status quoin_instance_add(quoin_scene scene, const quoin_instance* instance, size_t* out);
QUOIN_API quoin_status quoin_instance_set(quoin_scene scene, size_t index, const quoin_instance* instance);
QUOIN_API quoin_status quoin_group_count(quoin_scene scene, size_t* out);
QUOIN_API quoin_status quoin_group_get(quoin_scene scene, size_t number, quoin_group* out); /* counts from 1 */
QUOIN_API quoin_status quoin_camera_count(quoin_scene scene, size_t* out);
QUOIN_API quoin_status quoin_camera_get(quoin_scene scene, size_t index, quoin_camera* out);
QUOIN_API quoin_status quoin_lamp_count(quoin_scene scene, size_t* out);
QUOIN_API quoin_status quoin_lamp_get(quoin_scene scene, size_t index, quoin_lamp* out);

/* Meshes. `options` may be null. quoin_surface_nets and quoin_mesh_labels read arrays in place. */
QUOIN_API quoin_status quoin_grid_mesh(quoin_scene scene, size_t grid, const quoin_mesh_options* options,
                                       quoin_mesh* out);
/* Meshes the surface where the array equals `iso`. solid_below: values below iso are solid, as in signed distances. */
QUOIN_API quoin_status quoin_surface_nets(const quoin_array* array, double iso, int32_t solid_below, int32_t threads,
                                          quoin_mesh* out);
/* Meshes the surfaces between integer labels. relaxation_steps, 0 to 1,000, smooth the voxel steps. */
QUOIN_API quoin_status quoin_mesh_labels(const quoin_array* array, int64_t background, int32_t relaxation_steps,
                                         int32_t threads, quoin_mesh* out);
QUOIN_API quoin_status quoin_mesh_view(quoin_mesh mesh, quoin_mesh_data* out);

/* Renders an image into rgb[capacity]: rows from the top, three bytes per pixel (sRGB). `options` may be null. */
QUOIN_API quoin_status quoin_scene_render(quoin_scene scene, const quoin_render_options* options, uint8_t* rgb,
                                          size_t capacity);
/* Finds the nearest voxel or surface along each ray, given by origins[count][3] and directions[count][3] in world
 * space. The first call builds a tree, which the scene keeps and updates. */
QUOIN_API quoin_status quoin_scene_rays(quoin_scene scene, size_t count, const double* origins,
                                        const double* directions, double max_t, const quoin_hits* out);

/* Replaces the voxels of a box of a grid with an array of types (QUOIN_UINT8 or QUOIN_UINT16; 0 is air). The box starts
 * at array->origin in the grid's voxels, rounded down. Accepts the output of quoin_grid_read. If the scene lacks one of
 * the types, nothing changes. */
QUOIN_API quoin_status quoin_grid_write(quoin_scene scene, size_t grid, const quoin_array* array);

/* A rigid body, as physics engines take it: a grid, or one of its pieces. Lengths are in voxels (of a field: samples),
 * in the grid's space. A density is the mass of one voxel. For voxels that are s world units wide, and densities per
 * cubic world unit: multiply mass by s^3, centre by s and inertia by s^5. */
typedef struct quoin_body {
  size_t size;
  double mass;
  double centre[3];  /* centre of mass; 0 if the mass is 0 */
  double inertia[9]; /* tensor about the centre of mass, along the grid's axes: three rows, symmetric */
  int64_t voxels;    /* 0 for a field */
  int32_t min[3];    /* minimum corner of its tight box */
  int32_t extent[3];
  int32_t first[3]; /* pieces: the first voxel by z, then y, then x */
} quoin_body;

/* Computes the mass of a grid: of its field's solid if it has a field, otherwise of its voxels. `densities` has one
 * entry per type, 0 or more and finite; entry 0 is for a field's solid without a material. Types from `count` on weigh
 * nothing. Null: every voxel weighs 1. */
QUOIN_API quoin_status quoin_grid_body(quoin_scene scene, size_t grid, const double* densities, size_t count,
                                       quoin_body* out);
/* Finds the pieces of a grid's voxels: connected by faces, of any type except air. Writes the bodies of the first
 * `capacity` pieces in the order of their first voxels, and the number of all pieces to `pieces`. Set the size of the
 * first element of `out`: it is the size of each. With a capacity of 0, `out` may be null. Fields have no pieces.
 * Densities: as in quoin_grid_body. */
QUOIN_API quoin_status quoin_grid_pieces(quoin_scene scene, size_t grid, const double* densities, size_t count,
                                         quoin_body* out, size_t capacity, size_t* pieces);

/* Layers, cameras, lamps and the sun of a scene. If a format does not support some of them, saving adds warnings. */

/* A layer: instances and groups that are shown or hidden together, independent of the hierarchy. Layers are identified
 * by name. If several layers have the same name, the first is used. */
typedef struct quoin_layer {
  size_t size;
  char name[128];
  int32_t visible;
} quoin_layer;

/* The sun of a scene, infinitely far away. */
typedef struct quoin_sun {
  size_t size;
  double direction[3];  /* from the scene towards the sun; any non-zero length */
  double brightness;    /* brightness of a white surface facing the sun; 0: no sun */
  float colour[3];      /* linear */
  double angle_degrees; /* angular diameter; 0: a point */
} quoin_sun;

enum {
  QUOIN_SKY_GRADIENT = 0, /* follows the sun's height; the default */
  QUOIN_SKY_FIXED = 1,    /* always day */
  QUOIN_SKY_PHYSICAL = 2,
  QUOIN_SKY_UNIFORM = 3,
  QUOIN_SKY_IMAGE = 4 /* an image that the scene's file names; uniform if it cannot be read */
};
enum {
  QUOIN_TONE_AUTOMATIC = 0, /* neutral, or clamp under a uniform sky */
  QUOIN_TONE_CLAMP = 1,
  QUOIN_TONE_NEUTRAL = 2,
  QUOIN_TONE_AGX = 3,
  QUOIN_TONE_ACES = 4
};

/* The light and air around a scene, except the sun. All colours are linear. */
typedef struct quoin_environment {
  size_t size;
  int32_t sky; /* QUOIN_SKY_... */
  double sky_brightness;
  float sky_colour[3];    /* of a uniform sky */
  int32_t has_background; /* path tracing shows this colour to the camera in place of the sky */
  float background[3];
  double lamp_brightness; /* factor on the light of lamps and emissive voxels */
  int32_t has_exposure;   /* 0: 1, or for path tracing a value that suits the sky */
  double exposure;
  int32_t tone;           /* QUOIN_TONE_..., for path tracing */
  int32_t has_ground;     /* a ground plane, for path tracing */
  double ground_height;   /* world y */
  float ground_colour[3]; /* 0 to 1 */
  int32_t has_fog;        /* fog below a height, for path tracing */
  double fog_density;     /* scattering events per world unit */
  double fog_top;         /* world y */
  float fog_colour[3];    /* 0 to 1 */
  double fog_anisotropy;  /* -0.99 to 0.99 */
} quoin_environment;

QUOIN_API quoin_status quoin_layer_count(quoin_scene scene, size_t* out);
QUOIN_API quoin_status quoin_layer_get(quoin_scene scene, size_t index, quoin_layer* out);
/* Adds a layer, or shows or hides the existing layer of this name. The name must not be empty. */
QUOIN_API quoin_status quoin_layer_set(quoin_scene scene, const quoin_layer* layer);
/* Moves an instance to an existing layer; null or empty: no layer. */
QUOIN_API quoin_status quoin_instance_set_layer(quoin_scene scene, size_t index, const char* layer);
/* Adds a group. Use quoin_instance_add or quoin_instance_set to put instances in it. `shown` is the group's own flag;
 * `layer` is empty or the name of an existing layer. `out` receives the group's number and may be null. */
QUOIN_API quoin_status quoin_group_add(quoin_scene scene, const quoin_group* group, size_t* out);
/* Adds a camera. Its number must be unused, and `right` must be forward x up. */
QUOIN_API quoin_status quoin_camera_add(quoin_scene scene, const quoin_camera* camera);
/* Adds a lamp. A range of 0 is unlimited; an outer angle of 0 is 45 degrees. */
QUOIN_API quoin_status quoin_lamp_add(quoin_scene scene, const quoin_lamp* lamp);
/* Gets or sets the sun. Without a sun, all fields are 0. Properties that the file does not store have defaults: white,
 * brightness 1, 0.5 degrees. */
QUOIN_API quoin_status quoin_sun_get(quoin_scene scene, quoin_sun* out);
QUOIN_API quoin_status quoin_sun_set(quoin_scene scene, const quoin_sun* sun);
/* Gets or sets the environment, which quoin_scene_render uses; .json and .quoin files store it. A scene without one
 * gives the defaults of quoin_scene_render. To change some settings, get the environment first. Settings that this
 * struct lacks stay. Null removes the environment and the sun. */
QUOIN_API quoin_status quoin_environment_get(quoin_scene scene, quoin_environment* out);
QUOIN_API quoin_status quoin_environment_set(quoin_scene scene, const quoin_environment* environment);

#ifdef __cplusplus
}
#endif
/* NOLINTEND(readability-*,modernize-*,performance-*,cppcoreguidelines-*) */
#endif
