#include "io/mesh_parts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <glm/matrix.hpp>
#include <quoin/core/assert.h>
#include <quoin/mesh/occlusion.h>

#include "core/srgb.h"

namespace quoin {

std::string UniqueNames::add(const std::string& name, std::string_view separator) {
  const auto [known, is_new] = next_number_.try_emplace(name, 2U);
  if (is_new) return name;
  while (true) {
    std::string numbered = name;
    numbered.append(separator).append(std::to_string(known->second++));
    if (next_number_.try_emplace(numbered, 2U).second) return numbered;
  }
}

void BlockWriter::put(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    if (used_ == kBlockBytes) flush();
    const std::size_t count = std::min(bytes.size(), kBlockBytes - used_);
    std::memcpy(block_.data() + used_, bytes.data(), count);
    used_ += count;
    bytes = bytes.subspan(count);
  }
}

void BlockWriter::align(char filler) {
  while (bytes() % 4 != 0) put(filler);
}

Status BlockWriter::finish() {
  flush();
  return status_;
}

void BlockWriter::flush() {
  if (status_) status_ = sink_(std::span(block_).first(used_));
  written_ += used_;
  used_ = 0;
  if (!status_ || !progress_) return;
  const double done = static_cast<double>(written_) / static_cast<double>(std::max(written_, expected_bytes_));
  if (!progress_(expected_bytes_ == 0 ? 0.0 : done)) status_ = make_error(ErrorCode::Cancelled, "cancelled");
}

