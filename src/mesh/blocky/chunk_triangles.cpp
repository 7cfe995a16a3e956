#include <quoin/mesh/blocky.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <tuple>
#include <unordered_map>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/grid/chunk.h>
#include <quoin/mesh/quad.h>
#include <quoin/mesh/quad_triangles.h>

#include "core/work/progress_steps.h"

namespace quoin {
namespace {

constexpr int kLattice = kChunkEdge + 1;

struct OutlinePoint {
  IVec3 position;  ///< chunk coordinates, 0..64
  std::uint8_t occlusion;
};

/// Finds, for the quads of one chunk, the vertices that must be on their outlines so that no vertex is inside another
/// quad's edge.
///
/// Inside the chunk, these are the corners of its other quads. An edge in a border plane of the chunk is shared with a
/// chunk that may be meshed separately, so it is divided at every voxel: both sides follow this rule.
class OutlineFinder {
 public:
  /// Records the corners of all quads of a chunk.
  void prepare(const QuadBuffer& quads);

  /// Computes the outline of one of these quads, counter-clockwise from outside, starting at corner 0. Includes all
  /// corners.
  void outline(const Quad& quad, std::vector<OutlinePoint>& out) const;

 private:
  [[nodiscard]] bool is_vertex(IVec3 p) const;

