#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <glm/mat3x3.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/vec.h>

namespace [[gnu::visibility("default")]] quoin {

/// An orientation that maps the coordinate axes onto each other: a signed axis permutation. There are 48 of them. 24
/// are rotations by quarter turns; the other 24 combine such a rotation with a mirror.
///
/// Usage: const auto turned = AxisOrientation::quarter_turns(1, 1) * AxisOrientation::mirror(0);  // the mirror first
class AxisOrientation {
 public:
  static constexpr int kCount = 48;

  /// Creates the identity.
  constexpr AxisOrientation() = default;
  /// Returns the rotation about an axis (0 x, 1 y, 2 z) by `turns` quarter turns. Positive turns are counter-clockwise,
  /// seen from the positive end of the axis: a turn about z maps +x to +y. Negative turns rotate the other way.
  /// Requires: 0 <= axis < 3.
  [[nodiscard]] static constexpr AxisOrientation quarter_turns(int axis, int turns) {
    QUOIN_ASSERT(axis >= 0 && axis < 3, "0 <= axis < 3");
    AxisOrientation quarter;
    const auto u = static_cast<std::size_t>((axis + 1) % 3);
    const auto v = static_cast<std::size_t>((axis + 2) % 3);
    quarter.source_[u] = static_cast<std::uint8_t>(v);
    quarter.source_[v] = static_cast<std::uint8_t>(u);
    quarter.is_negated_[u] = true;
    AxisOrientation all;
    for (int i = (turns % 4 + 4) % 4; i > 0; --i) all = quarter * all;
    return all;
  }
  /// Returns the mirror that negates an axis (0 x, 1 y, 2 z). Requires: 0 <= axis < 3.
  [[nodiscard]] static constexpr AxisOrientation mirror(int axis) {
    QUOIN_ASSERT(axis >= 0 && axis < 3, "0 <= axis < 3");
    AxisOrientation mirrored;
    mirrored.is_negated_[static_cast<std::size_t>(axis)] = true;
    return mirrored;
  }
  /// Returns the orientation with the given `index()`; 0 is the identity. Requires: 0 <= index < kCount.
  [[nodiscard]] static constexpr AxisOrientation at(int index) {
    QUOIN_ASSERT(index >= 0 && index < kCount, "0 <= index < kCount");
    constexpr std::array<std::array<std::uint8_t, 3>, 6> kOrders = {
        {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}}};
    AxisOrientation found;
    found.source_ = kOrders[static_cast<std::size_t>(index / 8)];
    for (std::size_t i = 0; i < 3; ++i) found.is_negated_[i] = (index >> i & 1) != 0;
    return found;
  }
  /// Returns the orientation whose matrix differs by at most `tolerance` from a matrix in each entry; nullopt if there
  /// is none. Requires: tolerance < 0.5.
  [[nodiscard]] static std::optional<AxisOrientation> near_matrix(const glm::dmat3& matrix, double tolerance) {
    QUOIN_ASSERT(tolerance < 0.5, "tolerance < 0.5");
    AxisOrientation found;
    unsigned columns = 0;
    for (std::size_t row = 0; row < 3; ++row) {
      int entries = 0;
      for (std::size_t column = 0; column < 3; ++column) {
        const double entry = matrix[static_cast<int>(column)][static_cast<int>(row)];
        if (std::abs(entry) <= tolerance) continue;
        if (!(std::abs(std::abs(entry) - 1.0) <= tolerance)) return std::nullopt;
        found.source_[row] = static_cast<std::uint8_t>(column);
        found.is_negated_[row] = entry < 0.0;
        columns |= 1U << column;
        ++entries;
      }
      if (entries != 1) return std::nullopt;
    }
    return columns == 0b111 ? std::optional(found) : std::nullopt;
  }
  /// Returns the index of this orientation, 0 to 47, for files and tables.
  [[nodiscard]] constexpr int index() const {
    const int order = is_cyclic() ? source_[0] : 5 - source_[2];
    return 8 * order + int{is_negated_[0]} + 2 * int{is_negated_[1]} + 4 * int{is_negated_[2]};
  }

  /// Returns the source axis (0 x, 1 y, 2 z) that maps to `axis`. Requires: 0 <= axis < 3.
  [[nodiscard]] constexpr int source_axis(int axis) const {
    QUOIN_ASSERT(axis >= 0 && axis < 3, "0 <= axis < 3");
    return source_[static_cast<std::size_t>(axis)];
  }
  /// Returns true if `axis` is the negated source axis. Requires: 0 <= axis < 3.
  [[nodiscard]] constexpr bool is_negated(int axis) const {
    QUOIN_ASSERT(axis >= 0 && axis < 3, "0 <= axis < 3");
    return is_negated_[static_cast<std::size_t>(axis)];
  }
  /// Returns true if the orientation is a reflection (determinant -1), which swaps left and right hands.
  [[nodiscard]] constexpr bool is_mirrored() const {
    return (is_negated_[0] != is_negated_[1]) != (is_negated_[2] == is_cyclic());
  }

  /// Applies the orientation to a vector from the origin, or to a direction.
  [[nodiscard]] IVec3 apply(IVec3 v) const { return applied(v); }
  [[nodiscard]] DVec3 apply(DVec3 v) const { return applied(v); }
  [[nodiscard]] Direction apply(Direction direction) const {
    const FaceFrame& frame = frame_of(direction);
    std::size_t axis = 0;
    while (source_[axis] != frame.axis) ++axis;
    return static_cast<Direction>(2 * axis + std::size_t{is_negated_[axis] == (frame.sign > 0)});
  }
  /// Returns the size of a box after the orientation is applied to it.
  [[nodiscard]] IVec3 size_of(IVec3 size) const { return {size[source_[0]], size[source_[1]], size[source_[2]]}; }

  /// Returns the inverse orientation.
  [[nodiscard]] constexpr AxisOrientation inverse() const {
    AxisOrientation back;
    for (std::size_t i = 0; i < 3; ++i) {
      back.source_[source_[i]] = static_cast<std::uint8_t>(i);
      back.is_negated_[source_[i]] = is_negated_[i];
    }
    return back;
  }
  /// Composes two orientations in matrix order: applies `first`, then `second`.
  [[nodiscard]] friend constexpr AxisOrientation operator*(const AxisOrientation& second,
                                                           const AxisOrientation& first) {
    AxisOrientation both;
    for (std::size_t i = 0; i < 3; ++i) {
      both.source_[i] = first.source_[second.source_[i]];
      both.is_negated_[i] = second.is_negated_[i] != first.is_negated_[second.source_[i]];
    }
    return both;
  }
  /// Returns the orientation as a matrix for column vectors.
  [[nodiscard]] glm::dmat3 matrix() const {
    glm::dmat3 columns(0.0);
    for (int i = 0; i < 3; ++i) columns[source_axis(i)][i] = is_negated(i) ? -1.0 : 1.0;
    return columns;
  }
  constexpr bool operator==(const AxisOrientation&) const = default;

 private:
  [[nodiscard]] constexpr bool is_cyclic() const { return source_[1] == (source_[0] + 1) % 3; }
  template <class Vector>
  [[nodiscard]] Vector applied(const Vector& v) const {
    Vector turned = v;
    for (int i = 0; i < 3; ++i) turned[i] = is_negated(i) ? -v[source_axis(i)] : v[source_axis(i)];
    return turned;
  }

  std::array<std::uint8_t, 3> source_ = {0, 1, 2};  // [axis]: source axis
  std::array<bool, 3> is_negated_ = {};
};

}  // namespace quoin
