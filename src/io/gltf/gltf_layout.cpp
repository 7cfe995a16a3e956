#include <quoin/core/assert.h>
#include <quoin/scene/scene_meshes.h>

#include "core/coordinates/unit_rotation.h"
#include "io/gltf/gltf_layout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <utility>

namespace quoin {

namespace {

const glm::dmat3 kReflection(-1, 0, 0, 0, 1, 0, 0, 0, 1);

/// Appends a view to the buffer and advances the buffer to the next multiple of four.
GltfView reserve_view(std::uint64_t bytes, std::uint64_t& end) {
  constexpr std::uint64_t kAlignment = 4;
  QUOIN_ASSERT(end % kAlignment == 0, "an aligned end");
  const GltfView view{end, bytes};
  end += (bytes + kAlignment - 1) / kAlignment * kAlignment;
  return view;
}

/// Returns true if indices of that many vertices need 32 bits instead of 16. 65,535 restarts a strip, so the largest
/// 16-bit index is 65,534; one less for clients that count it among the vertices.
bool needs_wide_indices(std::uint64_t vertices) {
  constexpr std::uint64_t kShortIndexVertices = 65'535;
  return vertices >= kShortIndexVertices;
}

std::uint32_t size_of(GltfComponent component) {
  switch (component) {
    case GltfComponent::Byte:
    case GltfComponent::UnsignedByte:
      return 1;
    case GltfComponent::Short:
    case GltfComponent::UnsignedShort:
      return 2;
    default:
      return 4;
  }
}

GltfTransform transform_of(const Similarity& place) {
  return {place.position, glm::normalize(unit_rotation(place.rotation)), DVec3(place.scale),
          place.mirrored ? kReflection : glm::dmat3(1.0)};
}

/// Splits a transform into translation, rotation and positive scale, after a reflection of x if it mirrors. If it
/// shears, everything except the translation is baked into the mesh.
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
  // The lengths of rotated axes have rounding errors.
  constexpr double kRounding = 1e-14;
  const double mean = (node.scale.x + node.scale.y + node.scale.z) / 3.0;
  if (glm::length(node.scale - mean) < kRounding * mean) node.scale = DVec3(mean);
  if (glm::length(node.scale - 1.0) < kRounding) node.scale = DVec3(1.0);
  return node;
}

/// Returns the bounds of the positions as stored.
void measure(const GltfMesh& mesh, GltfPrimitive& primitive) {
  const bool is_rounded = mesh.stored.component != GltfComponent::Float;
  const auto stored = [&](const Vec3& position) {
    const DVec3 p = mesh.transform.position(position);
    return Vec3(is_rounded ? glm::round(p) : p);
  };
  if (mesh.transform.keeps_axes()) {
    const DBox box = bounds_of(primitive.view);
    const Vec3 a = stored(Vec3(box.min));
    const Vec3 b = stored(Vec3(box.max));
    primitive.min = glm::min(a, b);
    primitive.max = glm::max(a, b);
    return;
  }
  const auto& positions = primitive.view.positions;
  QUOIN_ASSERT(!positions.empty(), "at least one vertex");
  primitive.min = primitive.max = stored(positions.front());
  for (const Vec3& position : positions) {
    const Vec3 p = stored(position);
    primitive.min = glm::min(primitive.min, p);
    primitive.max = glm::max(primitive.max, p);
  }
}

/// Lists the arrays of a primitive in their order, with `count` elements each. Their views have sizes but no offsets
/// yet.
class ArrayPlan {
 public:
  ArrayPlan(const GltfMesh& mesh, const MeshView& view, bool is_textured, const MeshFileOptions& options)
      : mesh_(mesh), view_(view), is_textured_(is_textured), options_(options) {}