  std::vector<std::uint64_t> corners_;  // one bit for each of 65^3 lattice points
};

std::size_t lattice_index(IVec3 p) {
  QUOIN_ASSERT(std::min({p.x, p.y, p.z}) >= 0 && std::max({p.x, p.y, p.z}) < kLattice,
               "a corner of the chunk's voxels");
  return static_cast<std::size_t>((p.z * kLattice + p.y) * kLattice + p.x);
}

bool is_on_border(int coordinate) {
  return coordinate == 0 || coordinate == kChunkEdge;
}

// Returns true if an edge along `axis` through `p` is in a border plane of the chunk.
bool edge_is_on_border(IVec3 p, int axis) {
  for (int other = 0; other < 3; ++other) {
    if (other != axis && is_on_border(p[other])) return true;
  }
  return false;
}

// Returns the indices of the four corners in an outline.
std::array<std::size_t, 4> corner_places(const std::vector<OutlinePoint>& outline) {
  std::array<std::size_t, 4> places{};
  std::size_t found = 1;
  for (std::size_t i = 1; i < outline.size() && found < 4; ++i) {
    const IVec3 before = outline[i].position - outline[i - 1].position;
    const IVec3 after = outline[(i + 1) % outline.size()].position - outline[i].position;
    const bool is_straight = glm::sign(before) == glm::sign(after);
    if (!is_straight) places[found++] = i;
  }
  QUOIN_ASSERT(found == 4, "an outline with four corners");
  return places;
}

void OutlineFinder::prepare(const QuadBuffer& quads) {
  corners_.assign((static_cast<std::size_t>(kLattice) * kLattice * kLattice + 63) / 64, 0);
  for (const Quad& quad : quads) {
    for (int corner = 0; corner < 4; ++corner) {
      const std::size_t index = lattice_index(quad.corner(corner));
      corners_[index / 64] |= std::uint64_t{1} << (index % 64);
    }
  }
}

bool OutlineFinder::is_vertex(IVec3 p) const {
  QUOIN_ASSERT(!corners_.empty(), "quads that were prepared");
  const std::size_t index = lattice_index(p);
  return (corners_[index / 64] >> (index % 64) & 1U) != 0;
}

void OutlineFinder::outline(const Quad& quad, std::vector<OutlinePoint>& out) const {
  out.clear();
  for (int corner = 0; corner < 4; ++corner) {
    const IVec3 from = quad.corner(corner);
    const IVec3 to = quad.corner((corner + 1) % 4);
    const IVec3 step = glm::sign(to - from);
    const int axis = step.x != 0 ? 0 : step.y != 0 ? 1 : 2;
    const bool all = edge_is_on_border(from, axis);
    out.push_back({from, quad.occlusion(corner)});
    for (IVec3 p = from + step; p != to; p += step) {
      // Quads merge only where occlusion is constant, so occlusion is constant along an edge longer than a voxel.
      if (all || is_vertex(p)) out.push_back({p, quad.occlusion(corner)});
    }
  }
}

// Appends triangles that cover a quad's outline. Uses all points of the outline and no triangle of zero area.
//
// Order of `outline`: as OutlineFinder returns it. An outline of four points is split along the quad's diagonal.
//
// A and C are the ends of the diagonal. Fans from C cover side A-B, fans from the last point before B cover side B-C.
// The other half works in the same way.
void triangulate_outline(const std::vector<OutlinePoint>& outline, bool flipped, std::uint32_t base,
                         std::vector<std::uint32_t>& indices) {
  const std::array<std::size_t, 4> corners = corner_places(outline);
  const std::size_t count = outline.size();
  const auto emit = [&](std::size_t a, std::size_t b, std::size_t c) {
    for (const std::size_t i : {a, b, c}) indices.push_back(base + static_cast<std::uint32_t>(i % count));
  };
  const auto half = [&](std::size_t a, std::size_t b, std::size_t c) {
    // Indices increase from a to b to c, modulo the count.
    const std::size_t to_b = (b + count - a) % count;
    const std::size_t to_c = (c + count - a) % count;
    for (std::size_t i = 0; i + 1 < to_b; ++i) emit(a + i, a + i + 1, c);
    for (std::size_t i = to_b; i < to_c; ++i) emit(a + to_b - 1, a + i, a + i + 1);
  };
  const std::size_t first = flipped ? 1 : 0;
  half(corners[first], corners[first + 1], corners[(first + 2) % 4]);
  half(corners[(first + 2) % 4], corners[(first + 3) % 4], corners[first]);
}

constexpr std::size_t kMaxVertices = std::numeric_limits<std::uint32_t>::max() - 1'024;

Error too_large() {
  return {ErrorCode::LimitExceeded, "the mesh needs more than 2^32 vertices", {}, {}};
}

// The next vertex and index to write.
struct Cursor {
  std::size_t vertex = 0;
  std::size_t index = 0;
};

// Makes room for more vertices and indices. Returns the place of the first.
Cursor grow(std::size_t vertices, std::size_t indices, BlockyTriangles& out) {
  const Cursor first{out.positions.size(), out.indices.size()};
  const std::size_t total = first.vertex + vertices;
  out.positions.resize(total);
  out.directions.resize(total);
  out.occlusion.resize(total);
  out.types.resize(total);
  out.indices.resize(first.index + indices);
  return first;
}

void put_quad(const Quad& quad, IVec3 origin, Cursor& at, BlockyTriangles& out) {
  QUOIN_ASSERT(at.vertex + 4 <= out.positions.size() && at.index + 6 <= out.indices.size(), "a quad that was counted");
  for_each_vertex({&quad, 1}, [&](std::size_t i, const QuadVertex& vertex) {
    out.positions[at.vertex + i] = Vec3(origin + vertex.position);
    out.directions[at.vertex + i] = vertex.direction;
    out.occlusion[at.vertex + i] = vertex.occlusion;
    out.types[at.vertex + i] = vertex.type;
  });
  std::uint32_t* index = out.indices.data() + at.index;
  for (const std::uint8_t corner : triangle_corners(quad.flipped())) {
    *index++ = static_cast<std::uint32_t>(at.vertex) + corner;
  }
  at.vertex += 4;
  at.index += 6;
}

// Appends the triangles of a shape's face. A triangle has a fourth vertex that no index names, so that the vertices of
// each face begin at a multiple of four.
void append_face(const ShapeFace& face, IVec3 origin, BlockyTriangles& out) {
  const FaceOcclusion occlusion = face.occlusion();
  const bool is_triangle = face.is_triangle();
  const auto first = static_cast<std::uint32_t>(out.positions.size());
  for (std::size_t i = 0; i < 4; ++i) {
    out.positions.push_back(Vec3(origin + face.voxel()) + face.model_face().corners[i]);
    out.directions.push_back(face.model_face().direction);
    out.occlusion.push_back(occlusion[i]);
    out.types.push_back(face.type);
  }
  const std::array<std::uint8_t, 6>& order = triangle_corners(!is_triangle && flips_diagonal(occlusion));
  for (std::size_t i = 0; i < (is_triangle ? 3U : 6U); ++i) out.indices.push_back(first + order[i]);
}

void append_outline(const Quad& quad, IVec3 origin, const std::vector<OutlinePoint>& outline, BlockyTriangles& out) {
  const auto base = static_cast<std::uint32_t>(out.positions.size());
  for (const OutlinePoint& point : outline) {
    out.positions.emplace_back(origin + point.position);
    out.directions.push_back(quad.direction());
    out.occlusion.push_back(point.occlusion);
    out.types.push_back(quad.type());
  }
  triangulate_outline(outline, quad.flipped(), base, out.indices);
}

}  // namespace

SurfaceClass surface_class(const VoxelProperties& properties) {
  const bool is_transparent = properties.visibility == Visibility::Transparent;
  if (properties.emission > 0.0F) return is_transparent ? SurfaceClass::EmissiveTransparent : SurfaceClass::Emissive;
  return is_transparent ? SurfaceClass::Transparent : SurfaceClass::Opaque;
}

SurfaceClass surface_class(const VoxelProperties& properties, const VoxelFace* look) {
  if (look == nullptr || look->emission_share > 0) return surface_class(properties);
  return properties.visibility == Visibility::Transparent ? SurfaceClass::Transparent : SurfaceClass::Opaque;
}

namespace {

/// The faces of vertices that do not follow from type, direction and position (VertexLook), for one surface.
class LookTable {
 public:
  /// Returns VertexLook::face of a face with a lifetime of this object, or of `faces` of a type that is turned.
  [[nodiscard]] std::uint32_t number_of(const VoxelFace& face, BlockyTriangles& out) {
    const auto [known, is_new] = by_address_.try_emplace(&face, 0);
    if (is_new) known->second = add(face, out);
    return known->second;
  }
  [[nodiscard]] std::uint32_t number_of(const Quad& quad, const VoxelFaces& faces, BlockyTriangles& out) {
    const auto [known, is_new] =
        turned_.try_emplace({quad.type(), quad.direction(), quad.orientation().index()}, std::uint32_t{0});
    if (is_new) known->second = add(turned_face(faces, quad.direction(), quad.orientation()), out);
    return known->second;
  }

