#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/hash.h>
#include <quoin/mesh/smooth_mesh.h>

#include "mesh/surface/simplify.h"

#ifdef QUOIN_HAVE_MESHOPTIMIZER
#include <meshoptimizer.h>

#include "mesh/surface/smooth_surface.h"
#endif

namespace quoin {

#ifdef QUOIN_HAVE_MESHOPTIMIZER

namespace {

#if QUOIN_ASSERT_ENABLED
bool has_arrays_of_one_length(const SmoothMesh& mesh) {
  const std::size_t count = mesh.positions.size();
  return mesh.normals.size() == count && mesh.albedo.size() == count && mesh.types.size() == count &&
         (mesh.occlusion.empty() || mesh.occlusion.size() == count) &&
         (mesh.materials.empty() || mesh.materials.size() == count);
}

bool names_vertices(const SmoothMesh& mesh) {
  return std::all_of(mesh.indices.begin(), mesh.indices.end(),
                     [&](std::uint32_t index) { return index < mesh.positions.size(); });
}

bool has_finite_positions(const SmoothMesh& mesh) {
  return std::all_of(mesh.positions.begin(), mesh.positions.end(),
                     [](Vec3 p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); });
}
#endif

/// The distance between vertices at one position that must stay separate.
constexpr float kCopyDistance = 1.0F / 1024.0F;
/// The share of the error that the library may use. The library bounds a mean of squares, and single vertices of smooth
/// surfaces deviate up to twice as far.
constexpr float kMeanShare = 0.8F;
/// The ratio between consecutive error levels for the library. A larger step makes the number of triangles jump up and
/// down as the error grows.
constexpr float kLevelShare = 0.84F;
constexpr int kLevels = 16;
/// If at most one in this number of positions deviates too far, the mesh stays unchanged around these positions.
/// Otherwise the next level is tried.
constexpr std::size_t kFewPlaces = 20;
/// The number of rounds at one level; all except the first have triangles that stay. A sample has fewer positions that
/// may deviate too far.
constexpr int kRounds = 8;
constexpr int kRoundsOfSample = 4;
/// The number of rounds in which most triangles stay. Used if no level has few positions that deviate too far, as for
/// meshes that are curved everywhere. After the first rounds, each round uses the next level.
constexpr int kMostStayRounds = 12;
constexpr int kRoundsOfFirstLevel = 4;
/// A value in place of a level's number, for such a search.
constexpr int kMostStay = kLevels;
/// If an attempt removes at most one in this number of triangles and deviates too far, it is the last one.
constexpr std::size_t kHardlyAny = 1'000;
/// The level of a mesh with more triangles than this is determined on a sample of about this size.
constexpr std::size_t kSampleTriangles = 12'000;
constexpr std::size_t kLeastSampled = 4 * kSampleTriangles;
/// The edge length of the sample's boxes, in samples of the field.
constexpr double kSampleBox = 12.0;
/// The minimum number of these boxes: one box says little about the others.
constexpr int kSampleBoxes = 16;
/// If the sample loses at most one in this number of triangles, the mesh cannot be simplified.
constexpr std::size_t kLeastLoss = 100;

/// Returns, for each vertex, the first vertex at its position. Colours and normals may have split a position into
/// several vertices.
std::vector<std::uint32_t> places_of(const SmoothMesh& mesh) {
  std::vector<std::uint32_t> place(mesh.positions.size());
  meshopt_generateVertexRemap(place.data(), nullptr, place.size(), mesh.positions.data(), place.size(), sizeof(Vec3));
  std::vector<std::uint32_t> first(place.size(), ~0U);
  for (std::uint32_t i = 0; i < place.size(); ++i) {
    std::uint32_t& of_place = first[place[i]];
    if (of_place == ~0U) of_place = i;
    place[i] = of_place;
  }
  return place;
}

/// Removes triangles. Keeps the triangles that stay and their borders, and the border of a sample. Returns indices of
/// the mesh's vertices.
std::vector<std::uint32_t> remove_triangles(const SmoothMesh& mesh, float error_in_samples, float scale, bool is_sample,
                                            const std::vector<bool>& stays) {
  std::vector<std::uint32_t> kept;
  std::vector<std::uint32_t> others;
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) (stays[i / 3] ? kept : others).push_back(mesh.indices[i]);
  const unsigned options = kept.empty() && !is_sample ? 0 : meshopt_SimplifyLockBorder;
  std::vector<std::uint32_t> left(others.size());
  left.resize(meshopt_simplify(left.data(), others.data(), others.size(), &mesh.positions[0].x, mesh.positions.size(),
                               sizeof(Vec3), 0, error_in_samples / scale, options, nullptr));
  left.insert(left.end(), kept.begin(), kept.end());
  return left;
}

