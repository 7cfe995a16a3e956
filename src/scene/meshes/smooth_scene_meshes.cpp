#include <quoin/scene/scene_meshes.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/grid/copy_box.h>
#include <quoin/grid/voxel_field.h>

#include "core/coordinates/chunk_order.h"
#include "mesh/surface/smooth_surface.h"
#include "mesh/surface/voxel_surface.h"
#include "scene/meshes/scene_mesh_parts.h"

namespace quoin {

namespace {

using smooth::TriangleFace;

/// The instances of one group as one grid, in the lattice of the first.
class UnitedGrid {
 public:
  UnitedGrid(const Scene& scene, std::vector<LatticeMember> members) : members_(std::move(members)) {
    for (std::size_t i = 0; i < members_.size(); ++i) {
      grids_.push_back(&scene.grids()[scene.instances()[members_[i].instance].grid].grid);
      back_.push_back(members_[i].place.inverse());
      const IBox box = grids_[i]->bounds();
      const IBox arrived = members_[i].place.apply(box);
      copy_box(*grids_[i], box, voxels_, arrived.min, members_[i].place.orientation,
               {.copy_air = false, .type_map = {}});
      note_chunks(i);
    }
  }

  [[nodiscard]] const std::vector<LatticeMember>& members() const { return members_; }
  [[nodiscard]] const Grid& voxels() const { return voxels_; }
  /// Returns the placement from the lattice to a member's own grid.
  [[nodiscard]] const LatticePlace& way_back(std::size_t member) const {
    QUOIN_ASSERT(member < back_.size(), "one of the members");
    return back_[member];
  }

  /// Returns the owner of a voxel: the last member with a voxel there. Without one, the first member whose chunk it is,
  /// or 0.
  [[nodiscard]] std::uint32_t owner_of(IVec3 voxel) {
    const auto found = by_chunk_.find(chunk_of(voxel));
    if (found == by_chunk_.end()) return 0;
    if (found->second.size() > kFewMembers) return owners_in(found->first, found->second)[index_of(local_of(voxel))];
    for (auto member = found->second.rbegin(); member != found->second.rend(); ++member) {
      const IVec3 own = back_[*member].apply(IBox{voxel, voxel + 1}).min;
      if (grids_[*member]->get(own) != kAir) return *member;
    }
    return found->second.front();
  }

 private:
  static constexpr std::size_t kFewMembers = 16;
  using Owners = std::vector<std::uint32_t>;

  static std::size_t index_of(IVec3 local) {
    QUOIN_ASSERT(((local.x | local.y | local.z) & ~(kChunkEdge - 1)) == 0, "0 <= x, y, z < 64");
    return static_cast<std::size_t>((local.z * kChunkEdge + local.y) * kChunkEdge + local.x);
  }

  /// Returns the owners of all voxels of a chunk that several members share. Keeps the result for the last such chunk.
  const Owners& owners_in(IVec3 chunk, const std::vector<std::uint32_t>& members) {
    QUOIN_ASSERT(!members.empty(), "members in the chunk");
    if (dense_chunk_ == chunk) return dense_;
    dense_chunk_ = chunk;
    dense_.assign(std::size_t{kChunkEdge} * kChunkEdge * kChunkEdge, members.front());
    const IBox whole{chunk * kChunkEdge, (chunk + 1) * kChunkEdge};
    for (const std::uint32_t member : members) {
      const IBox box = intersect(whole, members_[member].place.apply(grids_[member]->bounds()));
      for (int z = box.min.z; z < box.max.z; ++z) {
        for (int y = box.min.y; y < box.max.y; ++y) {
          for (int x = box.min.x; x < box.max.x; ++x) {
            const IVec3 own = back_[member].apply(IBox{{x, y, z}, {x + 1, y + 1, z + 1}}).min;
            if (grids_[member]->get(own) != kAir) dense_[index_of(local_of({x, y, z}))] = member;
          }
        }
      }
    }
    return dense_;
  }

  /// Adds a member to all united chunks in which it may have voxels. Goes by the member's own chunks, since its box may
  /// be far larger than its contents.
  void note_chunks(std::size_t member) {
    std::vector<IVec3> reached;
    for (const IVec3 chunk : grids_[member]->chunks()) {
      const IBox arrived = members_[member].place.apply(IBox{chunk * kChunkEdge, (chunk + 1) * kChunkEdge});
      const IVec3 first = chunk_of(arrived.min);
      const IVec3 last = chunk_of(arrived.max - 1);
      for (int z = first.z; z <= last.z; ++z) {
        for (int y = first.y; y <= last.y; ++y) {
          for (int x = first.x; x <= last.x; ++x) reached.emplace_back(x, y, z);
        }
      }
    }
    sort_and_unite(reached);
    for (const IVec3 chunk : reached) by_chunk_[chunk].push_back(static_cast<std::uint32_t>(member));
  }

