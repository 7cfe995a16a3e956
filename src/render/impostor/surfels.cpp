#include "render/impostor/surfels.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

#include "core/coordinates/chunk_order.h"
#include "trace/density/smooth_normal.h"

namespace quoin {
namespace {

constexpr double kOfLargest = 0.8;
constexpr double kEnough = 0.55;
constexpr int kThin = 3;  // samples

// Collects the surface's crossings with the lattice edges that begin in each chunk.
class SurfelMaker {
 public:
  SurfelMaker(const DensityGrid& field, std::size_t max_count) : field_(&field), max_count_(max_count) {}

  // Returns false if there are too many surfels.
  bool take_chunk(IVec3 chunk) {
    for (int i = 0; i < 4; ++i) {
      IVec3 offset{0};
      if (i > 0) offset[i - 1] = 1;
      near_[static_cast<std::size_t>(i)] = field_->find_chunk(chunk + offset);
    }
    const IVec3 corner = chunk * kChunkEdge;
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y) {
        const std::uint64_t own = signs(0, y, z);
        const std::uint64_t along_x = own >> 1 | signs(1, y, z) << 63;
        const std::uint64_t along_y = y + 1 < kChunkEdge ? signs(0, y + 1, z) : signs(2, 0, z);
        const std::uint64_t along_z = z + 1 < kChunkEdge ? signs(0, y, z + 1) : signs(3, y, 0);
        take_row(corner + IVec3{0, y, z}, 0, own, along_x);
        take_row(corner + IVec3{0, y, z}, 1, own, along_y);
        take_row(corner + IVec3{0, y, z}, 2, own, along_z);
      }
    }
    return made_.faces.size() <= max_count_;
  }

  [[nodiscard]] bool is_thin() const { return 4 * thin_ > made_.faces.size(); }

