#include <quoin/core/assert.h>

#include "io/gltf/gltf_layout.h"
#include "scene/instance_axes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace quoin {

namespace {

const glm::dmat3 kReflection(-1, 0, 0, 0, 1, 0, 0, 0, 1);

/// A view at the end of the buffer, which moves on to the next multiple of four.
GltfView reserve_view(std::uint64_t bytes, std::uint64_t& end) {
  constexpr std::uint64_t kAlignment = 4;
  const GltfView view{end, bytes};
  end += (bytes + kAlignment - 1) / kAlignment * kAlignment;
  return view;
}

/// Whether indices into that many vertices take 32 bits instead of 16. 65,535 restarts a strip, so the largest 16-bit
/// index is 65,534; one less for clients that count it among the vertices.
bool needs_wide_indices(std::uint64_t vertices) {
  constexpr std::uint64_t kShortIndexVertices = 65'535;
  return vertices >= kShortIndexVertices;
}

GltfTransform transform_of(const Similarity& place) {
  return {place.position, glm::normalize(unit_rotation(place.rotation)), DVec3(place.scale),
          place.mirrored ? kReflection : glm::dmat3(1.0)};
}

/// As translation, rotation and positive scale, after a reflection of x where it mirrors; when it shears, all but the
/// translation is baked.
GltfTransform transform_of(const glm::dmat4& world_from_part) {
  constexpr double kTolerance = 1e-9;
  GltfTransform node;
  node.translation = DVec3(world_from_part[3]);
  glm::dmat3 linear(world_from_part);
  const glm::dmat3 sheared = linear;
  if (glm::determinant(linear) < 0.0) {
    node.baked = kReflection;
    linear[0] = -linear[0];
  }
  for (int axis = 0; axis < 3; ++axis) {
    node.scale[axis] = glm::length(linear[axis]);
    linear[axis] /= node.scale[axis];
  }
  const bool shears = std::abs(glm::dot(linear[0], linear[1])) > kTolerance ||
                      std::abs(glm::dot(linear[1], linear[2])) > kTolerance ||
                      std::abs(glm::dot(linear[2], linear[0])) > kTolerance;
  if (shears) return {.translation = node.translation, .rotation = {1, 0, 0, 0}, .scale = DVec3(1), .baked = sheared};
  node.rotation = glm::normalize(glm::quat_cast(linear));
  if (node.rotation.w < 0.0) node.rotation = -node.rotation;
  // Lengths of turned axes are off by a rounding.
  constexpr double kRounding = 1e-14;
  const double mean = (node.scale.x + node.scale.y + node.scale.z) / 3.0;
  if (glm::length(node.scale - mean) < kRounding * mean) node.scale = DVec3(mean);
  if (glm::length(node.scale - 1.0) < kRounding) node.scale = DVec3(1.0);
  return node;
}

void measure(const VertexTransform& transform, GltfPrimitive& primitive) {
  if (transform.keeps_axes()) {
    const DBox box = bounds_of(primitive.view);
    const Vec3 a(transform.position(Vec3(box.min)));
    const Vec3 b(transform.position(Vec3(box.max)));
    primitive.min = glm::min(a, b);
    primitive.max = glm::max(a, b);
    return;
  }
  const auto& positions = primitive.view.positions;
  primitive.min = primitive.max = Vec3(transform.position(positions.front()));
  for (const Vec3& position : positions) {
    const Vec3 p(transform.position(position));
    primitive.min = glm::min(primitive.min, p);
    primitive.max = glm::max(primitive.max, p);
  }
}

GltfPrimitive lay_out_primitive(const VertexTransform& transform, const MaterialSurfaces::Surface& surface,
                                OcclusionIn occlusion, std::uint64_t& end) {
  GltfPrimitive primitive;
  primitive.view = surface.view;
  primitive.material = surface.material;
  measure(transform, primitive);
  const MeshView& view = surface.view;
  const std::uint64_t vertices = view.positions.size();
  primitive.wide_indices = needs_wide_indices(vertices);
  primitive.positions = reserve_view(vertices * 12, end);
  primitive.normals = reserve_view(vertices * 12, end);
  if (!view.has_albedo()) primitive.texture_coordinates = reserve_view(vertices * 8, end);
  const bool is_apart = occlusion == OcclusionIn::Attribute;
  const std::uint64_t greys = is_apart ? 0 : view.block_occlusion.size() * 4;
  primitive.colours = reserve_view(view.has_albedo() ? vertices * 8 : greys, end);
  const bool has_occlusion = !view.block_occlusion.empty() || !view.occlusion.empty();
  if (is_apart && has_occlusion) primitive.occlusion = reserve_view(vertices * 4, end);
  primitive.indices = reserve_view(view.indices.size() * (primitive.wide_indices ? 4 : 2), end);
  return primitive;
}

Status add_images(GltfLayout& layout) {
  std::vector<std::pair<const char*, PngImage>> images;
  images.emplace_back("palette", layout.palette.base_colour());
  images.emplace_back("palette metallic-roughness", layout.palette.metallic_roughness());
  if (layout.palette.has_emission()) images.emplace_back("palette emissive", layout.palette.emissive());
  for (auto& [name, image] : images) {
    auto png = encode_png(image);
    if (!png) return png.error();
    const GltfView view = reserve_view(png->size(), layout.buffer_bytes);
    layout.images.push_back({name, std::move(*png), view});
  }
  return {};
}

/// Lays out the meshes that nodes ask for: a part's one after the other, those of blocks as they are before reflected.
class MeshLayout {
 public:
  MeshLayout(const SceneMeshes& meshes, OcclusionIn occlusion, GltfLayout& layout)
      : meshes_(meshes), occlusion_(occlusion), layout_(layout) {}