  std::vector<LatticeMember> members_;
  std::vector<const Grid*> grids_;  // by member
  std::vector<LatticePlace> back_;  // by member
  Grid voxels_;
  std::unordered_map<IVec3, std::vector<std::uint32_t>, CoordinateHash> by_chunk_;  // members in their order
  std::optional<IVec3> dense_chunk_;
  Owners dense_;
};

/// The surface of one body, and the owner of each vertex if there are several.
struct Body {
  SmoothMesh mesh;
  std::vector<std::uint32_t> owners;
};

std::vector<std::uint32_t> owners_of(UnitedGrid& united, const std::vector<TriangleFace>& faces) {
  std::vector<std::uint32_t> owners;
  owners.reserve(faces.size());
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const bool is_as_before = i > 0 && faces[i].sample == faces[i - 1].sample;
    owners.push_back(is_as_before ? owners.back() : united.owner_of(faces[i].sample));
  }
  return owners;
}

/// Meshes a united grid or a single one.
class Mesher {
 public:
  Mesher(const Scene& scene, const SmoothSceneOptions& options, Threads threads, MeshStats& stats)
      : scene_(scene), options_(options), threads_(threads), stats_(stats) {}

  /// Returns the opaque body, then all transparent ones combined. `united`: null for a single owner.
  Result<std::array<Body, 2>> mesh(const Grid& voxels, UnitedGrid* united, const Progress& progress) const {
    constexpr double kFieldShare = 0.2;
    const auto field = field_from_grid(voxels, threads_, part_of(progress, 0.0, kFieldShare));
    if (!field) return field.error();
    const DensityGrid& whole = *field;
    const std::vector<std::uint32_t> bodies = smooth::bodies_of(scene_.types, voxels.types());
    std::array<Body, 2> made;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const auto share = [&](std::size_t k) {
        return kFieldShare + (1.0 - kFieldShare) * static_cast<double>(k) / static_cast<double>(bodies.size());
      };
      const Progress part = part_of(progress, share(i), share(i + 1));
      const bool is_alone = bodies.size() == 1;
      auto body =
          is_alone ? mesh_body(whole, nullptr, united, part)
                   : mesh_body(smooth::field_of_body(whole, scene_.types, bodies[i], threads_), &whole, united, part);
      if (!body) return body.error();
      Body& out = made[bodies[i] == 0 ? 0 : 1];
      append(out.mesh, std::move(body->mesh));
      out.owners.insert(out.owners.end(), body->owners.begin(), body->owners.end());
    }
    return made;
  }

 private:
  Result<Body> mesh_body(const DensityGrid& field, const DensityGrid* whole, UnitedGrid* united,
                         const Progress& progress) const {
    SmoothMeshOptions wanted = options_.mesh;
    // Bodies meet only at level 0, and level_of knows only the chunks of a single grid.
    if (whole != nullptr || united != nullptr) wanted.level_of = nullptr;
    auto surface = smooth::build_surface(field, scene_.types, wanted, {whole, true}, threads_, progress);
    if (!surface) return surface.error();
    std::vector<std::uint32_t> owners;
    if (united != nullptr) owners = owners_of(*united, surface->faces);
    Body body;
    body.owners = smooth::finish_surface(*surface, scene_.types, options_.mesh, owners);
    body.mesh = std::move(surface->mesh);
    if (auto done = simplify_and_count(body.mesh, options_.simplify_error, body.owners, stats_); !done) {
      return done.error();
    }
    return body;
  }

  const Scene& scene_;
  const SmoothSceneOptions& options_;
  Threads threads_;
  MeshStats& stats_;
};

/// Field samples are the voxels' centres.
MeshPart part_of_voxels(const SceneGrid& grid, SmoothBodies bodies) {
  return part_of_bodies(grid.name, std::move(bodies), grid.pivot - 0.5);
}

