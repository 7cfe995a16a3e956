#include <quoin/core/memory.h>
#include <quoin/render/surface_light.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include <quoin/core/assert.h>

#include "core/moved_from.h"
#include "render/light/quad_cutter.h"
#include "render/light/voxel_light.h"

namespace quoin {

struct SurfaceLight::Rows {
  LightRows voxels;
  // Scratch memory for one quad: the light in front of and around it, and its corners.
  std::vector<FrontLight> fronts;
  std::vector<std::uint32_t> corners;
  QuadCutter cutter;
};

SurfaceLight::SurfaceLight(const PropagatedLight& light, const Grid& grid, const VoxelRegistry& types)
    : rows_(std::make_unique<Rows>(Rows{LightRows(light, grid, types), {}, {}, {}})) {}
SurfaceLight::SurfaceLight(SurfaceLight&&) noexcept = default;
SurfaceLight& SurfaceLight::operator=(SurfaceLight&&) noexcept = default;
SurfaceLight::~SurfaceLight() = default;

FaceLight SurfaceLight::face(IVec3 voxel, Direction direction) {
  return face_light(impl_of(rows_).voxels, voxel + normal_of(direction), direction);
}

namespace {

// Returns the light of a voxel if light passes it, and all of its 26 neighbours that light passes have the same.
std::optional<std::uint16_t> even_light_around(LightRows& voxels, IVec3 voxel) {
  if (!voxels.passes(voxel)) return std::nullopt;
  const std::uint16_t word = voxels.word(voxel);
  for (int i = 0; i < 9; ++i) {
    const IVec3 first = voxel + IVec3(-1, i % 3 - 1, i / 3 - 1);
    for (int x = 0; x < 3;) {
      const LightRows::Row& row = voxels.row_of(first + IVec3(x, 0, 0));
      auto at = static_cast<std::size_t>((first.x + x) & (kChunkEdge - 1));
      for (; x < 3 && at < kChunkEdge; ++x, ++at) {
        if ((row.passing >> at & 1U) != 0 && row.words[at] != word) return std::nullopt;
      }
    }
  }
  return word;
}

// Returns the light of a face's corner: half a voxel in front of it.
class ShapeCorners {
 public:
  ShapeCorners(LightRows& voxels, IVec3 voxel, const ShapeModel& model) : voxels_(voxels), voxel_(voxel) {
    if (model.cells == IBox{IVec3(0), IVec3(1)}) even_ = even_light_around(voxels, voxel);
  }

  [[nodiscard]] std::uint32_t light(const Vec3& corner, const Vec3& normal) const {
    if (even_ && reads_even(corner, normal)) return 12 * level_bytes(*even_);
    // Samples are at the centres of voxels.
    const DVec3 point = DVec3(voxel_) - 0.5 + DVec3(corner);
    const MeanLevels levels = light_before(voxels_, point, normal, 1);
    const auto part = [](float level) { return static_cast<std::uint32_t>(std::lround(12.0F * level)); };
    return part(levels.sky) | part(levels.red) << 8 | part(levels.green) << 16 | part(levels.blue) << 24;
  }

 private:
  // Returns true if the light in front is that of the voxel and its neighbours: some of them count, and no other voxel.
  [[nodiscard]] bool reads_even(const Vec3& corner, const Vec3& normal) const {
    for (int axis = 0; axis < 3; ++axis) {
      const float at = corner[axis] - 0.5F + 0.5F * normal[axis];
      if (at < -1.0F || at > 1.0F) return false;
      if (at < 1.0F) continue;
      // The voxel itself is none of the eight around the point: the next one is the nearest.
      IVec3 next = voxel_;
      ++next[axis];
      if (!voxels_.passes(next)) return false;
    }
    return true;
  }

  LightRows& voxels_;
  IVec3 voxel_;
  std::optional<std::uint16_t> even_;
};

}  // namespace

void SurfaceLight::read(std::span<const ShapeFace> faces, IVec3 chunk, BlockVector<FaceLight>& corners) {
  corners.clear();
  corners.reserve(faces.size());
  LightRows& voxels = impl_of(rows_).voxels;
  for (std::size_t first = 0, end = 0; first < faces.size(); first = end) {
    const IVec3 local = faces[first].voxel();
    const ShapeCorners light(voxels, chunk * kChunkEdge + local, *faces[first].model);
    for (end = first; end < faces.size() && faces[end].voxel() == local; ++end) {
      const ModelFace& face = faces[end].model_face();
      FaceLight& of_face = corners.emplace_back();
      for (std::size_t i = 0; i < of_face.size(); ++i) of_face[i] = light.light(face.corners[i], face.normal);
    }
  }
}

namespace {

// Spreads the four twelfths with gaps between them, so that sums and differences of all four take one operation. A
// difference borrows from the bits above it; equal values borrow equally.
constexpr std::uint64_t spread(std::uint32_t twelfths) {
  const std::uint64_t all = twelfths;
  return (all & 0xFFU) | (all & 0xFF00U) << 8 | (all & 0xFF'0000U) << 16 | (all & 0xFF00'0000U) << 24;
}

// The gradient of light over a face, if it is linear.
struct Slope {
  std::uint64_t along_u = 0;
  std::uint64_t along_v = 0;
  bool is_linear = false;
};

// Light at the corners of a quad's faces.
class QuadCorners {
 public:
  QuadCorners(int width, const std::vector<std::uint32_t>& corners) : width_(width), corners_(corners) {}