  [[nodiscard]] std::vector<GltfArray> arrays() {
    const bool is_smooth = view_.has_albedo();
    const bool is_apart = options_.occlusion_in == OcclusionIn::Attribute;
    const std::uint64_t vertices = view_.positions.size();
    add(GltfArrayKind::Position, mesh_.stored.component, 3, vertices);
    add(GltfArrayKind::Normal, normal_component(), 3, vertices);
    const bool is_short = options_.quantize;
    // A step of 1/65,535 may be a noticeable part of an atlas texel.
    if (!view_.atlas.empty()) add(GltfArrayKind::AtlasCoordinate, GltfComponent::Float, 2, vertices);
    if (is_textured_) {
      add(GltfArrayKind::FaceCoordinate, GltfComponent::Float, 2, vertices);
    } else if (!is_smooth)
      add(GltfArrayKind::PaletteCoordinate, is_short ? GltfComponent::UnsignedShort : GltfComponent::Float, 2,
          vertices);
    const bool is_wide_colour = is_smooth || !view_.light.empty();
    if (is_wide_colour || (!is_apart && !view_.block_occlusion.empty()))
      add(GltfArrayKind::Colour, is_wide_colour ? GltfComponent::UnsignedShort : GltfComponent::UnsignedByte, 4,
          vertices);
    const bool has_occlusion = !view_.block_occlusion.empty() || !view_.occlusion.empty();
    if (is_apart && has_occlusion) add(GltfArrayKind::Occlusion, GltfComponent::Float, 1, vertices);
    if (!view_.materials.empty() && view_.light.empty()) {
      add(GltfArrayKind::Materials, GltfComponent::UnsignedShort, 4, vertices);
      add(GltfArrayKind::Weights, GltfComponent::UnsignedByte, 4, vertices);
    }
    const bool is_wide = needs_wide_indices(vertices);
    add(GltfArrayKind::Index, is_wide ? GltfComponent::UnsignedInt : GltfComponent::UnsignedShort, 1,
        view_.indices.size());
    return std::move(arrays_);
  }

 private:
  /// Bytes represent axis-aligned normals exactly.
  [[nodiscard]] GltfComponent normal_component() const {
    if (!options_.quantize) return GltfComponent::Float;
    return !view_.has_albedo() && mesh_.transform.keeps_axes() ? GltfComponent::Byte : GltfComponent::Short;
  }

  void add(GltfArrayKind kind, GltfComponent component, int components, std::uint64_t count) {
    GltfArray& array = arrays_.emplace_back();
    array.kind = kind;
    array.component = component;
    array.components = components;
    const bool is_number =
        kind == GltfArrayKind::Position || kind == GltfArrayKind::Materials || kind == GltfArrayKind::Index;
    array.normalized = component != GltfComponent::Float && !is_number;
    array.stride = size_of(component) * static_cast<std::uint32_t>(components);
    if (kind != GltfArrayKind::Index) array.stride = (array.stride + 3) / 4 * 4;
    array.view.bytes = array.stride * count;
  }

