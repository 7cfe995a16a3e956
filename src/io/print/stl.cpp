// STL, binary. Source: 3D Systems, "StereoLithography Interface Specification" (1989).

#include <array>
#include <bit>
#include <cstdio>
#include <cstring>
#include <string>

#include <glm/geometric.hpp>

#include <quoin/version.h>

#include "io/mesh_parts.h"

namespace quoin {

namespace {

static_assert(std::endian::native == std::endian::little, "the format written is little-endian");

constexpr std::size_t kHeader = 80;
constexpr std::size_t kRecord = 50;

void put_triangle(const std::array<Vec3, 3>& corners, BlockWriter& out) {
  const DVec3 across = glm::cross(DVec3(corners[1]) - DVec3(corners[0]), DVec3(corners[2]) - DVec3(corners[0]));
  const double length = glm::length(across);
  const Vec3 normal = length > 0.0 ? Vec3(across / length) : Vec3(0.0F);
  char* at = out.room(kRecord);
  std::memcpy(at, &normal, sizeof(normal));
  std::memcpy(at + sizeof(normal), corners.data(), sizeof(corners));
  std::memset(at + sizeof(normal) + sizeof(corners), 0, 2);
  out.advance(at + kRecord);
}

/// Returns ", offset 20000000 64 0" with whole numbers, as far as the header has space.
std::string offset_text(const DVec3& offset) {
  std::array<char, kHeader> text{};
  std::snprintf(text.data(), text.size(), ", offset %.0f %.0f %.0f", offset.x + 0.0, offset.y + 0.0, offset.z + 0.0);
  return text.data();
}

void write_content(const SceneMeshes& meshes, std::uint32_t triangles, BlockWriter& out) {
  const DVec3 origin = file_origin(meshes, kMostStepsOfStl);
  std::string header = "Quoin ";
  header.append(version()).append(", millimetres");
  if (origin != DVec3(0.0)) header += offset_text(origin);
  header.resize(kHeader, ' ');
  out.put_text(header);
  out.put(triangles);
  for (const MeshPlacement* placement : placements_by_part(meshes)) {
    const MeshPart& part = meshes.parts[placement->part];
    const VertexTransform transform = VertexTransform(placement->matrix(), part.pivot).relative_to(origin);
    for (const MeshView& view : part.surfaces) {
      for (std::size_t i = 0; i < view.indices.size() && !out.failed(); i += 3) {
        std::array<Vec3, 3> corners{};
        const auto indices = corners_of(view, i, transform.mirrors());
        for (std::size_t k = 0; k < 3; ++k) corners[k] = Vec3(transform.position(view.positions[indices[k]]));
        put_triangle(corners, out);
      }
    }
  }
}

}  // namespace

Result<std::vector<MeshFile>> plan_stl(const SceneMeshes& meshes, const std::filesystem::path& path) {
  std::uint64_t triangles = 0;
  for (const MeshPlacement* placement : placements_by_part(meshes)) {
    for (const MeshView& view : meshes.parts[placement->part].surfaces) triangles += view.indices.size() / 3;
  }
  if (triangles > 0xFFFF'FFFFU) {
    return make_error(ErrorCode::LimitExceeded, "the meshes have " + std::to_string(triangles) +
                                                    " triangles, more than the 4294967295 of an STL file");
  }
  return std::vector<MeshFile>{{path, kHeader + 4 + triangles * kRecord, [&meshes, triangles](BlockWriter& out) {
                                  write_content(meshes, static_cast<std::uint32_t>(triangles), out);
                                }}};
}

}  // namespace quoin
