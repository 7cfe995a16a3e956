#include "voxelize/voxel_frame.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "voxelize/nearest_kernel.h"

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

namespace quoin::voxelizing {

namespace {

/// An edge, and the direction within the triangle's plane that points inwards from it.
struct Edge {
  Vec3 from{0.0F};
  Vec3 along{0.0F};
  Vec3 inwards{0.0F};
  float per_square = 0.0F;  // 1 / squared length; 0 for an edge of length 0
};

/// A triangle relative to a chunk.
struct Solid {
  std::array<Edge, 3> edges;
  Vec3 normal{0.0F};  // unit, or 0 for a triangle without area
  Vec3 low{0.0F};
  Vec3 high{0.0F};

  explicit Solid(const Corners& corners) {
    DVec3 n = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
    const double length = glm::length(n);
    n = length > 1e-12 ? n / length : DVec3(0.0);
    normal = Vec3(n);
    for (std::size_t i = 0; i < 3; ++i) {
      const DVec3 along = corners[i == 2 ? 0 : i + 1] - corners[i];
      const double square = glm::dot(along, along);
      edges[i] = {Vec3(corners[i]), Vec3(along), Vec3(glm::cross(n, along)),
                  square > 1e-24 ? static_cast<float>(1.0 / square) : 0.0F};
    }
    low = Vec3(glm::min(glm::min(corners[0], corners[1]), corners[2]));
    high = Vec3(glm::max(glm::max(corners[0], corners[1]), corners[2]));
  }
};

/// A row of centres (i + 0.5, y, z).
TriangleInRow in_row(const Solid& solid, float y, float z, std::uint32_t number) {
  TriangleInRow row{};
  for (std::size_t i = 0; i < 3; ++i) {
    const Edge& edge = solid.edges[i];
    const Vec3 at = Vec3(0.5F, y, z) - edge.from;
    row.edges[i] = {at.x,
                    at.y,
                    at.z,
                    edge.along.x,
                    edge.along.y,
                    edge.along.z,
                    edge.per_square,
                    at.x * edge.along.x + at.y * edge.along.y + at.z * edge.along.z,
                    at.x * edge.inwards.x + at.y * edge.inwards.y + at.z * edge.inwards.z,
                    edge.inwards.x};
  }
  const EdgeInRow& first = row.edges[0];
  row.plane = first.at_x * solid.normal.x + first.at_y * solid.normal.y + first.at_z * solid.normal.z;
  row.plane_x = solid.normal.x;
  row.flat = solid.normal == Vec3(0.0F) ? 1.0F : 0.0F;
  row.number = static_cast<std::int32_t>(number);
  return row;
}

/// Returns the range along x in which the plane is within reach of a row, clipped to [first, end).
void cut_by_plane(const Solid& solid, float y, float z, float reach, int& first, int& end) {
  const Vec3 n = solid.normal;
  const float rest =
      (y - solid.edges[0].from.y) * n.y + (z - solid.edges[0].from.z) * n.z - solid.edges[0].from.x * n.x;
  if (std::abs(n.x) < 1e-3F) {
    // Parallel to the plane: takes all or none of the row, with a margin for the slope.
    if (std::abs(rest) > reach + 0.1F + std::abs(n.x) * 2.0F * kChunkEdge) end = first;
    return;
  }
  const float one = (-reach - rest) / n.x;
  const float other = (reach - rest) / n.x;
  const float low = std::clamp(std::min(one, other) - 1.0F, -1.0F, kChunkEdge + 1.0F);
  const float high = std::clamp(std::max(one, other) + 1.0F, -1.0F, kChunkEdge + 1.0F);
  first = std::max(first, static_cast<int>(std::floor(low)));
  end = std::min(end, static_cast<int>(std::ceil(high)));
}

/// As the kernel's function, only at points with a surface.
template <class HasSurface>
void update_with_holes(const TriangleInRow& row, int first, int end, float* squared, std::int32_t* numbers,
                       const HasSurface& has_surface) {
  QUOIN_ASSERT(first >= 0 && first < end && end <= kChunkEdge, "0 <= first < end <= 64");
  std::array<float, kChunkEdge> own;
  std::array<std::int32_t, kChunkEdge> own_numbers;
  std::copy_n(squared, kChunkEdge, own.begin());
  std::copy_n(numbers, kChunkEdge, own_numbers.begin());
  kernel().update_row(row, first, end, own.data(), own_numbers.data());
  for (int x = 0; x < kChunkEdge; ++x) {
    const auto at = static_cast<std::size_t>(x);
    if (!(own[at] < squared[x]) || !has_surface(x)) continue;
    squared[x] = own[at];
    numbers[x] = own_numbers[at];
  }
}

float gap(float at, float low, float high) {
  return at < low ? low - at : (at > high ? at - high : 0.0F);
}

}  // namespace

DVec3 nearest_shares(const Corners& corners, DVec3 point) {
  const DVec3 ab = corners[1] - corners[0];
  const DVec3 ac = corners[2] - corners[0];
  const DVec3 ap = point - corners[0];
  const double d1 = glm::dot(ab, ap);
  const double d2 = glm::dot(ac, ap);
  if (d1 <= 0.0 && d2 <= 0.0) return {1.0, 0.0, 0.0};
  const DVec3 bp = point - corners[1];
  const double d3 = glm::dot(ab, bp);
  const double d4 = glm::dot(ac, bp);
  if (d3 >= 0.0 && d4 <= d3) return {0.0, 1.0, 0.0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    const double share = d1 / (d1 - d3);
    return {1.0 - share, share, 0.0};
  }
  const DVec3 cp = point - corners[2];
  const double d5 = glm::dot(ab, cp);
  const double d6 = glm::dot(ac, cp);
  if (d6 >= 0.0 && d5 <= d6) return {0.0, 0.0, 1.0};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    const double share = d2 / (d2 - d6);
    return {1.0 - share, 0.0, share};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    const double share = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0.0, 1.0 - share, share};
  }
  const double whole = va + vb + vc;
  return {va / whole, vb / whole, vc / whole};
}

