// Rays of one packet that go the same way, together, in AVX2: the units that any of them may pass are found once for
// all, in an order in which each of them passes those that it does; which rays pass an occupied voxel is then asked of
// all lanes. The same results as the walk in lockstep.
//
//     start ______                       origin, inverse: least and greatest of all lanes, mirrored
//     |  ___/   | \___                    -> chunks, bricks, cells, voxels that any lane may pass (BeamPaths)
//     | /       |     \                   -> of each occupied voxel: which lanes pass it; those are done
//     |/________|______|  end

#pragma once

#include "trace/kernel/lockstep.inl"
#include "trace/kernel/paths.inl"

namespace quoin::trace {
namespace {

// A ray passes at most ten of the 64 units of a block; a beam that passes more than this meets voxels that most of its
// rays do not.
constexpr int kWideBeam = 24;
// How wide a beam may be at its end, in voxels: measured. Wider ones walk in lockstep.
constexpr float kBeamWidth = 4.0F;

struct BeamAxis {
  F origin;   // mirrored
  F inverse;  // 1e37 where it is still
  F speed;
  F nudge;
};

struct BeamLanes {
  BeamAxis x, y, z;
  I4 base;
  I4 backward;
  int octant = 0;
  bool nudges = false;
  Mask left;  // have met nothing yet
};

// Fails where some go forward and some backward, or do not start next to the same multiple of 64.
inline bool mirror_axis(const Axis& axis, Mask live, Mask starts_there, int index, BeamLanes& out, BeamAxis& to) {
  const std::uint32_t is_forward = bits(axis.forward & live);
  const std::uint32_t is_backward = bits(live & ~axis.forward & ~axis.still);
  if (is_forward != 0 && is_backward != 0) return false;
  alignas(64) std::int32_t bases[kWidth];
  store(bases, axis.base);
  const int base = bases[std::countr_zero(bits(live) | 1U << (kWidth - 1))];
  if (any(live & ~equals(axis.base, base))) return false;
  const bool is_mirrored = is_backward != 0;
  const F whole = floor(axis.origin);
  const F own = select(axis.still, whole + all(0.5F), axis.origin);
  to.origin = is_mirrored ? all(0.0F) - own : own;
  to.inverse = select(axis.still, all(kStillInverse), abs(axis.inverse));
  to.speed = abs(axis.direction);
  to.nudge = select(axis.forward & ~axis.moved, all(kNudge), all(0.0F));
  out.nudges = out.nudges || any(live & starts_there & axis.forward & ~axis.moved & (whole == axis.origin));
  out.octant |= (is_mirrored ? 1 : 0) << index;
  out.base[index] = base;
  out.backward[index] = is_mirrored ? -1 : 0;
  return true;
}

struct Span {
  float least, greatest;
};

inline Span span_of(F a, Mask live) {
  return {least_of(select(live, a, all(kNever))), 0.0F - least_of(select(live, all(0.0F) - a, all(kNever)))};
}

inline Beam beam_of(const BeamLanes& lanes, F exit_t) {
  Beam beam{};
  const BeamAxis* axes[] = {&lanes.x, &lanes.y, &lanes.z};
  for (int i = 0; i < 3; ++i) {
    const Span origin = span_of(axes[i]->origin, lanes.left);
    const Span inverse = span_of(axes[i]->inverse, lanes.left);
    beam.least_origin[i] = origin.least;
    beam.greatest_origin[i] = origin.greatest;
    beam.least_inverse[i] = inverse.least;
    beam.greatest_inverse[i] = inverse.greatest;
  }
  beam.end = span_of(exit_t, lanes.left).greatest * 1.001F + 1e-6F;
  return beam;
}

// Whether no ray is far from the first one, where it starts and where it ends.
inline bool is_narrow(const Lanes& lanes) {
  const int first = std::countr_zero(bits(lanes.live) | 1U << (kWidth - 1));
  const auto apart = [first](F a) {
    alignas(64) float each[kWidth];
    store(each, a);
    return abs(a - all(each[first]));
  };
  const auto width = [&](const Axis& axis) { return apart(axis.origin) + apart(axis.direction) * lanes.exit_t; };
  const F widest = max(max(width(lanes.x), width(lanes.y)), width(lanes.z));
  return !any(lanes.live & (all(kBeamWidth) < widest));
}

inline F beam_t(const BeamAxis& axis, float plane, bool nudges) {
  const F t = (all(plane) - axis.origin) * axis.inverse;
  return nudges ? t - axis.nudge : t;
}

// Asks the lanes that are left which of them pass the voxel with these lower planes, and records it.
inline void meet(BeamLanes& lanes, F4 voxel, Met& met) {
  const F lx = beam_t(lanes.x, voxel[0], lanes.nudges);
  const F ly = beam_t(lanes.y, voxel[1], lanes.nudges);
  const F lz = beam_t(lanes.z, voxel[2], lanes.nudges);
  const F hx = beam_t(lanes.x, voxel[0] + 1.0F, lanes.nudges);
  const F hy = beam_t(lanes.y, voxel[1] + 1.0F, lanes.nudges);
  const F hz = beam_t(lanes.z, voxel[2] + 1.0F, lanes.nudges);
  const F yz = min(hy, hz);
  const F xy = min(hx, hy);
  const Mask pass = lanes.left & (lx <= yz) & (lz < xy) & (ly < hx) & (ly <= hz) & (all(0.0F) <= min(xy, hz));
  if (!any(pass)) return;
  const F last = max(max(lx, ly), lz);
  const I axis = select(lz == last, all(2), select(ly == last, all(1), all(0)));
  const F4 native = mirrored_planes(lanes.backward ? voxel + 1.0F : voxel, lanes.backward);
  const I4 at = __builtin_convertvector(native, I4) + lanes.base;
  met.x = select(pass, all(at[0]), met.x);
  met.y = select(pass, all(at[1]), met.y);
  met.z = select(pass, all(at[2]), met.z);
  met.axis = select(pass, axis, met.axis);
  met.inside = met.inside | (pass & (last < all(0.0F)));
  met.hit = met.hit | pass;
  lanes.left = lanes.left & ~pass;
}

// Traces the lanes through a brick.
inline void trace_brick(const Node& words, std::uint64_t cells, BeamLanes& lanes, const BeamPaths& paths, F4 brick,
                        Met& met) {
  const Mirror mirrored(lanes.octant);
  for (; cells != 0; cells &= cells - 1) {
    const int cell = std::countr_zero(cells);
    const F4 in_cell = brick + corner_of(cell) * 4.0F;
    const std::uint64_t& word = words[static_cast<std::size_t>(cell ^ flip_of(lanes.octant))];
    std::uint64_t voxels = paths.units<0>(in_cell) & mirrored(&word);
    for (; voxels != 0; voxels &= voxels - 1) {
      meet(lanes, in_cell + corner_of(std::countr_zero(voxels)), met);
      if (!any(lanes.left)) return;
    }
  }
}

// Traces the lanes through the 4^3 chunks with these lower planes; false when the beam is too wide to be worth it.
inline bool trace_chunks(const TreeView& tree, BeamLanes& lanes, const BeamPaths& paths, F4 block, Met& met) {
  const Mirror mirrored(lanes.octant);
  for (std::uint64_t chunks = paths.units<3>(block); chunks != 0; chunks &= chunks - 1) {
    const F4 chunk = block + corner_of(std::countr_zero(chunks)) * kChunkSize;
    const F4 native = mirrored_planes(lanes.backward ? chunk + kChunkSize : chunk, lanes.backward);
    const I4 place = (__builtin_convertvector(native, I4) + lanes.base) >> 6;
    const I4 sizes = I4{tree.brick_sizes.x, tree.brick_sizes.y, tree.brick_sizes.z, 0} >> 2;
    if (mask3((place < 0) | (place >= sizes)) != 0) continue;
    const FlatChunk& entry =
        tree.chunks[place[0] + place[1] * tree.chunk_strides[1] + place[2] * tree.chunk_strides[2]];
    if (entry.bricks == 0) continue;
    const std::uint64_t passed = paths.units<2>(chunk);
    if (std::popcount(passed) > kWideBeam) return false;
    std::uint64_t bricks = passed & mirrored(&entry.bricks);
    for (; bricks != 0; bricks &= bricks - 1) {
      const int brick = std::countr_zero(bricks);
      const F4 in_brick = chunk + corner_of(brick) * 16.0F;
      const auto at = static_cast<std::size_t>(brick ^ flip_of(lanes.octant));
      const std::uint64_t cells = paths.units<1>(in_brick);
      if (std::popcount(cells) > kWideBeam) return false;
      trace_brick(tree.nodes[entry.node->bricks[at]], cells & mirrored(&entry.node->cells[at]), lanes, paths, in_brick,
                  met);
      if (!any(lanes.left)) return true;
    }
  }
  return true;
}

inline F4 chunk_block(const BeamLanes& lanes, F t) {
  const auto first = [&](const BeamAxis& axis) {
    const F position = axis.origin + t * axis.speed - all(kSlack);
    return least_of(select(lanes.left, position, all(kNever)));
  };
  return floor4(F4{first(lanes.x), first(lanes.y), first(lanes.z), 0.0F} * (1.0F / kChunkSize)) * kChunkSize;
}

// Returns the lanes that are to be traced otherwise: it was not asked to serve them, or did not get on.
inline Mask trace_beam(const TreeView& tree, const Lanes& lanes, F t, const Crossing& entered, Met& met) {
  if (!is_narrow(lanes)) return lanes.live;
  BeamLanes beam;
  beam.left = lanes.live;
  const Mask starts_there = ~(entered.x | entered.y | entered.z) | (t == all(0.0F));
  if (any(lanes.unfinished) || !mirror_axis(lanes.x, lanes.live, starts_there, 0, beam, beam.x) ||
      !mirror_axis(lanes.y, lanes.live, starts_there, 1, beam, beam.y) ||
      !mirror_axis(lanes.z, lanes.live, starts_there, 2, beam, beam.z)) {
    return lanes.live;
  }
  const BeamPaths paths(beam_of(beam, lanes.exit_t));
  F4 block = chunk_block(beam, t);
  for (;;) {
    if (!trace_chunks(tree, beam, paths, block, met)) return beam.left;
    const F4 far = block + 4.0F * kChunkSize;
    const F out = min(min(beam_t(beam.x, far[0], false), beam_t(beam.y, far[1], false)), beam_t(beam.z, far[2], false));
    beam.left = beam.left & (out <= lanes.exit_t);
    if (!any(beam.left)) return beam.left;
    const F4 next = chunk_block(beam, out);
    if (mask3(next < block) != 0 || mask3(next > block) == 0) return beam.left;
    block = next;
  }
}

}  // namespace
}  // namespace quoin::trace