  void lay_out() {
    std::vector<std::size_t> order(meshes_.placements.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::ranges::stable_sort(order, {}, [&](std::size_t i) {
      const std::size_t part = meshes_.placements[i].part;
      return std::pair(part, is_block(part) && layout_.nodes[i].transform.baked == kReflection);
    });
    for (const std::size_t i : order) {
      const std::size_t part = meshes_.placements[i].part;
      if (!layout_.surfaces[part].surfaces().empty())
        layout_.nodes[i].mesh = mesh_of(part, layout_.nodes[i].transform.baked);
    }
  }

 private:
  using Key = std::pair<std::size_t, std::array<double, 9>>;

  [[nodiscard]] bool is_block(std::size_t part) const {
    const auto& surfaces = meshes_.parts[part].surfaces;
    return !surfaces.empty() && !surfaces.front().has_albedo();
  }

  std::size_t mesh_of(std::size_t part, const glm::dmat3& baked) {
    Key key{part, {}};
    for (std::size_t i = 0; i < 9; ++i) key.second[i] = baked[static_cast<int>(i / 3)][static_cast<int>(i % 3)];
    const auto [found, is_new] = mesh_of_.try_emplace(key, layout_.meshes.size());
    if (is_new) add_mesh(part, baked);
    return found->second;
  }

  void add_mesh(std::size_t part, const glm::dmat3& baked) {
    variants_ = part == part_ ? variants_ + 1 : 1;
    part_ = part;
    std::string name = meshes_.parts[part].name;
    if (is_block(part) && baked == kReflection) {
      name += " (mirrored)";
    } else if (variants_ > 1) {
      name += " (" + std::to_string(variants_) + ")";
    }
    GltfMesh mesh{std::move(name), {glm::dmat4(baked), meshes_.parts[part].pivot}, {}};
    for (const auto& surface : layout_.surfaces[part].surfaces()) {
      mesh.primitives.push_back(lay_out_primitive(mesh.transform, surface, occlusion_, layout_.buffer_bytes));
    }
    layout_.meshes.push_back(std::move(mesh));
  }

  const SceneMeshes& meshes_;
  OcclusionIn occlusion_;
  GltfLayout& layout_;
  std::map<Key, std::size_t> mesh_of_;  ///< by part and what is baked
  std::optional<std::size_t> part_;     ///< of the last mesh
  std::size_t variants_ = 0;            ///< meshes of that part
};

/// A rotation and a position as those of what is below a group's frame. Groups do not mirror.
GltfTransform below(const Similarity& group, GltfTransform world) {
  Instance frame;
  frame.rotation = group.rotation;
  world.translation = (world.translation - group.position) * world_axes(frame);
  world.rotation = glm::normalize(glm::conjugate(unit_rotation(group.rotation)) * world.rotation);
  // Of quarter turns, which rounding should not show.
  constexpr double kRounding = 1e-15;
  for (int i = 0; i < 4; ++i) {
    const double nearest = std::round(world.rotation[i]);
    if (std::abs(world.rotation[i] - nearest) < kRounding) world.rotation[i] = nearest;
  }
  return world;
}

/// Adds the groups' nodes; every node comes to be placed from the one above it.
void hang_below_groups(const SceneMeshes& meshes, std::vector<GltfNode>& nodes) {
  const std::size_t first = nodes.size();
  for (const MeshGroup& group : meshes.groups) {
    GltfNode& node = nodes.emplace_back();
    node.name = group.name;
    node.transform = transform_of({group.world_from_group.position, group.world_from_group.rotation});
    node.layer = group.layer;
    node.is_group = true;
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const std::optional<std::size_t> above = i < first ? meshes.placements[i].group : meshes.groups[i - first].parent;
    if (!above) continue;
    nodes[i].transform = below(meshes.groups[*above].world_from_group, nodes[i].transform);
    nodes[i].is_at_top = false;
    nodes[first + *above].children.push_back(i);
  }
}

}  // namespace

Result<GltfLayout> lay_out_gltf(const SceneMeshes& meshes, OcclusionIn occlusion) {
  QUOIN_ASSERT(check_meshes(meshes).has_value(), "sound meshes");
  GltfLayout layout{.palette = MaterialPalette(meshes), .nodes = {}, .meshes = {}, .images = {}, .surfaces = {}};
  for (const MeshPart& part : meshes.parts) layout.surfaces.emplace_back(part, layout.palette);
  for (const MeshPlacement& placement : meshes.placements) {
    const auto transform = [](const auto& place) { return transform_of(place); };
    layout.nodes.push_back(
        {name_of(meshes, placement), std::nullopt, std::visit(transform, placement.world_from_part), placement.layer});
  }
  hang_below_groups(meshes, layout.nodes);
  MeshLayout(meshes, occlusion, layout).lay_out();
  if (!layout.palette.materials().empty() && !layout.meshes.empty()) {
    if (auto added = add_images(layout); !added) return added.error();
  }
  return layout;
}

}  // namespace quoin
