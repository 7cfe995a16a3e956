#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <string_view>

#include <quoin/core/direction.h>

namespace quoin {

/// "+X", "-X", "+Y", "-Y", "+Z" or "-Z".
[[nodiscard]] constexpr std::string_view name_of(Direction direction) {
  constexpr std::array<std::string_view, 6> kNames = {"+X", "-X", "+Y", "-Y", "+Z", "-Z"};
  return kNames[static_cast<std::size_t>(direction)];
}

/// A set of directions, such as the visible faces of a voxel; takes a byte.
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
  /// Bit d is for the direction of value d: +X 0, -X 1, +Y 2, -Y 3, +Z 4, -Z 5. The two highest bits mean nothing.
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

  /// Goes over the directions of a set in the order of kDirections.
  class Iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = Direction;
    using difference_type = std::ptrdiff_t;
    using pointer = const Direction*;
    using reference = Direction;

    constexpr Iterator() = default;
    constexpr explicit Iterator(std::uint8_t bits) : bits_(bits) {}
    constexpr Direction operator*() const { return static_cast<Direction>(std::countr_zero(bits_)); }
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
    std::uint8_t bits_ = 0;  // of the directions that are still to come
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
