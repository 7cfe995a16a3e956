#include <algorithm>
#include <bit>
#include <cstddef>
#include <new>
#include <type_traits>

#include <glm/matrix.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "scene/tracer/packet_tree.h"
#include "scene/tracer/placed_grid.h"
#include "scene/tracer/scene_tracer_impl.h"
#include "scene/tracer/scene_view.h"
#include "trace/density/density_glass.h"

namespace quoin {
namespace {

constexpr std::size_t kLanes = RayPacket::kSize;

// Uninitialised memory for an object that is written before it is read: clearing packets takes longer than filling
// them.
template <class T>
class RoomFor {
 public:
  RoomFor() {}  // NOLINT: left as it is
  [[nodiscard]] T& operator*() { return *std::launder(reinterpret_cast<T*>(bytes_)); }

 private:
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);
  alignas(T) std::byte bytes_[sizeof(T)];
};

// The lanes of a packet, unpacked on demand.
class LanesWhenNeeded {
 public:
  LanesWhenNeeded(const RayPacket& rays, const PacketBounds& bounds) : rays_(rays), bounds_(bounds) {}
  [[nodiscard]] PacketLanes& operator*() {
    if (!is_made_) new (&*lanes_) PacketLanes(rays_, bounds_);
    is_made_ = true;
    return *lanes_;
  }

 private:
  const RayPacket& rays_;
  const PacketBounds& bounds_;
  RoomFor<PacketLanes> lanes_;
  bool is_made_ = false;
};

void turn(const glm::dmat3& axes, const RayPacket::Lanes<double> (&from)[3], DVec3 offset, RayPacket::Lanes<double>& x,
          RayPacket::Lanes<double>& y, RayPacket::Lanes<double>& z) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    const double fx = from[0][i];
    const double fy = from[1][i];
    const double fz = from[2][i];
    x[i] = axes[0].x * fx + axes[1].x * fy + axes[2].x * fz + offset.x;
    y[i] = axes[0].y * fx + axes[1].y * fy + axes[2].y * fz + offset.y;
    z[i] = axes[0].z * fx + axes[1].z * fy + axes[2].z * fz + offset.z;
  }
}

void move(const Affine& by, const RayPacket& from, RayPacket& to) {
  turn(by.axes, {from.origin_x, from.origin_y, from.origin_z}, by.offset, to.origin_x, to.origin_y, to.origin_z);
  turn(by.axes, {from.direction_x, from.direction_y, from.direction_z}, DVec3(0.0), to.direction_x, to.direction_y,
       to.direction_z);
  to.max_t = from.max_t;
  to.active = from.active;
}

bool has_opaque(const PlacedGrid& placed) {
  return !placed.opaque->bounds().empty();
}

bool has_transparent(const PlacedGrid& placed) {
  return placed.glass_voxels != nullptr || placed.face_cells != nullptr || placed.glass != nullptr;
}

// Adds the rays that hit the opaque field of a placed grid to `blocked`, the rays that hit its voxels. Rays are in its
// space.
std::uint32_t blocked_by_field(const PlacedGrid& placed, const RayPacket& rays_in_grid, std::uint32_t blocked) {
  if (placed.opaque_field == nullptr || blocked == rays_in_grid.active) return blocked;
  RayPacket rest = rays_in_grid;
  rest.active &= ~blocked;
  return blocked | quoin::any_hits(*placed.opaque_field, rest);
}

// Sets `blocked[i]` to the rays of packet i that hit an opaque voxel or shape of a placed grid. They are in its space.
void find_blocked(const PlacedGrid& placed, const VoxelRegistry& types, std::span<const RayPacket> packets_in_grid,
                  std::span<std::uint32_t> blocked, MostRays expected) {
  if (placed.shapes != nullptr) {
    return any_solids(*placed.shapes, *placed.opaque, *placed.voxels, types, packets_in_grid, blocked, expected);
  }
  if (has_opaque(placed)) return quoin::any_hits(*placed.opaque, packets_in_grid, blocked);
  std::fill_n(blocked.begin(), packets_in_grid.size(), 0U);
}