/// Divides a body among its members, each in the samples of its own grid.
std::vector<SmoothMesh> divide(const Body& body, const UnitedGrid& united) {
  std::vector<SmoothMesh> parts(united.members().size());
  std::vector<std::uint32_t> places(body.owners.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    QUOIN_ASSERT(body.owners[i] < parts.size(), "one of the members");
    SmoothMesh& part = parts[body.owners[i]];
    const LatticePlace& back = united.way_back(body.owners[i]);
    places[i] = smooth::append_vertex(part, body.mesh, i);
    // Samples are half a voxel from the corners that the placements refer to.
    const DVec3 point(body.mesh.positions[i]);
    part.positions.back() = Vec3(back.orientation.apply(point + 0.5) + DVec3(back.offset) - 0.5);
    part.normals.back() = Vec3(back.orientation.apply(DVec3(body.mesh.normals[i])));
  }
  for (std::size_t i = 0; i < body.mesh.indices.size(); i += 3) {
    const std::uint32_t* triangle = body.mesh.indices.data() + i;
    const std::uint32_t owner = body.owners[triangle[0]];
    QUOIN_ASSERT(body.owners[triangle[1]] == owner && body.owners[triangle[2]] == owner);
    const bool turns = united.way_back(owner).orientation.is_mirrored();
    for (const std::size_t k : {0, turns ? 2 : 1, turns ? 1 : 2}) {
      parts[owner].indices.push_back(places[triangle[k]]);
    }
  }
  return parts;
}

/// A unit of meshing: one grid for all of these instances, or a group of instances.
struct Unit {
  std::vector<LatticeMember> members;
  bool is_united = false;
};

std::vector<Unit> units_of(const Scene& scene, const SmoothSceneOptions& options) {
  std::vector<InstanceHandle> drawn;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const bool counts = is_drawn(scene, instance, options.instances);
    if (counts && !scene.grids()[instance.grid].grid.bounds().empty()) drawn.push_back(handle);
  }
  std::vector<std::vector<LatticeMember>> groups;
  if (options.unite) {
    groups = lattice_groups(scene, drawn);
  } else {
    groups.reserve(drawn.size());
    for (const InstanceHandle handle : drawn) groups.push_back({{handle, {}}});
  }
  std::map<GridHandle, Unit> alone;
  std::vector<Unit> united;
  for (auto& group : groups) {
    if (group.size() == 1) {
      alone[scene.instances()[group[0].instance].grid].members.push_back(group[0]);
    } else {
      united.push_back({std::move(group), true});
    }
  }
  std::vector<Unit> units;
  units.reserve(alone.size() + united.size());
  for (auto& [grid, unit] : alone) units.push_back(std::move(unit));
  std::move(united.begin(), united.end(), std::back_inserter(units));
  return units;
}

/// Adds a part, unless it is empty, and its placements.
void add_part(MeshPart part, std::span<const LatticeMember> members, MeshHierarchy& hierarchy, SceneMeshes& meshes) {
  if (part.surfaces.empty()) return;
  for (const LatticeMember& member : members) {
    MeshPlacement placement = hierarchy.place(member.instance, meshes.parts.size());
    // Uses the matrix, so that files contain the quaternion with a positive w.
    placement.world_from_part = placement.matrix();
    meshes.placements.push_back(std::move(placement));
  }
  meshes.parts.push_back(std::move(part));
}

Status add_unit(const Scene& scene, Unit unit, const Mesher& mesher, const Progress& progress, MeshHierarchy& hierarchy,
                SceneMeshes& meshes) {
  QUOIN_ASSERT(!unit.members.empty(), "a unit with instances");
  const auto grid_of = [&](const LatticeMember& member) -> const SceneGrid& {
    return scene.grids()[scene.instances()[member.instance].grid];
  };
  if (!unit.is_united) {
    const SceneGrid& grid = grid_of(unit.members[0]);
    auto bodies = mesher.mesh(grid.grid, nullptr, progress);
    if (!bodies) return bodies.error();
    MeshPart part = part_of_voxels(grid, {std::move((*bodies)[0].mesh), std::move((*bodies)[1].mesh)});
    add_part(std::move(part), unit.members, hierarchy, meshes);
    return {};
  }
  UnitedGrid united(scene, std::move(unit.members));
  auto bodies = mesher.mesh(united.voxels(), &united, progress);
  if (!bodies) return bodies.error();
  std::vector<SmoothMesh> opaque = divide((*bodies)[0], united);
  std::vector<SmoothMesh> transparent = divide((*bodies)[1], united);
  for (std::size_t i = 0; i < united.members().size(); ++i) {
    const LatticeMember& member = united.members()[i];
    MeshPart part = part_of_voxels(grid_of(member), {std::move(opaque[i]), std::move(transparent[i])});
    add_part(std::move(part), {&member, 1}, hierarchy, meshes);
  }
  return {};
}

}  // namespace