  FieldSurfels sorted() && {
    std::vector<std::uint32_t> order(made_.faces.size());
    std::iota(order.begin(), order.end(), 0U);
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return comes_before(made_.faces[a], made_.faces[b]); });
    FieldSurfels out;
    for (const std::uint32_t i : order) {
      out.faces.push_back(made_.faces[i]);
      out.surfels.push_back(made_.surfels[i]);
      out.types.push_back(made_.types[i]);
    }
    return out;
  }

 private:
  // Returns a mask of the solid samples in a row of this chunk or the next along x, y or z.
  [[nodiscard]] std::uint64_t signs(std::size_t of, int y, int z) const {
    return near_[of] == nullptr ? 0 : near_[of]->solid_row(y, z);
  }
  void take_row(IVec3 first, int axis, std::uint64_t low, std::uint64_t high) {
    for (std::uint64_t left = low ^ high; left != 0; left &= left - 1) {
      const int x = std::countr_zero(left);
      take_edge(first + IVec3{x, 0, 0}, axis, (low >> x & 1U) != 0);
    }
  }
  void take_edge(IVec3 sample, int axis, bool is_solid_below) {
    const auto direction = static_cast<Direction>(2 * axis + (is_solid_below ? 0 : 1));
    const std::optional<double> crossing = height(sample, axis, is_solid_below);
    QUOIN_ASSERT(crossing.has_value(), "an edge that the surface crosses");
    const double offset = *crossing;
    DVec3 point(sample);
    point[axis] += offset;
    const DVec3 normal = normal_at(point);
    const DVec3 size = glm::abs(normal);
    const double largest = std::max({size.x, size.y, size.z});
    const bool is_outward = (normal[axis] > 0.0) == is_solid_below && normal[axis] != 0.0;
    if (!is_outward || size[axis] < std::min(kEnough, kOfLargest * largest)) return;
    IVec3 solid = sample;
    if (!is_solid_below) ++solid[axis];
    IVec3 inwards{0};
    inwards[axis] = is_solid_below ? -1 : 1;
    bool is_thin = false;
    for (int i = 1; i <= kThin; ++i) is_thin |= !(field_->density(solid + i * inwards) < 0.0F);
    thin_ += is_thin ? 1 : 0;
    ImpostorFaces::Surfel surfel;
    surfel.normal = Vec3(normal);
    double rise = offset;
    for (std::size_t i = 0; i < 2; ++i) {
      const FaceFrame& frame = frame_of(direction);
      const Side side = side_of(sample, axis, static_cast<int>(i == 0 ? frame.u : frame.v), is_solid_below, offset);
      // Rounded to steps that fit in a few bits on the device.
      surfel.half[i] = static_cast<float>(std::round(512.0 * (side.low + side.high)) / 1024.0);
      surfel.shift[i] = static_cast<float>(0.5 * (side.high - side.low));
      surfel.slope[i] = static_cast<float>(side.slope);
      rise += side.slope * 0.5 * (side.high - side.low);
    }
    surfel.offset = static_cast<float>(rise);
    made_.faces.push_back({sample, direction});
    made_.surfels.push_back(surfel);
    made_.types.push_back(field_->material(solid));
  }

  // The extent of a surfel along another axis: its reach to both sides, and its rise.
  struct Side {
    double low = 0.5;
    double high = 0.5;
    double slope = 0.0;
  };
  [[nodiscard]] Side side_of(IVec3 sample, int axis, int along, bool is_solid_below, double offset) const {
    std::array<std::optional<double>, 2> adjacent;
    Side side;
    for (int i = 0; i < 2; ++i) {
      IVec3 step{0};
      step[along] = i == 0 ? -1 : 1;
      auto& found = adjacent[static_cast<std::size_t>(i)];
      found = height_near(sample + step, axis, is_solid_below);
      if (!found) (i == 0 ? side.low : side.high) = reach_to(sample, step, axis, is_solid_below);
    }
    if (adjacent[0] && adjacent[1]) {
      side.slope = 0.5 * (*adjacent[1] - *adjacent[0]);
    } else if (adjacent[0]) {
      side.slope = offset - *adjacent[0];
    } else if (adjacent[1]) {
      side.slope = *adjacent[1] - offset;
    }
    return side;
  }
  // Returns the height of the surface's crossing with an edge above its lower end; nullopt without one, or for the
  // opposite side.
  [[nodiscard]] std::optional<double> height(IVec3 sample, int axis, bool is_solid_below) const {
    IVec3 next = sample;
    ++next[axis];
    const double below = field_->density(sample);
    const double above = field_->density(next);
    if ((below < 0.0) != is_solid_below || (above < 0.0) == is_solid_below) return std::nullopt;
    return std::clamp(below / (below - above), 0.0, 1.0);
  }
  // As `height`, for the edge, or the edge below or above it.
  [[nodiscard]] std::optional<double> height_near(IVec3 sample, int axis, bool is_solid_below) const {
    for (const int up : {0, -1, 1}) {
      IVec3 at = sample;
      at[axis] += up;
      if (const std::optional<double> found = height(at, axis, is_solid_below)) return *found + up;
    }
    return std::nullopt;
  }
  // Returns the extent of the surface from an edge if it does not cross the next edge: up to its bend, or to a wall.
  [[nodiscard]] double reach_to(IVec3 sample, IVec3 step, int axis, bool is_solid_below) const {
    IVec3 solid = sample;
    IVec3 air = sample;
    ++(is_solid_below ? air : solid)[axis];
    const double own = field_->density(solid);
    const double next = field_->density(solid + step);
    if (!(next < 0.0)) return std::clamp(own / (own - next), 0.0, 1.0);
    const double before = field_->density(air);
    const double wall = field_->density(air + step);
    return wall < 0.0 ? std::clamp(before / (before - wall), 0.0, 1.0) : 0.5;
  }
  [[nodiscard]] DVec3 normal_at(const DVec3& point) const {
    DensityHit hit;
    const DVec3 gradient = field_->gradient_at(point);
    const double length = glm::length(gradient);
    if (length > 0.0) hit.normal = gradient / length;
    return smooth_normal(*field_, point, hit);
  }

  const DensityGrid* field_;
  std::size_t max_count_;
  std::array<const DensityChunk*, 4> near_{};
  FieldSurfels made_;
  std::size_t thin_ = 0;
};

}  // namespace

std::optional<FieldSurfels> surfels_of(const DensityGrid& field, std::size_t max_count) {
  std::vector<IVec3> chunks;
  for (const IVec3 chunk : field.chunks()) {
    chunks.push_back(chunk);
    for (int axis = 0; axis < 3; ++axis) {
      chunks.push_back(chunk);
      --chunks.back()[axis];
    }
  }
  sort_and_unite(chunks);
  SurfelMaker maker(field, max_count);
  for (const IVec3 chunk : chunks) {
    if (!maker.take_chunk(chunk)) return std::nullopt;
  }
  if (maker.is_thin()) return std::nullopt;
  return std::move(maker).sorted();
}

}  // namespace quoin