 private:
  static std::uint32_t add(const VoxelFace& face, BlockyTriangles& out) {
    auto found = std::find(out.faces.begin(), out.faces.end(), face);
    if (found == out.faces.end()) found = out.faces.insert(found, face);
    return static_cast<std::uint32_t>(found - out.faces.begin()) + 1;
  }

  std::unordered_map<const VoxelFace*, std::uint32_t> by_address_;
  std::map<std::tuple<VoxelType, Direction, int>, std::uint32_t> turned_;
};

/// Converts the quads and shapes of consecutive chunks to triangles.
class ChunkTriangles {
 public:
  ChunkTriangles(const VoxelRegistry& types, bool watertight);

  /// Appends the triangles of one chunk, and counts its faces and quads. Errors: LimitExceeded if a surface class needs
  /// more than about 2^32 vertices. Requires: one mesh for all chunks.
  [[nodiscard]] Status append(const QuadBuffer& quads, const ShapeFaceBuffer* shapes, IVec3 chunk, BlockyMesh& mesh);

 private:
  using Counts = std::array<std::size_t, kSurfaceClasses>;

  [[nodiscard]] SurfaceClass class_of(const Quad& quad) const {
    const VoxelType type = quad.type();
    if (type >= classes_.size()) return SurfaceClass::Opaque;
    return has_dark_faces_ ? class_of_face(quad) : classes_[type];
  }
  [[nodiscard]] SurfaceClass class_of_face(const Quad& quad) const {
    const VoxelProperties& type = types_[quad.type()];
    if (type.faces.empty()) return classes_[quad.type()];
    return surface_class(type, &type.faces[quad.orientation().inverse().apply(quad.direction())]);
  }
  [[nodiscard]] Status append_quads(const QuadBuffer& quads, IVec3 origin, BlockyMesh& mesh);
  [[nodiscard]] Status append_outlines(const QuadBuffer& quads, IVec3 origin, BlockyMesh& mesh);
  [[nodiscard]] Status append_shapes(const ShapeFaceBuffer& shapes, IVec3 origin, BlockyMesh& mesh);
  // Sets the looks of the vertices since `first` if the quad is turned.
  void set_look(const Quad& quad, IVec3 origin, std::size_t first, std::size_t end, BlockyMesh& mesh);