// Returns the rays that hit an opaque voxel, shape or field of a placed grid. They are in its space.
std::uint32_t blocked_by(const PlacedGrid& placed, const VoxelRegistry& types, const RayPacket& rays_in_grid) {
  std::uint32_t blocked = 0;
  if (placed.shapes != nullptr) {
    any_solids(*placed.shapes, *placed.opaque, *placed.voxels, types, std::span(&rays_in_grid, 1),
               std::span(&blocked, 1));
  } else if (has_opaque(placed)) {
    blocked = quoin::any_hits(*placed.opaque, rays_in_grid);
  }
  return blocked_by_field(placed, rays_in_grid, blocked);
}

// Returns the maximum distance of the active rays.
double farthest(const RayPacket& rays) {
  double max_t = 0.0;
  for (std::uint32_t left = rays.active; left != 0; left &= left - 1) {
    max_t = std::max(max_t, rays.max_t[static_cast<std::size_t>(std::countr_zero(left))]);
  }
  return max_t;
}

}  // namespace

struct SceneView::Impl {
  const SceneTracer* tracer = nullptr;
  std::vector<Affine> grid_from_view;
  std::vector<Affine> view_from_grid;
  DVec3 origin{0.0};
  PacketTree instances;                 // in view space
  PacketTree seen;                      // the instances that `first_hits` sees, if not all
  std::vector<bool> left_to_impostors;  // empty: sees all
  bool is_alone = false;                // there is one instance
  PacketTree with_glass;                // the `instances` with transparent contents, if there are several
  std::vector<std::size_t> glass;       // their indices
  bool has_cells = false;               // any of them has cells of faces

  void find_glass_instances() {
    const BlockVector<PlacedGrid>& placed = placed_in(*tracer);
    std::vector<bool> left_out(placed.size());
    for (std::size_t i = 0; i < placed.size(); ++i) {
      left_out[i] = !has_transparent(placed[i]);
      if (!left_out[i]) glass.push_back(i);
      has_cells |= placed[i].face_cells != nullptr;
    }
    if (glass.size() > 1) with_glass = PacketTree(tracer->impl().instances, origin, left_out);
  }

  // Returns the rays in view space that hit a transparent voxel or field of the instance.
  [[nodiscard]] std::uint32_t meet_glass(std::size_t index, std::uint32_t near, const RayPacket& in_view,
                                         RayPacket& room, bool with_faces) const {
    QUOIN_ASSERT(index < grid_from_view.size() && is_current(), "an instance of a tracer that was not updated since");
    const PlacedGrid& placed = placed_in(*tracer)[index];
    move(grid_from_view[index], in_view, room);
    room.active = near;
    std::uint32_t met = placed.glass_voxels == nullptr ? 0 : quoin::any_hits(*placed.glass_voxels, room);
    if (with_faces && placed.face_cells != nullptr) {
      room.active &= ~met;
      met |= quoin::any_hits(*placed.face_cells, room);
    }
    if (placed.glass == nullptr) return met;
    room.active &= ~met;
    return met | quoin::any_hits(placed.glass->cells(), room);
  }
  // Returns true if `meet_through` finds more than `any_transparent`.
  [[nodiscard]] bool has_first_hits() const {
    if (!is_alone || glass.empty()) return false;
    const PlacedGrid& placed = placed_in(*tracer).front();
    return placed.shapes != nullptr || placed.face_cells != nullptr;
  }
  // Fills in the hits of rays in the space of the only instance of the scene, `hits.rays`.
  void meet_through(bool with_faces, ThroughHits& hits) const {
    const PlacedGrid& placed = placed_in(*tracer).front();
    hits.has_first = true;
    hits.first_glass.hit = hits.first_faces.hit = 0;
    if (placed.glass_voxels != nullptr && placed.shapes != nullptr) {
      first_glass(*placed.shapes, *placed.glass_voxels, hits.rays, hits.first_glass);
    } else if (placed.glass_voxels != nullptr) {
      quoin::first_hits(*placed.glass_voxels, hits.rays, hits.first_glass);
    }
    if (with_faces && placed.face_cells != nullptr) {
      quoin::first_hits(*placed.face_cells, hits.rays, hits.first_faces);
    }
    hits.glass = hits.first_glass.hit;
    hits.faces = hits.first_faces.hit;
    if (placed.glass != nullptr) hits.glass |= quoin::any_hits(placed.glass->cells(), hits.rays);
  }
  [[nodiscard]] std::uint32_t any_transparent(const RayPacket& rays_in_view, bool with_faces) const;
  void find_blocked(std::int32_t home, std::span<const RayPacket> packets_in_grid, std::span<std::uint32_t> blocked,
                    MostRays expected) const;
  // Returns `blocked` and the other rays, in the space of grid `own`, that hit another instance.
  [[nodiscard]] std::uint32_t blocked_by_others(std::size_t own, const RayPacket& rays_in_grid,
                                                std::uint32_t blocked) const;
  [[nodiscard]] bool sees_all() const { return left_to_impostors.empty(); }
  // Returns false if an update of the tracer added or removed placed grids, which invalidates the view.
  [[nodiscard]] bool is_current() const { return placed_in(*tracer).size() == grid_from_view.size(); }

