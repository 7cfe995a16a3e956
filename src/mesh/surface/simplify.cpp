#include <quoin/mesh/smooth_mesh.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>

#include "mesh/surface/simplify_tagged.h"

#ifdef QUOIN_HAVE_MESHOPTIMIZER
#include <meshoptimizer.h>

#include "mesh/surface/build.h"
#include "mesh/surface/manifold.h"
#include "mesh/surface/triangle_tree.h"
#endif

namespace quoin {

#ifdef QUOIN_HAVE_MESHOPTIMIZER

namespace {

#if QUOIN_ASSERT_ENABLED
bool has_arrays_of_one_length(const SmoothMesh& mesh) {
  const std::size_t count = mesh.positions.size();
  return mesh.normals.size() == count && mesh.albedo.size() == count && mesh.types.size() == count &&
         (mesh.occlusion.empty() || mesh.occlusion.size() == count);
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

/// How far apart vertices of one place are drawn that have to be several.
constexpr float kApart = 1.0F / 1024.0F;
/// The share of the error that the library is allowed: it bounds a mean of squares, and single vertices of smooth
/// surfaces are up to twice as far off.
constexpr float kMeanShare = 0.8F;
/// If no more than one of so many places is too far off, the mesh stays as it was around those, and after some rounds
/// a little less error is allowed; else much less is allowed everywhere.
constexpr std::size_t kFewPlaces = 20;
constexpr float kLittleLess = 0.8F;
constexpr float kMuchLess = 0.6F;
constexpr int kMaxTries = 16;
/// Rounds in which triangles stay before a little less error is allowed.
constexpr int kRounds = 4;
/// A try that removes no more than one of so many triangles, and is too far off, is the last one.
constexpr std::size_t kHardlyAny = 1'000;

/// The vertices of each place, which colours and normals may have made several: by vertex, the first of its place.
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

/// Fewer triangles, in the vertices of the mesh; those that are to stay do, and what they border on too.
std::vector<std::uint32_t> remove_triangles(const SmoothMesh& mesh, float error_in_samples, float scale,
                                            const std::vector<bool>& stays) {
  std::vector<std::uint32_t> kept;
  std::vector<std::uint32_t> others;
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) (stays[i / 3] ? kept : others).push_back(mesh.indices[i]);
  const unsigned options = kept.empty() ? 0 : meshopt_SimplifyLockBorder;
  std::vector<std::uint32_t> left(others.size());
  left.resize(meshopt_simplify(left.data(), others.data(), others.size(), &mesh.positions[0].x, mesh.positions.size(),
                               sizeof(Vec3), 0, error_in_samples / scale, options, nullptr));
  left.insert(left.end(), kept.begin(), kept.end());
  return left;
}

/// Triangles of the places, whose corners are vertices of the mesh.
Triangulation triangulation_of(const SmoothMesh& mesh, std::vector<std::uint32_t> left,
                               const std::vector<std::uint32_t>& place) {
  Triangulation result{mesh.positions, std::move(left), {}};
  result.corners = result.indices;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < result.indices.size(); i += 3) {
    std::array<std::uint32_t, 3> at{};
    for (std::size_t k = 0; k < 3; ++k) at[k] = place[result.indices[i + k]];
    // Of what was cut for colours, triangles may be left whose corners lie in two places.
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

/// How far the vertices of the mesh lie from simpler triangles.
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

/// Adds the triangles that touch one of these places, and their neighbours.
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

/// Puts simpler triangles in place of the mesh's: a vertex for each corner and place that is in use.
void take_over(SmoothMesh& mesh, const Triangulation& simple, std::vector<std::uint32_t>& tags) {
  const auto before = static_cast<std::uint32_t>(mesh.positions.size());
  // What was drawn apart is appended; the first such copy of a corner by its place.
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

/// A try to remove triangles.
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
  Search(const SmoothMesh& mesh, float scale, float error_in_samples)
      : mesh_(mesh),
        place_(places_of(mesh)),
        scale_(scale),
        error_(error_in_samples),
        allowed_(kMeanShare * error_in_samples),
        stays_(mesh.indices.size() / 3) {}

  /// Nothing if no try is within the error.
  std::optional<Attempt> run() {
    std::optional<Attempt> best;
    for (int tries = 0; tries < kMaxTries; ++tries) {
      Attempt attempt = try_once();
      if (!attempt.is_within()) {
        if (best || attempt.removes_hardly_any) break;
        change(tries, std::move(attempt));
        continue;
      }
      if (!best || attempt.simple.indices.size() < best->simple.indices.size()) best = std::move(attempt);
      if (rounds_ == 0) break;
      // Fewer triangles may be left where less error is allowed and none has to stay.
      restart(allowed_before_rounds_ * kMuchLess);
    }
    return best;
  }

 private:
  [[nodiscard]] Attempt try_once() const {
    Attempt attempt;
    std::vector<std::uint32_t> left = remove_triangles(mesh_, allowed_, scale_, stays_);
    attempt.removes_hardly_any = left.size() + mesh_.indices.size() / kHardlyAny >= mesh_.indices.size();
    attempt.simple = triangulation_of(mesh_, std::move(left), place_);
    // A neck three edges round, say, is drawn together to one edge.
    make_manifold(attempt.simple, std::min(kApart, 0.25F * error_));
    attempt.deviation = deviation_of(mesh_, place_, attempt.simple, error_);
    return attempt;
  }
  /// Changes the next try after one that was not within the error.
  void change(int tries, Attempt attempt) {
    had_few_ = had_few_ || !attempt.is_far_off();
    if (tries + 1 == kMaxTries / 2 && !had_few_) {
      // Less error did not help: a mesh that is round everywhere, say, and hardly to be made simpler.
      restart(kMeanShare * error_);
    } else if (attempt.is_far_off() && tries < kMaxTries / 2) {
      // Triangles that had to stay for more error need not for less.
      restart(allowed_ * kMuchLess);
    } else {
      if (rounds_ == 0) allowed_before_rounds_ = allowed_;
      keep_around(mesh_, place_, std::move(attempt.deviation.is_beyond), stays_);
      // Other triangles are removed where these stay, so that new places may be too far off in every try.
      if (++rounds_ > kRounds) allowed_ *= kLittleLess;
    }
  }
  void restart(float allowed) {
    allowed_ = allowed;
    rounds_ = 0;
    stays_.assign(stays_.size(), false);
  }

  const SmoothMesh& mesh_;
  std::vector<std::uint32_t> place_;
  float scale_;
  float error_;
  float allowed_;
  float allowed_before_rounds_ = 0.0F;
  std::vector<bool> stays_;
  bool had_few_ = false;
  int rounds_ = 0;  ///< in which triangles had to stay
};

/// Returns the error reached, in samples.
float simplify_within(SmoothMesh& mesh, float error_in_samples, std::vector<std::uint32_t>& tags) {
  const float scale = meshopt_simplifyScale(&mesh.positions[0].x, mesh.positions.size(), sizeof(Vec3));
  if (!(scale > 0.0F)) return 0.0F;
  const std::optional<Attempt> found = Search(mesh, scale, error_in_samples).run();
  if (!found) return 0.0F;
  take_over(mesh, found->simple, tags);
  return found->deviation.most;
}

template <class T>
void keep_used(std::vector<T>& values, const std::vector<std::uint32_t>& place_of, std::size_t used) {
  if (values.empty()) return;
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
  keep_used(tags, place_of, used);
}

}  // namespace

bool can_simplify() {
  return true;
}

Result<float> simplify_tagged(SmoothMesh& mesh, float error_in_samples, std::vector<std::uint32_t>& tags) {
  if (!(error_in_samples >= 0.0F))
    return make_error(ErrorCode::InvalidArgument, "the error must be a number of at least 0");
#if QUOIN_ASSERT_ENABLED
  QUOIN_ASSERT(has_arrays_of_one_length(mesh));
  QUOIN_ASSERT(names_vertices(mesh));
  QUOIN_ASSERT(has_finite_positions(mesh));
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

Result<float> simplify_tagged(SmoothMesh&, float error_in_samples, std::vector<std::uint32_t>&) {
  if (!(error_in_samples >= 0.0F))
    return make_error(ErrorCode::InvalidArgument, "the error must be a number of at least 0");
  return make_error(
      ErrorCode::Unsupported,
      "this build cannot simplify meshes: it was made without meshoptimizer (libmeshoptimizer-dev in Debian)");
}

#endif

Result<float> simplify_smooth_mesh(SmoothMesh& mesh, float error_in_samples) {
  std::vector<std::uint32_t> none;
  return simplify_tagged(mesh, error_in_samples, none);
}

}  // namespace quoin
