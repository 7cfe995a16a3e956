#include "render/light/occlusion_directions.h"

#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>

namespace quoin {
namespace {

constexpr std::size_t kTurns = 1024;
constexpr double kLean = 0.41421356237309505;  // tangent of half of 45 degrees

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
  QUOIN_ASSERT(rays >= 1, "at least one ray");
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

// Multiples of the golden ratio, and of its likes in two dimensions, leave no large gaps, however many are taken.
OcclusionDirections::Turn OcclusionDirections::turn_of(int sample, int rays) {
  QUOIN_ASSERT(sample >= 0, "a sample of a pixel");
  if (rays != 9 || sample == 0) return {};
  const auto share_of = [&](double step) { return std::fmod(sample * step, 1.0); };
  constexpr double kPlastic = 1.32471795724474602596;
  const double radians = 0.5 * std::numbers::pi * share_of(std::numbers::phi - 1.0);
  const double around = 2.0 * std::numbers::pi * share_of(1.0 / kPlastic);
  const double lean = kLean * std::sqrt(share_of(1.0 / (kPlastic * kPlastic)));
  return {{std::cos(radians), std::sin(radians)},
          glm::normalize(DVec3(lean * std::cos(around), lean * std::sin(around), 1.0))};
}

OcclusionDirections::Fixed OcclusionDirections::turned(const Turn& turn) const {
  QUOIN_ASSERT(is_fixed_, "directions shared by all pixels");
  Fixed all = fixed_;
  const auto [cosine, sine] = turn.about_normal;
  if (sine == 0.0) return all;
  for (std::size_t face = 0; face < all.size(); ++face) {
    const FaceFrame& frame = kFaceFrames[face];
    for (DVec3& direction : all[face]) {
      const double u = direction[frame.u];
      const double v = direction[frame.v];
      direction[frame.u] = cosine * u - sine * v;
      direction[frame.v] = sine * u + cosine * v;
    }
    DVec3& upright = all[face][0];
    upright[frame.u] = turn.upright.x;
    upright[frame.v] = turn.upright.y;
    upright[frame.axis] = frame.sign * turn.upright.z;
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
  QUOIN_ASSERT(face < fixed_.size(), "one of the six faces");
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