  // Takes the hits that are nearer than those known. Returns their lanes.
  std::uint32_t take_nearer(std::size_t placed, const PacketHits& found, RayPacket& rays, SceneHits& hits) const {
    std::uint32_t taken = 0;
    for (std::uint32_t left = found.hit; left != 0; left &= left - 1) {
      const int lane = std::countr_zero(left);
      const auto i = static_cast<std::size_t>(lane);
      const std::uint32_t bit = 1U << lane;
      const auto index = static_cast<std::int32_t>(placed);
      if ((hits.grids.hit & bit) != 0) {
        if (found.t[i] > hits.grids.t[i]) continue;
        if (found.t[i] == hits.grids.t[i] && index > hits.placed[i]) continue;
      }
      hits.grids.hit |= bit;
      hits.grids.starts_inside = (hits.grids.starts_inside & ~bit) | (found.starts_inside & bit);
      hits.grids.x[i] = found.x[i], hits.grids.y[i] = found.y[i], hits.grids.z[i] = found.z[i];
      hits.grids.t[i] = found.t[i];
      hits.grids.face[i] = found.face[i];
      hits.placed[i] = index;
      hits.in_field &= ~bit;
      hits.in_shape &= ~bit;
      rays.max_t[i] = found.t[i];
      taken |= bit;
    }
    return taken;
  }

  // Finds the first hits in the only instance of the scene.
  void meet_alone(const RayPacket& rays_in_view, SceneHits& hits) const {
    QUOIN_ASSERT(grid_from_view.size() == 1 && is_current(), "the only instance of the scene");
    const PlacedGrid& placed = placed_in(*tracer).front();
    RoomFor<RayPacket> room_for_rays;
    RayPacket& rays = *room_for_rays;
    move(grid_from_view.front(), rays_in_view, rays);
    if (placed.shapes != nullptr) {
      hits.in_shape =
          first_solids(*placed.shapes, *placed.voxels, tracer->scene().types, rays, hits.grids, hits.shapes);
    } else if (has_opaque(placed)) {
      quoin::first_hits(*placed.opaque, rays, hits.grids);
    }
    hits.placed.fill(0);
    if (placed.opaque_field == nullptr) return;
    for (std::size_t i = 0; i < kLanes; ++i) {
      if ((hits.grids.hit >> i & 1U) != 0) rays.max_t[i] = hits.grids.t[i];
    }
    (void)add_field(placed, 0, rays, hits);
  }