/// Returns triangles of welded positions; their corners are vertices of the mesh.
Triangulation triangulation_of(const SmoothMesh& mesh, std::vector<std::uint32_t> left,
                               const std::vector<std::uint32_t>& place) {
  Triangulation result{mesh.positions, std::move(left), {}};
  result.corners = result.indices;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < result.indices.size(); i += 3) {
    std::array<std::uint32_t, 3> at{};
    for (std::size_t k = 0; k < 3; ++k) at[k] = place[result.indices[i + k]];
    // If the mesh was cut by colour, triangles with only two distinct positions may be left.
    if (at[0] == at[1] || at[1] == at[2] || at[2] == at[0]) continue;
    for (std::size_t k = 0; k < 3; ++k, ++kept) {
      result.corners[kept] = result.corners[i + k];
      result.indices[kept] = at[k];
    }
  }
  result.indices.resize(kept);
  result.corners.resize(kept);
  return result;
}

/// The distances of the mesh's vertices from simpler triangles.
struct Deviation {
  float most = 0.0F;
  std::size_t places = 0;
  std::size_t beyond = 0;
  std::vector<bool> is_beyond;  // by place: farther off than allowed
};

Deviation deviation_of(const SmoothMesh& mesh, const std::vector<std::uint32_t>& place, const Triangulation& simple,
                       float allowed) {
  const TriangleTree tree(simple.positions, simple.indices);
  std::vector<bool> is_done(mesh.positions.size());
  for (const std::uint32_t index : simple.indices) {
    if (index < is_done.size() && simple.positions[index] == mesh.positions[index]) is_done[index] = true;
  }
  Deviation found;
  found.is_beyond.resize(mesh.positions.size());
  for (const std::uint32_t index : mesh.indices) {
    const std::uint32_t vertex = place[index];
    if (is_done[vertex]) continue;
    is_done[vertex] = true;
    ++found.places;
    const float distance = tree.distance(mesh.positions[vertex], std::numeric_limits<float>::max());
    found.most = std::max(found.most, distance);
    found.is_beyond[vertex] = distance > allowed;
    found.beyond += distance > allowed ? 1 : 0;
  }
  return found;
}

/// Adds the triangles that touch one of these positions, and their neighbours.
void keep_around(const SmoothMesh& mesh, const std::vector<std::uint32_t>& place, std::vector<bool> is_near,
                 std::vector<bool>& stays) {
  for (int ring = 0; ring < 2; ++ring) {
    std::vector<bool> is_next = is_near;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      const std::array<std::uint32_t, 3> at = {place[mesh.indices[i]], place[mesh.indices[i + 1]],
                                               place[mesh.indices[i + 2]]};
      if (std::ranges::none_of(at, [&](std::uint32_t vertex) { return is_near[vertex]; })) continue;
      stays[i / 3] = true;
      for (const std::uint32_t vertex : at) is_next[vertex] = true;
    }
    is_near = std::move(is_next);
  }
}

/// Returns the vertices on a border: an edge there has a triangle on one side only, by vertex.
///
/// In a closed fan, each neighbour is a start as often as an end, so the sum over both is 0. It is not 0 for one open
/// fan. For several open fans of one vertex it can be 0 by chance, once in 2^32.
std::vector<bool> vertices_on_border(const SmoothMesh& mesh) {
  std::vector<std::uint32_t> balance(mesh.positions.size());
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const std::uint32_t* at = mesh.indices.data() + i;
    const std::array<std::uint32_t, 3> mixed = {mix_bits(at[0]), mix_bits(at[1]), mix_bits(at[2])};
    for (std::size_t k = 0; k < 3; ++k) balance[at[k]] += mixed[(k + 1) % 3] - mixed[(k + 2) % 3];
  }
  std::vector<bool> is_on_border(balance.size());
  for (std::size_t i = 0; i < balance.size(); ++i) is_on_border[i] = balance[i] != 0;
  return is_on_border;
}

