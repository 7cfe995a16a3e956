// One ray in a field of densities: the walk of trace/kernel/single.inl through cells that touch the solid, each asked
// for where the field in it becomes negative, until one says so.

#pragma once

#include "trace/kernel/cell.inl"
#include "trace/kernel/single.inl"

namespace quoin::trace {
namespace {

template <bool kAsksWhere>
inline bool first_in_field(const FieldView& field, const Ray& ray, double max_t, FieldHit& hit, bool& unfinished) {
  const TreeView& tree = *field.cells;
  unfinished = false;
  PathRay path;
  const SetUp ready = set_up_path(tree, ray, max_t, path);
  if (ready != SetUp::Ready) {
    unfinished = ready == SetUp::Unusual;
    return false;
  }
  const CellRay in_cells = cell_ray(ray, max_t);
  const I4 origin = {static_cast<int>(tree.origin.x), static_cast<int>(tree.origin.y), static_cast<int>(tree.origin.z),
                     0};
  unfinished = path.is_cut;
  bool is_hit = false;
  I4 known = {};
  const DensityStorage* chunk = nullptr;
  bool knows = false;
  PathWalk walk(tree, path);
  walk.walk([&](int brick, int cell, std::uint64_t met) {
    const F4 in_cell = walk.corner_of_cell(brick, cell);
    if (walk.is_too_far(in_cell)) return unfinished = true;
    for (; met != 0; met &= met - 1) {
      const I4 at = walk.native_voxel(in_cell + corner_of(std::countr_zero(met))) + origin;
      const I4 its_chunk = at >> 6;
      if (!knows || mask3(its_chunk != known) != 0) {
        known = its_chunk;
        knows = true;
        chunk = field.find(*field.grid, known[0], known[1], known[2]);
      }
      const I4 local = at & 63;
      Corners corners;
      if (chunk != nullptr && mask3(local == 63) == 0) {
        corners = corners_within(*chunk, local[0], local[1], local[2]);
      } else {
        field.read(*field.grid, at[0], at[1], at[2], reinterpret_cast<float*>(&corners.density));
      }
      const CellD4 place = __builtin_convertvector(at, CellD4);
      const double t = meet_cell<kAsksWhere>(in_cells, place, span_in(in_cells, place), corners);
      if (t < 0.0) continue;
      hit.t = t;
      hit.x = at[0], hit.y = at[1], hit.z = at[2];
      std::memcpy(hit.corners, &corners, sizeof hit.corners);
      unfinished = false;
      return is_hit = true;
    }
    return false;
  });
  return is_hit;
}

}  // namespace
}  // namespace quoin::trace