void find_nearest(const Frame& frame, IVec3 chunk, std::span<const std::uint32_t> triangles, const Wanted& wanted,
                  const Holes& holes, Nearest& nearest) {
  QUOIN_ASSERT(wanted.reach > 0.0F && std::isfinite(wanted.reach), "a positive, finite reach");
  nearest.squared.assign(kChunkVoxels, wanted.reach * wanted.reach);
  nearest.triangles.assign(kChunkVoxels, kNoTriangle);
  const DVec3 origin = DVec3(chunk) * static_cast<double>(kChunkEdge);
  const float reach = wanted.reach;
  const Kernel& use = kernel();
  for (const std::uint32_t triangle : triangles) {
    const Corners placed = frame.corners(triangle);
    const Solid solid({placed[0] - origin, placed[1] - origin, placed[2] - origin});
    const bool has_holes = holes.may_have_holes(triangle);
    // Centres are half a voxel beyond the voxels' corners.
    const IVec3 least = glm::max(voxel_of(DVec3(solid.low - reach - 0.5F)), IVec3(0));
    const IVec3 end = glm::min(voxel_of(DVec3(solid.high + reach - 0.5F)) + 1, IVec3(kChunkEdge));
    for (int z = least.z; z < end.z; ++z) {
      const float at_z = static_cast<float>(z) + 0.5F;
      const float gap_z = gap(at_z, solid.low.z, solid.high.z);
      for (int y = least.y; y < end.y; ++y) {
        const float at_y = static_cast<float>(y) + 0.5F;
        const float gap_y = gap(at_y, solid.low.y, solid.high.y);
        if (gap_y * gap_y + gap_z * gap_z > reach * reach) continue;
        int first_x = least.x;
        int end_x = end.x;
        cut_by_plane(solid, at_y, at_z, reach, first_x, end_x);
        if (first_x >= end_x) continue;
        if (wanted.voxels != nullptr && ((*wanted.voxels)[row_of(y, z)] & bits_between(first_x, end_x)) == 0) continue;
        float* squared = nearest.squared.data() + row_of(y, z) * kChunkEdge;
        std::int32_t* numbers = nearest.triangles.data() + row_of(y, z) * kChunkEdge;
        const TriangleInRow row = in_row(solid, at_y, at_z, triangle);
        if (!has_holes) {
          use.update_row(row, first_x, end_x, squared, numbers);
          continue;
        }
        update_with_holes(row, first_x, end_x, squared, numbers, [&](int x) {
          return holes.has_surface(triangle, nearest_shares(placed, origin + DVec3(x + 0.5, y + 0.5, z + 0.5)));
        });
      }
    }
  }
}

}  // namespace quoin::voxelizing
