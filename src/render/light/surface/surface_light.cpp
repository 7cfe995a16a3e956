#include <quoin/core/memory.h>
#include <quoin/render/surface_light.h>

#include <algorithm>
#include <array>
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

// The light of the voxels around a voxel, by positions relative to it: -1 to 2 on each axis.
class NearLight {
 public:
  NearLight(LightRows& rows, IVec3 voxel) {
    for (int i = 0; i < 16; ++i) {
      const IVec3 first = voxel + IVec3(-1, i % 4 - 1, i / 4 - 1);
      for (int x = 0; x < 4;) {
        const LightRows::Row& row = rows.row_of(first + IVec3(x, 0, 0));
        auto at = static_cast<std::size_t>((first.x + x) & (kChunkEdge - 1));
        for (; x < 4 && at < kChunkEdge; ++x, ++at) {
          const auto number = static_cast<std::size_t>(4 * i + x);
          words_[number] = row.words[at];
          passing_ |= (row.passing >> at & 1U) << number;
        }
      }
    }
  }

  [[nodiscard]] bool passes(IVec3 at) const { return (passing_ >> number_of(at) & 1U) != 0; }
  [[nodiscard]] std::uint16_t word(IVec3 at) const { return words_[number_of(at)]; }
  // Returns the light of those of eight voxels, from `low` on, that light passes, if there are any and they have the
  // same. It is then that of all points between them.
  [[nodiscard]] std::optional<std::uint16_t> common(IVec3 low) const {
    std::optional<std::uint16_t> found;
    for (std::size_t i = 0; i < 8; ++i) {
      const std::size_t number = number_of(low) + (i & 1U) + 4 * (i >> 1U & 1U) + 16 * (i >> 2U);
      if ((passing_ >> number & 1U) == 0) continue;
      if (found && *found != words_[number]) return std::nullopt;
      found = words_[number];
    }
    return found;
  }

 private:
  static std::size_t number_of(IVec3 at) {
    QUOIN_ASSERT(at.x >= -1 && at.x <= 2 && at.y >= -1 && at.y <= 2 && at.z >= -1 && at.z <= 2, "a voxel around");
    return static_cast<std::size_t>(at.x + 1 + 4 * (at.y + 1) + 16 * (at.z + 1));
  }

  std::uint64_t passing_ = 0;  // bit x + 4 y + 16 z, counted from the lowest voxel
  std::array<std::uint16_t, 64> words_;
};

// The same for shapes that reach outside their voxel.
struct FarLight {
  LightRows& rows;
  IVec3 voxel;

  [[nodiscard]] bool passes(IVec3 at) const { return rows.passes(voxel + at); }
  [[nodiscard]] std::uint16_t word(IVec3 at) const { return rows.word(voxel + at); }
};

// The light at corners of the faces of a voxel: half a voxel in front of them.
class ShapeCorners {
 public:
  ShapeCorners(LightRows& rows, IVec3 voxel, const ShapeModel& model) : far_{rows, voxel} {
    if (model.cells == IBox{IVec3(0), IVec3(1)}) near_.emplace(rows, voxel);
  }

  [[nodiscard]] std::uint32_t light(const Vec3& corner, const Vec3& normal) const {
    const DVec3 point = DVec3(corner) - 0.5;  // samples are at the centres of voxels
    const DVec3 front = point + 0.5 * DVec3(normal);
    IVec3 low(0);
    bool is_near = near_.has_value();
    for (int axis = 0; axis < 3; ++axis) {
      is_near = is_near && front[axis] >= -1.0 && front[axis] <= 1.0;
      low[axis] = front[axis] < 0.0 ? -1 : front[axis] < 1.0 ? 0 : 1;
    }
    if (!is_near) return twelfths(light_before(far_, point, normal, 1));
    if (const auto word = near_->common(low)) return 12 * level_bytes(*word);
    return twelfths(light_before(*near_, point, normal, 1));
  }

 private:
  static std::uint32_t twelfths(const MeanLevels& levels) {
    const auto part = [](float level) { return static_cast<std::uint32_t>(12.0F * level + 0.5F); };
    return part(levels.sky) | part(levels.red) << 8 | part(levels.green) << 16 | part(levels.blue) << 24;
  }

  FarLight far_;
  std::optional<NearLight> near_;
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