  const GltfMesh& mesh_;
  const MeshView& view_;
  bool is_textured_;
  const MeshFileOptions& options_;
  std::vector<GltfArray> arrays_;
};

/// Returns new vertex positions in the order in which triangles first use them. This shrinks the compressed indices to
/// a third; indices are a third of a compressed file.
std::vector<std::uint32_t> places_by_use(const MeshView& view) {
  constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> place_of(view.positions.size(), kNowhere);
  std::uint32_t next = 0;
  const auto place = [&](std::uint32_t& at) {
    if (at == kNowhere) at = next++;
  };
  for (const std::uint32_t index : view.indices) {
    QUOIN_ASSERT(index < place_of.size(), "an index of a vertex");
    place(place_of[index]);
  }
  for (std::uint32_t& at : place_of) place(at);
  return place_of;
}

/// Moves elements to new positions, or renumbers indices of moved vertices.
template <class Index>
void renumber(std::vector<std::byte>& bytes, const std::vector<std::uint32_t>& place_of) {
  for (std::size_t at = 0; at < bytes.size(); at += sizeof(Index)) {
    Index index{};
    std::memcpy(&index, bytes.data() + at, sizeof(Index));
    QUOIN_ASSERT(index < place_of.size(), "an index of a vertex");
    index = static_cast<Index>(place_of[index]);
    std::memcpy(bytes.data() + at, &index, sizeof(Index));
  }
}

std::vector<std::byte> moved(const std::vector<std::byte>& bytes, std::size_t stride,
                             const std::vector<std::uint32_t>& place_of) {
  QUOIN_ASSERT(bytes.size() == place_of.size() * stride, "an element for each vertex");
  std::vector<std::byte> result(bytes.size());
  for (std::size_t i = 0; i < place_of.size(); ++i) {
    std::memcpy(result.data() + place_of[i] * stride, bytes.data() + i * stride, stride);
  }
  return result;
}

/// Returns the compressed elements of an array for vertices in this order.
std::vector<std::byte> packed_array(const MaterialPalette& palette, const GltfMesh& mesh,
                                    const GltfPrimitive& primitive, const GltfArray& array,
                                    const std::vector<std::uint32_t>& place_of) {
  std::vector<std::byte> bytes;
  bytes.reserve(array.view.bytes);
  const Progress nobody;
  BlockWriter out(
      [&](std::span<const std::byte> block) {
        bytes.insert(bytes.end(), block.begin(), block.end());
        return Status();
      },
      nobody, 0);
  write_gltf_array(palette, mesh, primitive, array, out);
  [[maybe_unused]] const Status done = out.finish();
  QUOIN_ASSERT(done.has_value() && bytes.size() == array.view.bytes, "as large as planned");
  if (array.kind != GltfArrayKind::Index) {
    bytes = moved(bytes, array.stride, place_of);
  } else if (array.component == GltfComponent::UnsignedInt) {
    renumber<std::uint32_t>(bytes, place_of);
  } else {
    renumber<std::uint16_t>(bytes, place_of);
  }
  return compress_gltf_array(array, bytes);
}

PngImage png_of(const Texture& texture) {
  const auto size = static_cast<std::uint32_t>(texture.size());
  return {size, size, 4, texture.image().rgba};
}

Status add_image(GltfImageKind kind, std::string name, const PngImage& image, GltfLayout& layout) {
  auto png = encode_png(image);
  if (!png) return png.error();
  const GltfView view = reserve_view(png->size(), layout.buffer_bytes);
  layout.images.push_back({kind, std::move(name), std::move(*png), view});
  return {};
}

Status add_face_images(GltfLayout& layout) {
  const MaterialPalette& palette = layout.palette;
  for (std::size_t i = 0; i < palette.face_image_count(); ++i) {
    const PngImage image = palette.face_image(i);
    if (Status added = add_image(GltfImageKind::Face, palette.face_image_name(i), image, layout); !added) return added;
  }
  return {};
}

/// Finds the materials that vertices name, and adds an image for each of their textures.
Status add_field_textures(GltfLayout& layout) {
  std::set<VoxelType> used;
  for (const MaterialSurfaces& part : layout.surfaces) {
    for (const MaterialSurfaces::Surface& surface : part.surfaces()) {
      if (!surface.view.light.empty()) continue;
      for (const VertexMaterials& each : surface.view.materials) used.insert(each.types.begin(), each.types.end());
    }
  }
  const VoxelRegistry& types = layout.palette.types();
  used.erase(kAir);
  std::erase_if(used, [&](VoxelType type) { return type >= types.size(); });
  if (std::ranges::none_of(used, [&](VoxelType type) { return !types[type].faces.empty(); })) return {};
  layout.field_types.assign(used.begin(), used.end());
  for (const VoxelType type : used) {
    if (types[type].faces.empty()) continue;
    for (const Direction direction : kDirections) {
      const Texture& texture = types[type].faces[direction].texture;
      if (std::ranges::find(layout.field_textures, texture) != layout.field_textures.end()) continue;
      layout.field_textures.push_back(texture);
      if (Status added = add_image(GltfImageKind::Field, texture.name(), png_of(texture), layout); !added) return added;
    }
  }
  return {};
}

/// Omits images that no material uses.
Status add_images(const Image& atlas, GltfLayout& layout) {
  const MaterialPalette& palette = layout.palette;
  const auto& materials = palette.materials();
  const auto is_opaque = [](const SurfaceMaterial& material) { return material.surface == SurfaceClass::Opaque; };
  const bool has_atlas = !atlas.rgb.empty() && std::ranges::any_of(materials, is_opaque);
  std::vector<std::tuple<GltfImageKind, const char*, PngImage>> images;
  if (!has_atlas || !std::ranges::all_of(materials, is_opaque)) {
    images.emplace_back(GltfImageKind::Palette, "palette", palette.base_colour());
  }
  if (!layout.is_unlit) {
    images.emplace_back(GltfImageKind::MetallicRoughness, "palette metallic-roughness", palette.metallic_roughness());
  }
  if (!layout.is_unlit && palette.has_emission())
    images.emplace_back(GltfImageKind::Emissive, "palette emissive", palette.emissive());
  if (has_atlas) images.emplace_back(GltfImageKind::Atlas, "atlas", png_of(atlas));
  for (auto& [kind, name, image] : images) {
    if (Status added = add_image(kind, name, image, layout); !added) return added;
  }
  return {};
}

/// Returns the transform of a node whose mesh stores its positions this way.
GltfTransform from_stored(const GltfQuantization& stored, GltfTransform transform) {
  if (stored.step == 1.0 && stored.origin == DVec3(0.0)) return transform;
  transform.translation += transform.rotation * (transform.scale * stored.origin);
  transform.scale *= stored.step;
  return transform;
}

/// Lays out the meshes that nodes use, part by part. Unmirrored block meshes come before mirrored ones.
class MeshLayout {
 public:
  MeshLayout(const SceneMeshes& meshes, const MeshFileOptions& options, GltfLayout& layout)
      : meshes_(meshes), options_(options), layout_(layout) {}

