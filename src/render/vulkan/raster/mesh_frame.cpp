#include "render/vulkan/raster/mesh_frame.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>
#include <quoin/grid/chunk.h>

#include "render/light/light_model.h"
#include "render/shared/image_request.h"
#include "scene/frustum.h"

namespace quoin::vulkan {
namespace {

constexpr double kEdge = kChunkEdge;
// Radius of a ball around a chunk; smooth surfaces extend slightly beyond the chunk.
constexpr double kChunkRadius = (kEdge / 2 + 2.0) * 1.7320508075688774;
constexpr double kNearest = 1.0 / 1024.0;  // voxels
// In device subpixel steps; half a step closes the holes caused by rounding. In 2.3 million pixels of a room of merged
// faces there were 168 holes without it and 12 with 0.25; in 34.6 million pixels there were none with 0.5.
constexpr double kWidening = 0.5;

// The image and the visible part of the world.
struct View {
  CameraRays rays;
  Frustum frustum;
  glm::dmat3 pixel_from_world;  // pixels to the right and down of the middle, at distance 1, and depth
  double width, height;
  double nearest = std::numeric_limits<double>::infinity();
  double furthest = 0.0;
  double smallest_voxel = std::numeric_limits<double>::infinity();

  View(const Camera& camera, const RenderOptions& options)
      : rays(camera, options.width, options.height),
        frustum(camera, options.width, options.height),
        pixel_from_world(glm::inverse(glm::dmat3(rays.right(), rays.down(), rays.forward()))),
        width(options.width),
        height(options.height) {}

  void include(double depth, double radius, double voxel_size) {
    nearest = std::min(nearest, depth - radius);
    furthest = std::max(furthest, depth + radius);
    smallest_voxel = std::min(smallest_voxel, voxel_size);
  }
  void finish() {
    if (nearest > furthest) nearest = smallest_voxel = furthest = 1.0;
    nearest = std::max(nearest, rays.is_perspective() ? smallest_voxel * kNearest : 0.0);
    furthest = std::max(furthest, nearest + smallest_voxel);
  }
};

// An instance relative to the camera.
struct Space {
  const MeshInstance* instance;
  glm::dmat3 view_axes;  // view from grid: the world's axes, the camera's position as origin
  DVec3 camera_in_grid;  // voxels
  DVec3 base{0.0};       // in the grid: the reference point
  DVec3 eye{0.0};        // the camera relative to it; orthographic: the direction towards it
  DVec3 base_in_view{0.0};