/// Merges the corners of each vertex of the simpler triangles into one, so that a closed mesh stays closed by vertex
/// and not only by position. Corners differ where a zero-length edge had triangles, which are gone, and where surfaces
/// touch. Corners on a border of the mesh stay separate: lines between colours are borders.
void merge_corners(const SmoothMesh& mesh, Triangulation& simple) {
  std::vector<std::uint32_t> first(simple.positions.size(), ~0U);
  const auto joined = [&](std::size_t i) -> std::uint32_t {
    std::uint32_t& corner = first[simple.indices[i]];
    if (corner == ~0U) corner = simple.corners[i];
    return corner;
  };
  std::size_t i = 0;
  while (i < simple.corners.size() && joined(i) == simple.corners[i]) ++i;
  if (i == simple.corners.size()) return;
  const std::vector<bool> stays_apart = vertices_on_border(mesh);
  std::ranges::fill(first, ~0U);
  for (i = 0; i < simple.corners.size(); ++i) {
    if (!stays_apart[simple.corners[i]]) simple.corners[i] = joined(i);
  }
}

/// Replaces the mesh's triangles by simpler ones, with a vertex for each used pair of corner and position.
void take_over(SmoothMesh& mesh, const Triangulation& simple, std::vector<std::uint32_t>& tags) {
  const auto before = static_cast<std::uint32_t>(mesh.positions.size());
  // Vertices that were moved apart are appended: one copy per pair of position and corner.
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> copies;
  std::vector<std::uint32_t> indices;
  indices.reserve(simple.indices.size());
  for (std::size_t i = 0; i < simple.indices.size(); ++i) {
    const std::uint32_t vertex = simple.indices[i];
    const std::uint32_t corner = simple.corners[i];
    if (vertex < before && simple.positions[vertex] == mesh.positions[corner]) {
      indices.push_back(corner);
      continue;
    }
    const auto [copy, is_new] = copies.try_emplace({vertex, corner}, static_cast<std::uint32_t>(mesh.positions.size()));
    if (is_new) {
      smooth::append_vertex(mesh, mesh, corner);
      mesh.positions.back() = simple.positions[vertex];
      if (const std::uint32_t tag = tags.empty() ? 0 : tags[corner]; !tags.empty()) tags.push_back(tag);
    }
    indices.push_back(copy->second);
  }
  mesh.indices = std::move(indices);
}

/// An attempt to remove triangles.
struct Attempt {
  Triangulation simple;
  Deviation deviation;
  bool removes_hardly_any = false;

  [[nodiscard]] bool is_within() const { return deviation.beyond == 0 && !simple.indices.empty(); }
  [[nodiscard]] bool is_far_off() const {
    return deviation.beyond > deviation.places / kFewPlaces || simple.indices.empty();
  }
};

/// Searches for the fewest triangles that stay within an error.
class Search {
 public:
  Search(const SmoothMesh& mesh, float scale, float error_in_samples, bool is_sample)
      : mesh_(mesh),
        place_(places_of(mesh)),
        scale_(scale),
        error_(error_in_samples),
        is_sample_(is_sample),
        rounds_(is_sample ? kRoundsOfSample : kRounds) {}