  void lay_out() {
    std::vector<std::size_t> order(meshes_.placements.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::ranges::stable_sort(order, {}, [&](std::size_t i) {
      const std::size_t part = meshes_.placements[i].part;
      return std::pair(part, is_block(part) && layout_.nodes[i].transform.baked == kReflection);
    });
    for (const std::size_t i : order) {
      const std::size_t part = meshes_.placements[i].part;
      if (layout_.surfaces[part].surfaces().empty()) continue;
      GltfNode& node = layout_.nodes[i];
      node.mesh = mesh_of(part, node.transform.baked);
      node.transform = from_stored(layout_.meshes[*node.mesh].stored, node.transform);
    }
  }

 private:
  using Key = std::pair<std::size_t, std::array<double, 9>>;

  [[nodiscard]] bool is_block(std::size_t part) const {
    const auto& surfaces = meshes_.parts[part].surfaces;
    return !surfaces.empty() && !surfaces.front().has_albedo();
  }

  std::size_t mesh_of(std::size_t part, const glm::dmat3& baked) {
    QUOIN_ASSERT(part < meshes_.parts.size(), "a part of the meshes");
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
    const DVec3& pivot = meshes_.parts[part].pivot;
    const auto& surfaces = layout_.surfaces[part].surfaces();
    GltfMesh mesh{std::move(name), {glm::dmat4(baked), pivot}};
    if (options_.quantize) mesh.stored = quantize_positions(mesh.transform, surfaces);
    if (mesh.stored.component == GltfComponent::Float) {
      mesh.stored.origin =
          float_origin(bounds_of(meshes_.parts[part], mesh.transform), kNearVoxels * mesh.transform.least_step());
    }
    if (mesh.stored.step != 1.0 || mesh.stored.origin != DVec3(0.0)) {
      glm::dmat4 stored_from_part(baked / mesh.stored.step);
      stored_from_part[3] = glm::dvec4(-mesh.stored.origin / mesh.stored.step, 1.0);
      mesh.transform = VertexTransform(stored_from_part, pivot);
    }
    for (const auto& surface : surfaces) add_primitive(surface, mesh);
    layout_.meshes.push_back(std::move(mesh));
  }

  void add_primitive(const MaterialSurfaces::Surface& surface, GltfMesh& mesh) {
    GltfPrimitive& primitive = mesh.primitives.emplace_back();
    primitive.view = surface.view;
    primitive.material = surface.material;
    measure(mesh, primitive);
    primitive.arrays = ArrayPlan(mesh, surface.view, layout_.palette.is_textured(surface.material), options_).arrays();
    const auto place_of = options_.compress ? places_by_use(surface.view) : std::vector<std::uint32_t>();
    for (GltfArray& array : primitive.arrays) {
      std::uint64_t& end = options_.compress ? layout_.decoded_bytes : layout_.buffer_bytes;
      array.view = reserve_view(array.view.bytes, end);
      if (!options_.compress) continue;
      array.packed = packed_array(layout_.palette, mesh, primitive, array, place_of);
      array.packed_view = reserve_view(array.packed.size(), layout_.buffer_bytes);
    }
  }

  const SceneMeshes& meshes_;
  const MeshFileOptions& options_;
  GltfLayout& layout_;
  std::map<Key, std::size_t> mesh_of_;  ///< mesh index by part and baked transform
  std::optional<std::size_t> part_;     ///< part of the last mesh
  std::size_t variants_ = 0;            ///< meshes of that part
};

/// Converts a world rotation and position to a group's frame. Groups do not mirror.
GltfTransform below(const Similarity& group, GltfTransform world) {
  Instance frame;
  frame.rotation = group.rotation;
  world.translation = (world.translation - group.position) * world_axes(frame);
  world.rotation = glm::normalize(glm::conjugate(unit_rotation(group.rotation)) * world.rotation);
  // Removes rounding errors of quarter turns.
  constexpr double kRounding = 1e-15;
  for (int i = 0; i < 4; ++i) {
    const double nearest = std::round(world.rotation[i]);
    if (std::abs(world.rotation[i] - nearest) < kRounding) world.rotation[i] = nearest;
  }
  return world;
}

/// Adds the groups' nodes and places every node relative to its parent.
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
    QUOIN_ASSERT(*above < meshes.groups.size(), "a group of the meshes");
    nodes[i].transform = below(meshes.groups[*above].world_from_group, nodes[i].transform);
    nodes[i].is_at_top = false;
    nodes[first + *above].children.push_back(i);
  }
}