  /// `low` to `high`: range of its chunk coordinates.
  Space(const MeshInstance& of, IVec3 low, IVec3 high, const Camera& camera)
      : instance(&of), view_axes(of.world_axes * of.voxel_size) {
    const glm::dmat3 grid_axes = glm::transpose(of.world_axes);
    // The difference of two far positions is taken first: it is small, and mostly exact.
    camera_in_grid = of.pivot - grid_axes * (of.position - camera.position) / of.voxel_size;
    const DVec3 chunk = glm::clamp(glm::floor(camera_in_grid / kEdge), DVec3(low), DVec3(high));
    base = chunk * kEdge;
    base_in_view = view_axes * (base - camera_in_grid);
    eye = camera_in_grid - base;
    if (camera.projection == Camera::Projection::Orthographic) eye = glm::normalize(grid_axes * -camera.forward);
  }
};

// Returns the directions of faces that may be visible in a box.
std::uint8_t visible_faces(DBox box, DVec3 eye, bool is_perspective) {
  const DVec3 low = is_perspective ? box.min : DVec3(0.0);
  const DVec3 high = is_perspective ? box.max : DVec3(0.0);
  int faces = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (eye[axis] > low[axis]) faces |= 1 << (2 * axis);
    if (eye[axis] < high[axis]) faces |= 2 << (2 * axis);
  }
  return static_cast<std::uint8_t>(faces);
}

// Lists an instance's chunks in the image; returns false if there are none.
bool add_draws(const Space& space, const MeshStore::StoredGrid& grid, View& view, MeshFrameData& data) {
  const auto number = static_cast<std::uint32_t>(data.instances.size());
  const double radius = kChunkRadius * space.instance->voxel_size;
  const std::size_t before = data.draws.size();
  for (const auto& [chunk, mesh] : grid.chunks) {
    if (space.instance->is_far && !mesh.has_glass()) continue;
    const DVec3 offset = DVec3(chunk) * kEdge - space.base;
    const DVec3 middle = space.view_axes * (offset + kEdge / 2) + space.base_in_view;
    if (!view.frustum.meets(middle, radius)) continue;
    const double depth = glm::dot(middle, view.rays.forward());
    if (!std::isfinite(depth)) continue;
    view.include(depth, radius * 1.01, space.instance->voxel_size);
    const bool is_perspective = view.rays.is_perspective();
    data.draws.push_back({&mesh, number, Vec3(offset), is_perspective ? glm::length(middle) : depth,
                          visible_faces({offset, offset + kEdge}, space.eye, is_perspective), space.instance->mirrored,
                          space.instance->is_far});
  }
  return data.draws.size() > before;
}

void append_run(std::uint32_t first, std::uint32_t end, QuadRuns& runs) {
  QUOIN_ASSERT(first <= end, "a range of quads");
  if (first == end) return;
  if (!runs.empty() && runs.back().second == first) {
    runs.back().second = end;
  } else {
    runs.emplace_back(first, end);
  }
}

// Lists the faces of its impostor, which lie in a ball.
void add_far(const Space& space, View& view, MeshFrameData& data) {
  const MeshImpostor& impostor = space.instance->impostor;
  const DVec3 offset = impostor.centre - space.base;
  const DVec3 middle = space.view_axes * offset + space.base_in_view;
  const double depth = glm::dot(middle, view.rays.forward());
  if (!std::isfinite(depth)) return;
  view.include(depth, impostor.radius * 1.01 * space.instance->voxel_size, space.instance->voxel_size);
  const auto instance = static_cast<std::uint32_t>(data.instances.size());
  const bool is_perspective = view.rays.is_perspective();
  const DBox box{offset - impostor.radius, offset + impostor.radius};
  const std::uint8_t seen = visible_faces(box, space.eye, is_perspective);
  for (const MeshImpostor::Part& part : impostor.parts) {
    FarDraw draw{part.faces,
                 {},
                 impostor.faces,
                 instance,
                 Vec3(offset),
                 impostor.coarser << kMeshShareShift | (part.is_coarser ? kMeshIsCoarser : 0) |
                     (part.faces.cells != 0 ? kMeshHasCells : 0),
                 is_perspective ? glm::length(middle) : depth};
    for (std::size_t face = 0; face < 6; ++face) {
      if ((seen >> face & 1) != 0) append_run(part.begin[face], part.begin[face + 1], draw.runs);
    }
    if (!draw.runs.empty()) data.far.push_back(std::move(draw));
  }
}

// Sets the data that maps its faces to voxels of the grid.
void set_impostor(const Space& space, ShaderMeshInstance& out) {
  const MeshImpostor& impostor = space.instance->impostor;
  out.home = IVec4(-space.instance->origin, space.instance->placed);
  for (const MeshImpostor::Part& part : impostor.parts) {
    out.far_steps.at(part.is_coarser ? 1 : 0) = part.faces.step;
    out.far_cells.at(part.is_coarser ? 1 : 0) = part.faces.cells;
  }
  out.far_near = impostor.near;
  out.far_centre = Vec4(Vec3(impostor.centre - DVec3(space.instance->origin)), 0.0F);
}

// Converts a vector in view, or with w = 1 a point, to clip space.
DVec3 scaled_pixel(const View& view, DVec3 in_view) {
  return view.pixel_from_world * in_view * DVec3(2.0 / view.width, 2.0 / view.height, 1.0);
}
Vec4 clip_vector(const View& view, DVec3 in_view) {
  const DVec3 p = scaled_pixel(view, in_view);
  if (view.rays.is_perspective()) return to_vec4(DVec3(p.x, p.y, 0.0) / view.nearest, p.z / view.nearest);
  return to_vec4({p.x, p.y, -p.z / (view.furthest - view.nearest)});
}
Vec4 clip_point(const View& view, DVec3 in_view) {
  const DVec3 p = scaled_pixel(view, in_view);
  if (view.rays.is_perspective()) {
    return to_vec4(DVec3(p.x, p.y, view.nearest) / view.nearest, p.z / view.nearest);
  }
  return to_vec4({p.x, p.y, (view.furthest - p.z) / (view.furthest - view.nearest)}, 1.0);
}

ShaderMeshInstance shader_instance(const Space& space, const View& view, const Environment& environment,
                                   int subpixels) {
  ShaderMeshInstance out;
  const MeshInstance& instance = *space.instance;
  const DVec3 sun_in_grid = glm::transpose(instance.world_axes) * environment.sun.unit_direction();
  const double brightness = daylight_of(environment).sun_brightness;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    out.clip[i] = clip_vector(view, space.view_axes[axis]);
    out.axes[i] = to_vec4(instance.world_axes[axis]);
  }
  out.clip[3] = clip_point(view, space.base_in_view);
  for (const Direction face : kDirections) {
    const double cosine = glm::dot(DVec3(normal_of(face)), sun_in_grid);
    const int i = static_cast<int>(face);
    out.diffuse[static_cast<std::size_t>(i / 4)][i % 4] = static_cast<float>(std::max(cosine, 0.0) * brightness);
  }
  out.home = IVec4(IVec3(space.base) - instance.origin, instance.placed);
  const bool is_of_field = instance.mesh.content == SurfaceContent::Field;
  if (is_of_field) {
    out.first_sample = 0.0F;
    const IVec3 origin = instance.placed < 0 ? IVec3(0) : instance.origin;
    for (int axis = 0; axis < 3; ++axis) {
      out.far_near.at(static_cast<std::size_t>(axis)) = static_cast<std::uint32_t>(origin[axis]);
    }
    out.far_near[3] = static_cast<std::uint32_t>(instance.mesh.level);
  }
  out.eye = to_vec4(space.eye, view.rays.is_perspective() ? 1.0 : 0.0);
  const double depth_per_w = view.rays.is_perspective() ? view.nearest : 1.0;
  const double pixel = glm::length(view.rays.right());
  constexpr float kMeanOfFace = 1e15F;
  const double spacing = glm::length(view.rays.down()) / (view.rays.is_perspective() ? 1.0 : instance.voxel_size);
  // Halved fields show textures in their own size.
  out.axes[0].w = instance.shows_means && !is_of_field ? kMeanOfFace : static_cast<float>(spacing);
  out.room = static_cast<float>(depth_per_w * kWidening * pixel / instance.voxel_size / subpixels);
  return out;
}