  struct Found {
    Attempt attempt;
    int level = 0;
  };
  /// Returns the attempt with the fewest triangles, of all levels; empty if no attempt is within the error.
  std::optional<Found> best_of_levels() {
    std::optional<Found> best;
    for (int level = 0; level < kLevels; ++level) {
      std::optional<Attempt> attempt = run(level);
      if (is_fruitless_) break;
      if (best && first_triangles_ >= best->attempt.simple.indices.size()) break;
      if (!attempt) continue;
      if (!best || attempt->simple.indices.size() < best->attempt.simple.indices.size()) {
        best = Found{std::move(*attempt), level};
      }
      if (last_round_ == 0) break;
    }
    const bool is_good = best && 4 * best->attempt.simple.indices.size() <= 3 * mesh_.indices.size();
    if (is_good || is_fruitless_) return best;
    std::optional<Attempt> attempt = run(kMostStay);
    if (attempt && (!best || attempt->simple.indices.size() < best->attempt.simple.indices.size())) {
      best = Found{std::move(*attempt), kMostStay};
    }
    return best;
  }
  /// Returns the attempt of the first level, starting at `level`, that is within the error.
  std::optional<Attempt> first_from(int level) {
    for (; level <= kMostStay; ++level) {
      std::optional<Attempt> attempt = run(level);
      if (attempt || is_fruitless_) return attempt;
    }
    return std::nullopt;
  }

 private:
  /// Tries one level, in rounds in which more and more triangles stay. Returns nothing if the level fails.
  std::optional<Attempt> run(int level) {
    const bool most_stay = level == kMostStay;
    std::vector<bool> stays(mesh_.indices.size() / 3);
    for (last_round_ = 0; last_round_ < (most_stay ? kMostStayRounds : rounds_); ++last_round_) {
      const int lowered = most_stay ? std::max(last_round_ + 1 - kRoundsOfFirstLevel, 0) : level;
      const float allowed = kMeanShare * error_ * std::pow(kLevelShare, static_cast<float>(lowered));
      Attempt attempt = try_once(allowed, stays);
      if (last_round_ == 0) first_triangles_ = attempt.simple.indices.size();
      if (attempt.is_within()) return attempt;
      is_fruitless_ = attempt.removes_hardly_any;
      if (is_fruitless_ || (attempt.is_far_off() && !most_stay)) break;
      keep_around(mesh_, place_, std::move(attempt.deviation.is_beyond), stays);
    }
    return std::nullopt;
  }
  [[nodiscard]] Attempt try_once(float allowed, const std::vector<bool>& stays) const {
    Attempt attempt;
    std::vector<std::uint32_t> left = remove_triangles(mesh_, allowed, scale_, is_sample_, stays);
    attempt.removes_hardly_any = left.size() + mesh_.indices.size() / kHardlyAny >= mesh_.indices.size();
    attempt.simple = triangulation_of(mesh_, std::move(left), place_);
    // A neck of three edges, for example, may collapse to one edge.
    make_manifold(attempt.simple, std::min(kCopyDistance, 0.25F * error_));
    attempt.deviation = deviation_of(mesh_, place_, attempt.simple, error_);
    return attempt;
  }

  const SmoothMesh& mesh_;
  std::vector<std::uint32_t> place_;
  float scale_;
  float error_;
  bool is_sample_;
  int rounds_;
  std::size_t first_triangles_ = 0;  ///< indices that the last level's first round left
  int last_round_ = 0;
  bool is_fruitless_ = false;
};

/// Returns the positions and triangles of about kSampleTriangles triangles of a mesh, in boxes selected by a hash of
/// their position.
SmoothMesh sample_of(const SmoothMesh& mesh) {
  const auto box_of = [&](std::size_t i) {
    const IVec3 at = voxel_of(DVec3(mesh.positions[mesh.indices[i]]) / kSampleBox);
    const auto part = [&](int axis) { return static_cast<std::uint32_t>(at[axis]); };
    return mix_bits(mix_bits(mix_bits(part(0)) ^ part(1)) ^ part(2));
  };
  std::map<std::uint32_t, std::size_t> triangles_of;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) ++triangles_of[box_of(i)];
  std::size_t count = 0;
  std::uint32_t last = 0;
  int boxes = 0;
  for (auto box = triangles_of.begin(); box != triangles_of.end(); ++box) {
    if (count >= kSampleTriangles && boxes >= kSampleBoxes) break;
    count += box->second;
    last = box->first;
    ++boxes;
  }
  SmoothMesh sample;
  std::vector<std::uint32_t> vertex_of(mesh.positions.size(), ~0U);
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    if (box_of(i) > last) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& vertex = vertex_of[mesh.indices[i + k]];
      if (vertex == ~0U) {
        vertex = static_cast<std::uint32_t>(sample.positions.size());
        sample.positions.push_back(mesh.positions[mesh.indices[i + k]]);
      }
      sample.indices.push_back(vertex);
    }
  }
  return sample;
}

