#include "io/smooth_parts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <glm/matrix.hpp>

#include "core/srgb.h"

namespace quoin {

namespace {

constexpr float kFull = 65'535.0F;  // of LinearRgba16

/// What is wrong with a mesh; null when nothing is.
const char* fault_of(const SmoothMesh& mesh) {
  const std::size_t count = mesh.positions.size();
  if (mesh.normals.size() != count || mesh.albedo.size() != count) return "arrays of different lengths";
  if (!mesh.openness.empty() && mesh.openness.size() != count) return "arrays of different lengths";
  if (mesh.indices.size() % 3 != 0) return "indices that make no whole triangles";
  const auto is_beyond = [count](std::uint32_t index) { return index >= count; };
  if (std::any_of(mesh.indices.begin(), mesh.indices.end(), is_beyond)) return "an index of no vertex";
  const auto is_infinite = [](const Vec3& v) { return !is_finite(DVec3(v)); };
  if (std::any_of(mesh.positions.begin(), mesh.positions.end(), is_infinite)) return "a position that is not finite";
  if (std::any_of(mesh.normals.begin(), mesh.normals.end(), is_infinite)) return "a normal that is not finite";
  const auto is_no_share = [](float openness) { return !(openness >= 0.0F && openness <= 1.0F); };
  if (std::any_of(mesh.openness.begin(), mesh.openness.end(), is_no_share)) return "an openness beyond 0 to 1";
  return nullptr;
}

const char* fault_of(const glm::dmat4& matrix) {
  for (int column = 0; column < 4; ++column) {
    if (!is_finite(DVec3(matrix[column]))) return "a transform that is not finite";
    if (matrix[column].w != (column == 3 ? 1.0 : 0.0)) return "a transform that is not affine";
  }
  // Against the product of the axes' lengths, so that a small scale is not taken for a singular one.
  const double lengths = glm::length(DVec3(matrix[0])) * glm::length(DVec3(matrix[1])) * glm::length(DVec3(matrix[2]));
  const double volume = std::abs(glm::determinant(glm::dmat3(matrix)));
  const bool is_sound = std::isnormal(lengths) && std::isnormal(volume) && volume > 1e-12 * lengths;
  return is_sound ? nullptr : "a transform that is singular";
}

DBox bounds_of(const SmoothMesh& mesh) {
  DBox box;
  for (const Vec3& position : mesh.positions) box.extend(DVec3(position));
  return box;
}

/// Whether floats reach every point of a box once it is moved. Affine images of a box lie between those of its corners.
bool stays_within_floats(const DBox& box, const glm::dmat4& moved_from_box) {
  constexpr double kMost = std::numeric_limits<float>::max();
  for (int i = 0; i < 8; ++i) {
    const DVec3 corner{(i & 1 ? box.max : box.min).x, (i & 2 ? box.max : box.min).y, (i & 4 ? box.max : box.min).z};
    const DVec3 moved(moved_from_box * glm::dvec4(corner, 1.0));
    for (int axis = 0; axis < 3; ++axis) {
      if (!(std::abs(moved[axis]) <= kMost)) return false;
    }
  }
  return true;
}

}  // namespace

const char* fault_of_places(const DBox& bounds, const DVec3& pivot, std::span<const SmoothPlacement> placements) {
  const DBox from_pivot{bounds.min - pivot, bounds.max - pivot};
  for (const SmoothPlacement& placement : placements) {
    if (const char* fault = fault_of(placement.world_from_mesh); fault != nullptr) return fault;
    const bool is_within = bounds.empty() || (stays_within_floats(from_pivot, glm::dmat4(1.0)) &&
                                              stays_within_floats(from_pivot, placement.world_from_mesh));
    if (!is_within) return "a vertex farther away than a float can say";
  }
  return nullptr;
}

Status unsound_part(const std::string& name, const char* fault) {
  return fail(ErrorCode::InvalidArgument, "part \"" + name + "\" has " + fault);
}

Status check_parts(std::span<const SmoothPart> parts) {
  for (const SmoothPart& part : parts) {
    const char* fault = is_finite(part.pivot) ? fault_of(part.mesh) : "a pivot that is not finite";
    if (fault == nullptr) fault = fault_of_places(bounds_of(part.mesh), part.pivot, part.placements);
    if (fault != nullptr) return unsound_part(part.name, fault);
  }
  return {};
}

VertexTransform::VertexTransform(const glm::dmat4& world_from_mesh, DVec3 pivot)
    : linear_(world_from_mesh),
      normal_matrix_(glm::cross(linear_[1], linear_[2]), glm::cross(linear_[2], linear_[0]),
                     glm::cross(linear_[0], linear_[1])),
      translation_(world_from_mesh[3]),
      pivot_(pivot),
      mirrors_(glm::determinant(linear_) < 0.0) {
  // Scaled to about 1, so that squares neither vanish nor overflow.
  double largest = 0.0;
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) largest = std::max(largest, std::abs(normal_matrix_[column][row]));
  }
  normal_matrix_ /= mirrors_ ? -largest : largest;
}

DVec3 VertexTransform::normal(Vec3 in_mesh) const {
  const DVec3 turned = normal_matrix_ * DVec3(in_mesh);
  const double length = glm::length(turned);
  return length > 0.0 ? turned / length : DVec3(0.0, 1.0, 0.0);
}

LinearRgba16 linear_colour(const SmoothMesh& mesh, std::size_t vertex, bool occlusion) {
  const float openness = openness_of(mesh, vertex, occlusion);
  LinearRgba16 colour{0, 0, 0, 65'535};
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const float light = static_cast<float>(mesh.albedo[vertex][channel]) * openness;
    colour[channel] = static_cast<std::uint16_t>(std::lround(light));
  }
  return colour;
}

std::array<std::uint8_t, 3> srgb_colour(const SmoothMesh& mesh, std::size_t vertex, bool occlusion) {
  const SrgbEncoder& encode = SrgbEncoder::shared();
  const float openness = openness_of(mesh, vertex, occlusion);
  std::array<std::uint8_t, 3> colour{};
  for (std::size_t channel = 0; channel < 3; ++channel) {
    colour[channel] = encode(static_cast<float>(mesh.albedo[vertex][channel]) / kFull * openness);
  }
  return colour;
}

}  // namespace quoin