// Returns the distance of a point of a chunk.
float distance_of(DVec3 in_chunk, const MeshDraw& draw, const Space& space, const View& view) {
  const DVec3 middle = DVec3(draw.offset) + in_chunk;
  if (view.rays.is_perspective()) {
    return static_cast<float>(glm::length(middle - space.eye) * space.instance->voxel_size);
  }
  return static_cast<float>(glm::dot(space.view_axes * middle + space.base_in_view, view.rays.forward()));
}

bool faces_camera(const Quad& quad, const MeshDraw& draw, const Space& space, const View& view) {
  const FaceFrame& frame = frame_of(quad.direction());
  const double plane =
      view.rays.is_perspective() ? static_cast<double>(draw.offset[frame.axis]) + quad.corner(0)[frame.axis] : 0.0;
  return frame.sign * (space.eye[frame.axis] - plane) > 0.0;
}
bool faces_camera(const GlassShape& shape, const MeshDraw& draw, const Space& space, const View& view) {
  const DVec3 point = view.rays.is_perspective() ? DVec3(draw.offset) + DVec3(shape.centre) : DVec3(0.0);
  return glm::dot(DVec3(shape.normal), space.eye - point) > 0.0;
}

struct GlassEntry {
  float distance;
  ShaderGlassQuad quad;
};