SmoothMeshOptions smooth_voxels() {
  SmoothMeshOptions options;
  options.colours = SurfaceColours::Sharp;
  options.keep_thin = true;
  return options;
}

Result<SceneMeshes> mesh_scene_smoothly(const Scene& scene, const SmoothSceneOptions& options, Threads threads,
                                        const Progress& progress) {
  if (auto sound = check_instances(scene, options.instances); !sound) return sound.error();
  SceneMeshes meshes;
  meshes.types = scene.types;
  MeshHierarchy hierarchy(scene, meshes);
  const Mesher mesher(scene, options, threads, meshes.stats);
  std::vector<Unit> units = units_of(scene, options);
  const std::vector<GridHandle> grids = drawn_grids(scene, options.instances);
  const bool has_fields = std::any_of(grids.begin(), grids.end(),
                                      [&](GridHandle handle) { return scene.grids()[handle].field.chunk_count() > 0; });
  const double share_of_voxels = !has_fields ? 1.0 : units.empty() ? 0.0 : 0.5;
  for (std::size_t i = 0; i < units.size(); ++i) {
    const auto share = [&](std::size_t done) {
      return share_of_voxels * static_cast<double>(done) / static_cast<double>(units.size());
    };
    const Progress part = part_of(progress, share(i), share(i + 1));
    if (auto done = add_unit(scene, std::move(units[i]), mesher, part, hierarchy, meshes); !done) return done.error();
  }
  SmoothMeshOptions of_fields;
  of_fields.occlusion = options.mesh.occlusion;
  of_fields.split_sheets = options.mesh.split_sheets;
  of_fields.level_of = options.mesh.level_of;
  const SurfaceOptions wanted{of_fields, options.simplify_error};
  const Progress left = part_of(progress, share_of_voxels, 1.0);
  if (auto done = add_fields(scene, grids, options.instances, wanted, hierarchy, meshes, threads, left); !done) {
    return done.error();
  }
  return meshes;
}

namespace {

/// The maximum distance of a voxel corner from the lattice, in voxels.
constexpr double kTolerance = 1e-3;
/// Larger coordinates are ignored, because their sums would overflow.
constexpr double kFarthest = 1 << 29;

DBox world_box(const SceneGrid& grid, const Instance& instance) {
  DBox box;
  const IBox bounds = grid.grid.bounds();
  for (int i = 0; i < 8; ++i) box.extend(world_from_grid(instance, grid, box_corner(bounds, i)));
  return box;
}

/// A union-find structure over numbers.
class Sets {
 public:
  explicit Sets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }

