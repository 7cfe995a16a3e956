#include "io/vox/orientation.h"

#include <cmath>

#include <glm/mat3x3.hpp>

#include <quoin/core/assert.h>

namespace quoin::vox {

namespace {

constexpr AxisOrientation kQuoinFromVox = AxisOrientation::quarter_turns(0, -1);
constexpr AxisOrientation kVoxFromQuoin = AxisOrientation::quarter_turns(0, 1);
constexpr AxisOrientation kMirrorX = AxisOrientation::mirror(0);

DQuat quaternion(const AxisOrientation& rotation) {
  DQuat q = glm::normalize(glm::quat_cast(rotation.matrix()));
  if (q.w < 0.0) q = -q;
  // Adding zero turns -0.0 into 0.0.
  return {q.w + 0.0, q.x + 0.0, q.y + 0.0, q.z + 0.0};
}

}  // namespace

Offset operator*(const AxisOrientation& orientation, const Offset& offset) {
  Offset turned{};
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t value = offset[static_cast<std::size_t>(orientation.source_axis(axis))];
    turned[static_cast<std::size_t>(axis)] = orientation.is_negated(axis) ? -value : value;
  }
  return turned;
}

Motion operator*(const Motion& a, const Motion& b) {
  Motion both{a.orientation * b.orientation, a.orientation * b.translation};
  for (std::size_t axis = 0; axis < 3; ++axis) both.translation[axis] += a.translation[axis];
  return both;
}

Motion inverse(const Motion& motion) {
  Motion back{motion.orientation.inverse(), {}};
  back.translation = back.orientation * motion.translation;
  for (std::int64_t& value : back.translation) value = -value;
  return back;
}

std::optional<AxisOrientation> orientation_from_byte(std::uint8_t byte) {
  const std::array<int, 2> columns = {byte & 3, byte >> 2 & 3};
  if (columns[0] > 2 || columns[1] > 2 || columns[0] == columns[1]) return std::nullopt;
  const std::array<int, 3> column_of_row = {columns[0], columns[1], 3 - columns[0] - columns[1]};
  glm::dmat3 matrix(0.0);
  for (int row = 0; row < 3; ++row) {
    matrix[column_of_row[static_cast<std::size_t>(row)]][row] = (byte >> (4 + row) & 1) != 0 ? -1.0 : 1.0;
  }
  return AxisOrientation::near_matrix(matrix, 0.0);
}

std::uint8_t byte_from_orientation(const AxisOrientation& orientation) {
  int byte = orientation.source_axis(0) | orientation.source_axis(1) << 2;
  for (int row = 0; row < 3; ++row) byte |= int{orientation.is_negated(row)} << (4 + row);
  return static_cast<std::uint8_t>(byte);
}

InstanceTurn turn_from_orientation(const AxisOrientation& in_vox) {
  const AxisOrientation in_quoin = kQuoinFromVox * in_vox * kVoxFromQuoin;
  const bool mirrored = in_quoin.is_mirrored();
  return {quaternion(mirrored ? in_quoin * kMirrorX : in_quoin), mirrored};
}

std::optional<AxisOrientation> orientation_from_turn(const InstanceTurn& turn) {
  constexpr double kRounding = 1e-6;
  if (!(std::abs(glm::length(turn.rotation) - 1.0) <= kRounding)) return std::nullopt;
  const auto rotation = AxisOrientation::near_matrix(glm::mat3_cast(turn.rotation), kRounding);
  if (!rotation) return std::nullopt;
  const AxisOrientation in_quoin = turn.mirrored ? *rotation * kMirrorX : *rotation;
  return kVoxFromQuoin * in_quoin * kQuoinFromVox;
}

Offset quoin_from_vox(const Offset& offset) {
  return kQuoinFromVox * offset;
}
Offset vox_from_quoin(const Offset& offset) {
  return kVoxFromQuoin * offset;
}

}  // namespace quoin::vox