// Lists the glass of a draw that faces the camera.
void add_glass(const MeshDraw& draw, const Space& space, const View& view, const SolidFaces& solid,
               std::uint32_t number, std::vector<GlassEntry>& entries) {
  const StoredMesh& mesh = *draw.mesh;
  for (std::size_t i = 0; i < mesh.glass.size(); ++i) {
    const Quad& quad = mesh.glass[i];
    if (solid.contains(quad) || !faces_camera(quad, draw, space, view)) continue;
    const DVec3 middle = 0.5 * DVec3(quad.corner(0) + quad.corner(2));
    entries.push_back(
        {distance_of(middle, draw, space, view), {number, mesh.opaque.back() + static_cast<std::uint32_t>(i)}});
  }
  for (const GlassShape& shape : mesh.shapes.glass) {
    if (solid.contains(shape.type, shape.look) || !faces_camera(shape, draw, space, view)) continue;
    entries.push_back({distance_of(DVec3(shape.centre), draw, space, view), {number, shape.number | kGlassIsShape}});
  }
}

void order_glass(std::span<const Space> spaces, const View& view, const SolidFaces& solid, MeshFrameData& data) {
  for (const MeshDraw& draw : data.draws) {
    const StoredMesh& mesh = *draw.mesh;
    data.glass_quads += mesh.glass.size() + mesh.shapes.glass.size();
    data.has_smooth_glass |= mesh.glass_indices > 0;
    data.has_shape_glass |= !mesh.shapes.glass.empty();
  }
  if (data.glass_by_rays || data.glass_quads > kMaxOrdered) return;
  std::vector<GlassEntry> entries;
  for (const MeshDraw& draw : data.draws) {
    const StoredMesh& mesh = *draw.mesh;
    if (mesh.glass.empty() && mesh.shapes.glass.empty()) continue;
    QUOIN_ASSERT(draw.instance < spaces.size(), "an instance of the frame");
    const auto number = static_cast<std::uint32_t>(data.glass.size());
    data.glass.push_back(
        {mesh.place.address, draw.instance, 0, Vec4(draw.offset, 0.0F), mesh.shapes.records, mesh.shapes.faces});
    add_glass(draw, spaces[draw.instance], view, solid, number, entries);
  }
  std::stable_sort(entries.begin(), entries.end(),
                   [](const GlassEntry& a, const GlassEntry& b) { return a.distance > b.distance; });
  data.order.reserve(entries.size());
  for (const GlassEntry& entry : entries) data.order.push_back(entry.quad);
}

void set_frame(const View& view, const Environment& environment, MeshFrameData& data) {
  data.sky.clip = {to_vec4(view.rays.right()), to_vec4(view.rays.down()), to_vec4(view.rays.corner()),
                   to_vec4(view.rays.forward())};
  data.sky.room = view.rays.is_perspective() ? 1.0F : static_cast<float>(view.rays.sky_scale());
  data.frame.sun = to_vec4(environment.sun.unit_direction() * daylight_of(environment).sun_brightness);
}

// Returns true if the camera's axes lie in one plane. Products of nearly perpendicular unit vectors are near 1.
bool is_flat(const Camera& camera) {
  return !(std::abs(glm::dot(glm::cross(camera.right, camera.up), camera.forward)) > 1e-6);
}

}  // namespace

SolidFaces SolidFaces::of(const VoxelRegistry& types) {
  SolidFaces solid;
  for (std::size_t i = 0; types.has_textures() && i < types.size(); ++i) {
    const VoxelProperties& type = types[static_cast<VoxelType>(i)];
    if (type.visibility != Visibility::Transparent) continue;
    std::uint8_t faces = 0;
    for (const Direction direction : kDirections) {
      if (type.faces.empty() || type.faces[direction].alpha == FaceAlpha::Translucent) continue;
      faces = static_cast<std::uint8_t>(faces | 1U << static_cast<unsigned>(direction));
    }
    if (type.faces.empty()) continue;
    solid.by_type.resize(types.size());
    solid.by_type[i] = faces;
    solid.has_any |= faces != 0;
  }
  return solid;
}