namespace {

template <class T>
bool is_one_a_vertex(std::span<const T> values, const MeshView& view) {
  return values.size() == view.positions.size();
}

template <class T>
bool is_none_or_one_a_vertex(std::span<const T> values, const MeshView& view) {
  return values.empty() || is_one_a_vertex(values, view);
}

/// Returns the largest value, or 0 if empty. Has no early exit, so that it runs at memory speed.
template <class T>
T largest_of(std::span<const T> values) {
  T largest{};
  for (const T value : values) largest = std::max(largest, value);
  return largest;
}

bool all_finite(std::span<const Vec3> points) {
  Vec3 zero(0.0F);
  for (const Vec3& point : points) zero += point * 0.0F;  // not 0 once a number is infinite or NaN
  return zero == Vec3(0.0F);
}

const char* find_blocks_error(const MeshView& view, std::size_t types) {
  const bool has_all = is_one_a_vertex(view.directions, view) && is_one_a_vertex(view.types, view) &&
                       is_none_or_one_a_vertex(view.block_occlusion, view) &&
                       is_none_or_one_a_vertex(view.atlas, view) && is_none_or_one_a_vertex(view.looks, view);
  if (!has_all) return "arrays of different lengths";
  if (largest_of(view.types) >= types) return "an unregistered type";
  if (largest_of(view.directions) > Direction::NegZ) return "an invalid direction";
  for (const VertexLook& look : view.looks) {
    if (look.face > view.faces.size()) return "a look that names no face";
    if (!std::isfinite(look.uv[0]) || !std::isfinite(look.uv[1])) return "a texture coordinate that is not finite";
    if (!is_finite(DVec3(look.normal))) return "a normal that is not finite";
  }
  if (!view.looks.empty() && !view.atlas.empty()) return "both looks and an atlas";
  return largest_of(view.block_occlusion) > 3 ? "an occlusion above 3" : nullptr;
}

const char* find_smooth_error(const MeshView& view, std::size_t types) {
  const bool has_all = is_one_a_vertex(view.normals, view) && is_one_a_vertex(view.albedo, view) &&
                       is_none_or_one_a_vertex(view.occlusion, view) && is_none_or_one_a_vertex(view.types, view) &&
                       is_none_or_one_a_vertex(view.materials, view);
  if (!has_all) return "arrays of different lengths";
  if (!view.types.empty() && largest_of(view.types) >= types) return "an unregistered type";
  if (!all_finite(view.normals)) return "a normal that is not finite";
  const auto is_no_share = [](float occlusion) { return !(occlusion >= 0.0F && occlusion <= 1.0F); };
  return std::ranges::any_of(view.occlusion, is_no_share) ? "an occlusion outside 0 to 1" : nullptr;
}

/// Returns a description of a mesh's first fault; null if it is valid.
const char* find_error(const MeshView& view, std::size_t types) {
  if (const char* fault = view.has_albedo() ? find_smooth_error(view, types) : find_blocks_error(view, types))
    return fault;
  if (!is_none_or_one_a_vertex(view.light, view)) return "arrays of different lengths";
  if (!view.light.empty() && !view.atlas.empty()) return "both light and an atlas";
  if (view.indices.size() % 3 != 0) return "an index count that is not a multiple of 3";
  if (!view.indices.empty() && largest_of(view.indices) >= view.positions.size()) return "an index beyond its vertices";
  return all_finite(view.positions) ? nullptr : "a position that is not finite";
}

const char* find_error(const glm::dmat4& matrix) {
  for (int column = 0; column < 4; ++column) {
    if (!is_finite(DVec3(matrix[column]))) return "a transform that is not finite";
    if (matrix[column].w != (column == 3 ? 1.0 : 0.0)) return "a transform that is not affine";
  }
  // Relative to the product of the axes' lengths, so that a small scale does not count as singular.
  const double lengths = glm::length(DVec3(matrix[0])) * glm::length(DVec3(matrix[1])) * glm::length(DVec3(matrix[2]));
  const double volume = std::abs(glm::determinant(glm::dmat3(matrix)));
  const bool is_sound = std::isnormal(lengths) && std::isnormal(volume) && volume > 1e-12 * lengths;
  return is_sound ? nullptr : "a transform that is singular";
}

/// Returns true if floats can represent all points of a transformed box. Affine images of a box lie within the hull of
/// its transformed corners.
bool stays_within_floats(const DBox& box, const glm::dmat4& moved_from_box) {
  constexpr double kMost = std::numeric_limits<float>::max();
  for (int i = 0; i < 8; ++i) {
    const DVec3 moved(moved_from_box * glm::dvec4(box_corner(box, i), 1.0));
    for (int axis = 0; axis < 3; ++axis) {
      if (!(std::abs(moved[axis]) <= kMost)) return false;
    }
  }
  return true;
}

/// Returns a description of a fault in a part's position; null if it is valid.
const char* find_place_error(const DBox& bounds, const DVec3& pivot, const glm::dmat4& world_from_part) {
  if (const char* fault = find_error(world_from_part)) return fault;
  const DBox from_pivot{bounds.min - pivot, bounds.max - pivot};
  const bool is_within = bounds.empty() || (stays_within_floats(from_pivot, glm::dmat4(1.0)) &&
                                            stays_within_floats(from_pivot, world_from_part));
  return is_within ? nullptr : "a vertex too far away for a float";
}

/// Returns a description of a fault in a placement's keys; null if they are valid.
const char* find_keys_error(const DBox& bounds, const DVec3& pivot, const MeshPlacement& placement) {
  const bool mirrors = glm::determinant(glm::dmat3(placement.matrix())) < 0.0;
  // Files store times as floats.
  float last = 0.0F;
  for (const MeshKey& key : placement.keys) {
    const bool is_first = &key == &placement.keys.front();
    const auto seconds = static_cast<float>(key.seconds);
    if (!(is_first ? seconds == 0.0F : seconds > last) || !std::isfinite(seconds)) {
      return "keys whose times do not ascend from 0 seconds";
    }
    last = seconds;
    if (key.world_from_part.mirrored != mirrors) return "a key whose mirroring differs from its placement's";
    MeshPlacement at;
    at.world_from_part = key.world_from_part;
    if (const char* fault = find_place_error(bounds, pivot, at.matrix())) return fault;
  }
  return nullptr;
}

/// Returns a contradiction to the atlas: if some opaque blocks of a scene use it, all must. Null if there is none.
const char* find_atlas_error(const MeshView& view, const Image& atlas) {
  const auto is_outside = [](const std::array<float, 2>& uv) {
    return !(uv[0] >= 0.0F && uv[0] <= 1.0F && uv[1] >= 0.0F && uv[1] <= 1.0F);
  };
  if (std::ranges::any_of(view.atlas, is_outside)) return "a texture coordinate outside 0 to 1";
  if (!view.atlas.empty() && view.surface != SurfaceClass::Opaque) return "an atlas on a surface that is not opaque";
  if (!view.atlas.empty() && !view.block_occlusion.empty()) return "both occlusion and an atlas";
  if (!view.atlas.empty() && atlas.rgb.empty()) return "atlas coordinates, and there is no atlas";
  const bool is_left_out = view.atlas.empty() && !view.positions.empty() && view.surface == SurfaceClass::Opaque;
  return is_left_out && !view.has_albedo() && !atlas.rgb.empty() ? "opaque blocks that are not in the atlas" : nullptr;
}

Status unsound(const MeshPart& part, const char* fault) {
  return make_error(ErrorCode::InvalidArgument, "part \"" + part.name + "\" has " + fault);
}

/// Checks a part, and appends its bounds if it is valid.
Status check_part(const MeshPart& part, const SceneMeshes& meshes, std::vector<DBox>& bounds) {
  if (!is_finite(part.pivot)) return unsound(part, "a pivot that is not finite");
  DBox& box = bounds.emplace_back();
  for (const MeshView& view : part.surfaces) {
    if (view.has_albedo() != part.surfaces.front().has_albedo())
      return unsound(part, "surfaces with and without their own colours");
    if (const char* fault = find_error(view, meshes.types.size())) return unsound(part, fault);
    if (const char* fault = find_atlas_error(view, meshes.atlas)) return unsound(part, fault);
    if (view.positions.empty()) continue;
    const DBox more = bounds_of(view);
    box.extend(more.min);
    box.extend(more.max);
  }
  return {};
}

}  // namespace

