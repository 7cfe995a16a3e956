#include <array>
#include <bit>
#include <map>
#include <optional>
#include <utility>

#include <quoin/io/smooth_files.h>

#include "io/gltf_arrays.h"
#include "io/gltf_container.h"
#include "io/smooth_parts.h"

namespace quoin {

namespace {

using namespace gltf;

static_assert(std::endian::native == std::endian::little, "glTF buffers are little-endian");
static_assert(sizeof(Vec3) == 12 && sizeof(LinearRgba16) == 8);

/// Where a node stands, and what its mesh's vertices have gone through before.
struct NodeTransform {
  DVec3 translation{0.0};
  DQuat rotation{1.0, 0.0, 0.0, 0.0};
  DVec3 scale{1.0};
  glm::dmat3 baked{1.0};  ///< from the part's mesh to the node's
};

/// A mesh of the file: a part's, with what nodes cannot say baked in.
struct FileMesh {
  const SmoothPart* part = nullptr;
  glm::dmat3 baked{1.0};
  std::string name;
  bool wide_indices = false;
  Vec3 min{0.0F};  ///< of the positions as written
  Vec3 max{0.0F};
  GltfView positions;
  GltfView normals;
  GltfView colours;
  GltfView indices;

  [[nodiscard]] VertexTransform transform() const { return {glm::dmat4(baked), part->pivot}; }
};

struct FileNode {
  std::string name;
  std::size_t mesh = 0;
  NodeTransform transform;
};

struct Layout {
  std::vector<FileMesh> meshes;
  std::vector<FileNode> nodes;
  std::uint64_t buffer_bytes = 0;
};

/// As translation, rotation and positive scale, after a reflection of x where it mirrors; when it shears, all but the
/// translation is baked.
NodeTransform node_transform(const glm::dmat4& world_from_mesh) {
  constexpr double kTolerance = 1e-9;
  NodeTransform node;
  node.translation = DVec3(world_from_mesh[3]);
  glm::dmat3 linear(world_from_mesh);
  const glm::dmat3 sheared = linear;
  if (glm::determinant(linear) < 0.0) {
    node.baked[0].x = -1.0;
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

void measure(FileMesh& mesh) {
  const VertexTransform transform = mesh.transform();
  const std::vector<Vec3>& positions = mesh.part->mesh.positions;
  mesh.min = mesh.max = Vec3(transform.position(positions.front()));
  for (const Vec3& position : positions) {
    const Vec3 p(transform.position(position));
    mesh.min = glm::min(mesh.min, p);
    mesh.max = glm::max(mesh.max, p);
  }
}

FileMesh lay_out_mesh(const SmoothPart& part, const glm::dmat3& baked, std::uint64_t& end) {
  FileMesh mesh;
  mesh.part = &part;
  mesh.baked = baked;
  mesh.name = part.name;
  measure(mesh);
  const std::uint64_t vertices = part.mesh.positions.size();
  mesh.wide_indices = needs_wide_indices(vertices);
  mesh.positions = reserve_view(vertices * 12, end);
  mesh.normals = reserve_view(vertices * 12, end);
  mesh.colours = reserve_view(vertices * 8, end);
  mesh.indices = reserve_view(part.mesh.indices.size() * (mesh.wide_indices ? 4 : 2), end);
  return mesh;
}

void lay_out_part(const SmoothPart& part, Layout& layout) {
  std::map<std::array<double, 9>, std::size_t> mesh_of;  // by what is baked
  for (const SmoothPlacement& placement : part.placements) {
    FileNode node{placement.name.empty() ? part.name : placement.name, 0, node_transform(placement.world_from_mesh)};
    const glm::dmat3& baked = node.transform.baked;
    std::array<double, 9> key{};
    for (std::size_t i = 0; i < 9; ++i) key[i] = baked[static_cast<int>(i / 3)][static_cast<int>(i % 3)];
    const auto [found, is_new] = mesh_of.try_emplace(key, layout.meshes.size());
    if (is_new) layout.meshes.push_back(lay_out_mesh(part, baked, layout.buffer_bytes));
    if (is_new && mesh_of.size() > 1) layout.meshes.back().name += " (" + std::to_string(mesh_of.size()) + ")";
    node.mesh = found->second;
    layout.nodes.push_back(std::move(node));
  }
}

Json node_json(const FileNode& node) {
  Json entry = Json::object();
  if (!node.name.empty()) entry["name"] = node.name;
  entry["mesh"] = node.mesh;
  const NodeTransform& transform = node.transform;
  if (transform.translation != DVec3(0.0)) entry["translation"] = json_from(transform.translation);
  if (transform.rotation != DQuat(1, 0, 0, 0)) entry["rotation"] = json_from(transform.rotation);
  if (transform.scale != DVec3(1.0)) entry["scale"] = json_from(transform.scale);
  return entry;
}

Json mesh_json(const FileMesh& mesh, Arrays& arrays) {
  const std::uint64_t vertices = mesh.part->mesh.positions.size();
  Json attributes;
  attributes["POSITION"] = arrays.add(mesh.positions, kArrayBuffer, kFloat, "VEC3", vertices);
  arrays.accessors.back()["min"] = json_from(mesh.min);
  arrays.accessors.back()["max"] = json_from(mesh.max);
  attributes["NORMAL"] = arrays.add(mesh.normals, kArrayBuffer, kFloat, "VEC3", vertices);
  attributes["COLOR_0"] = arrays.add(mesh.colours, kArrayBuffer, kUnsignedShort, "VEC4", vertices);
  arrays.accessors.back()["normalized"] = true;
  const std::size_t indices =
      arrays.add(mesh.indices, kElementArrayBuffer, mesh.wide_indices ? kUnsignedInt : kUnsignedShort, "SCALAR",
                 mesh.part->mesh.indices.size());
  Json entry = Json::object();
  if (!mesh.name.empty()) entry["name"] = mesh.name;
  entry["primitives"] = Json::array({{{"attributes", std::move(attributes)}, {"indices", indices}, {"material", 0}}});
  return entry;
}

std::string json_text(const Layout& layout, std::string_view buffer_uri) {
  Json nodes = Json::array();
  for (const FileNode& node : layout.nodes) nodes.push_back(node_json(node));
  Json document = document_of(std::move(nodes));
  if (layout.meshes.empty()) return text_of(document);
  Arrays arrays;
  document["meshes"] = Json::array();
  for (const FileMesh& mesh : layout.meshes) document["meshes"].push_back(mesh_json(mesh, arrays));
  document["materials"] = Json::array(
      {{{"name", "smooth"}, {"pbrMetallicRoughness", {{"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}}}});
  add_buffer(std::move(arrays), layout.buffer_bytes, buffer_uri, document);
  return text_of(document);
}

template <class Index>
void write_indices(const SmoothMesh& mesh, bool turned, BlockWriter& out) {
  for (std::size_t i = 0; i < mesh.indices.size() / 3 && !out.failed(); ++i) {
    for (const std::uint32_t corner : corners_of(mesh, i, turned)) out.put(static_cast<Index>(corner));
  }
}

void write_mesh(const FileMesh& mesh, bool occlusion, BlockWriter& out) {
  const SmoothMesh& source = mesh.part->mesh;
  const VertexTransform transform = mesh.transform();
  for (const Vec3& position : source.positions) out.put(Vec3(transform.position(position)));
  for (const Vec3& normal : source.normals) out.put(Vec3(transform.normal(normal)));
  for (std::size_t i = 0; i < source.positions.size(); ++i) out.put(linear_colour(source, i, occlusion));
  if (mesh.wide_indices) {
    write_indices<std::uint32_t>(source, transform.mirrors(), out);
  } else {
    write_indices<std::uint16_t>(source, transform.mirrors(), out);
  }
  out.align('\0');
}

using WriteContent = Result<std::uint64_t>(const GltfContent&, const std::filesystem::path&, const Progress&);

Result<std::uint64_t> write_with(WriteContent write, std::span<const SmoothPart> parts,
                                 const std::filesystem::path& path, const SmoothFileOptions& options,
                                 const Progress& progress) {
  if (auto sound = check_parts(parts); !sound) return fail(sound.error().code, sound.error().message, path.string());
  Layout layout;
  for (const SmoothPart& part : parts) {
    if (is_drawn(part)) lay_out_part(part, layout);
  }
  const GltfContent content{[&](std::string_view uri) { return Result<std::string>(json_text(layout, uri)); },
                            layout.buffer_bytes,
                            [&](BlockWriter& out) {
                              for (const FileMesh& mesh : layout.meshes) write_mesh(mesh, options.occlusion, out);
                            }};
  return write(content, path, progress);
}

}  // namespace

Result<std::uint64_t> write_smooth_glb(std::span<const SmoothPart> parts, const std::filesystem::path& path,
                                       const SmoothFileOptions& options, const Progress& progress) {
  return write_with(write_glb_file, parts, path, options, progress);
}

Result<std::uint64_t> write_smooth_gltf(std::span<const SmoothPart> parts, const std::filesystem::path& path,
                                        const SmoothFileOptions& options, const Progress& progress) {
  return write_with(write_gltf_files, parts, path, options, progress);
}

std::vector<std::filesystem::path> smooth_gltf_files(std::span<const SmoothPart> parts,
                                                     const std::filesystem::path& path) {
  for (const SmoothPart& part : parts) {
    if (is_drawn(part)) return {path, gltf_buffer_path(path)};
  }
  return {path};
}

}  // namespace quoin