  std::size_t find(std::size_t i) {
    QUOIN_ASSERT(i < parent_.size(), "one of the numbers");
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  /// Unites two sets. The least number of a set represents it.
  void unite(std::size_t a, std::size_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::size_t> parent_;
};

class Grouping {
 public:
  Grouping(const Scene& scene, const std::vector<InstanceHandle>& instances)
      : scene_(scene), instances_(instances), sets_(instances.size()) {
    for (const InstanceHandle handle : instances) {
      QUOIN_ASSERT(has_valid_transform(instance_of(handle)), "instances with a finite transform");
      boxes_.push_back(world_box(grid_of(handle), instance_of(handle)));
    }
  }

  std::vector<std::vector<LatticeMember>> find() {
    unite_those_that_touch();
    std::vector<std::vector<LatticeMember>> groups;
    std::vector<std::size_t> group_of(instances_.size());
    for (std::size_t i = 0; i < instances_.size(); ++i) {
      const std::size_t first = sets_.find(i);
      QUOIN_ASSERT(first <= i, "the least number represents a set");
      if (first != i) {
        // Relative to the first member. Small errors can add up over many neighbours. An instance with a larger total
        // error becomes a group by itself.
        const auto place = place_in_lattice(scene_, instance_of(instances_[first]), instance_of(instances_[i]));
        if (place) {
          groups[group_of[first]].push_back({instances_[i], *place});
          continue;
        }
      }
      group_of[i] = groups.size();
      groups.push_back({{instances_[i], {}}});
    }
    return groups;
  }

 private:
  [[nodiscard]] const Instance& instance_of(InstanceHandle handle) const { return scene_.instances()[handle]; }
  [[nodiscard]] const SceneGrid& grid_of(InstanceHandle handle) const {
    return scene_.grids()[instance_of(handle).grid];
  }

  /// Sweeps along the axis of the largest spread.
  void unite_those_that_touch() {
    DBox all;
    for (const DBox& box : boxes_) {
      all.extend(box.min);
      all.extend(box.max);
    }
    int axis = 0;
    for (int other = 1; other < 3; ++other) {
      if (all.max[other] - all.min[other] > all.max[axis] - all.min[axis]) axis = other;
    }
    std::vector<std::size_t> order(instances_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return boxes_[i].min[axis]; });
    std::vector<std::size_t> open;
    for (const std::size_t i : order) {
      const double begin = boxes_[i].min[axis];
      std::erase_if(open, [&](std::size_t k) { return boxes_[k].max[axis] + margin(k) < begin; });
      for (const std::size_t k : open) {
        if (sets_.find(i) != sets_.find(k) && touch(std::min(i, k), std::max(i, k))) sets_.unite(i, k);
      }
      open.push_back(i);
    }
  }

  /// Half a voxel: more than rounding, less than a gap.
  [[nodiscard]] double margin(std::size_t i) const { return 0.5 * instance_of(instances_[i]).voxel_size; }

  [[nodiscard]] bool touch(std::size_t a, std::size_t b) const {
    const double more = margin(a);
    for (int axis = 0; axis < 3; ++axis) {
      if (boxes_[a].max[axis] + more < boxes_[b].min[axis] || boxes_[b].max[axis] + more < boxes_[a].min[axis]) {
        return false;
      }
    }
    const auto place = place_in_lattice(scene_, instance_of(instances_[a]), instance_of(instances_[b]));
    if (!place) return false;
    IBox near = grid_of(instances_[a]).grid.bounds();
    near.min -= 1;
    near.max += 1;
    return !intersect(near, place->apply(grid_of(instances_[b]).grid.bounds())).empty();
  }

  const Scene& scene_;
  const std::vector<InstanceHandle>& instances_;
  std::vector<DBox> boxes_;  // in the world
  Sets sets_;
};

}  // namespace

IBox LatticePlace::apply(const IBox& box) const {
  const IVec3 a = orientation.apply(box.min) + offset;
  const IVec3 b = orientation.apply(box.max) + offset;
  return {glm::min(a, b), glm::max(a, b)};
}

LatticePlace LatticePlace::inverse() const {
  const AxisOrientation back = orientation.inverse();
  return {back, -back.apply(offset)};
}

std::optional<LatticePlace> place_in_lattice(const Scene& scene, const Instance& lattice, const Instance& instance) {
  const SceneGrid& own = scene.grids()[lattice.grid];
  const SceneGrid& other = scene.grids()[instance.grid];
  if (!(std::abs(lattice.voxel_size - instance.voxel_size) <= kTolerance * lattice.voxel_size)) return std::nullopt;
  const auto moved = [&](DVec3 point) {
    return grid_from_world(lattice, own, world_from_grid(instance, other, point));
  };
  const IBox box = other.grid.bounds();
  const DVec3 origin = moved(DVec3(box.min));
  glm::dmat3 axes(1.0);
  for (int axis = 0; axis < 3; ++axis) axes[axis] = moved(DVec3(box.min) + axes[axis]) - origin;
  const auto orientation = AxisOrientation::near_matrix(axes, 0.1);
  if (!orientation) return std::nullopt;
  LatticePlace place{*orientation};
  const DVec3 whole = glm::round(origin - place.orientation.apply(DVec3(box.min)));
  const IBox lattice_box = own.grid.bounds();
  const auto is_near = [](DVec3 point) {
    return std::max({std::abs(point.x), std::abs(point.y), std::abs(point.z)}) < kFarthest;
  };
  for (const DVec3 point : {whole, origin, moved(DVec3(box.max)), DVec3(lattice_box.min), DVec3(lattice_box.max),
                            DVec3(box.min), DVec3(box.max)}) {
    if (!is_near(point)) return std::nullopt;
  }
  place.offset = IVec3(whole);
  for (int corner = 0; corner < 8; ++corner) {
    const DVec3 at = box_corner(box, corner);
    const DVec3 off = moved(at) - (place.orientation.apply(at) + DVec3(place.offset));
    if (!(std::max({std::abs(off.x), std::abs(off.y), std::abs(off.z)}) < kTolerance)) return std::nullopt;
  }
  return place;
}

std::vector<std::vector<LatticeMember>> lattice_groups(const Scene& scene,
                                                       const std::vector<InstanceHandle>& instances) {
  return Grouping(scene, instances).find();
}

}  // namespace quoin
