#include <quoin/light/surface_light.h>

#include <algorithm>
#include <utility>

#include <quoin/core/assert.h>

#include "light/surface/levels.h"
#include "light/surface/rows.h"

namespace quoin {

struct SurfaceLight::Rows {
  LightRows voxels;
  // Of one quad: what lies in front of it and around, corners, and faces that are done.
  std::vector<FrontLight> fronts;
  std::vector<std::uint32_t> corners;
  std::vector<bool> done;
};

SurfaceLight::SurfaceLight(const PropagatedLight& light, const Grid& grid, const VoxelRegistry& types)
    : rows_(std::make_unique<Rows>(Rows{LightRows(light, grid, types), {}, {}, {}})) {}
SurfaceLight::SurfaceLight(SurfaceLight&&) noexcept = default;
SurfaceLight& SurfaceLight::operator=(SurfaceLight&&) noexcept = default;
SurfaceLight::~SurfaceLight() = default;

FaceLight SurfaceLight::face(IVec3 voxel, Direction direction) {
  return face_light(rows_->voxels, voxel + normal_of(direction), direction);
}

namespace {

// Twelfths with room between them, so that sums and differences of all four are one operation each. Differences borrow
// from what lies above them, the same wherever they are the same.
constexpr std::uint64_t spread(std::uint32_t twelfths) {
  const std::uint64_t all = twelfths;
  return (all & 0xFFU) | (all & 0xFF00U) << 8 | (all & 0xFF'0000U) << 16 | (all & 0xFF00'0000U) << 24;
}

// How light changes over a face, where it is linear.
struct Slope {
  std::uint64_t along_u = 0;
  std::uint64_t along_v = 0;
  bool is_linear = false;
};

// Light at the corners of a quad's faces, and how it is cut.
class QuadCutter {
 public:
  QuadCutter(int width, int height, const std::vector<std::uint32_t>& corners, std::vector<bool>& done)
      : width_(width), height_(height), corners_(corners), done_(done) {
    done_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), false);
  }

  template <class Emit>
  void cut(LightMerging merging, const Emit& emit) {
    for (int v = 0; v < height_; ++v) {
      for (int u = 0; u < width_; ++u) {
        if (is_done(u, v)) continue;
        const auto [along_u, along_v] = extent(u, v, merging);
        for (int y = v; y < v + along_v; ++y) {
          const auto first = done_.begin() + (u + width_ * y);
          std::fill(first, first + along_u, true);
        }
        emit(u, v, along_u, along_v);
      }
    }
  }
  [[nodiscard]] FaceLight corners_of(int u, int v, int along_u, int along_v) const {
    return {corner(u, v), corner(u + along_u, v), corner(u + along_u, v + along_v), corner(u, v + along_v)};
  }

 private:
  [[nodiscard]] std::uint32_t corner(int u, int v) const {
    return corners_[static_cast<std::size_t>(u + (width_ + 1) * v)];
  }
  [[nodiscard]] bool is_done(int u, int v) const { return done_[static_cast<std::size_t>(u + width_ * v)]; }
  [[nodiscard]] Slope slope(int u, int v) const {
    const std::uint64_t first = spread(corner(u, v));
    const Slope slope{spread(corner(u + 1, v)) - first, spread(corner(u, v + 1)) - first, true};
    const bool is_linear = spread(corner(u + 1, v + 1)) - spread(corner(u, v + 1)) == slope.along_u;
    return {slope.along_u, slope.along_v, is_linear};
  }
  // How far a face goes on, along u and then along v.
  [[nodiscard]] std::pair<int, int> extent(int u, int v, LightMerging merging) const {
    const Slope first = slope(u, v);
    if (!first.is_linear) return {1, 1};
    const bool is_linear = merging == LightMerging::Linear;
    const auto joins = [&](int x, int y) {
      if (is_done(x, y)) return false;
      const Slope other = slope(x, y);
      return other.is_linear && other.along_u == first.along_u && other.along_v == first.along_v;
    };
    int right = u + 1;
    if (is_linear || first.along_u == 0) {
      while (right < width_ && joins(right, v)) ++right;
    }
    int top = v + 1;
    const auto row_joins = [&](int y) {
      for (int x = u; x < right; ++x) {
        if (!joins(x, y)) return false;
      }
      return true;
    };
    if (is_linear || first.along_v == 0) {
      while (top < height_ && row_joins(top)) ++top;
    }
    return {right - u, top - v};
  }

  int width_;
  int height_;
  const std::vector<std::uint32_t>& corners_;
  std::vector<bool>& done_;
};

// Corner (u, v) of a quad of so many faces, from what lies in front of it and one voxel around. Its own voxel is one in
// front of the quad: two of a corner's that are both are beside each other, so that either says the same.
std::uint32_t corner_of_quad(const std::vector<FrontLight>& fronts, int width, int height, int u, int v) {
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
                         std::vector<FaceLight>& corners) {
  out.clear();
  corners.clear();
  Rows& rows = *rows_;
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
    QuadCutter cutter(width, height, rows.corners, rows.done);
    cutter.cut(merging, [&](int u, int v, int along_u, int along_v) {
      out.push_back(quad_part(quad, u, v, along_u, along_v));
      corners.push_back(cutter.corners_of(u, v, along_u, along_v));
    });
  }
}

void SurfaceLight::read(const SmoothPlaces& places, std::span<MeanLevels> out) {
  QUOIN_ASSERT(places.normals.size() == places.positions.size() && out.size() >= places.positions.size(),
               "a normal for every position, and room for its light");
  const int step = 1 << std::clamp(places.level, 0, kMaxSmoothLevel);
  for (std::size_t i = 0; i < places.positions.size(); ++i) {
    const DVec3 point = DVec3(places.positions[i]) + DVec3(places.origin);
    out[i] = light_before(rows_->voxels, point, places.normals[i], step);
  }
}

}  // namespace quoin