QuadRuns visible_quads(const MeshDraw& draw, bool with_glass) {
  QUOIN_ASSERT(draw.mesh != nullptr, "a mesh to draw");
  const StoredMesh& mesh = *draw.mesh;
  QuadRuns runs;
  const auto add = [&](std::uint32_t first, std::uint32_t end) { append_run(first, end, runs); };
  const bool has_opaque = !draw.is_far;
  for (std::size_t face = 0; face < 6 && has_opaque && mesh.is_by_direction; ++face) {
    if ((draw.faces >> face & 1) != 0) add(mesh.opaque[face], mesh.opaque[face + 1]);
  }
  if (has_opaque && !mesh.is_by_direction) add(0, mesh.opaque.back());
  if (with_glass) add(mesh.opaque.back(), mesh.opaque.back() + static_cast<std::uint32_t>(mesh.glass.size()));
  return runs;
}

std::int64_t MeshFrameData::triangles() const {
  const bool is_ordered = !glass_by_rays && glass_quads > 0 && glass_quads <= kMaxOrdered;
  std::int64_t count = is_ordered ? 2 * static_cast<std::int64_t>(order.size()) : 0;
  for (const FarDraw& draw : far) {
    for (const auto& [first, end] : draw.runs) count += 2 * std::int64_t{end - first};
  }
  for (const MeshDraw& draw : draws) {
    count += draw.mesh->indices / 3;
    for (const auto& [first, end] : visible_quads(draw, !is_ordered)) count += 2 * std::int64_t{end - first};
    if (!draw.is_far) count += std::int64_t{2} * draw.mesh->shapes.count;
  }
  return count;
}

Result<MeshFrameData> make_mesh_frame(MeshStore& store, std::span<const MeshInstance> instances, const Camera& camera,
                                      const RenderOptions& options, int subpixels, bool glass_by_rays,
                                      const SolidFaces& solid) {
  if (is_flat(camera)) return make_error(ErrorCode::InvalidArgument, "camera: directions must not lie in one plane");
  MeshFrameData data;
  data.glass_by_rays = glass_by_rays;
  data.has_cutouts = solid.has_any;
  data.has_textured_glass = !solid.by_type.empty();
  View view(camera, options);
  std::vector<Space> spaces;
  const auto keep = [&](const Space& space) {
    spaces.push_back(space);
    data.instances.emplace_back();
  };
  for (const MeshInstance& instance : instances) {
    if (const MeshStore::StoredGrid* grid = store.find(instance.mesh); grid != nullptr) {
      const Space space(instance, grid->low, grid->high, camera);
      if (add_draws(space, *grid, view, data)) keep(space);
    }
    if (instance.impostor.parts.empty()) continue;
    const IVec3 chunk(glm::floor(instance.impostor.centre / kEdge));
    const Space space(instance, chunk, chunk, camera);
    add_far(space, view, data);
    keep(space);
  }
  QUOIN_ASSERT(spaces.size() == data.instances.size() && subpixels > 0, "one space per instance");
  view.finish();
  for (std::size_t i = 0; i < spaces.size(); ++i) {
    data.instances[i] = shader_instance(spaces[i], view, *options.environment, subpixels);
  }
  for (const FarDraw& draw : data.far) set_impostor(spaces[draw.instance], data.instances[draw.instance]);
  const auto is_nearer = [](const auto& a, const auto& b) { return a.distance < b.distance; };
  std::stable_sort(data.draws.begin(), data.draws.end(), is_nearer);
  std::stable_sort(data.far.begin(), data.far.end(), is_nearer);
  set_frame(view, *options.environment, data);
  // When values are shown instead of colours, transparent surfaces are drawn like opaque ones.
  if (!shows_values(options.light.shading)) order_glass(spaces, view, solid, data);
  return data;
}

}  // namespace quoin::vulkan