  // Finds hits of the lanes `near` in an instance that are nearer than those in `hits`. Lowers the max_t of these rays.
  // Returns the lanes with a new hit.
  std::uint32_t meet(std::size_t index, std::uint32_t near, RayPacket& left, SceneHits& hits) const {
    QUOIN_ASSERT(index < grid_from_view.size() && is_current(), "an instance of a tracer that was not updated since");
    const PlacedGrid& placed = placed_in(*tracer)[index];
    RoomFor<RayPacket> room_for_rays;
    RayPacket& rays = *room_for_rays;
    move(grid_from_view[index], left, rays);
    rays.active = near;
    std::uint32_t met = 0;
    RoomFor<PacketHits> room_for_hits;
    PacketHits& found = *room_for_hits;
    if (placed.shapes != nullptr) {
      RoomFor<RayPacket::Lanes<ShapeHit>> room_for_shapes;
      RayPacket::Lanes<ShapeHit>& shapes = *room_for_shapes;
      const std::uint32_t in_shape =
          first_solids(*placed.shapes, *placed.voxels, tracer->scene().types, rays, found, shapes);
      met = found.hit;
      const std::uint32_t taken = take_nearer(index, found, left, hits) & in_shape;
      hits.in_shape |= taken;
      for (std::uint32_t each = taken; each != 0; each &= each - 1) {
        const auto lane = static_cast<std::size_t>(std::countr_zero(each));
        hits.shapes[lane] = shapes[lane];
      }
    } else if (has_opaque(placed)) {
      quoin::first_hits(*placed.opaque, rays, found);
      met = found.hit;
      take_nearer(index, found, left, hits);
    }
    if (placed.opaque_field == nullptr) return met;
    rays.max_t = left.max_t;
    const std::uint32_t taken = add_field(placed, index, rays, hits);
    for (std::uint32_t each = taken; each != 0; each &= each - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(each));
      left.max_t[lane] = hits.grids.t[lane];
    }
    return met | taken;
  }

  // Adds hits with the opaque field of a placed grid that are nearer than those in `hits`. The rays are in the grid's
  // space and limited to the known hits. Returns the lanes with a new hit.
  static std::uint32_t add_field(const PlacedGrid& placed, std::size_t index, const RayPacket& rays_in_grid,
                                 SceneHits& hits) {
    QUOIN_ASSERT(placed.opaque_field != nullptr, "a placed grid with an opaque field");
    DensityPacketHits found;
    quoin::first_hits(*placed.opaque_field, rays_in_grid, found);
    std::uint32_t taken = 0;
    for (std::uint32_t left = found.hit; left != 0; left &= left - 1) {
      const int lane = std::countr_zero(left);
      const auto i = static_cast<std::size_t>(lane);
      const DensityHit& hit = found.lanes[i];
      if ((hits.grids.hit >> lane & 1U) != 0) {
        if (hit.t > hits.grids.t[i]) continue;
        if (hit.t == hits.grids.t[i] && static_cast<std::int32_t>(index) >= hits.placed[i]) continue;
      }
      hits.grids.starts_inside &= ~(1U << lane);
      hits.grids.set(lane, {hit.cell, nearest_direction(hit.normal), hit.t, hit.starts_inside});
      hits.placed[i] = static_cast<std::int32_t>(index);
      const Ray ray = rays_in_grid.ray(lane);
      const DVec3 normal = smooth_normal(placed.opaque_field->field(), ray.origin + ray.direction * hit.t, hit);
      hits.normal_x[i] = static_cast<float>(normal.x);
      hits.normal_y[i] = static_cast<float>(normal.y);
      hits.normal_z[i] = static_cast<float>(normal.z);
      hits.material[i] = hit.material;
      taken |= 1U << lane;
    }
    hits.in_field |= taken;
    hits.in_shape &= ~taken;
    return taken;
  }
};