namespace {

bool is_lit_throughout(const MeshPart& part) {
  return std::ranges::all_of(part.surfaces,
                             [](const MeshView& view) { return view.positions.empty() || !view.light.empty(); });
}

Status check_groups(const std::vector<MeshGroup>& groups) {
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const Similarity& place = groups[i].world_from_group;
    const DQuat& q = place.rotation;
    const bool is_sound = is_finite(place.position) && is_finite({q.x, q.y, q.z}) && std::isfinite(q.w);
    if (is_sound && (!groups[i].parent || *groups[i].parent < i)) continue;
    const char* what = is_sound ? "has a parent that does not come before it" : "has a placement that is not finite";
    return make_error(ErrorCode::InvalidArgument, "group \"" + groups[i].name + "\" " + what);
  }
  return {};
}

}  // namespace

bool has_light(const SceneMeshes& meshes) {
  return std::ranges::any_of(meshes.parts, [](const MeshPart& part) {
    return std::ranges::any_of(part.surfaces, [](const MeshView& view) { return !view.light.empty(); });
  });
}

Status check_meshes(const SceneMeshes& meshes) {
  if (!(meshes.seconds >= 0.0) || !std::isfinite(static_cast<float>(meshes.seconds))) {
    return make_error(ErrorCode::InvalidArgument, "the length of the animation is not a finite number of seconds");
  }
  const Image& atlas = meshes.atlas;
  const bool is_sound = atlas.width >= 0 && atlas.height >= 0 &&
                        atlas.rgb.size() == std::size_t{3} * static_cast<std::size_t>(atlas.width) *
                                                static_cast<std::size_t>(atlas.height);
  if (!is_sound) return make_error(ErrorCode::InvalidArgument, "the atlas does not have width x height pixels");
  const bool is_lit = has_light(meshes);
  std::vector<DBox> bounds;
  for (const MeshPart& part : meshes.parts) {
    if (auto sound = check_part(part, meshes, bounds); !sound) return sound;
    if (is_lit && !is_lit_throughout(part)) return unsound(part, "no light, and other parts have light");
  }
  for (const MeshPlacement& placement : meshes.placements) {
    if (placement.part >= meshes.parts.size()) {
      return make_error(ErrorCode::InvalidArgument,
                        "placement \"" + placement.name + "\" has a part that does not exist");
    }
    const MeshPart& part = meshes.parts[placement.part];
    const char* fault = find_place_error(bounds[placement.part], part.pivot, placement.matrix());
    if (fault == nullptr) fault = find_keys_error(bounds[placement.part], part.pivot, placement);
    if (fault != nullptr) return unsound(part, fault);
    if (placement.group && *placement.group >= meshes.groups.size()) {
      return make_error(ErrorCode::InvalidArgument,
                        "placement \"" + placement.name + "\" has a group that does not exist");
    }
  }
  return check_groups(meshes.groups);
}