  const VoxelRegistry& types_;
  std::vector<SurfaceClass> classes_;  // [VoxelType]
  bool has_dark_faces_ = false;        // faces of cubes without a share of their type's emission
  bool watertight_;
  OutlineFinder finder_;
  std::vector<OutlinePoint> outline_;
  std::array<LookTable, kSurfaceClasses> looks_;
};

ChunkTriangles::ChunkTriangles(const VoxelRegistry& types, bool watertight)
    : types_(types), classes_(types.size()), watertight_(watertight) {
  for (std::size_t i = 0; i < classes_.size(); ++i) {
    const VoxelProperties& type = types[static_cast<VoxelType>(i)];
    classes_[i] = surface_class(type);
    const auto is_dark = [&](Direction each) { return type.faces[each].emission_share == 0; };
    if (type.emission > 0.0F && !type.faces.empty()) has_dark_faces_ |= std::ranges::any_of(kDirections, is_dark);
  }
}

Status ChunkTriangles::append(const QuadBuffer& quads, const ShapeFaceBuffer* shapes, IVec3 chunk, BlockyMesh& mesh) {
  const std::size_t faces = shapes == nullptr ? 0 : shapes->size();
  mesh.faces_visible += face_count(quads) + static_cast<std::int64_t>(faces);
  mesh.quads += static_cast<std::int64_t>(quads.size() + faces);
  const IVec3 origin = chunk * kChunkEdge;
  Status done = watertight_ ? append_outlines(quads, origin, mesh) : append_quads(quads, origin, mesh);
  if (done && faces > 0) done = append_shapes(*shapes, origin, mesh);
  for (BlockyTriangles& surface : mesh.surfaces) {
    if (!surface.looks.empty()) surface.looks.resize(surface.positions.size());
  }
  return done;
}

void ChunkTriangles::set_look(const Quad& quad, IVec3 origin, std::size_t first, std::size_t end, BlockyMesh& mesh) {
  const VoxelFaces& faces = types_[quad.type()].faces;
  if (faces.empty()) return;
  const auto which = static_cast<std::size_t>(class_of(quad));
  BlockyTriangles& out = mesh.surfaces[which];
  out.looks.resize(out.positions.size());
  const std::uint32_t face = looks_[which].number_of(quad, faces, out);
  const TextureFrame frame = texture_frame(out.faces[face - 1], quad.direction());
  for (std::size_t i = first; i < end; ++i) {
    out.looks[i].face = face;
    out.looks[i].uv = texture_coordinates(frame, out.positions[i] - Vec3(origin + quad.voxel()));
  }
}

Status ChunkTriangles::append_quads(const QuadBuffer& quads, IVec3 origin, BlockyMesh& mesh) {
  Counts counts{};
  for (const Quad& quad : quads) ++counts[static_cast<std::size_t>(class_of(quad))];
  std::array<Cursor, kSurfaceClasses> next{};
  for (std::size_t i = 0; i < kSurfaceClasses; ++i) {
    BlockyTriangles& out = mesh.surfaces[i];
    if (out.positions.size() + vertices_needed(counts[i]) > kMaxVertices) return too_large();
    next[i] = grow(vertices_needed(counts[i]), indices_needed(counts[i]), out);
  }
  for (const Quad& quad : quads) {
    const auto which = static_cast<std::size_t>(class_of(quad));
    put_quad(quad, origin, next[which], mesh.surfaces[which]);
  }
  if (!types_.has_turned_by_state()) return {};
  // The vertices of each surface are in the order of its quads.
  for (std::size_t i = 0; i < kSurfaceClasses; ++i) next[i].vertex -= vertices_needed(counts[i]);
  for (const Quad& quad : quads) {
    std::size_t& first = next[static_cast<std::size_t>(class_of(quad))].vertex;
    if (quad.orientation().index() != 0) set_look(quad, origin, first, first + 4, mesh);
    first += 4;
  }
  return {};
}

Status ChunkTriangles::append_outlines(const QuadBuffer& quads, IVec3 origin, BlockyMesh& mesh) {
  finder_.prepare(quads);
  for (const Quad& quad : quads) {
    BlockyTriangles& out = mesh.surfaces[static_cast<std::size_t>(class_of(quad))];
    const std::size_t first = out.positions.size();
    if (first > kMaxVertices) return too_large();
    finder_.outline(quad, outline_);
    append_outline(quad, origin, outline_, out);
    if (quad.orientation().index() != 0) set_look(quad, origin, first, out.positions.size(), mesh);
  }
  return {};
}

Status ChunkTriangles::append_shapes(const ShapeFaceBuffer& shapes, IVec3 origin, BlockyMesh& mesh) {
  for (const ShapeFace& face : shapes) {
    const ModelFace& shown = face.model_face();
    const VoxelFace* const look = look_of(*face.model, shown, types_[face.type].faces);
    const auto which = static_cast<std::size_t>(surface_class(types_[face.type], look));
    BlockyTriangles& out = mesh.surfaces[which];
    const std::size_t first = out.positions.size();
    if (first > kMaxVertices) return too_large();
    append_face(face, origin, out);
    out.looks.resize(out.positions.size());
    const bool is_inclined = shown.normal != Vec3(normal_of(shown.direction));
    const std::uint32_t number = look == nullptr ? 0 : looks_[which].number_of(*look, out);
    for (std::size_t i = first; i < out.positions.size(); ++i) {
      VertexLook& vertex = out.looks[i];
      vertex.is_shape = true;
      vertex.face = number;
      if (look != nullptr) vertex.uv = texture_uv(shown, *look, shown.uv[i - first]);
      if (is_inclined) vertex.normal = shown.normal;
    }
  }
  return {};
}

}  // namespace

std::int64_t BlockyMesh::triangle_count() const {
  std::size_t total = 0;
  for (const BlockyTriangles& surface : surfaces) total += surface.indices.size() / 3;
  return static_cast<std::int64_t>(total);
}

std::int64_t BlockyMesh::vertex_count() const {
  std::size_t total = 0;
  for (const BlockyTriangles& surface : surfaces) total += surface.positions.size();
  return static_cast<std::int64_t>(total);
}

namespace {

struct ChunkFaces {
  std::vector<QuadBuffer> quads;
  std::vector<ShapeFaceBuffer> shapes;  // empty if no type has shapes
};

// Returns the faces of all chunks; fewer if `reporter` was cancelled.
ChunkFaces faces_of(const Grid& grid, const std::vector<IVec3>& chunks, const VoxelRegistry& types,
                    const BlockyMeshOptions& options, Threads threads, ProgressSteps& reporter) {
  ChunkFaces parts{std::vector<QuadBuffer>(chunks.size()),
                   std::vector<ShapeFaceBuffer>(types.has_shapes() ? chunks.size() : 0)};
  // Enough tasks to keep every thread busy; each task uses one mesher for its chunks.
  const std::size_t tasks = std::min<std::size_t>(chunks.size(), std::size_t{8} * thread_count(threads));
  parallel_for(tasks, threads, [&](std::size_t task) {
    BlockyMesher mesher;
    QuadOptions quad_options;
    quad_options.merge = options.merge;
    quad_options.bake_occlusion = options.bake_occlusion;
    for (std::size_t i = task; i < chunks.size() && !reporter.cancelled(); i += tasks) {
      const Neighbourhood near = grid.neighbourhood(chunks[i]);
      if (parts.shapes.empty()) {
        mesher.mesh(near, types, quad_options, parts.quads[i]);
      } else {
        mesher.mesh(near, types, quad_options, parts.quads[i], parts.shapes[i]);
      }
      if (options.cut) options.cut(chunks[i], parts.quads[i]);
      reporter.step();
    }
  });
  return parts;
}

}  // namespace

Status append_triangles(std::span<const QuadBuffer> quads, std::span<const IVec3> chunks, const VoxelRegistry& types,
                        bool watertight, BlockyMesh& mesh, std::span<const ShapeFaceBuffer> shapes) {
  QUOIN_ASSERT(quads.size() == chunks.size(), "a chunk for each buffer of quads");
  QUOIN_ASSERT(shapes.empty() || shapes.size() == chunks.size(), "a chunk for each buffer of shapes");
  ChunkTriangles triangles(types, watertight);
  for (std::size_t i = 0; i < quads.size(); ++i) {
    const ShapeFaceBuffer* const own = shapes.empty() ? nullptr : &shapes[i];
    if (auto done = triangles.append(quads[i], own, chunks[i], mesh); !done) return done;
  }
  return {};
}

Result<BlockyMesh> build_blocky_mesh(const Grid& grid, const VoxelRegistry& types, const BlockyMeshOptions& options,
                                     Threads threads, const Progress& progress) {
  const std::vector<IVec3> chunks = grid.chunks();
  ProgressSteps reporter(progress, 2 * chunks.size());
  ChunkFaces parts = faces_of(grid, chunks, types, options, threads, reporter);
  if (reporter.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");

  BlockyMesh mesh;
  mesh.faces_total = 6 * grid.voxel_count();
  ChunkTriangles triangles(types, options.watertight);
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    ShapeFaceBuffer* const shapes = parts.shapes.empty() ? nullptr : &parts.shapes[i];
    if (auto done = triangles.append(parts.quads[i], shapes, chunks[i], mesh); !done) return done.error();
    parts.quads[i] = {};
    if (shapes != nullptr) *shapes = {};
    reporter.step();
    if (reporter.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  }
  return mesh;
}

}  // namespace quoin
