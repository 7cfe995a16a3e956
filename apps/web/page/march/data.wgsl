// The shaders' data: src/render/shaders/data.glsl in WGSL, which has no memory addresses. The scene is one array of
// words, the image's own tables another. Addresses are byte offsets below 2^32 in them, so only their lower word is
// used. Supports only Quoin's default lighting: rays, nine occlusion rays, lamps and glass surfaces; march.js rejects
// all else.

// Features of the scene; shaders are compiled without missing ones.
override kHasGlass: bool = false;
override kHasFields: bool = false;
override kHasFieldGlass: bool = false;

const kLamps = 2048u;
const kGlassSurfaces = 4096u;

// Replaces infinity, which WGSL need not support; all compared numbers are far smaller.
const kInfinity = 3.0e38;
const kNever = 1.0e37;

// A sparse tree whose nodes have 4^3 slots each; a node of level l spans 4^(l + 1) voxels. Level 0 is a word of
// voxels, level 1 a brick of 16^3, level 2 a chunk.
struct Tree {
  root: vec4u,
  low: vec4i,   // tight bounds, from the tree's origin; w: the root's level, at least 2
  high: vec4i,
}

// A pixel's hit: a voxel, or a cell of a field.
struct Point {
  voxel: vec4i,   // w: the instance; -1: none
  inside: vec4f,  // position in the voxel; w: t
  what: vec4u,    // type, face (field: normal), kind; w: distance from the instance's start, as a float
}

// A run of transparent voxels, or of a transparent part of a field, of one type.
struct Body {
  voxel: vec4i,    // w: the instance
  lengths: vec4f,  // t of enter and exit, voxels, and t of enter from the start of the instance's ray
  what: vec4u,     // type, face or normal, flags; exit: 8 times the instance, plus the face
}
const kStartsInside = 1u;
const kBeginsInField = 2u;
const kEndsInField = 4u;
const kHowItBegins = 3u;
const kExitNormal = 4u;  // bits

const kSurface = 0u;
const kUnlit = 1u;
const kGlow = 2u;
const kIsField = 8u;
const kIsBlended = 16u;  // of a field: blended from the materials around, see blend_of_field

// A pixel in progress: the transmittance of the glass so far, where to continue, and the sample's colour so far.
struct State {
  weight: vec4f,
  colour: vec4f,
}

struct Frame {
  right: vec4f,
  down: vec4f,
  corner: vec4f,
  forward: vec4f,
  start: vec4f,
  start_x: vec4f,
  start_y: vec4f,
  right_low: vec4f,
  down_low: vec4f,
  corner_low: vec4f,
  forward_low: vec4f,
  sky_zenith: vec4f,
  sky_horizon: vec4f,
  sky_ground: vec4f,
  light: vec4f,
  ambient: vec4f,
  sun: vec4f,
  level_sky: vec4f,
  level_lamps: vec4f,
  level_least: vec4f,
  placed: vec2u,
  grids: vec2u,
  tree: vec2u,
  leaves: vec2u,
  surfaces: vec2u,
  directions: vec2u,
  turns: vec2u,
  thresholds: vec2u,
  points: vec2u,
  bodies: vec2u,
  sun_bodies: vec2u,
  states: vec2u,
  sums: vec2u,
  colours: vec2u,
  depths: vec2u,
  counters: vec2u,
  fars: vec2u,
  far_parts: vec2u,
  far_depths: vec2u,
  far_numbers: vec2u,
  lamps: vec2u,
  lamp_bricks: vec2u,
  lamp_lists: vec2u,
  light_bricks: vec2u,
  light_numbers: vec2u,
  light_pad: vec2u,
  width: i32,
  height: i32,
  flags: u32,
  placed_count: u32,
  last_surface: u32,
  occlusion_count: i32,
  occlusion_distance: f32,
  shadow_distance: f32,
  exposure: f32,
  samples: f32,
  ground_begins: f32,
  ground_is_full: f32,
  view_depth: f32,
  sky_scale: f32,
  lift: f32,
  far_count: u32,
  lamp_mask: u32,
  light_mask: u32,
  paths: vec2u,
}