DBox bounds_of(const MeshView& view) {
  DBox box;
  if (view.positions.empty()) return box;
  Vec3 min = view.positions.front();
  Vec3 max = min;
  for (const Vec3& position : view.positions) {
    min = glm::min(min, position);
    max = glm::max(max, position);
  }
  return {DVec3(min), DVec3(max)};
}

std::vector<const MeshPlacement*> placements_by_part(const SceneMeshes& meshes) {
  std::vector<const MeshPlacement*> placements;
  placements.reserve(meshes.placements.size());
  for (const MeshPlacement& placement : meshes.placements) placements.push_back(&placement);
  std::ranges::stable_sort(placements, {}, &MeshPlacement::part);
  return placements;
}

const std::string& name_of(const SceneMeshes& meshes, const MeshPlacement& placement) {
  QUOIN_ASSERT(placement.part < meshes.parts.size(), "a part of the meshes");
  return placement.name.empty() ? meshes.parts[placement.part].name : placement.name;
}

VertexTransform::VertexTransform(const glm::dmat4& world_from_part, DVec3 pivot)
    : linear_(world_from_part),
      normal_matrix_(glm::cross(linear_[1], linear_[2]), glm::cross(linear_[2], linear_[0]),
                     glm::cross(linear_[0], linear_[1])),
      translation_(world_from_part[3]),
      pivot_(pivot),
      mirrors_(glm::determinant(linear_) < 0.0) {
  QUOIN_ASSERT(glm::determinant(linear_) != 0.0, "a linear part that is not singular");
  // Scaled to about 1, so that squares neither underflow nor overflow.
  double largest = 0.0;
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) largest = std::max(largest, std::abs(normal_matrix_[column][row]));
  }
  normal_matrix_ /= mirrors_ ? -largest : largest;
}

glm::dmat4 VertexTransform::part_from_position() const {
  const glm::dmat3 back = glm::inverse(linear_);
  glm::dmat4 matrix(back);
  matrix[3] = glm::dvec4(pivot_ - back * translation_, 1.0);
  return matrix;
}

double VertexTransform::least_step() const {
  return std::min({glm::length(linear_[0]), glm::length(linear_[1]), glm::length(linear_[2])});
}

VertexTransform VertexTransform::relative_to(const DVec3& origin) const {
  VertexTransform moved = *this;
  moved.translation_ -= origin;
  return moved;
}

DBox bounds_of(const MeshPart& part, const VertexTransform& transform) {
  DBox box;
  for (const MeshView& view : part.surfaces) {
    if (view.positions.empty()) continue;
    const DBox own = bounds_of(view);
    for (int i = 0; i < 8; ++i) box.extend(transform.position(Vec3(box_corner(own, i))));
  }
  return box;
}