/// glTF has no visibility: a scale of 0 hides a node.
void hide_at_first(const SceneMeshes& meshes, std::vector<GltfNode>& nodes) {
  for (std::size_t i = 0; i < meshes.placements.size(); ++i) {
    const auto& keys = meshes.placements[i].keys;
    if (!keys.empty() && !keys.front().visible) nodes[i].transform.scale = DVec3(0.0);
  }
}

/// Collects the values of one property; skips repeated values except the last.
class ChannelBuilder {
 public:
  ChannelBuilder(std::size_t node, GltfChannel::Path path) : channel_{.node = node, .path = path} {}

  void add(double seconds, std::span<const float> value, bool is_last) {
    QUOIN_ASSERT(!value.empty() && channel_.values.size() % value.size() == 0, "as many numbers at each time");
    const std::span<const float> all(channel_.values);
    const bool is_same = !all.empty() && std::ranges::equal(all.last(value.size()), value);
    has_changes_ |= !all.empty() && !is_same;
    if (is_same && !is_last) return;
    channel_.seconds.push_back(static_cast<float>(seconds));
    channel_.values.insert(channel_.values.end(), value.begin(), value.end());
  }
  /// Returns nullopt if the property never changes.
  [[nodiscard]] std::optional<GltfChannel> channel() const {
    return has_changes_ ? std::optional(channel_) : std::nullopt;
  }

 private:
  GltfChannel channel_;
  bool has_changes_ = false;
};

std::array<float, 3> floats_of(const DVec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

std::array<float, 4> floats_of(const DQuat& q) {
  return {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z), static_cast<float>(q.w)};
}

/// Adds the animation of placement nodes up to the end of the last frame, so that frames of a loop have equal length.
void add_channels(const SceneMeshes& meshes, GltfLayout& layout) {
  for (std::size_t i = 0; i < meshes.placements.size(); ++i) {
    const MeshPlacement& placement = meshes.placements[i];
    const GltfNode& node = layout.nodes[i];
    if (placement.keys.empty() || !node.mesh) continue;
    QUOIN_ASSERT(*node.mesh < layout.meshes.size(), "a mesh of the file");
    ChannelBuilder translation(i, GltfChannel::Path::Translation);
    ChannelBuilder rotation(i, GltfChannel::Path::Rotation);
    ChannelBuilder scale(i, GltfChannel::Path::Scale);
    const auto add = [&](const MeshKey& key, double seconds, bool is_last) {
      GltfTransform transform = transform_of(key.world_from_part);
      if (placement.group) transform = below(meshes.groups[*placement.group].world_from_group, transform);
      transform = from_stored(layout.meshes[*node.mesh].stored, transform);
      translation.add(seconds, floats_of(transform.translation), is_last);
      rotation.add(seconds, floats_of(transform.rotation), is_last);
      scale.add(seconds, floats_of(key.visible ? transform.scale : DVec3(0.0)), is_last);
    };
    for (const MeshKey& key : placement.keys) add(key, key.seconds, false);
    const MeshKey& last = placement.keys.back();
    const bool is_longer = static_cast<float>(meshes.seconds) > static_cast<float>(last.seconds);
    if (is_longer) add(last, meshes.seconds, true);
    for (const ChannelBuilder* const each : {&translation, &rotation, &scale}) {
      auto channel = each->channel();
      if (!channel) continue;
      channel->seconds_view = reserve_view(channel->seconds.size() * sizeof(float), layout.buffer_bytes);
      channel->values_view = reserve_view(channel->values.size() * sizeof(float), layout.buffer_bytes);
      layout.channels.push_back(std::move(*channel));
    }
  }
}