struct Push {
  frame_address: vec2u,
  corner: vec2i,  // of the tile, in pixels
  size: vec2i,    // of the tile
  point: vec2f,   // of the sample, within pixels
  point_low: vec2f,
  turn: vec2f,     // of the sample: rotation of the nine fixed occlusion directions
  upright: vec3f,  // the first of these directions, along u, v and the normal
  seed: u32,
  first: u32,  // 1: the pixel's first sample
  round: u32,
  base: u32,   // index of the tile's first pixel in the image, and the row stride
  pitch: u32,
  far: vec3u,
  sample_number: u32,
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> words: array<u32>;       // of the scene
@group(0) @binding(2) var<storage, read> nodes: array<vec4u>;     // the same data
@group(0) @binding(3) var<storage, read> tables: array<vec4u>;    // of the image
@group(0) @binding(4) var<storage, read_write> points: array<Point>;  // of the tile
@group(0) @binding(5) var<storage, read_write> sums: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> colours: array<u32>;
@group(1) @binding(0) var<uniform> push: Push;

fn has(flag: u32) -> bool {
  return (frame.flags & flag) != 0u;
}
fn vector_at(table: u32, i: u32) -> vec4f {
  return bitcast<vec4f>(tables[(table >> 4u) + i]);
}

// Fields of an instance, read one by one: src/render/vulkan/trees/shader_data.h, ShaderPlaced. View space has the
// world's axes and units; its origin is the camera, or a point in front of it if everything is far.
const kGridAxes = 0u;     // columns: grid from view
const kViewAxes = 3u;     // columns: view from grid
const kRefBase = 6u;      // in the tree's coordinates; w: the grid
const kRefInside = 7u;    // from there; w: world units per voxel
const kRefView = 8u;      // the same point in view space; w: voxels of the full grid per voxel
const kStartBase = 9u;    // of the image's rays, which start at start + x start_x + y start_y for pixel (x, y)
const kStart = 10u;       // w: its distance along the rays, in lengths of their forward component
const kStartX = 11u;
const kStartY = 12u;
const kToSun = 13u;       // w: its brightness
const kDiffuse = 14u;     // by face
const kGridAxesLow = 17u; // rounding remainders of the numbers above
const kStartLow = 20u;
const kStartXLow = 21u;
const kStartYLow = 22u;
const kOrigin = 23u;      // origin of the tree's coordinates in the grid; w: number of halvings

fn placed_vector(i: i32, field: u32) -> vec4f {
  return vector_at(frame.placed.x, 24u * u32(i) + field);
}
fn placed_whole(i: i32, field: u32) -> vec4i {
  return bitcast<vec4i>(tables[(frame.placed.x >> 4u) + 24u * u32(i) + field]);
}
fn voxel_size(i: i32) -> f32 {
  return placed_vector(i, kRefInside).w;
}
// Transforms `v` to another space: `axes` is kGridAxes or kViewAxes.
fn turned(i: i32, axes: u32, v: vec3f) -> vec3f {
  return placed_vector(i, axes).xyz * v.x + placed_vector(i, axes + 1u).xyz * v.y +
         placed_vector(i, axes + 2u).xyz * v.z;
}

// Contents of a grid's trees.
const kOpaque = 0u;
const kTransparent = 1u;
const kField = 2u;  // cells that touch the opaque part of the field
const kGlass = 3u;  // cells that touch its transparent part

fn tree_of(instance: i32, content: u32) -> Tree {
  let at = (frame.grids.x >> 4u) + 12u * u32(placed_whole(instance, kRefBase).w) + 3u * content;
  return Tree(nodes[at], bitcast<vec4i>(nodes[at + 1u]), bitcast<vec4i>(nodes[at + 2u]));
}

// Voxel faces, numbered as in core/direction.h: the axes of a face's edges.
const kFaceU = array<i32, 6>(1, 2, 2, 0, 0, 1);
const kFaceV = array<i32, 6>(2, 1, 0, 2, 1, 0);

fn axis_of(face: u32) -> i32 {
  return i32(face >> 1u);
}
fn sign_of(face: u32) -> f32 {
  return select(-1.0, 1.0, (face & 1u) == 0u);
}
// In the grid.
fn face_normal(face: u32) -> vec3f {
  var normal = vec3f();
  normal[axis_of(face)] = sign_of(face);
  return normal;
}

fn kind_of(point: Point) -> u32 {
  return point.what.z & 3u;
}
fn is_of_field(point: Point) -> bool {
  return kHasFields && (point.what.z & kIsField) != 0u;
}

// A direction packed into a word: the octahedron's faces folded into a square.
fn unit_vector(word: u32) -> vec3f {
  let e = unpack2x16snorm(word);
  var v = vec3f(e, 1.0 - abs(e.x) - abs(e.y));
  if (v.z < 0.0) {
    v = vec3f((1.0 - abs(v.yx)) * select(vec2f(-1.0), vec2f(1.0), v.xy >= vec2f()), v.z);
  }
  return normalize(v);
}
const kNoNormal = 0x80008000u;  // not the word of any unit vector

fn packed_normal(n: vec3f) -> u32 {
  let size = abs(n.x) + abs(n.y) + abs(n.z);
  if (!(size > 0.0)) {
    return kNoNormal;
  }
  var at = n.xy / size;
  if (n.z < 0.0) {
    at = (1.0 - abs(at.yx)) * select(vec2f(-1.0), vec2f(1.0), at >= vec2f());
  }
  return pack2x16snorm(at);
}
fn normal_of(word: u32) -> vec3f {
  if (word == kNoNormal) {
    return vec3f();
  }
  return unit_vector(word);
}

// The image pixel of an invocation, and its index in the tile.
fn is_in_tile(id: vec3u) -> bool {
  return all(vec2i(id.xy) < push.size);
}
fn slot_of(id: vec3u) -> u32 {
  return id.y * u32(push.size.x) + id.x;
}
fn place_of(id: vec3u) -> u32 {
  return push.base + id.y * push.pitch + id.x;
}
