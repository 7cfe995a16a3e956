#include "io/nrrd_placement.h"

#include <cmath>
#include <glm/matrix.hpp>

#include "io/text.h"

namespace quoin::nrrd {

namespace {

tl::unexpected<Error> bad(std::string message, const Field& field) {
  return fail(ErrorCode::BadFormat, std::move(message), {}, field.at);
}

tl::unexpected<Error> unsupported(std::string message, const Field& field) {
  return fail(ErrorCode::Unsupported, std::move(message), {}, field.at);
}

Result<VolumeSpace> space_of(const Fields& fields) {
  if (const Field* dimension = fields.find("spacedimension"); dimension != nullptr && dimension->text != "3") {
    return unsupported("the space has " + printable(dimension->text) + " dimensions; only 3 are read", *dimension);
  }
  const Field* field = fields.find("space");
  if (field == nullptr) return VolumeSpace::RightHanded;
  const std::string space = normalised(field->text);
  if (space == "right-anterior-superior" || space == "ras") return VolumeSpace::RightFrontHead;
  if (space == "left-anterior-superior" || space == "las") return VolumeSpace::LeftFrontHead;
  if (space == "left-posterior-superior" || space == "lps") return VolumeSpace::LeftBackHead;
  if (space == "scanner-xyz" || space == "3d-right-handed") return VolumeSpace::RightHanded;
  if (space == "3d-left-handed") return VolumeSpace::LeftHanded;
  return unsupported("the space is \"" + printable(field->text) + "\", which is none of three dimensions", *field);
}

/// Kinds of axes that are not space.
bool is_spatial(std::string_view kind) {
  const std::string name = normalised(kind);
  return name == "domain" || name == "space" || name == "???" || name == "none";
}

/// Values of several components, and slices in time, come before space in some files.
Status check_kinds(const Fields& fields) {
  const Field* field = fields.find("kinds");
  if (field == nullptr) return {};
  const auto kinds = words_of(field->text);
  for (std::size_t axis = 0; axis < kinds.size() && axis < 3; ++axis) {
    if (!is_spatial(kinds[axis])) {
      return unsupported("axis " + std::to_string(axis + 1) + " is of kind \"" + printable(kinds[axis]) +
                             "\"; the first three must be space",
                         *field);
    }
  }
  return {};
}

bool is_vector(const std::vector<double>& numbers) {
  return numbers.size() == 3 && is_finite({numbers[0], numbers[1], numbers[2]});
}

Status read_directions(const Field& field, std::size_t dimensions, glm::dmat4& space_from_voxel) {
  const auto vectors = parse_vectors(field.text);
  if (!vectors || vectors->size() != dimensions) {
    return bad("the space directions are not " + std::to_string(dimensions) + " vectors", field);
  }
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double>& v = (*vectors)[static_cast<std::size_t>(axis)];
    if (v.empty()) {
      return unsupported("axis " + std::to_string(axis + 1) + " has no direction; the first three must be space",
                         field);
    }
    if (!is_vector(v)) return bad("a space direction is no vector of 3 finite numbers", field);
    space_from_voxel[axis] = glm::dvec4(v[0], v[1], v[2], 0.0);
  }
  const glm::dmat3 turn(space_from_voxel);
  const double box = glm::length(turn[0]) * glm::length(turn[1]) * glm::length(turn[2]);
  constexpr double kFlattest = 1e-6;
  if (std::isfinite(box) && std::abs(glm::determinant(turn)) > kFlattest * box) return {};
  return bad("the space directions do not span a space", field);
}

Status read_origin(const Fields& fields, glm::dmat4& space_from_voxel) {
  const Field* field = fields.find("spaceorigin");
  if (field == nullptr) return {};
  const auto vectors = parse_vectors(field->text);
  if (!vectors || vectors->size() != 1 || !is_vector(vectors->front())) {
    return bad("the space origin is no vector of 3 finite numbers", *field);
  }
  const std::vector<double>& v = vectors->front();
  space_from_voxel[3] = glm::dvec4(v[0], v[1], v[2], 1.0);
  return {};
}

Status read_spacings(const Field& field, std::size_t dimensions, Volume& volume) {
  const auto words = words_of(field.text);
  if (words.size() != dimensions) {
    return bad("the spacings are not " + std::to_string(dimensions) + " numbers", field);
  }
  bool is_amiss = false;
  for (int axis = 0; axis < 3; ++axis) {
    const auto number = parse_number(words[static_cast<std::size_t>(axis)]);
    if (!number) return bad("the spacings are not " + std::to_string(dimensions) + " numbers", field);
    const double spacing = std::abs(*number);
    const bool is_good = is_distance(spacing);
    volume.spacing[axis] = is_good ? spacing : 1.0;
    is_amiss |= !is_good;
  }
  if (is_amiss) volume.warnings.emplace_back("a spacing is no distance; 1 is taken");
  return {};
}

/// "mm" from "\"mm\" \"mm\" \"mm\"".
std::string units_of(const Fields& fields) {
  const Field* field = fields.find("spaceunits");
  if (field == nullptr) field = fields.find("units");
  if (field == nullptr) return {};
  const std::size_t open = field->text.find('"');
  if (open == std::string_view::npos) return {};
  const std::size_t close = field->text.find('"', open + 1);
  if (close == std::string_view::npos) return {};
  return printable(field->text.substr(open + 1, close - open - 1));
}

}  // namespace

Status place(const Fields& fields, std::size_t dimensions, Volume& volume) {
  if (auto status = check_kinds(fields); !status) return status;
  const auto space = space_of(fields);
  if (!space) return tl::unexpected<Error>(space.error());
  glm::dmat4 space_from_voxel(1.0);
  if (const Field* directions = fields.find("spacedirections")) {
    if (auto status = read_directions(*directions, dimensions, space_from_voxel); !status) return status;
    for (int axis = 0; axis < 3; ++axis) volume.spacing[axis] = glm::length(DVec3(space_from_voxel[axis]));
  } else {
    if (const Field* spacings = fields.find("spacings")) {
      if (auto status = read_spacings(*spacings, dimensions, volume); !status) return status;
    }
    for (int axis = 0; axis < 3; ++axis) space_from_voxel[axis][axis] = volume.spacing[axis];
  }
  if (auto status = read_origin(fields, space_from_voxel); !status) return status;
  volume.world_from_voxel = quoin_from_space(*space) * space_from_voxel;
  volume.units = units_of(fields);
  return {};
}

}  // namespace quoin::nrrd
