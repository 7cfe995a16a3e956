#include "io/vox/orientation.h"

#include <cmath>

#include <glm/mat3x3.hpp>

#include <quoin/core/assert.h>

namespace quoin::vox {

namespace {

constexpr Orientation kQuoinFromVox{{0, 2, 1}, {1, 1, -1}};
constexpr Orientation kVoxFromQuoin{{0, 2, 1}, {1, -1, 1}};
constexpr Orientation kMirrorX{{0, 1, 2}, {-1, 1, 1}};

DQuat quaternion(const Orientation& rotation) {
  glm::dmat3 matrix(0.0);
  for (int row = 0; row < 3; ++row) {
    const auto i = static_cast<std::size_t>(row);
    matrix[rotation.axis[i]][row] = rotation.sign[i];
  }
  DQuat q = glm::normalize(glm::quat_cast(matrix));
  if (q.w < 0.0) q = -q;
  // Adding zero turns -0.0 into 0.0.
  return {q.w + 0.0, q.x + 0.0, q.y + 0.0, q.z + 0.0};
}

}  // namespace

Orientation operator*(const Orientation& a, const Orientation& b) {
  Orientation product;
  for (std::size_t i = 0; i < 3; ++i) {
    QUOIN_ASSERT(a.axis[i] < 3, "one of three axes");
    product.axis[i] = b.axis[a.axis[i]];
    product.sign[i] = static_cast<std::int8_t>(a.sign[i] * b.sign[a.axis[i]]);
  }
  return product;
}

Offset operator*(const Orientation& a, const Offset& offset) {
  return {a.sign[0] * offset[a.axis[0]], a.sign[1] * offset[a.axis[1]], a.sign[2] * offset[a.axis[2]]};
}

Orientation inverse(const Orientation& orientation) {
  Orientation transposed;
  for (std::size_t row = 0; row < 3; ++row) {
    transposed.axis[orientation.axis[row]] = static_cast<std::uint8_t>(row);
    transposed.sign[orientation.axis[row]] = orientation.sign[row];
  }
  return transposed;
}

Motion operator*(const Motion& a, const Motion& b) {
  Motion both{a.orientation * b.orientation, a.orientation * b.translation};
  for (std::size_t axis = 0; axis < 3; ++axis) both.translation[axis] += a.translation[axis];
  return both;
}

Motion inverse(const Motion& motion) {
  Motion back{inverse(motion.orientation), {}};
  back.translation = back.orientation * motion.translation;
  for (std::int64_t& value : back.translation) value = -value;
  return back;
}

bool is_reflection(const Orientation& orientation) {
  const bool even = (orientation.axis[0] + 1) % 3 == orientation.axis[1];
  const int signs = orientation.sign[0] * orientation.sign[1] * orientation.sign[2];
  return even ? signs < 0 : signs > 0;
}

std::optional<Orientation> orientation_from_byte(std::uint8_t byte) {
  Orientation orientation;
  orientation.axis[0] = byte & 3U;
  orientation.axis[1] = (byte >> 2U) & 3U;
  if (orientation.axis[0] > 2 || orientation.axis[1] > 2 || orientation.axis[0] == orientation.axis[1]) {
    return std::nullopt;
  }
  orientation.axis[2] = static_cast<std::uint8_t>(3 - orientation.axis[0] - orientation.axis[1]);
  for (std::size_t i = 0; i < 3; ++i) orientation.sign[i] = ((byte >> (4U + i)) & 1U) != 0 ? -1 : 1;
  return orientation;
}

std::uint8_t byte_from_orientation(const Orientation& orientation) {
  QUOIN_ASSERT(orientation.axis[0] < 3 && orientation.axis[1] < 3 && orientation.axis[0] != orientation.axis[1],
               "rows with different columns");
  unsigned byte = orientation.axis[0] | static_cast<unsigned>(orientation.axis[1]) << 2U;
  for (std::size_t i = 0; i < 3; ++i) {
    if (orientation.sign[i] < 0) byte |= 1U << (4U + i);
  }
  return static_cast<std::uint8_t>(byte);
}

InstanceTurn turn_from_orientation(const Orientation& in_vox) {
  const Orientation in_quoin = kQuoinFromVox * in_vox * kVoxFromQuoin;
  const bool mirrored = is_reflection(in_quoin);
  return {quaternion(mirrored ? in_quoin * kMirrorX : in_quoin), mirrored};
}

std::optional<Orientation> orientation_from_turn(const InstanceTurn& turn) {
  constexpr double kRounding = 1e-6;
  if (!(std::abs(glm::length(turn.rotation) - 1.0) <= kRounding)) return std::nullopt;
  const glm::dmat3 matrix = glm::mat3_cast(turn.rotation);
  Orientation rotation;
  unsigned columns = 0;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      const double entry = matrix[column][row];
      if (std::abs(entry) <= kRounding) continue;
      if (!(std::abs(std::abs(entry) - 1.0) <= kRounding)) return std::nullopt;
      rotation.axis[static_cast<std::size_t>(row)] = static_cast<std::uint8_t>(column);
      rotation.sign[static_cast<std::size_t>(row)] = entry < 0.0 ? -1 : 1;
      columns |= 1U << static_cast<unsigned>(column);
    }
  }
  if (columns != 7U) return std::nullopt;
  const Orientation in_quoin = turn.mirrored ? rotation * kMirrorX : rotation;
  return kVoxFromQuoin * in_quoin * kQuoinFromVox;
}

Offset quoin_from_vox(const Offset& offset) {
  return kQuoinFromVox * offset;
}
Offset vox_from_quoin(const Offset& offset) {
  return kVoxFromQuoin * offset;
}

}  // namespace quoin::vox