DVec3 float_origin(const DBox& bounds, double most) {
  QUOIN_ASSERT(most > 0.0, "a positive distance");
  if (bounds.empty()) return DVec3(0.0);
  const DVec3 far = glm::max(glm::abs(bounds.min), glm::abs(bounds.max));
  if (std::max({far.x, far.y, far.z}) <= most) return DVec3(0.0);
  return glm::round(0.5 * (bounds.min + bounds.max));
}

DVec3 file_origin(const SceneMeshes& meshes, double most_steps) {
  DBox all;
  double step = std::numeric_limits<double>::infinity();
  for (const MeshPlacement& placement : meshes.placements) {
    QUOIN_ASSERT(placement.part < meshes.parts.size(), "a part of the meshes");
    const MeshPart& part = meshes.parts[placement.part];
    const VertexTransform transform(placement.matrix(), part.pivot);
    const DBox box = bounds_of(part, transform);
    if (box.empty()) continue;
    all.extend(box.min);
    all.extend(box.max);
    step = std::min(step, transform.least_step());
  }
  return float_origin(all, most_steps * step);
}

DVec3 VertexTransform::normal(Vec3 in_part) const {
  const DVec3 turned = normal_matrix_ * DVec3(in_part);
  const double length = glm::length(turned);
  return length > 0.0 ? turned / length : DVec3(0.0, 1.0, 0.0);
}

std::array<Vec3, 6> VertexTransform::face_normals() const {
  std::array<Vec3, 6> normals{};
  for (const Direction direction : kDirections) {
    normals[static_cast<std::size_t>(direction)] = Vec3(normal(Vec3(normal_of(direction))));
  }
  return normals;
}

float openness_at(const MeshView& view, std::size_t vertex) {
  QUOIN_ASSERT(vertex < view.positions.size(), "a vertex of the surface");
  if (!view.block_occlusion.empty()) return occlusion_brightness(view.block_occlusion[vertex]);
  return view.occlusion.empty() ? 1.0F : 1.0F - view.occlusion[vertex];
}

MeshView without_occlusion(const MeshView& view) {
  MeshView plain = view;
  plain.block_occlusion = {};
  plain.atlas = {};
  plain.occlusion = {};
  return plain;
}

LinearRgba16 linear_colour(const MeshView& view, std::size_t vertex) {
  QUOIN_ASSERT(vertex < view.albedo.size(), "a vertex with a colour");
  const float open = view.occlusion.empty() ? 1.0F : 1.0F - view.occlusion[vertex];
  LinearRgba16 colour{0, 0, 0, 65'535};
  if (is_transparent(view.surface)) colour[3] = view.albedo[vertex][3];
  for (std::size_t channel = 0; channel < 3; ++channel) {
    float light = static_cast<float>(view.albedo[vertex][channel]) * open;
    if (!view.light.empty()) light *= static_cast<float>(view.light[vertex][channel]) * (1.0F / 65'535.0F);
    colour[channel] = static_cast<std::uint16_t>(std::lround(light));
  }
  return colour;
}

std::array<std::uint8_t, 3> srgb_colour(const MeshView& view, std::size_t vertex) {
  QUOIN_ASSERT(vertex < view.albedo.size(), "a vertex with a colour");
  constexpr float kFull = 65'535.0F;  // the maximum value of LinearRgba16
  const SrgbEncoder& encode = SrgbEncoder::shared();
  const float open = view.occlusion.empty() ? 1.0F : 1.0F - view.occlusion[vertex];
  std::array<std::uint8_t, 3> colour{};
  for (std::size_t channel = 0; channel < 3; ++channel) {
    colour[channel] = encode(static_cast<float>(view.albedo[vertex][channel]) / kFull * open);
  }
  return colour;
}

}  // namespace quoin