float scale_of(const SmoothMesh& mesh) {
  return meshopt_simplifyScale(&mesh.positions[0].x, mesh.positions.size(), sizeof(Vec3));
}

/// Returns the attempt that simplifies a mesh; empty if it cannot be simplified.
std::optional<Attempt> find_simpler(const SmoothMesh& mesh, float scale, float error_in_samples) {
  Search search(mesh, scale, error_in_samples, false);
  if (mesh.indices.size() / 3 < kLeastSampled) {
    std::optional<Search::Found> found = search.best_of_levels();
    return found ? std::optional(std::move(found->attempt)) : std::nullopt;
  }
  const SmoothMesh sample = sample_of(mesh);
  const float scale_of_sample = scale_of(sample);
  if (!(scale_of_sample > 0.0F)) return search.first_from(0);
  const auto found = Search(sample, scale_of_sample, error_in_samples, true).best_of_levels();
  if (!found) return std::nullopt;
  const std::size_t left = found->attempt.simple.indices.size();
  if (left + sample.indices.size() / kLeastLoss >= sample.indices.size()) return std::nullopt;
  return search.first_from(found->level);
}

/// Returns the error reached, in samples.
float simplify_within(SmoothMesh& mesh, float error_in_samples, std::vector<std::uint32_t>& tags) {
  const float scale = scale_of(mesh);
  if (!(scale > 0.0F)) return 0.0F;
  std::optional<Attempt> found = find_simpler(mesh, scale, error_in_samples);
  if (!found) return 0.0F;
  merge_corners(mesh, found->simple);
  take_over(mesh, found->simple, tags);
  return found->deviation.most;
}

template <class T>
void keep_used(std::vector<T>& values, const std::vector<std::uint32_t>& place_of, std::size_t used) {
  if (values.empty()) return;
  QUOIN_ASSERT(values.size() == place_of.size(), "a value per vertex");
  std::vector<T> kept(used);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (place_of[i] != ~0U) kept[place_of[i]] = values[i];
  }
  values = std::move(kept);
}

void order_for_caches(SmoothMesh& mesh, std::vector<std::uint32_t>& tags) {
  const std::size_t count = mesh.positions.size();
  meshopt_optimizeVertexCache(mesh.indices.data(), mesh.indices.data(), mesh.indices.size(), count);
  std::vector<std::uint32_t> place_of(count);
  const std::size_t used =
      meshopt_optimizeVertexFetchRemap(place_of.data(), mesh.indices.data(), mesh.indices.size(), count);
  for (std::uint32_t& index : mesh.indices) index = place_of[index];
  keep_used(mesh.positions, place_of, used);
  keep_used(mesh.normals, place_of, used);
  keep_used(mesh.occlusion, place_of, used);
  keep_used(mesh.albedo, place_of, used);
  keep_used(mesh.types, place_of, used);
  keep_used(mesh.materials, place_of, used);
  keep_used(tags, place_of, used);
}

}  // namespace

bool can_simplify() {
  return true;
}

Result<float> simplify_smooth_mesh(SmoothMesh& mesh, float error_in_samples, std::vector<std::uint32_t>& tags) {
  if (!(error_in_samples >= 0.0F)) return make_error(ErrorCode::InvalidArgument, "the error must be at least 0");
#if QUOIN_ASSERT_ENABLED
  QUOIN_ASSERT(has_arrays_of_one_length(mesh));
  QUOIN_ASSERT(names_vertices(mesh));
  QUOIN_ASSERT(has_finite_positions(mesh));
  QUOIN_ASSERT(tags.empty() || tags.size() == mesh.positions.size(), "a tag per vertex, or none");
#endif
  if (mesh.indices.empty()) return 0.0F;
  const float reached = simplify_within(mesh, error_in_samples, tags);
  order_for_caches(mesh, tags);
  return reached;
}

#else

bool can_simplify() {
  return false;
}