SceneView::SceneView(const SceneTracer& tracer, DVec3 origin) : impl_(std::make_unique<Impl>()) {
  impl_->tracer = &tracer;
  for (const PlacedGrid& placed : placed_in(tracer)) {
    // Subtracts the two far positions first: the difference is small and usually exact.
    const DVec3 position = placed.position - origin;
    const glm::dmat3 grid_axes = glm::transpose(placed.world_axes) / placed.voxel_size;
    impl_->grid_from_view.push_back({grid_axes, placed.pivot - grid_axes * position});
    const glm::dmat3 view_axes = placed.world_axes * placed.voxel_size;
    impl_->view_from_grid.push_back({view_axes, position - view_axes * placed.pivot});
  }
  QUOIN_ASSERT(tracer.impl().instances.boxes().size() == placed_in(tracer).size(), "a box per placed grid");
  impl_->origin = origin;
  impl_->instances = PacketTree(tracer.impl().instances, origin);
  impl_->is_alone = placed_in(tracer).size() == 1;
  impl_->find_glass_instances();
}

SceneView::SceneView(SceneView&&) noexcept = default;
SceneView& SceneView::operator=(SceneView&&) noexcept = default;
SceneView::~SceneView() = default;

const SceneTracer& SceneView::tracer() const {
  return *impl_->tracer;
}

void SceneView::leave_to_impostors(std::span<const std::int32_t> placed) {
  if (placed.empty()) return;
  impl_->left_to_impostors.resize(placed_in(*impl_->tracer).size());
  for (const std::int32_t i : placed) {
    QUOIN_ASSERT(i >= 0 && static_cast<std::size_t>(i) < impl_->left_to_impostors.size(), "a placed grid");
    impl_->left_to_impostors[static_cast<std::size_t>(i)] = true;
  }
  impl_->seen = PacketTree(impl_->tracer->impl().instances, impl_->origin, impl_->left_to_impostors);
}

void SceneView::first_hits(const RayPacket& rays_in_view, SceneHits& hits) const {
  hits.grids.hit = hits.grids.starts_inside = hits.in_field = hits.in_shape = 0;
  if (impl_->is_alone && impl_->sees_all()) {
    impl_->meet_alone(rays_in_view, hits);
    return;
  }
  RayPacket left = rays_in_view;  // `max_t` shrinks to the nearest hits so far
  PacketBounds bounds(left);
  LanesWhenNeeded lanes(left, bounds);
  const PacketTree& seen = impl_->sees_all() ? impl_->instances : impl_->seen;
  seen.visit(bounds, [&](std::size_t i, const FourBoxes& boxes, std::size_t box) {
    const std::uint32_t near = (*lanes).meet(boxes, box) & left.active;
    if (near == 0) return true;
    const std::uint32_t met = impl_->meet(i, near, left, hits);
    if (met == 0) return true;
    for (std::uint32_t each = met; each != 0; each &= each - 1) {
      const int lane = std::countr_zero(each);
      (*lanes).set_reach(lane, left.max_t[static_cast<std::size_t>(lane)]);
    }
    if (hits.grids.hit == left.active) bounds.set_reach(farthest(left));
    return true;
  });
}

std::uint32_t SceneView::any_hits(std::int32_t home, const RayPacket& rays_in_grid, MostRays expected) const {
  std::uint32_t blocked = 0;
  impl_->find_blocked(home, std::span(&rays_in_grid, 1), std::span(&blocked, 1), expected);
  return blocked;
}

void SceneView::any_hits(std::int32_t home, std::span<const RayPacket> packets_in_grid,
                         std::span<std::uint32_t> blocked) const {
  impl_->find_blocked(home, packets_in_grid, blocked, MostRays::Miss);
}

