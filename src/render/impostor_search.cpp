#include "render/impostor_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace quoin {
namespace {

constexpr int kEdge = Impostor::kEdge;
constexpr double kHalf = 0.5 * kEdge;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLeastStep = 0.5;  // texels
// How deep a ray goes into what no view saw empty before it is taken for solid.
constexpr double kDeepTexels = 2.0;
constexpr double kDeepVoxels = 1.0;
// Texels: how far from a texel's point its face is taken to reach where voxels are smaller than texels.
constexpr double kRoom = 0.75;

// Texels and voxels: how much further or nearer than a point a texel may have seen a face that is crossed there.
constexpr double kAboutTexels = 3.0;
constexpr double kAboutVoxels = 2.0;

// Requires: it is within the range of integers. Several times as fast as the library's.
double floor_of(double value) {
  const auto whole = static_cast<double>(static_cast<std::int64_t>(value));
  return whole > value ? whole - 1.0 : whole;
}

// 1 / |(x, y, focal)| by its series: exact to 1e-8 within a snapshot, where the angle is below 11 degrees.
double inverse_length(double x, double y, double focal) {
  const double inverse = 1.0 / focal;
  const double s = (x * x + y * y) * inverse * inverse;
  return inverse * (1.0 - s * (0.5 - s * (0.375 - s * (0.3125 - s * 0.2734375))));
}

// The indices of the views by their dot product with a direction, largest first, the first one on ties.
std::array<int, kImpostorViews> views_by_nearness(DVec3 direction) {
  std::array<int, kImpostorViews> order{};
  std::array<double, kImpostorViews> product{};
  for (int i = 0; i < kImpostorViews; ++i) {
    const auto index = static_cast<std::size_t>(i);
    order[index] = i;
    product[index] = glm::dot(direction, impostor_view(i));
  }
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return product[static_cast<std::size_t>(a)] > product[static_cast<std::size_t>(b)];
  });
  return order;
}

}  // namespace

// One ray on its way, in voxels.
struct ImpostorSearch::March {
  DVec3 origin{0.0};
  DVec3 unit{0.0};
  DVec3 inverse{0.0};  // 1 / unit
  double end = 0.0;
  std::array<Line, kViews> lines{};
  std::size_t known_lines = 0;
};

ImpostorSearch::ImpostorSearch(const Impostor& impostor, DVec3 towards_camera) : impostor_(&impostor) {
  const DVec3 size = glm::abs(towards_camera);
  const auto order = views_by_nearness(towards_camera / std::max({size.x, size.y, size.z}));
  for (std::size_t i = 0; i < kViews; ++i) {
    Eye& eye = eyes_[i];
    const auto view = static_cast<std::size_t>(order[i]);
    eye.view = order[i];
    eye.camera = impostor.cameras_[view];
    eye.depth = impostor.depth_.data() + view * Impostor::kTexels;
    eye.clear_depth = impostor.clear_depth_.data() + view * Impostor::kTiles;
    eye.near_depth = impostor.near_depth_.data() + view * Impostor::kPairs;
    eye.faces = impostor.faces_.data() + view * Impostor::kTexels;
  }
  texel_ = eyes_[0].camera.half_size() / kHalf;
  step_ = kLeastStep * texel_;
  room_ = texel_ > 1.0 ? kRoom * texel_ : 0.0;
  about_ = kAboutTexels * texel_ + kAboutVoxels;
}

ImpostorSearch::Line ImpostorSearch::line_of(const Eye& eye, const March& march) const {
  const SnapshotCamera& camera = eye.camera;
  const DVec3 unit = march.unit;
  const DVec3 from_eye = march.origin - camera.position;
  Line line;
  line.origin = {glm::dot(camera.right, from_eye) * camera.focal, -glm::dot(camera.up, from_eye) * camera.focal,
                 glm::dot(camera.forward, from_eye)};
  line.direction = {glm::dot(camera.right, unit) * camera.focal, -glm::dot(camera.up, unit) * camera.focal,
                    glm::dot(camera.forward, unit)};
  const double straight = line.direction.z;
  line.lateral = texel_ / std::sqrt(std::max(1.0 - straight * straight, 1e-4));
  return line;
}

ImpostorSearch::Look ImpostorSearch::look(const Eye& eye, const Line& line, double at) {
  const double x = line.origin.x + at * line.direction.x;
  const double y = line.origin.y + at * line.direction.y;
  const double z = line.origin.z + at * line.direction.z;
  const double inverse = 1.0 / z;
  const double column = x * inverse;
  const double row = y * inverse;
  Look found;
  if (!(std::abs(column) < kHalf && std::abs(row) < kHalf)) {
    found.clear = line.lateral;
    return found;
  }
  const int texel_column = static_cast<int>(column + kHalf);
  const int texel_row = static_cast<int>(row + kHalf);
  found.texel = texel_row * kEdge + texel_column;
  // |(x, y, z)| by its series, exact to 1e-6 of a voxel's share within a snapshot: the angle is below 8 degrees.
  const double slope = (column * column + row * row) / (eye.camera.focal * eye.camera.focal);
  const double distance = z * (1.0 + slope * (0.5 - 0.125 * slope));
  constexpr int kTile = Impostor::kTile;
  const int tile = texel_row / kTile * (kEdge / kTile) + texel_column / kTile;
  constexpr int kPair = Impostor::kPair;
  const int pair = texel_row / kPair * (kEdge / kPair) + texel_column / kPair;
  const double wide = static_cast<double>(eye.clear_depth[tile]) - distance;
  const double about = static_cast<double>(eye.near_depth[pair]) - distance;
  const double narrow = static_cast<double>(eye.depth[found.texel]) - distance;
  found.distance = distance;
  found.is_near = !(about > 0.0);
  found.clear = std::max(
      {std::min(wide, kTile * line.lateral), std::min(about, kPair * line.lateral), std::min(narrow, line.lateral)});
  return found;
}

