#include "mesh/surface/faces.h"

#include <numeric>

#include <quoin/core/assert.h>

namespace quoin::smooth {
namespace {

/// What tells the copies of a vertex apart.
struct Look {
  VoxelType type = kAir;
  Direction direction = Direction::PosX;
  std::uint32_t group = 0;

  bool operator==(const Look&) const = default;
};

/// A copy of a vertex, in the list of those of its vertex.
struct Copy {
  Look look;
  std::uint32_t next = 0;  // 0: none, else the place of another, less one
};

/// The copies that each vertex needs, and which of them each corner of a triangle takes.
class Copies {
 public:
  explicit Copies(std::size_t vertices) : first_(vertices), count_(vertices + 1) {}

  /// The number, among the copies of the vertex, of that with the look.
  std::uint32_t find_or_add(std::uint32_t vertex, const Look& look) {
    std::uint32_t number = 0;
    std::uint32_t* link = &first_[vertex];
    for (; *link != 0; link = &all_[*link - 1].next, ++number) {
      if (all_[*link - 1].look == look) return number;
    }
    *link = static_cast<std::uint32_t>(all_.size() + 1);
    all_.push_back({look, 0});
    ++count_[vertex + std::size_t{1}];
    return number;
  }

  /// Where the copies of each vertex begin among all.
  [[nodiscard]] std::vector<std::uint32_t> places() const {
    std::vector<std::uint32_t> places(count_.size());
    std::partial_sum(count_.begin(), count_.end(), places.begin());
    return places;
  }

  /// In the order of the vertices, those of one in the order in which they were added.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (std::size_t vertex = 0; vertex < first_.size(); ++vertex) {
      for (std::uint32_t at = first_[vertex]; at != 0; at = all_[at - 1].next) visit(vertex, all_[at - 1].look);
    }
  }

 private:
  std::vector<std::uint32_t> first_;  // by vertex, as Copy::next
  std::vector<std::uint32_t> count_;  // by vertex plus one
  std::vector<Copy> all_;
};

/// Between a face's normal and the surface's; the face's where they cancel out.
Vec3 normal_between(Direction direction, Vec3 normal, float smoothness) {
  const Vec3 flat(normal_of(direction));
  const Vec3 sum = flat * (1.0F - smoothness) + normal * smoothness;
  const float length = glm::length(sum);
  return length > 1e-6F ? sum / length : flat;
}

}  // namespace

std::vector<std::uint32_t> split_by_faces(SmoothMesh& mesh, std::span<const TriangleFace> faces,
                                          const FaceLooks& looks) {
  QUOIN_ASSERT(faces.size() == mesh.indices.size() / 3);
  Copies copies(mesh.positions.size());
  std::vector<std::uint32_t> numbers(mesh.indices.size());
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
    const TriangleFace& face = faces[i / 3];
    Look look;
    if (looks.sharp != nullptr) look.type = face.type;
    if (looks.smoothness < 1.0F) look.direction = face.direction;
    if (!looks.groups.empty()) look.group = looks.groups[i / 3];
    numbers[i] = copies.find_or_add(mesh.indices[i], look);
  }
  const std::vector<std::uint32_t> places = copies.places();
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) mesh.indices[i] = places[mesh.indices[i]] + numbers[i];
  SmoothMesh split;
  split.indices = std::move(mesh.indices);
  std::vector<std::uint32_t> groups;
  split.positions.reserve(places.back());
  split.normals.reserve(places.back());
  split.albedo.reserve(places.back());
  split.types.reserve(places.back());
  copies.for_each([&](std::size_t vertex, const Look& look) {
    const Vec3 normal = mesh.normals[vertex];
    split.positions.push_back(mesh.positions[vertex]);
    split.normals.push_back(looks.smoothness < 1.0F ? normal_between(look.direction, normal, looks.smoothness)
                                                    : normal);
    if (!mesh.occlusion.empty()) split.occlusion.push_back(mesh.occlusion[vertex]);
    split.albedo.push_back(looks.sharp != nullptr ? looks.sharp->albedo(look.type) : mesh.albedo[vertex]);
    split.types.push_back(looks.sharp != nullptr ? look.type : mesh.types[vertex]);
    if (!looks.groups.empty()) groups.push_back(look.group);
  });
  mesh = std::move(split);
  return groups;
}

}  // namespace quoin::smooth