void SceneView::Impl::find_blocked(std::int32_t home, std::span<const RayPacket> packets_in_grid,
                                   std::span<std::uint32_t> blocked, MostRays expected) const {
  const BlockVector<PlacedGrid>& placed = placed_in(*tracer);
  const auto own = static_cast<std::size_t>(home);
  QUOIN_ASSERT(own < placed.size() && is_current(), "a placed grid of a tracer that was not updated since");
  QUOIN_ASSERT(blocked.size() >= packets_in_grid.size(), "a mask for every packet");
  quoin::find_blocked(placed[own], tracer->scene().types, packets_in_grid, blocked, expected);
  for (std::size_t i = 0; i < packets_in_grid.size(); ++i) {
    blocked[i] = blocked_by_field(placed[own], packets_in_grid[i], blocked[i]);
    if (!is_alone) blocked[i] = blocked_by_others(own, packets_in_grid[i], blocked[i]);
  }
}

std::uint32_t SceneView::Impl::blocked_by_others(std::size_t own, const RayPacket& rays_in_grid,
                                                 std::uint32_t blocked) const {
  if (blocked == rays_in_grid.active) return blocked;
  const BlockVector<PlacedGrid>& placed = placed_in(*tracer);
  RoomFor<RayPacket> room_in_view;
  RayPacket& in_view = *room_in_view;
  move(view_from_grid[own], rays_in_grid, in_view);
  in_view.active &= ~blocked;
  const PacketBounds bounds(in_view);
  LanesWhenNeeded lanes(in_view, bounds);
  RoomFor<RayPacket> room_for_rays;
  RayPacket& rays = *room_for_rays;
  instances.visit(bounds, [&](std::size_t i, const FourBoxes& boxes, std::size_t box) {
    if (i == own) return true;
    const std::uint32_t near = (*lanes).meet(boxes, box) & in_view.active;
    if (near == 0) return true;
    move(grid_from_view[i], in_view, rays);
    rays.active = near;
    const std::uint32_t found = blocked_by(placed[i], tracer->scene().types, rays);
    blocked |= found;
    in_view.active &= ~found;
    return in_view.active != 0;
  });
  return blocked;
}

std::uint32_t SceneView::Impl::any_transparent(const RayPacket& rays_in_view, bool with_faces) const {
  if (rays_in_view.active == 0 || glass.empty()) return 0;
  RoomFor<RayPacket> room_for_rays;
  if (glass.size() == 1) {
    return meet_glass(glass.front(), rays_in_view.active, rays_in_view, *room_for_rays, with_faces);
  }
  RayPacket left = rays_in_view;
  const PacketBounds bounds(left);
  LanesWhenNeeded lanes(left, bounds);
  with_glass.visit(bounds, [&](std::size_t i, const FourBoxes& boxes, std::size_t box) {
    const std::uint32_t near = (*lanes).meet(boxes, box) & left.active;
    if (near != 0) left.active &= ~meet_glass(i, near, left, *room_for_rays, with_faces);
    return left.active != 0;
  });
  return rays_in_view.active & ~left.active;
}

std::uint32_t SceneView::any_transparent(const RayPacket& rays_in_view) const {
  return impl_->any_transparent(rays_in_view, true);
}

void SceneView::find_through(const RayPacket& rays_in_view, ThroughHits& hits) const {
  if (impl_->has_first_hits()) {
    move(impl_->grid_from_view.front(), rays_in_view, hits.rays);
    return impl_->meet_through(true, hits);
  }
  hits.has_first = false;
  hits.rays = rays_in_view;
  hits.faces = 0;
  hits.glass = impl_->any_transparent(rays_in_view, true);
}

void SceneView::find_glass(std::int32_t home, const RayPacket& rays_in_grid, ThroughHits& hits) const {
  QUOIN_ASSERT(static_cast<std::size_t>(home) < placed_in(*impl_->tracer).size(), "a placed grid");
  if (impl_->has_first_hits()) {
    hits.rays = rays_in_grid;
    return impl_->meet_through(false, hits);
  }
  hits.has_first = false;
  hits.faces = 0;
  move(impl_->view_from_grid[static_cast<std::size_t>(home)], rays_in_grid, hits.rays);
  hits.glass = impl_->any_transparent(hits.rays, false);
}