/// Returns true if glTF can represent the lamp: finite numbers, some light and, for spots, a direction.
bool can_light(const Lamp& lamp) {
  const bool is_finite_lamp = is_finite(lamp.position) && is_finite(lamp.direction) && is_finite(DVec3(lamp.colour)) &&
                              std::isfinite(lamp.intensity) && std::isfinite(lamp.inner_angle_radians) &&
                              std::isfinite(lamp.outer_angle_radians);
  const float most = std::max({lamp.colour.r, lamp.colour.g, lamp.colour.b});
  const bool has_direction = lamp.kind == Lamp::Kind::Point || glm::length(lamp.direction) > 0.0;
  return is_finite_lamp && lamp.intensity > 0.0 && most > 0.0F && lamp.range > 0.0 && has_direction;
}

bool can_look(const Camera& camera) {
  const bool is_sound =
      is_finite(camera.position) && is_finite(camera.right) && is_finite(camera.up) && is_finite(camera.forward);
  const double size =
      camera.projection == Camera::Projection::Perspective ? camera.vertical_fov_radians : camera.view_height;
  return is_sound && size > 0.0 && std::isfinite(size);
}

}  // namespace

std::optional<std::size_t> GltfLayout::texture(GltfImageKind kind) const {
  const auto found = std::ranges::find(images, kind, &GltfImage::kind);
  if (found == images.end()) return std::nullopt;
  return static_cast<std::size_t>(found - images.begin());
}

Result<GltfLayout> lay_out_gltf(const SceneMeshes& meshes, const MeshFileOptions& options) {
  if (options.compress && !can_compress_gltf()) {
    return make_error(ErrorCode::Unsupported,
                      "cannot compress meshes: Quoin was built without meshoptimizer (Debian: libmeshoptimizer-dev)");
  }
  QUOIN_ASSERT(check_meshes(meshes).has_value(), "sound meshes");
  GltfLayout layout{.palette = MaterialPalette(meshes, face_colours_in(options)),
                    .nodes = {},
                    .meshes = {},
                    .images = {},
                    .surfaces = {}};
  if (Status sound = layout.palette.validate(); !sound) return sound.error();
  layout.is_unlit = has_light(meshes);
  for (const MeshPart& part : meshes.parts) layout.surfaces.emplace_back(part, layout.palette);
  for (const MeshPlacement& placement : meshes.placements) {
    const auto transform = [](const auto& place) { return transform_of(place); };
    layout.nodes.push_back(
        {name_of(meshes, placement), std::nullopt, std::visit(transform, placement.world_from_part), placement.layer});
  }
  hang_below_groups(meshes, layout.nodes);
  MeshLayout(meshes, options, layout).lay_out();
  hide_at_first(meshes, layout.nodes);
  if (!layout.palette.materials().empty() && !layout.meshes.empty()) {
    if (auto added = add_images(meshes.atlas, layout); !added) return added.error();
  }
  if (auto added = add_face_images(layout); !added) return added.error();
  if (auto added = add_field_textures(layout); !added) return added.error();
  add_channels(meshes, layout);
  std::ranges::copy_if(meshes.lamps, std::back_inserter(layout.lamps), can_light);
  std::ranges::copy_if(meshes.cameras, std::back_inserter(layout.cameras),
                       [](const MeshCamera& each) { return can_look(each.camera); });
  return layout;
}

}  // namespace quoin
