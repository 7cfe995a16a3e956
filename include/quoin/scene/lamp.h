#pragma once

#include <cstdint>
#include <limits>
#include <string>

#include <quoin/core/vec.h>

namespace quoin {

/// A light without a body, at a point of the world. Voxels that emit light are lamps by themselves.
///
/// Falls off with the square of the distance, times 1 - (distance / range)^4, as KHR_lights_punctual of glTF
/// recommends; where it would add less than 1/4096 before its range is over, it ends there in the same way. A lamp
/// whose numbers are not finite (but the range), or whose intensity is not positive, lights nothing.
struct Lamp {
  enum class Kind : std::uint8_t {
    Point,  ///< shines into all directions alike
    Spot,   ///< into a cone around `direction`
  };
  std::string name;
  Kind kind = Kind::Point;
  DVec3 position{0.0};              ///< world units
  DVec3 direction{0.0, -1.0, 0.0};  ///< of a spot's middle; any length but 0
  Vec3 colour{1.0F};                ///< linear
  double intensity = 1.0;           ///< the light of a white surface that faces it at a distance of 1
  double range = std::numeric_limits<double>::infinity();  ///< world units
  double inner_angle_radians = 0.0;                        ///< from a spot's middle, up to which it is at its brightest
  double outer_angle_radians = 0.785398163;                ///< and from which on it is dark; up to pi

  bool operator==(const Lamp&) const = default;
};

}  // namespace quoin
