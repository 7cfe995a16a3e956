#include "io/nifti_placement.h"

#include <cmath>
#include <glm/matrix.hpp>
#include <optional>

namespace quoin::nifti {

namespace {

bool is_sound(const glm::dmat4& affine) {
  for (int column = 0; column < 4; ++column) {
    if (!is_finite(DVec3(affine[column]))) return false;
  }
  const double volume = std::abs(glm::determinant(glm::dmat3(affine)));
  const double box = glm::length(DVec3(affine[0])) * glm::length(DVec3(affine[1])) * glm::length(DVec3(affine[2]));
  constexpr double kFlattest = 1e-6;
  return std::isfinite(box) && box > 0.0 && volume > kFlattest * box;
}

/// pixdim without the signs that some programs give it; 1 where it says nothing.
DVec3 spacing_of(const Fields& fields, std::vector<std::string>& warnings) {
  DVec3 spacing(1.0);
  bool is_amiss = false;
  for (int axis = 0; axis < 3; ++axis) {
    const double said = std::abs(fields.real(kPixdim, static_cast<std::size_t>(axis) + 1));
    const bool is_good = is_distance(said);
    if (is_good) spacing[axis] = said;
    // Axes that have one sample need no spacing.
    is_amiss |= !is_good && axis < fields.dim(0);
  }
  if (is_amiss) warnings.emplace_back("pixdim is no distance; 1 is taken");
  return spacing;
}

glm::dmat4 sform(const Fields& fields) {
  glm::dmat4 affine(1.0);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      affine[column][row] = fields.real(kSrow, static_cast<std::size_t>(4 * row + column));
    }
  }
  return affine;
}

glm::dmat4 qform(const Fields& fields, DVec3 spacing) {
  const DVec3 turn(fields.real(kQuaternion, 0), fields.real(kQuaternion, 1), fields.real(kQuaternion, 2));
  const double rest = 1.0 - glm::dot(turn, turn);
  // Rounding may leave no room for the real part: a half turn.
  const DQuat quaternion = rest > 0.0 ? DQuat(std::sqrt(rest), turn) : DQuat(0.0, glm::normalize(turn));
  const double qfac = fields.real(kPixdim) < 0.0 ? -1.0 : 1.0;
  const glm::dmat3 rotation = glm::mat3_cast(quaternion);
  glm::dmat4 affine(1.0);
  affine[0] = glm::dvec4(rotation[0] * spacing.x, 0.0);
  affine[1] = glm::dvec4(rotation[1] * spacing.y, 0.0);
  affine[2] = glm::dvec4(rotation[2] * (spacing.z * qfac), 0.0);
  affine[3] = glm::dvec4(fields.real(kQoffset, 0), fields.real(kQoffset, 1), fields.real(kQoffset, 2), 1.0);
  return affine;
}

/// The first of sform and qform that the header gives and that places samples in space.
std::optional<glm::dmat4> given(const Fields& fields, DVec3 spacing, std::vector<std::string>& warnings) {
  if (fields.code(kSformCode) > 0) {
    const glm::dmat4 affine = sform(fields);
    if (is_sound(affine)) return affine;
    warnings.emplace_back("the sform places no sample; it is left out");
  }
  if (fields.code(kQformCode) > 0) {
    const glm::dmat4 affine = qform(fields, spacing);
    if (is_sound(affine)) return affine;
    warnings.emplace_back("the qform places no sample; it is left out");
  }
  return std::nullopt;
}

}  // namespace

void place(const Fields& fields, Volume& volume) {
  volume.spacing = spacing_of(fields, volume.warnings);
  glm::dmat4 ras_from_voxel(1.0);
  if (const auto affine = given(fields, volume.spacing, volume.warnings)) {
    ras_from_voxel = *affine;
  } else {
    for (int axis = 0; axis < 3; ++axis) ras_from_voxel[axis][axis] = volume.spacing[axis];
  }
  for (int axis = 0; axis < 3; ++axis) {
    const double length = glm::length(DVec3(ras_from_voxel[axis]));
    constexpr double kRounding = 1e-3;
    // What places the samples is what counts.
    if (std::abs(length - volume.spacing[axis]) > kRounding * length) volume.spacing[axis] = length;
  }
  volume.world_from_voxel = quoin_from_space(VolumeSpace::RightFrontHead) * ras_from_voxel;
}

}  // namespace quoin::nifti