Result<float> simplify_smooth_mesh(SmoothMesh&, float error_in_samples, std::vector<std::uint32_t>&) {
  if (!(error_in_samples >= 0.0F)) return make_error(ErrorCode::InvalidArgument, "the error must be at least 0");
  return make_error(ErrorCode::Unsupported,
                    "cannot simplify meshes: this build lacks meshoptimizer (libmeshoptimizer-dev in Debian)");
}

#endif

Result<float> simplify_smooth_mesh(SmoothMesh& mesh, float error_in_samples) {
  std::vector<std::uint32_t> none;
  return simplify_smooth_mesh(mesh, error_in_samples, none);
}

namespace {

constexpr std::size_t kLeaf = 4;

float squared(Vec3 v) {
  return glm::dot(v, v);
}

float squared_distance_from_box(Vec3 point, Vec3 min, Vec3 max) {
  return squared(point - glm::clamp(point, min, max));
}

float squared_distance_from_edge(Vec3 point, Vec3 a, Vec3 b) {
  const Vec3 along = b - a;
  const float length = squared(along);
  const float t = length > 0.0F ? std::clamp(glm::dot(point - a, along) / length, 0.0F, 1.0F) : 0.0F;
  return squared(point - (a + along * t));
}

}  // namespace

TriangleTree::TriangleTree(std::span<const Vec3> positions, std::span<const std::uint32_t> indices)
    : positions_(positions), indices_(indices) {
  QUOIN_ASSERT(indices.size() % 3 == 0, "whole triangles");
  std::vector<Item> items;
  items.reserve(indices.size() / 3);
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    const Vec3 a = positions[indices[i]];
    const Vec3 b = positions[indices[i + 1]];
    const Vec3 c = positions[indices[i + 2]];
    items.push_back({glm::min(glm::min(a, b), c), glm::max(glm::max(a, b), c), static_cast<std::uint32_t>(i / 3)});
  }
  if (items.empty()) return;
  nodes_.resize(1);
  build(0, items, 0);
  for (const Item& item : items) order_.push_back(item.triangle);
}

void TriangleTree::build(std::size_t node, std::span<Item> items, std::size_t first) {
  QUOIN_ASSERT(!items.empty() && node < nodes_.size(), "a node of triangles");
  Vec3 min = items[0].min;
  Vec3 max = items[0].max;
  for (const Item& item : items) {
    min = glm::min(min, item.min);
    max = glm::max(max, item.max);
  }
  nodes_[node] = {min, max, static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(items.size())};
  if (items.size() <= kLeaf) return;
  const Vec3 size = max - min;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::size_t half = items.size() / 2;
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(half), items.end(),
                   [axis](const Item& a, const Item& b) {
                     const float x = a.min[axis] + a.max[axis];
                     const float y = b.min[axis] + b.max[axis];
                     return x != y ? x < y : a.triangle < b.triangle;
                   });
  const std::size_t children = nodes_.size();
  nodes_.resize(children + 2);
  nodes_[node].first = static_cast<std::uint32_t>(children);
  nodes_[node].count = 0;
  build(children, items.first(half), first);
  build(children + 1, items.subspan(half), first + half);
}

float TriangleTree::squared_distance(Vec3 point, std::uint32_t triangle) const {
  QUOIN_ASSERT(std::size_t{3} * triangle + 2 < indices_.size(), "one of the triangles");
  const std::uint32_t* at = indices_.data() + std::size_t{3} * triangle;
  const Vec3 a = positions_[at[0]];
  const Vec3 b = positions_[at[1]];
  const Vec3 c = positions_[at[2]];
  const Vec3 normal = glm::cross(b - a, c - a);
  const auto is_within = [&](Vec3 from, Vec3 to) {
    return glm::dot(glm::cross(to - from, point - from), normal) >= 0.0F;
  };
  const float area = squared(normal);
  if (area > 0.0F && is_within(a, b) && is_within(b, c) && is_within(c, a)) {
    const float height = glm::dot(point - a, normal);
    return height * height / area;
  }
  return std::min({squared_distance_from_edge(point, a, b), squared_distance_from_edge(point, b, c),
                   squared_distance_from_edge(point, c, a)});
}