  [[nodiscard]] Slope slope(int u, int v) const {
    const std::uint64_t first = spread(corner(u, v));
    const Slope slope{spread(corner(u + 1, v)) - first, spread(corner(u, v + 1)) - first, true};
    const bool is_linear = spread(corner(u + 1, v + 1)) - spread(corner(u, v + 1)) == slope.along_u;
    return {slope.along_u, slope.along_v, is_linear};
  }
  [[nodiscard]] FaceLight of_part(int u, int v, int along_u, int along_v) const {
    return {corner(u, v), corner(u + along_u, v), corner(u + along_u, v + along_v), corner(u, v + along_v)};
  }

 private:
  [[nodiscard]] std::uint32_t corner(int u, int v) const {
    QUOIN_ASSERT(u >= 0 && u <= width_ && static_cast<std::size_t>(u + (width_ + 1) * v) < corners_.size(),
                 "a corner of the quad's faces");
    return corners_[static_cast<std::size_t>(u + (width_ + 1) * v)];
  }

  int width_;
  const std::vector<std::uint32_t>& corners_;
};

// A rectangle with a constant gradient.
struct SlopePiece {
  const QuadCorners& corners;
  Slope slope;
  bool goes_along_u;
  bool goes_along_v;

  SlopePiece(const QuadCorners& of, int u, int v, LightMerging merging) : corners(of), slope(of.slope(u, v)) {
    const bool is_any = merging == LightMerging::Linear;
    goes_along_u = slope.is_linear && (is_any || slope.along_u == 0);
    goes_along_v = slope.is_linear && (is_any || slope.along_v == 0);
  }
  [[nodiscard]] bool joins(int u, int v) const {
    const Slope other = corners.slope(u, v);
    return other.is_linear && other.along_u == slope.along_u && other.along_v == slope.along_v;
  }
};

// Returns the light of corner (u, v) of a quad from the voxels in front of it and one voxel around. Its own voxel is in
// front of the quad. If two voxels at a corner are in front of the quad, they are neighbours, and each gives the same
// result.
std::uint32_t corner_of_quad(const std::vector<FrontLight>& fronts, int width, int height, int u, int v) {
  QUOIN_ASSERT(u >= 0 && u <= width && v >= 0 && v <= height, "a corner of the quad's faces");
  QUOIN_ASSERT(fronts.size() == static_cast<std::size_t>((width + 2) * (height + 2)), "the voxels in front and around");
  const int own_u = std::min(u, width - 1) + 1;
  const int own_v = std::min(v, height - 1) + 1;
  const int other_u = own_u == u ? u + 1 : u;
  const int other_v = own_v == v ? v + 1 : v;
  const auto front = [&](int x, int y) -> const FrontLight& {
    return fronts[static_cast<std::size_t>(x + (width + 2) * y)];
  };
  return corner_light(front(own_u, own_v), front(other_u, own_v), front(own_u, other_v), front(other_u, other_v));
}

}  // namespace

void SurfaceLight::split(const QuadBuffer& quads, IVec3 chunk, LightMerging merging, QuadBuffer& out,
                         BlockVector<FaceLight>& corners) {
  out.clear();
  corners.clear();
  Rows& rows = impl_of(rows_);
  for (const Quad quad : quads) {
    const FaceFrame& frame = frame_of(quad.direction());
    const IVec3 step_u(frame.u == 0, frame.u == 1, frame.u == 2);
    const IVec3 step_v(frame.v == 0, frame.v == 1, frame.v == 2);
    IVec3 first = chunk * kChunkEdge + quad.voxel() + normal_of(quad.direction()) - step_u - step_v;
    const int width = quad.size_u();
    const int height = quad.size_v();
    rows.fronts.clear();
    for (int v = -1; v <= height; ++v, first += step_v) {
      IVec3 at = first;
      for (int u = -1; u <= width; ++u, at += step_u) rows.fronts.push_back(rows.voxels.front(at));
    }
    rows.corners.clear();
    for (int v = 0; v <= height; ++v) {
      for (int u = 0; u <= width; ++u) rows.corners.push_back(corner_of_quad(rows.fronts, width, height, u, v));
    }
    if (width == 1 && height == 1) {
      out.push_back(quad);
      corners.push_back({rows.corners[0], rows.corners[1], rows.corners[3], rows.corners[2]});
      continue;
    }
    const QuadCorners of_quad(width, rows.corners);
    const auto start = [&](int u, int v) { return SlopePiece(of_quad, u, v, merging); };
    rows.cutter.cut(width, height, start, [&](int u, int v, int along_u, int along_v) {
      out.push_back(quad_part(quad, u, v, along_u, along_v));
      corners.push_back(of_quad.of_part(u, v, along_u, along_v));
    });
  }
  QUOIN_ASSERT(corners.size() == out.size(), "the light of each quad");
}

void SurfaceLight::read(const SmoothSamples& samples, std::span<MeanLevels> out) {
  QUOIN_ASSERT(samples.normals.size() == samples.positions.size() && out.size() >= samples.positions.size(),
               "a normal for every position, and an element of `out` for its light");
  const int step = 1 << std::clamp(samples.level, 0, kMaxSmoothLevel);
  for (std::size_t i = 0; i < samples.positions.size(); ++i) {
    const DVec3 point = DVec3(samples.positions[i]) + DVec3(samples.origin);
    out[i] = light_before(rows_->voxels, point, samples.normals[i], step);
  }
}

}  // namespace quoin
