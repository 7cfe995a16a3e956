#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <string_view>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>

namespace [[gnu::visibility("default")]] quoin {

/// The six face directions. The value is also the bit index in a visible-face mask.
enum class Direction : std::uint8_t { PosX = 0, NegX = 1, PosY = 2, NegY = 3, PosZ = 4, NegZ = 5 };

inline constexpr std::array<Direction, 6> kDirections = {Direction::PosX, Direction::NegX, Direction::PosY,
                                                         Direction::NegY, Direction::PosZ, Direction::NegZ};

/// The frame of a face: its axis, its sign, and the two axes along its edges.
///
/// u x v points along the outward normal. The corners (0,0) (1,0) (1,1) (0,1) in (u,v) therefore run counter-clockwise,
/// seen from outside.
struct FaceFrame {
  std::uint8_t axis;  ///< 0 x, 1 y, 2 z
  std::int8_t sign;   ///< +1 or -1
  std::uint8_t u;     ///< axis of the first edge
  std::uint8_t v;     ///< axis of the second edge
};

inline constexpr std::array<FaceFrame, 6> kFaceFrames = {FaceFrame{0, +1, 1, 2}, FaceFrame{0, -1, 2, 1},
                                                         FaceFrame{1, +1, 2, 0}, FaceFrame{1, -1, 0, 2},
                                                         FaceFrame{2, +1, 0, 1}, FaceFrame{2, -1, 1, 0}};

/// Returns the face frame of a direction.
[[nodiscard]] constexpr const FaceFrame& frame_of(Direction d) {
  QUOIN_ASSERT(static_cast<std::size_t>(d) < kFaceFrames.size(), "one of the six directions");
  return kFaceFrames[static_cast<std::size_t>(d)];
}

/// Returns the unit vector of a direction.
[[nodiscard]] inline IVec3 normal_of(Direction d) {
  IVec3 n{0};
  n[frame_of(d).axis] = frame_of(d).sign;
  return n;
}

/// Returns the direction that points the other way.
[[nodiscard]] constexpr Direction opposite(Direction d) {
  return static_cast<Direction>(static_cast<unsigned>(d) ^ 1U);
}

/// Returns the direction closest to a vector. Ties prefer x over y over z. Returns PosX for the zero vector.
[[nodiscard]] inline Direction nearest_direction(const DVec3& vector) {
  int axis = 0;
  for (int other = 1; other < 3; ++other) {
    if (std::abs(vector[other]) > std::abs(vector[axis])) axis = other;
  }
  return static_cast<Direction>(2 * axis + (vector[axis] < 0.0 ? 1 : 0));
}

/// Returns "+X", "-X", "+Y", "-Y", "+Z" or "-Z".
[[nodiscard]] constexpr std::string_view name_of(Direction direction) {
  constexpr std::array<std::string_view, 6> kNames = {"+X", "-X", "+Y", "-Y", "+Z", "-Z"};
  QUOIN_ASSERT(static_cast<std::size_t>(direction) < kNames.size(), "one of the six directions");
  return kNames[static_cast<std::size_t>(direction)];
}

/// A set of directions, such as the visible faces of a voxel, stored in one byte.
///
///   const DirectionSet faces = visible_faces(chunks, types, {10, 10, 10});
///   if (faces.contains(Direction::PosY)) grow_grass();
///   for (const Direction face : faces) draw(face);       // in the order of kDirections
class DirectionSet {
 public:
  constexpr DirectionSet() = default;
  constexpr DirectionSet(std::initializer_list<Direction> directions) {
    for (const Direction direction : directions) insert(direction);
  }
  [[nodiscard]] static constexpr DirectionSet all() { return from_bits(kAll); }
  /// Creates a set from a bit mask: +X is bit 0, then -X, +Y, -Y, +Z, -Z. The two highest bits are ignored.
  [[nodiscard]] static constexpr DirectionSet from_bits(std::uint8_t bits) {
    DirectionSet set;
    set.bits_ = bits & kAll;
    return set;
  }
  [[nodiscard]] constexpr std::uint8_t bits() const { return bits_; }

  [[nodiscard]] constexpr bool contains(Direction direction) const { return (bits_ & bit_of(direction)) != 0; }
  constexpr void insert(Direction direction) { bits_ = static_cast<std::uint8_t>(bits_ | bit_of(direction)); }
  constexpr void erase(Direction direction) { bits_ = static_cast<std::uint8_t>(bits_ & ~bit_of(direction)); }
  [[nodiscard]] constexpr int size() const { return std::popcount(bits_); }
  [[nodiscard]] constexpr bool empty() const { return bits_ == 0; }
  constexpr bool operator==(const DirectionSet&) const = default;

  /// Iterates over the directions of a set in the order of kDirections.
  class Iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = Direction;
    using difference_type = std::ptrdiff_t;
    using pointer = const Direction*;
    using reference = Direction;

    constexpr Iterator() = default;
    constexpr explicit Iterator(std::uint8_t bits) : bits_(bits) {}
    constexpr Direction operator*() const {
      QUOIN_ASSERT(bits_ != 0, "an iterator before the end");
      return static_cast<Direction>(std::countr_zero(bits_));
    }
    constexpr Iterator& operator++() {
      bits_ = static_cast<std::uint8_t>(bits_ & (bits_ - 1));
      return *this;
    }
    constexpr Iterator operator++(int) {
      const Iterator before = *this;
      ++*this;
      return before;
    }
    constexpr bool operator==(const Iterator&) const = default;

   private:
    std::uint8_t bits_ = 0;  // the remaining directions
  };
  [[nodiscard]] constexpr Iterator begin() const { return Iterator(bits_); }
  [[nodiscard]] constexpr Iterator end() const { return Iterator(); }

 private:
  static constexpr std::uint8_t kAll = 0b11'1111;
  static constexpr std::uint8_t bit_of(Direction direction) {
    return static_cast<std::uint8_t>(1U << static_cast<unsigned>(direction));
  }

  std::uint8_t bits_ = 0;
};

}  // namespace quoin