float TriangleTree::distance(Vec3 point, float most) const {
  if (nodes_.empty()) return most;
  float nearest = most * most;
  // The median halves each node: no tree of 2^32 triangles is deeper than this.
  std::array<std::uint32_t, 72> open;
  std::size_t depth = 0;
  open[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[open[--depth]];
    if (squared_distance_from_box(point, node.min, node.max) >= nearest) continue;
    if (node.count != 0) {
      for (std::uint32_t i = 0; i < node.count; ++i) {
        nearest = std::min(nearest, squared_distance(point, order_[node.first + i]));
      }
      continue;
    }
    const auto away = [&](std::uint32_t child) {
      return squared_distance_from_box(point, nodes_[child].min, nodes_[child].max);
    };
    QUOIN_ASSERT(depth + 2 <= open.size(), "a tree of halves is not so deep");
    std::uint32_t near = node.first;
    std::uint32_t far = near + 1;
    if (away(far) < away(near)) std::swap(near, far);
    open[depth++] = far;
    open[depth++] = near;
  }
  return std::min(std::sqrt(nearest), most);
}

namespace {

/// A triangle as seen from one of its vertices: it leads from one neighbour to the next.
struct Arc {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  std::uint32_t triangle = 0;
};

/// The triangles of each vertex.
class Corners {
 public:
  explicit Corners(const Triangulation& mesh) : first_(mesh.positions.size() + 1), triangles_(mesh.indices.size()) {
    for (const std::uint32_t index : mesh.indices) {
      QUOIN_ASSERT(index < mesh.positions.size(), "a vertex of the mesh");
      ++first_[index + std::size_t{1}];
    }
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
      triangles_[next[mesh.indices[i]]++] = static_cast<std::uint32_t>(i / 3);
    }
  }

  [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t vertex) const {
    QUOIN_ASSERT(vertex + std::size_t{1} < first_.size(), "a vertex of the mesh");
    return std::span(triangles_).subspan(first_[vertex], first_[vertex + std::size_t{1}] - first_[vertex]);
  }

 private:
  std::vector<std::uint32_t> first_;
  std::vector<std::uint32_t> triangles_;
};

/// Replaces `arcs` by the arcs around a vertex, sorted by their start.
void arcs_around(const Triangulation& mesh, const Corners& corners, std::uint32_t vertex, std::vector<Arc>& arcs) {
  arcs.clear();
  for (const std::uint32_t triangle : corners.of(vertex)) {
    const std::uint32_t* at = mesh.indices.data() + std::size_t{3} * triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      if (at[k] == vertex) arcs.push_back({at[(k + 1) % 3], at[(k + 2) % 3], triangle});
    }
  }
  std::sort(arcs.begin(), arcs.end(),
            [](const Arc& a, const Arc& b) { return a.from != b.from ? a.from < b.from : a.triangle < b.triangle; });
}

void remove_back_to_back(Triangulation& mesh) {
  QUOIN_ASSERT(mesh.corners.size() == mesh.indices.size(), "one corner per index");
  const Corners corners(mesh);
  std::vector<bool> is_removed(mesh.indices.size() / 3);
  std::vector<Arc> arcs;
  for (std::uint32_t vertex = 0; vertex < mesh.positions.size(); ++vertex) {
    arcs_around(mesh, corners, vertex, arcs);
    for (const Arc& arc : arcs) {
      if (vertex > std::min(arc.from, arc.to) || arc.from > arc.to || is_removed[arc.triangle]) continue;
      const auto opposite = std::find_if(arcs.begin(), arcs.end(), [&](const Arc& other) {
        return other.from == arc.to && other.to == arc.from && !is_removed[other.triangle];
      });
      if (opposite == arcs.end()) continue;
      is_removed[arc.triangle] = is_removed[opposite->triangle] = true;
    }
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < is_removed.size(); ++i) {
    if (is_removed[i]) continue;
    for (std::size_t k = 0; k < 3; ++k, ++kept) {
      mesh.indices[kept] = mesh.indices[3 * i + k];
      mesh.corners[kept] = mesh.corners[3 * i + k];
    }
  }
  mesh.indices.resize(kept);
  mesh.corners.resize(kept);
}

