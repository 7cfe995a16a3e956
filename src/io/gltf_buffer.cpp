#include "io/gltf_buffer.h"

#include <array>
#include <bit>

namespace quoin {

namespace {

static_assert(std::endian::native == std::endian::little, "glTF buffers are little-endian");
static_assert(sizeof(Vec3) == 12);

void write_positions(const GltfMesh& mesh, const BlockyTriangles& triangles, BlockWriter& out) {
  for (const Vec3& position : triangles.positions) out.put(position_in_mesh(mesh, position));
}

void write_normals(const GltfMesh& mesh, const BlockyTriangles& triangles, BlockWriter& out) {
  std::array<Vec3, kDirections.size()> normals{};
  for (const Direction direction : kDirections) {
    Vec3 normal(normal_of(direction));
    if (mesh.mirrored) normal.x = 0.0F - normal.x;
    normals[static_cast<std::size_t>(direction)] = normal;
  }
  for (const Direction direction : triangles.directions) out.put(normals[static_cast<std::size_t>(direction)]);
}

void write_texture_coordinates(const MaterialPalette& palette, const BlockyTriangles& triangles, BlockWriter& out) {
  for (const VoxelType type : triangles.types) out.put(palette.texel_centre(type));
}

void write_colours(const BlockyTriangles& triangles, BlockWriter& out) {
  for (const std::uint8_t level : triangles.levels) {
    const std::uint8_t grey = occlusion_grey(level);
    out.put(std::array<std::uint8_t, 4>{grey, grey, grey, 255});
  }
}

/// A reflection turns triangles inside out; swapping two corners turns them back.
template <class Index>
void write_indices(const GltfMesh& mesh, const BlockyTriangles& triangles, BlockWriter& out) {
  const std::size_t second = mesh.mirrored ? 2 : 1;
  for (std::size_t i = 0; i + 2 < triangles.indices.size(); i += 3) {
    out.put(std::array<Index, 3>{static_cast<Index>(triangles.indices[i]),
                                 static_cast<Index>(triangles.indices[i + second]),
                                 static_cast<Index>(triangles.indices[i + 3 - second])});
  }
}

void write_primitive(const GltfLayout& layout, const GltfMesh& mesh, const GltfPrimitive& primitive, BlockWriter& out) {
  const BlockyTriangles& triangles = *primitive.triangles;
  write_positions(mesh, triangles, out);
  write_normals(mesh, triangles, out);
  write_texture_coordinates(layout.palette, triangles, out);
  if (layout.occlusion) write_colours(triangles, out);
  if (primitive.wide_indices) {
    write_indices<std::uint32_t>(mesh, triangles, out);
  } else {
    write_indices<std::uint16_t>(mesh, triangles, out);
  }
  out.align('\0');
}

}  // namespace

void write_gltf_buffer(const GltfLayout& layout, BlockWriter& out) {
  for (const GltfMesh& mesh : layout.meshes) {
    for (const GltfPrimitive& primitive : mesh.primitives) write_primitive(layout, mesh, primitive, out);
  }
  for (const GltfImage& image : layout.images) {
    out.put(std::span<const std::byte>(image.png));
    out.align('\0');
  }
}

}  // namespace quoin
