#include "light/occlusion_directions.h"

#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include <quoin/core/direction.h>

namespace quoin {
namespace {

constexpr std::size_t kTurns = 1024;

struct Basis {
  DVec3 normal{0.0};
  DVec3 u{0.0};
  DVec3 v{0.0};
};

Basis basis_of(std::size_t face) {
  const FaceFrame& frame = kFaceFrames[face];
  Basis basis;
  basis.normal[frame.axis] = frame.sign;
  basis.u[frame.u] = 1.0;
  basis.v[frame.v] = 1.0;
  return basis;
}

}  // namespace

OcclusionDirections::OcclusionDirections(int rays) : count_(rays), is_fixed_(rays == 6 || rays == 9) {
  const double half = std::sqrt(0.5);
  const double third = std::sqrt(1.0 / 3.0);
  for (std::size_t face = 0; is_fixed_ && face < 6; ++face) {
    const auto [n, u, v] = basis_of(face);
    fixed_[face] = {n, (n + u) * half, (n - u) * half, (n + v) * half, (n - v) * half};
    if (rays == 6) {
      fixed_[face][5] = (n + u + v) * third;
      continue;
    }
    for (std::size_t i = 0; i < 4; ++i) {
      fixed_[face][5 + i] = (n + ((i & 1U) != 0 ? -u : u) + ((i & 2U) != 0 ? -v : v)) * third;
    }
  }
  if (is_fixed_) return;
  const auto angle = [](double radians) { return Angle{std::cos(radians), std::sin(radians)}; };
  const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (int ray = 0; ray < rays; ++ray) ring_angles_.push_back(angle(golden * ray));
  for (std::size_t i = 0; i < kTurns; ++i) {
    turns_.push_back(angle(2.0 * std::numbers::pi * static_cast<double>(i) / kTurns));
  }
}

OcclusionDirections::Angle OcclusionDirections::turn_of(int sample, int rays) {
  if (rays != 9 || sample == 0) return {};
  // Multiples of the golden ratio leave no large gaps, however many are taken.
  const double share = std::fmod(sample * (std::numbers::phi - 1.0), 1.0);
  const double radians = 0.5 * std::numbers::pi * share;
  return {std::cos(radians), std::sin(radians)};
}

OcclusionDirections::Fixed OcclusionDirections::turned(Angle turn) const {
  QUOIN_ASSERT(is_fixed_, "directions that all pixels have");
  Fixed all = fixed_;
  if (turn.sine == 0.0) return all;
  for (std::size_t face = 0; face < all.size(); ++face) {
    const FaceFrame& frame = kFaceFrames[face];
    for (DVec3& direction : all[face]) {
      const double u = direction[frame.u];
      const double v = direction[frame.v];
      direction[frame.u] = turn.cosine * u - turn.sine * v;
      direction[frame.v] = turn.sine * u + turn.cosine * v;
    }
  }
  return all;
}

DVec3 turned_from_up(const DVec3& direction, const DVec3& normal) {
  // Straight down any axis will do.
  if (normal.y < -1.0 + 1e-9) return {-direction.x, -direction.y, direction.z};
  // Rodrigues' formula, with the sine and cosine of the angle in the axis and in normal.y.
  const DVec3 axis{normal.z, 0.0, -normal.x};
  const DVec3 once = glm::cross(axis, direction);
  return direction + once + glm::cross(axis, once) / (1.0 + normal.y);
}

DVec3 OcclusionDirections::spread(std::size_t face, int ray, std::uint32_t hash) const {
  QUOIN_ASSERT(!is_fixed_ && ray >= 0 && ray < count_, "a ray of those that are spread");
  const Angle ring = ring_angles_[static_cast<std::size_t>(ray)];
  const Angle turn = turns_[hash % kTurns];
  const std::uint32_t rest = hash / kTurns;
  const double shift = (static_cast<double>(rest) + 0.5) * (kTurns * 0x1p-32);
  const double sine_squared = (ray + shift) / count_;
  const double radius = std::sqrt(sine_squared);
  const FaceFrame& frame = kFaceFrames[face];
  DVec3 direction;
  direction[frame.axis] = frame.sign * std::sqrt(1.0 - sine_squared);
  direction[frame.u] = radius * (ring.cosine * turn.cosine - ring.sine * turn.sine);
  direction[frame.v] = radius * (ring.sine * turn.cosine + ring.cosine * turn.sine);
  return direction;
}

}  // namespace quoin