/// Returns the first arc that starts at a neighbour, or the number of arcs if there is none.
std::size_t first_from(const std::vector<Arc>& arcs, std::uint32_t neighbour) {
  const auto found = std::lower_bound(arcs.begin(), arcs.end(), neighbour,
                                      [](const Arc& arc, std::uint32_t value) { return arc.from < value; });
  if (found == arcs.end() || found->from != neighbour) return arcs.size();
  return static_cast<std::size_t>(found - arcs.begin());
}

/// Returns true if the arcs form one ring: following them from the first leads back to it through all others.
bool are_one_ring(const std::vector<Arc>& arcs) {
  std::size_t at = 0;
  for (std::size_t passed = 1; passed <= arcs.size(); ++passed) {
    at = first_from(arcs, arcs[at].to);
    if (at == 0) return passed == arcs.size();
    if (at == arcs.size()) return false;
  }
  return arcs.empty();
}

/// Splits arcs into rings that pass no neighbour twice. Returns the ring number of each arc, starting at 0. Arcs
/// outside of any ring are in ring 0.
std::vector<std::uint32_t> rings_of(const std::vector<Arc>& arcs) {
  std::vector<std::uint32_t> ring(arcs.size(), 0);
  std::vector<bool> is_used(arcs.size());
  std::vector<std::size_t> path;
  std::uint32_t rings = 0;
  for (std::size_t start = 0; start < arcs.size(); ++start) {
    if (is_used[start]) continue;
    path.assign(1, start);
    is_used[start] = true;
    while (!path.empty()) {
      const std::uint32_t at = arcs[path.back()].to;
      // A neighbour that is already on the path closes a ring, which is removed from the path.
      const auto begin = std::find_if(path.begin(), path.end(), [&](std::size_t i) { return arcs[i].from == at; });
      if (begin != path.end()) {
        std::for_each(begin, path.end(), [&](std::size_t i) { ring[i] = rings; });
        path.erase(begin, path.end());
        ++rings;
        continue;
      }
      std::size_t next = first_from(arcs, at);
      while (next < arcs.size() && arcs[next].from == at && is_used[next]) ++next;
      if (next == arcs.size() || arcs[next].from != at) break;
      is_used[next] = true;
      path.push_back(next);
    }
  }
  return ring;
}

/// Makes one vertex per ring, each moved towards the middle of its neighbours.
void split(Triangulation& mesh, std::uint32_t vertex, const std::vector<Arc>& arcs, float distance) {
  QUOIN_ASSERT(!arcs.empty(), "a vertex of triangles");
  const std::vector<std::uint32_t> ring = rings_of(arcs);
  const std::size_t rings = *std::max_element(ring.begin(), ring.end()) + std::size_t{1};
  if (rings == 1) return;
  const Vec3 place = mesh.positions[vertex];
  std::vector<std::uint32_t> vertex_of(rings, vertex);
  std::vector<Vec3> sum(rings, Vec3(0.0F));
  for (std::size_t i = 0; i < arcs.size(); ++i) {
    const Vec3 away = mesh.positions[arcs[i].from] - place;
    const float length = glm::length(away);
    if (length > 0.0F) sum[ring[i]] += away / length;
  }
  for (std::size_t i = 0; i < rings; ++i) {
    const float length = glm::length(sum[i]);
    const Vec3 moved = length > 1e-6F ? place + sum[i] * (distance / length) : place;
    if (i == 0) {
      mesh.positions[vertex] = moved;
      continue;
    }
    vertex_of[i] = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back(moved);
  }
  for (std::size_t i = 0; i < arcs.size(); ++i) {
    std::uint32_t* at = mesh.indices.data() + std::size_t{3} * arcs[i].triangle;
    *std::find(at, at + 3, vertex) = vertex_of[ring[i]];
  }
}

}  // namespace

void make_manifold(Triangulation& mesh, float distance) {
  remove_back_to_back(mesh);
  const Corners corners(mesh);
  const auto count = static_cast<std::uint32_t>(mesh.positions.size());
  std::vector<Arc> arcs;
  for (std::uint32_t vertex = 0; vertex < count; ++vertex) {
    arcs_around(mesh, corners, vertex, arcs);
    if (!are_one_ring(arcs)) split(mesh, vertex, arcs, distance);
  }
}

}  // namespace quoin