bool ImpostorSearch::clip(DVec3 origin, const March& march, double& begin, double& end) const {
  const IBox& box = impostor_->box();
  for (int axis = 0; axis < 3; ++axis) {
    const double low = box.min[axis] - origin[axis];
    const double high = box.max[axis] - origin[axis];
    if (march.unit[axis] == 0.0) {
      if (low > 0.0 || high < 0.0) return false;
      continue;
    }
    const double a = low * march.inverse[axis];
    const double b = high * march.inverse[axis];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  return begin <= end;
}

bool ImpostorSearch::crosses(const March& march, const Eye& eye, std::int32_t texel, double& at) const {
  const FaceFrame& frame = frame_of(eye.faces[texel]);
  const double slope = march.unit[frame.axis];
  if (slope * frame.sign >= 0.0) return false;
  const SnapshotCamera& camera = eye.camera;
  const double x = texel % kEdge + 0.5 - kHalf;
  const double y = kHalf - (texel / kEdge + 0.5);
  const double scale = static_cast<double>(eye.depth[texel]) * inverse_length(x, y, camera.focal);
  const auto seen = [&](int axis) {
    const double along = camera.right[axis] * x + camera.up[axis] * y + camera.forward[axis] * camera.focal;
    return camera.position[axis] + along * scale;
  };
  at = (floor_of(seen(frame.axis) + 0.5) - march.origin[frame.axis]) * march.inverse[frame.axis];
  // First, since elsewhere the numbers below may be too large for integers.
  if (!(at >= -step_ && at <= march.end + step_)) return false;
  for (const int axis : {frame.u, frame.v}) {
    const double centre = seen(axis);
    const double crossing = march.origin[axis] + at * march.unit[axis];
    if (floor_of(centre) != floor_of(crossing) && !(std::abs(centre - crossing) <= room_)) return false;
  }
  return true;
}

bool ImpostorSearch::crosses_nearby(const March& march, const Eye& eye, const Look& look, FoundTexel& found) const {
  found.view = eye.view;
  found.texel = look.texel;
  const auto is_about = [&](std::int32_t texel) {
    return std::abs(static_cast<double>(eye.depth[texel]) - look.distance) <= about_;
  };
  if (is_about(look.texel) && crosses(march, eye, look.texel, found.t)) return true;
  double nearest = kInfinity;
  const int column = look.texel % kEdge;
  const int row = look.texel / kEdge;
  for (int y = std::max(row - 1, 0); y <= std::min(row + 1, kEdge - 1); ++y) {
    for (int x = std::max(column - 1, 0); x <= std::min(column + 1, kEdge - 1); ++x) {
      double at = 0.0;
      const std::int32_t texel = y * kEdge + x;
      if (texel == look.texel || !is_about(texel) || !crosses(march, eye, texel, at) || at >= nearest) continue;
      nearest = found.t = at;
      found.texel = texel;
    }
  }
  return nearest < kInfinity;
}

void ImpostorSearch::settle(const March& march, const std::array<Look, kViews>& looks, double at,
                            FoundTexel& found) const {
  std::size_t best = 0;
  double highest = -kInfinity;
  for (std::size_t i = 0; i < kViews; ++i) {
    if (looks[i].texel < 0) continue;
    // Rather a face that looks towards the ray's origin; then the least far behind what was seen.
    const FaceFrame& frame = frame_of(eyes_[i].faces[looks[i].texel]);
    const bool faces_away = march.unit[frame.axis] * frame.sign >= 0.0;
    const double merit = looks[i].clear - (faces_away ? 1e3 * texel_ : 0.0);
    if (merit > highest) best = i, highest = merit;
  }
  found = {at, eyes_[best].view, looks[best].texel};
}

bool ImpostorSearch::walk(March& march, FoundTexel& found) const {
  const double deep = kDeepTexels * texel_ + kDeepVoxels;
  std::array<Look, kViews> looks;
  std::array<std::int32_t, kViews> tried;
  tried.fill(-1);
  FoundTexel entered;
  double entered_at = -1.0;
  for (double at = 0.0; at <= march.end;) {
    double clear = 0.0;
    for (std::size_t i = 0; i < kViews; ++i) {
      if (i == march.known_lines) march.lines[march.known_lines++] = line_of(eyes_[i], march);
      looks[i] = look(eyes_[i], march.lines[i], at);
      clear = std::max(clear, looks[i].clear);
      if (!looks[i].is_near) break;
      if (looks[i].texel == tried[i]) continue;
      tried[i] = looks[i].texel;
      if (crosses_nearby(march, eyes_[i], looks[i], found)) return true;
    }
    if (clear > 0.0) {
      entered_at = -1.0;
    } else {
      if (entered_at < 0.0) entered_at = at, settle(march, looks, at, entered);
      if (at - entered_at > deep) return found = entered, true;
    }
    at += std::max(clear, step_);
  }
  return false;
}

bool ImpostorSearch::find(DVec3 origin, DVec3 direction, double max_t, FoundTexel& found) const {
  const double length = glm::length(direction);
  March march;
  march.unit = direction / length;
  march.inverse = 1.0 / march.unit;
  double begin = 0.0;
  double end = kInfinity;
  // What lies further in is searched to its end, so that the answer does not depend on what was found before.
  if (!clip(origin, march, begin, end) || begin > max_t * length) return false;
  // From where it enters: what follows is then as exact far away as it is near.
  march.origin = origin + march.unit * begin;
  march.end = end - begin;
  if (!walk(march, found)) return false;
  found.t = (begin + std::max(found.t, 0.0)) / length;
  return found.t <= max_t;
}

}  // namespace quoin
