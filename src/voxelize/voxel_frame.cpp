#include "voxelize/voxel_frame.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

namespace quoin {

namespace {

constexpr int kMostVoxels = 1 << 14;
// Clearance between the mesh and the lattice's sides, in voxels.
constexpr double kClear = 1e-3;

Error nothing_there() {
  return make_error(ErrorCode::InvalidArgument, "the mesh has no triangles");
}

Error too_many(double voxels) {
  return make_error(ErrorCode::LimitExceeded, "more than " + std::to_string(kMostVoxels) + " voxels along an axis: " +
                                                  std::to_string(static_cast<std::int64_t>(std::min(voxels, 1e18))));
}

double longest_side(const DBox& box) {
  const DVec3 size = box.max - box.min;
  return std::max(std::max(size.x, size.y), size.z);
}

Status check_materials(const TriangleMesh& mesh) {
  const std::size_t materials = std::max<std::size_t>(mesh.materials.size(), 1);
  for (const std::uint32_t material : mesh.material_of) {
    if (material >= materials) {
      return make_error(ErrorCode::InvalidArgument, "a triangle has material index " + std::to_string(material) +
                                                        ", but there are " + std::to_string(materials) + " materials");
    }
  }
  for (const MeshMaterial& material : mesh.materials) {
    if (material.texture && *material.texture >= mesh.textures.size()) {
      return make_error(ErrorCode::InvalidArgument, "a material's texture index is out of range");
    }
    if (material.emissive_texture && *material.emissive_texture >= mesh.textures.size()) {
      return make_error(ErrorCode::InvalidArgument, "a material's emissive texture index is out of range");
    }
    const glm::vec4& colour = material.colour;
    const float sum = colour.x + colour.y + colour.z + colour.w + material.alpha_cutoff + material.roughness +
                      material.metalness + material.emission + material.emissive_tint.x + material.emissive_tint.y +
                      material.emissive_tint.z;
    if (!std::isfinite(sum)) return make_error(ErrorCode::InvalidArgument, "a material has a value that is not finite");
  }
  for (const MeshTexture& texture : mesh.textures) {
    const AlphaImage& image = texture.image;
    const bool sound = image.width > 0 && image.height > 0 &&
                       image.rgba.size() == std::size_t{4} * static_cast<std::size_t>(image.width) *
                                                static_cast<std::size_t>(image.height);
    if (!sound) return make_error(ErrorCode::InvalidArgument, "a texture's size does not match its pixels");
  }
  return {};
}

}  // namespace

DBox TriangleMesh::bounds() const {
  DBox box;
  for (const auto& triangle : triangles) {
    for (const std::uint32_t index : triangle) box.extend(positions[index]);
  }
  return box;
}

Status check_mesh(const TriangleMesh& mesh) {
  const std::size_t triangles = mesh.triangles.size();
  if (triangles > 0x7FFF'FFFFU) return make_error(ErrorCode::LimitExceeded, "2^31 triangles or more");
  const auto fits = [](std::size_t size, std::size_t wanted) { return size == 0 || size == wanted; };
  if (!fits(mesh.colours.size(), mesh.positions.size()) || !fits(mesh.material_of.size(), triangles) ||
      !fits(mesh.uvs.size(), 3 * triangles) || !fits(mesh.emissive_uvs.size(), 3 * triangles)) {
    return make_error(ErrorCode::InvalidArgument, "the mesh's array lengths do not match");
  }
  for (std::size_t i = 0; i < triangles; ++i) {
    for (const std::uint32_t index : mesh.triangles[i]) {
      if (index >= mesh.positions.size()) {
        return make_error(ErrorCode::InvalidArgument, "triangle " + std::to_string(i) + " has vertex index " +
                                                          std::to_string(index) + ", but the number of positions is " +
                                                          std::to_string(mesh.positions.size()));
      }
      if (!is_finite(mesh.positions[index])) {
        return make_error(ErrorCode::InvalidArgument, "position " + std::to_string(index) + " is not finite");
      }
    }
  }
  return check_materials(mesh);
}

Result<VoxelLattice> lattice_of_size(const TriangleMesh& mesh, int voxels) {
  if (voxels <= 0) return make_error(ErrorCode::InvalidArgument, "size: must be at least 1 voxel");
  if (voxels > kMostVoxels) return too_many(voxels);
  if (const auto sound = check_mesh(mesh); !sound) return sound.error();
  const DBox box = mesh.bounds();
  if (box.empty()) return nothing_there();
  const double side = longest_side(box);
  VoxelLattice lattice;
  // A single point gets one voxel.
  lattice.voxel_size = side > 0.0 ? side / (voxels - 2.0 * kClear) : 1.0;
  // Centred in the smallest number of voxels along each axis that contain it.
  const DVec3 size = (box.max - box.min) / lattice.voxel_size;
  const DVec3 voxels_around = glm::max(glm::ceil(size - kClear), DVec3(1.0));
  lattice.origin = 0.5 * (box.min + box.max) - 0.5 * lattice.voxel_size * voxels_around;
  return lattice;
}

Result<VoxelLattice> lattice_of_voxel(const TriangleMesh& mesh, double voxel_size) {
  if (!(voxel_size > 0.0) || !std::isfinite(voxel_size)) {
    return make_error(ErrorCode::InvalidArgument, "voxel size: must be finite and more than 0");
  }
  if (const auto sound = check_mesh(mesh); !sound) return sound.error();
  const DBox box = mesh.bounds();
  if (box.empty()) return nothing_there();
  if (!(longest_side(box) / voxel_size <= kMostVoxels)) return too_many(longest_side(box) / voxel_size);
  return VoxelLattice{glm::floor(box.min / voxel_size) * voxel_size, voxel_size};
}

namespace voxelizing {

namespace {

/// Snaps a position that rounding moved slightly off a voxel's side or centre back onto it, so that their rules apply.
DVec3 snapped(const DVec3& position) {
  constexpr double kRounding = 1e-7;
  DVec3 result = position;
  for (int axis = 0; axis < 3; ++axis) {
    const double nearest = 0.5 * std::round(2.0 * position[axis]);
    if (std::abs(position[axis] - nearest) <= kRounding) result[axis] = nearest;
  }
  return result;
}

}  // namespace

Result<Frame> Frame::make(const TriangleMesh& mesh, const VoxelLattice& lattice, double margin) {
  if (!(lattice.voxel_size > 0.0) || !std::isfinite(lattice.voxel_size) || !is_finite(lattice.origin)) {
    return make_error(ErrorCode::InvalidArgument, "lattice: voxel size must be finite and more than 0, origin finite");
  }
  if (auto sound = check_mesh(mesh); !sound) return sound.error();
  Frame frame;
  frame.mesh_ = &mesh;
  const DBox box = mesh.bounds();
  if (box.empty()) return frame;
  const DVec3 low = lattice.grid_from_mesh(box.min);
  const DVec3 high = lattice.grid_from_mesh(box.max);
  constexpr double kFarthest = 1 << 30;
  if (!(glm::length(low) <= kFarthest && glm::length(high) <= kFarthest)) {
    return make_error(ErrorCode::LimitExceeded, "the mesh lies too far from the lattice's origin");
  }
  const double side = longest_side({low, high});
  if (!(side <= kMostVoxels + 2.0)) return too_many(side);
  // A plane between two voxels belongs to both.
  const IVec3 first = voxel_of(glm::ceil(low - margin) - 1.0);
  const IVec3 last = voxel_of(high + margin);
  frame.first_chunk_ = chunk_of(first);
  frame.chunks_ = chunk_of(last) - frame.first_chunk_ + 1;
  QUOIN_ASSERT(std::min({frame.chunks_.x, frame.chunks_.y, frame.chunks_.z}) > 0, "at least one chunk");
  const DVec3 corner = DVec3(frame.first_chunk_) * static_cast<double>(kChunkEdge);
  frame.positions_.reserve(mesh.positions.size());
  for (const DVec3& position : mesh.positions) {
    frame.positions_.push_back(snapped(lattice.grid_from_mesh(position) - corner));
  }
  return frame;
}

namespace {

/// Returns the chunks of a frame that a triangle's grown box overlaps, half open.
IBox chunk_box(const Frame& frame, const Corners& corners, double margin) {
  const DVec3 low = glm::min(glm::min(corners[0], corners[1]), corners[2]) - margin;
  const DVec3 high = glm::max(glm::max(corners[0], corners[1]), corners[2]) + margin;
  // Closed, as cubes are.
  const IVec3 first = chunk_of(voxel_of(glm::ceil(low) - 1.0));
  return {glm::max(first, IVec3(0)), glm::min(chunk_of(voxel_of(high)) + 1, frame.chunks())};
}

/// Returns true if a plane may come within `margin` of a chunk.
bool meets(const DVec3& normal, const DVec3& on_plane, IVec3 chunk, double margin) {
  const double half = 0.5 * kChunkEdge + margin + 1e-6;
  const DVec3 centre = (DVec3(chunk) + 0.5) * static_cast<double>(kChunkEdge);
  const DVec3 reach = glm::abs(normal) * half;
  return std::abs(glm::dot(normal, centre - on_plane)) <= (reach.x + reach.y + reach.z) * (1.0 + 1e-9);
}

}  // namespace

ChunkTriangles::ChunkTriangles(const Frame& frame, double margin) : begin_(frame.chunk_count() + 1, 0) {
  const auto visit = [&](auto&& at_chunk) {
    for (std::size_t i = 0; i < frame.triangle_count(); ++i) {
      const Corners corners = frame.corners(i);
      const IBox box = chunk_box(frame, corners, margin);
      const bool is_one = box.size() == IVec3(1);
      const DVec3 normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
      for (int z = box.min.z; z < box.max.z; ++z) {
        for (int y = box.min.y; y < box.max.y; ++y) {
          for (int x = box.min.x; x < box.max.x; ++x) {
            if (is_one || meets(normal, corners[0], {x, y, z}, margin)) at_chunk(frame.index_of({x, y, z}), i);
          }
        }
      }
    }
  };
  visit([&](std::size_t chunk, std::size_t) { ++begin_[chunk + 1]; });
  for (std::size_t i = 1; i < begin_.size(); ++i) begin_[i] += begin_[i - 1];
  triangles_.resize(begin_.back());
  std::vector<std::uint64_t> next(begin_.begin(), begin_.end() - 1);
  visit([&](std::size_t chunk, std::size_t i) { triangles_[next[chunk]++] = static_cast<std::uint32_t>(i); });
}

}  // namespace voxelizing

}  // namespace quoin