std::uint32_t SceneView::visit_face_cells(
    std::int32_t home, const RayPacket& rays_in_grid,
    FunctionRef<std::uint32_t(std::int32_t, const RayPacket&, const PacketHits&)> visit) const {
  const BlockVector<PlacedGrid>& placed = placed_in(*impl_->tracer);
  const auto own = static_cast<std::size_t>(home);
  QUOIN_ASSERT(own < placed.size() && impl_->is_current(), "a placed grid of a tracer that was not updated since");
  RoomFor<PacketHits> room_for_hits;
  PacketHits& first = *room_for_hits;
  const auto visit_one = [&](std::size_t i, const RayPacket& rays) {
    if (placed[i].face_cells == nullptr) return std::uint32_t{0};
    // Most rays miss, and the kernel that finds no distances is faster.
    const std::uint32_t met = quoin::any_hits(*placed[i].face_cells, rays);
    if (met == 0) return std::uint32_t{0};
    RoomFor<RayPacket> room;
    RayPacket& meeting = *room;
    meeting = rays;
    meeting.active = met;
    quoin::first_hits(*placed[i].face_cells, meeting, first);
    return visit(static_cast<std::int32_t>(i), meeting, first);
  };
  std::uint32_t ended = visit_one(own, rays_in_grid);
  if (impl_->is_alone || !impl_->has_cells || ended == rays_in_grid.active) return ended;
  RayPacket left = view_from_grid(home, rays_in_grid);
  left.active &= ~ended;
  const PacketBounds bounds(left);
  LanesWhenNeeded lanes(left, bounds);
  RoomFor<RayPacket> room_for_rays;
  RayPacket& rays = *room_for_rays;
  const PacketTree& instances = impl_->glass.size() > 1 ? impl_->with_glass : impl_->instances;
  instances.visit(bounds, [&](std::size_t i, const FourBoxes& boxes, std::size_t box) {
    if (i == own || placed[i].face_cells == nullptr) return true;
    const std::uint32_t near = (*lanes).meet(boxes, box) & left.active;
    if (near == 0) return true;
    move(impl_->grid_from_view[i], left, rays);
    rays.active = near;
    const std::uint32_t found = visit_one(i, rays);
    ended |= found;
    left.active &= ~found;
    return left.active != 0;
  });
  return ended;
}

void SceneView::visit_transparent(const Ray& ray_in_view, double max_t,
                                  FunctionRef<void(std::int32_t, const Ray&)> visit) const {
  const auto visit_one = [&](std::size_t i) {
    const Affine& to_grid = impl_->grid_from_view[i];
    visit(static_cast<std::int32_t>(i), {to_grid.point(ray_in_view.origin), to_grid.axes * ray_in_view.direction});
  };
  if (impl_->glass.size() == 1) return visit_one(impl_->glass.front());
  RayPacket alone;
  alone.set(0, ray_in_view, max_t);
  impl_->with_glass.visit(PacketBounds(alone), [&](std::size_t i, const FourBoxes&, std::size_t) {
    visit_one(i);
    return true;
  });
}

const Affine& SceneView::grid_from_view(std::int32_t placed) const {
  QUOIN_ASSERT(static_cast<std::size_t>(placed) < impl_->grid_from_view.size(), "a placed grid");
  return impl_->grid_from_view[static_cast<std::size_t>(placed)];
}

const Affine& SceneView::view_from_grid(std::int32_t placed) const {
  QUOIN_ASSERT(static_cast<std::size_t>(placed) < impl_->view_from_grid.size(), "a placed grid");
  return impl_->view_from_grid[static_cast<std::size_t>(placed)];
}

RayPacket SceneView::view_from_grid(std::int32_t placed, const RayPacket& rays_in_grid) const {
  RayPacket rays;
  move(view_from_grid(placed), rays_in_grid, rays);
  return rays;
}

}  // namespace quoin
