#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>

#include <quoin/mesh/occlusion.h>
#include <quoin/version.h>

#include "core/srgb.h"
#include "io/mesh_parts.h"

namespace quoin {

namespace {

static_assert(std::endian::native == std::endian::little, "the format written is little-endian");

constexpr std::size_t kVertexBytes = 6 * 4 + 3;  // position and normal as floats, red, green and blue as bytes
constexpr std::size_t kFaceBytes = 1 + 3 * 4;    // a byte of 3, and three int
constexpr std::size_t kOcclusions = 4;

using Srgb = std::array<std::uint8_t, 3>;

struct Counts {
  std::uint64_t vertices = 0;
  std::uint64_t faces = 0;
};

/// Formats whole numbers: "20000000 64 0".
std::string text_of(const DVec3& v) {
  std::array<char, 128> text{};
  return {text.data(), static_cast<std::size_t>(
                           std::snprintf(text.data(), text.size(), "%.0f %.0f %.0f", v.x + 0.0, v.y + 0.0, v.z + 0.0))};
}

std::string header_of(const Counts& counts, OcclusionIn occlusion, const DVec3& origin) {
  std::string text = "ply\nformat binary_little_endian 1.0\ncomment Quoin ";
  text.append(version()).append("\n");
  if (origin != DVec3(0.0)) text += "comment offset " + text_of(origin) + " (add it to x y z)\n";
  text += "element vertex " + std::to_string(counts.vertices) + "\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) text += "property float " + std::string(name) + "\n";
  for (const char* name : {"red", "green", "blue"}) text += "property uchar " + std::string(name) + "\n";
  if (occlusion == OcclusionIn::Attribute) text += "property float ao\n";
  text += "element face " + std::to_string(counts.faces) + "\n";
  return text + "property list uchar int vertex_indices\nend_header\n";
}

/// The colours of all types at every occlusion, [type * kOcclusions + occlusion].
std::vector<Srgb> colours_of(const VoxelRegistry& types) {
  const SrgbEncoder& encode = SrgbEncoder::shared();
  // Rounded through 16 bits, like the colours of smooth meshes.
  const auto darkened = [&](std::uint8_t byte, std::uint8_t occlusion) {
    const auto linear = static_cast<std::uint16_t>(std::lround(linear_from_srgb(byte) * 65'535.0F));
    return encode(static_cast<float>(linear) / 65'535.0F * occlusion_brightness(occlusion));
  };
  std::vector<Srgb> colours;
  colours.reserve(types.size() * kOcclusions);
  for (std::size_t type = 0; type < types.size(); ++type) {
    const Rgba8 colour = types[static_cast<VoxelType>(type)].colour;
    for (std::uint8_t occlusion = 0; occlusion < kOcclusions; ++occlusion) {
      colours.push_back({darkened(colour.r, occlusion), darkened(colour.g, occlusion), darkened(colour.b, occlusion)});
    }
  }
  return colours;
}

void put_vertex(const Vec3& position, const Vec3& normal, const Srgb& colour, BlockWriter& out) {
  char* at = out.room(kVertexBytes);
  std::memcpy(at, &position, sizeof(position));
  std::memcpy(at + sizeof(position), &normal, sizeof(normal));
  std::memcpy(at + sizeof(position) + sizeof(normal), colour.data(), colour.size());
  out.advance(at + kVertexBytes);
}

void write_vertices(const MeshView& view, const VertexTransform& transform, const std::vector<Srgb>& colours,
                    OcclusionIn occlusion, BlockWriter& out) {
  const bool is_apart = occlusion == OcclusionIn::Attribute;
  const MeshView coloured = is_apart ? without_occlusion(view) : view;
  if (view.has_albedo()) {
    for (std::size_t i = 0; i < view.positions.size() && !out.failed(); ++i) {
      put_vertex(Vec3(transform.position(view.positions[i])), Vec3(transform.normal(view.normals[i])),
                 srgb_colour(coloured, i), out);
      if (is_apart) out.put(openness_at(view, i));
    }
    return;
  }
  const auto normals = transform.face_normals();
  const bool is_darkened = !coloured.block_occlusion.empty();
  for (std::size_t i = 0; i < view.positions.size() && !out.failed(); ++i) {
    put_vertex(Vec3(transform.position(view.positions[i])), normals[static_cast<std::size_t>(view.directions[i])],
               colours[view.types[i] * kOcclusions + (is_darkened ? view.block_occlusion[i] : 0)], out);
    if (is_apart) out.put(openness_at(view, i));
  }
}

void write_faces(const MeshView& view, bool turned, std::uint64_t first, BlockWriter& out) {
  for (std::size_t i = 0; i < view.indices.size() && !out.failed(); i += 3) {
    const auto [a, b, c] = corners_of(view, i, turned);
    const std::array corners = {static_cast<std::int32_t>(first + a), static_cast<std::int32_t>(first + b),
                                static_cast<std::int32_t>(first + c)};
    char* at = out.room(kFaceBytes);
    *at = 3;
    std::memcpy(at + 1, corners.data(), sizeof(corners));
    out.advance(at + kFaceBytes);
  }
}

/// Calls `use(view, transform)` for every surface with a triangle, in each placement of its part, relative to `origin`.
template <class Use>
void for_each_surface(const SceneMeshes& meshes, const DVec3& origin, Use use) {
  for (const MeshPlacement* placement : placements_by_part(meshes)) {
    const MeshPart& part = meshes.parts[placement->part];
    const VertexTransform transform = VertexTransform(placement->matrix(), part.pivot).relative_to(origin);
    for (const MeshView& view : part.surfaces) {
      if (!view.indices.empty()) use(view, transform);
    }
  }
}

/// The content of a file except its meshes.
struct PlyPlan {
  std::string header;
  OcclusionIn occlusion{};
  DVec3 origin{0.0};
};

void write_content(const SceneMeshes& meshes, const PlyPlan& plan, BlockWriter& out) {
  const std::vector<Srgb> colours = colours_of(meshes.types);
  out.put_text(plan.header);
  for_each_surface(meshes, plan.origin, [&](const MeshView& view, const VertexTransform& transform) {
    write_vertices(view, transform, colours, plan.occlusion, out);
  });
  std::uint64_t first = 0;
  for_each_surface(meshes, plan.origin, [&](const MeshView& view, const VertexTransform& transform) {
    write_faces(view, transform.mirrors(), first, out);
    first += view.positions.size();
  });
}

}  // namespace

Result<std::vector<MeshFile>> plan_ply(const SceneMeshes& meshes, const std::filesystem::path& path,
                                       const MeshFileOptions& options) {
  PlyPlan plan{{}, options.occlusion_in, file_origin(meshes, kMostStepsOfPly)};
  Counts counts;
  for_each_surface(meshes, plan.origin, [&](const MeshView& view, const VertexTransform&) {
    counts.vertices += view.positions.size();
    counts.faces += view.indices.size() / 3;
  });
  constexpr std::uint64_t kMost = 0x7FFF'FFFF;
  if (counts.vertices > kMost || counts.faces > kMost) {
    return make_error(ErrorCode::LimitExceeded, "the meshes have " + std::to_string(counts.vertices) +
                                                    " vertices and " + std::to_string(counts.faces) +
                                                    " triangles, more than the 2147483647 of each in a PLY file");
  }
  plan.header = header_of(counts, plan.occlusion, plan.origin);
  const std::size_t of_vertex = kVertexBytes + (plan.occlusion == OcclusionIn::Attribute ? sizeof(float) : 0);
  const std::uint64_t bytes = plan.header.size() + counts.vertices * of_vertex + counts.faces * kFaceBytes;
  return std::vector<MeshFile>{
      {path, bytes, [&meshes, plan = std::move(plan)](BlockWriter& out) { write_content(meshes, plan, out); }}};
}

}  // namespace quoin
