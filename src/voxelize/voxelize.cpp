#include <quoin/voxelize/voxelize.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/thousands.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/grid.h>

#include "core/caches.h"
#include "core/work/progress_steps.h"
#include "grid/colour_table.h"
#include "voxelize/crossings.h"
#include "voxelize/surface_colours.h"
#include "voxelize/voxel_frame.h"

namespace quoin {

namespace voxelizing {
namespace {

/// The half plane on the inner side of an edge in a projection, grown by a unit square: a square with the lowest corner
/// (a, b) meets it if a * slope_a + b * slope_b + offset >= 0.
struct HalfPlane {
  double slope_a = 0.0;
  double slope_b = 0.0;
  double offset = 0.0;

  [[nodiscard]] double at(double a, double b) const { return slope_a * a + slope_b * b + offset; }
};

/// `turn`: 1 if the projection is counter-clockwise, otherwise -1.
HalfPlane inner_side(double from_a, double from_b, double to_a, double to_b, double turn) {
  HalfPlane side;
  side.slope_a = -(to_b - from_b) * turn;
  side.slope_b = (to_a - from_a) * turn;
  side.offset =
      -(side.slope_a * from_a + side.slope_b * from_b) + std::max(side.slope_a, 0.0) + std::max(side.slope_b, 0.0);
  return side;
}

/// The precomputed data for testing a triangle.
struct Triangle {
  DVec3 normal{0.0};
  double nearer = 0.0;                            // plane offset for the cube's farthest corner along the normal
  double farther = 0.0;                           // and for the opposite corner
  std::array<std::array<HalfPlane, 3>, 3> sides;  // of the projections along each axis

  explicit Triangle(const Corners& corners) {
    normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
    const DVec3 far_corner(normal.x > 0.0 ? 1.0 : 0.0, normal.y > 0.0 ? 1.0 : 0.0, normal.z > 0.0 ? 1.0 : 0.0);
    nearer = glm::dot(normal, far_corner - corners[0]);
    farther = glm::dot(normal, DVec3(1.0) - far_corner - corners[0]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<int>((axis + 1) % 3);
      const auto b = static_cast<int>((axis + 2) % 3);
      const double turn = normal[static_cast<int>(axis)] < 0.0 ? -1.0 : 1.0;
      for (std::size_t i = 0; i < 3; ++i) {
        const DVec3& from = corners[i];
        const DVec3& to = corners[i == 2 ? 0 : i + 1];
        sides[axis][i] = inner_side(from[a], from[b], to[a], to[b], turn);
      }
    }
  }
  [[nodiscard]] bool overlaps(std::size_t axis, double a, double b) const {
    const auto& s = sides[axis];
    return s[0].at(a, b) >= 0.0 && s[1].at(a, b) >= 0.0 && s[2].at(a, b) >= 0.0;
  }
  [[nodiscard]] bool meets_plane(const DVec3& cube) const {
    const double along = glm::dot(normal, cube);
    return (along + nearer) * (along + farther) <= 0.0;
  }
};

/// Marks the voxels of a chunk whose closed cube meets the triangle.
///
/// Source: M. Schwarz, H.-P. Seidel, "Fast Parallel Surface and Solid Voxelization on GPUs" (2010): a cube and a
///         triangle meet where the plane passes the cube and both overlap in all three projections.
void mark_overlapping(const Corners& corners, IVec3 chunk, ChunkBits& bits) {
  // In chunk coordinates, without a relevant loss of precision: corners lie at most 2^14 chunks away.
  const DVec3 origin = DVec3(chunk) * static_cast<double>(kChunkEdge);
  const Corners local = {corners[0] - origin, corners[1] - origin, corners[2] - origin};
  const DVec3 low = glm::min(glm::min(local[0], local[1]), local[2]);
  const DVec3 high = glm::max(glm::max(local[0], local[1]), local[2]);
  // The cube [i, i + 1] is closed: it also meets triangles that touch its sides.
  const IVec3 first = glm::max(voxel_of(glm::ceil(low) - 1.0), IVec3(0));
  const IVec3 end = glm::min(voxel_of(high) + 1, IVec3(kChunkEdge));
  if (IBox{first, end}.empty()) return;
  const Triangle triangle(local);
  for (int z = first.z; z < end.z; ++z) {
    for (int y = first.y; y < end.y; ++y) {
      if (!triangle.overlaps(0, y, z)) continue;
      std::uint64_t row = 0;
      for (int x = first.x; x < end.x; ++x) {
        const bool meets =
            triangle.meets_plane(DVec3(x, y, z)) && triangle.overlaps(1, z, x) && triangle.overlaps(2, x, y);
        row |= std::uint64_t{meets} << static_cast<unsigned>(x);
      }
      bits[row_of(y, z)] |= row;
    }
  }
}

// Voxels within this distance of the surface take its colours: voxels with one visible side lie within 1.
constexpr float kColourReach = 1.25F;
// Reach for samples: a corner of a cell that the surface crosses lies within the cell's diagonal.
constexpr float kFieldColourReach = 1.75F;
// A cube that the surface meets has its centre within half its diagonal.
constexpr float kCubeReach = 0.8661F;

/// The colour of a voxel.
struct Coloured {
  std::uint32_t voxel;  // in the chunk, x fastest
  std::uint32_t material;
  Rgba8 colour;
};

/// The results for a chunk, before types exist.
struct Found {
  Filled filled = Filled::None;
  std::unique_ptr<ChunkBits> bits;  // of Some
  std::vector<Coloured> coloured;   // ascending
  std::optional<DensityChunk> densities;
};

constexpr std::size_t kRows = kLines;
constexpr float kMostBand = 64.0F;
// Shares of the work in the reported progress.
constexpr double kLinesShare = 0.2;
constexpr double kFoundShare = 0.9;

/// The shared data of a run, made once.
struct Parts {
  Frame frame;
  std::unique_ptr<const Crossings> crossings;  // null if not needed
  std::optional<Inside> inside;                // if a rule for solid voxels is set
  std::optional<ChunkTriangles> triangles;
  std::optional<SurfaceColours> colours;
};

/// Buffers that a thread reuses.
struct Scratch {
  InsideScratch inside;
  Nearest nearest;
};

Filled filled(const ChunkBits& bits) {
  const auto is = [&](std::uint64_t all) {
    return std::all_of(bits.begin(), bits.end(), [&](std::uint64_t row) { return row == all; });
  };
  if (is(0)) return Filled::None;
  return is(~std::uint64_t{0}) ? Filled::All : Filled::Some;
}

/// Finds the solid voxels of a chunk; sets `solid` only if it returns Some.
Filled find_solid(const Parts& parts, IVec3 chunk, Scratch& scratch, ChunkBits& solid) {
  return parts.inside ? parts.inside->find(chunk, scratch.inside, solid) : Filled::None;
}

void fill_unless_some(Filled filled, ChunkBits& bits) {
  if (filled != Filled::Some) bits.fill(filled == Filled::All ? ~std::uint64_t{0} : 0);
}

void find_nearest_of(const Parts& parts, std::size_t index, const Wanted& wanted, bool holes_count, Nearest& nearest) {
  const SurfaceColours& colours = *parts.colours;
  const auto may_have_holes = [&](std::uint32_t triangle) { return holes_count && colours.may_have_holes(triangle); };
  const auto has_surface = [&](std::uint32_t triangle, DVec3 shares) { return colours.has_surface(triangle, shares); };
  find_nearest(parts.frame, parts.frame.chunk_at(index), parts.triangles->of(index), wanted,
               {may_have_holes, has_surface}, nearest);
}

Coloured coloured_voxel(const Parts& parts, IVec3 chunk, std::size_t voxel, std::int32_t nearest) {
  QUOIN_ASSERT(voxel < kChunkVoxels && nearest != kNoTriangle, "a voxel near a triangle");
  const auto triangle = static_cast<std::uint32_t>(nearest);
  const IVec3 local(static_cast<int>(voxel % kChunkEdge), static_cast<int>(voxel / kChunkEdge % kChunkEdge),
                    static_cast<int>(voxel / kRows));
  const DVec3 centre = DVec3(chunk * kChunkEdge + local) + 0.5;
  const DVec3 shares = nearest_shares(parts.frame.corners(triangle), centre);
  return {static_cast<std::uint32_t>(voxel), parts.colours->look_index(triangle, shares),
          parts.colours->colour(triangle, shares)};
}

void mark_surface(const Parts& parts, std::size_t index, SurfaceVoxels which, ChunkBits& surface) {
  const IVec3 chunk = parts.frame.chunk_at(index);
  QUOIN_ASSERT(which != SurfaceVoxels::Separating6 || parts.crossings != nullptr, "crossings of the lines");
  if (which == SurfaceVoxels::Separating6) mark_crossed(*parts.crossings, chunk, surface);
  if (which != SurfaceVoxels::Separating26) return;
  for (const std::uint32_t triangle : parts.triangles->of(index)) {
    mark_overlapping(parts.frame.corners(triangle), chunk, surface);
  }
}

/// Colours the voxels near the surface; removes cut-out voxels from `all`.
void colour_voxels(const Parts& parts, std::size_t index, const Nearest& nearest, const ChunkBits& solid,
                   ChunkBits& all, std::vector<Coloured>& coloured) {
  const IVec3 chunk = parts.frame.chunk_at(index);
  for (std::size_t row = 0; row < kRows; ++row) {
    for (std::uint64_t rest = all[row]; rest != 0; rest &= rest - 1) {
      const auto x = static_cast<unsigned>(std::countr_zero(rest));
      const std::size_t voxel = row * kChunkEdge + x;
      const bool is_solid = (solid[row] >> x & 1U) != 0;
      if (!is_solid && nearest.squared[voxel] > kCubeReach * kCubeReach) {
        all[row] &= ~(std::uint64_t{1} << x);
      } else if (nearest.triangles[voxel] != kNoTriangle) {
        coloured.push_back(coloured_voxel(parts, chunk, voxel, nearest.triangles[voxel]));
      }
    }
  }
}

Found find_voxels(const Parts& parts, std::size_t index, const VoxelizeOptions& options, Scratch& scratch) {
  Found found;
  ChunkBits solid;
  found.filled = find_solid(parts, parts.frame.chunk_at(index), scratch, solid);
  if (found.filled != Filled::Some && parts.triangles->of(index).empty()) return found;
  fill_unless_some(found.filled, solid);
  ChunkBits all = solid;
  mark_surface(parts, index, options.surface, all);
  if (!parts.colours->is_plain() && !parts.triangles->of(index).empty()) {
    find_nearest_of(parts, index, {&all, kColourReach}, true, scratch.nearest);
    colour_voxels(parts, index, scratch.nearest, solid, all, found.coloured);
  }
  found.filled = filled(all);
  if (found.filled == Filled::Some) found.bits = std::make_unique<ChunkBits>(all);
  return found;
}

/// Makes signed distances from the nearest triangles and the solid voxels.
DensityChunk signed_densities(const Nearest& nearest, const ChunkBits& solid, float band) {
  QUOIN_ASSERT(nearest.squared.size() == kChunkVoxels, "a distance per sample");
  DensityChunk densities(stored_density(band, band));
  std::array<float, kChunkEdge> distances{};
  for (std::size_t row = 0; row < kRows; ++row) {
    const float* squared = nearest.squared.data() + row * kChunkEdge;
    for (unsigned x = 0; x < kChunkEdge; ++x) {
      const float distance = std::sqrt(squared[x]);
      // Points on the surface count as inside, as they do for voxels.
      const bool is_solid = (solid[row] >> x & 1U) != 0;
      distances[x] = is_solid ? -std::max(distance, 1e-6F) : distance;
    }
    densities.write_row(static_cast<int>(row % kChunkEdge), static_cast<int>(row / kChunkEdge), distances, band);
  }
  densities.unite_slabs();
  return densities;
}

Found find_densities(const Parts& parts, std::size_t index, const DistanceFieldOptions& options, Scratch& scratch) {
  Found found;
  ChunkBits solid;
  const IVec3 chunk = parts.frame.chunk_at(index);
  found.filled = find_solid(parts, chunk, scratch, solid);
  const float band = options.band;
  if (parts.triangles->of(index).empty() && found.filled != Filled::Some) {
    if (found.filled == Filled::All) found.densities = DensityChunk(stored_density(-band, band));
    return found;
  }
  fill_unless_some(found.filled, solid);
  find_nearest_of(parts, index, {nullptr, band}, false, scratch.nearest);
  found.densities = signed_densities(scratch.nearest, solid, band);
  if (found.filled == Filled::Some) found.bits = std::make_unique<ChunkBits>(solid);
  if (parts.colours->is_plain() || found.filled == Filled::None) return found;
  const float reach = std::min(kFieldColourReach, band);
  for (std::size_t voxel = 0; voxel < kChunkVoxels; ++voxel) {
    const bool is_solid = (solid[voxel / kChunkEdge] >> (voxel % kChunkEdge) & 1U) != 0;
    if (!is_solid || !(scratch.nearest.squared[voxel] < reach * reach)) continue;
    found.coloured.push_back(coloured_voxel(parts, chunk, voxel, scratch.nearest.triangles[voxel]));
  }
  return found;
}

/// The results for all chunks; null for empty chunks.
using AllFound = std::vector<std::unique_ptr<Found>>;

/// Finds all chunks. Errors: Cancelled.
template <class Find>
Result<AllFound> find_all(const Frame& frame, Threads threads, const Progress& progress, const Find& find) {
  AllFound found(frame.chunk_count());
  ProgressSteps steps(progress, found.size());
  ObjectPool<Scratch> scratches;
  parallel_for(found.size(), threads, [&](std::size_t i) {
    if (steps.cancelled()) return;
    scratches.with([&](Scratch& scratch) {
      Found one = find(i, scratch);
      if (one.filled != Filled::None || one.densities) found[i] = std::make_unique<Found>(std::move(one));
    });
    steps.step();
  });
  if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  return found;
}

std::size_t count_of(const Found& found) {
  if (found.filled != Filled::Some) return found.filled == Filled::All ? kChunkVoxels : 0;
  QUOIN_ASSERT(found.bits != nullptr, "bits of a chunk with some voxels");
  std::size_t count = 0;
  for (const std::uint64_t row : *found.bits) count += static_cast<std::size_t>(std::popcount(row));
  return count;
}

/// The voxel types of the results: of deep voxels, and by entry of the colour table.
struct Types {
  VoxelType deep = kAir;
  std::vector<VoxelType> by_entry;
};

/// Collects colours in the order of chunks and voxels; each `Coloured::material` becomes the index of its entry.
Result<Types> find_types(const SurfaceColours& colours, AllFound& found, VoxelRegistry& registry, std::size_t most,
                         std::vector<std::string>& warnings) {
  std::vector<VoxelProperties> materials = colours.looks();
  // Deep voxels take the one material that all triangles share, or none.
  const std::uint32_t deep_material = colours.deep_look().value_or(static_cast<std::uint32_t>(materials.size()));
  materials.emplace_back();
  ColourTable table;
  bool has_deep = false;
  for (const auto& chunk : found) {
    if (chunk == nullptr) continue;
    for (Coloured& voxel : chunk->coloured) voxel.material = table.index_of(voxel.colour, voxel.material);
    has_deep |= count_of(*chunk) > chunk->coloured.size();
  }
  std::uint32_t deep = 0;
  // A model with few colours keeps them: the mean would add another.
  constexpr std::size_t kFewColours = 256;
  const bool has_few = colours.deep_look() && table.size() <= kFewColours;
  const Rgba8 deep_colour = has_few ? table.nearest(colours.mean(), deep_material) : colours.mean();
  if (has_deep) deep = table.index_of(deep_colour, deep_material);
  auto types = table.add_to(registry, materials, warnings, most);
  if (!types) return types.error();
  return Types{has_deep ? (*types)[deep] : kAir, std::move(*types)};
}

/// Returns the types of a chunk's voxels.
Chunk types_of(const Found& found, const Types& types) {
  if (found.filled != Filled::Some && found.coloured.empty()) {
    return Chunk(found.filled == Filled::All ? types.deep : kAir);
  }
  Chunk chunk(found.filled == Filled::All ? types.deep : kAir);
  std::array<VoxelType, kChunkEdge> row{};
  auto next = found.coloured.begin();
  for (std::size_t i = 0; i < kRows; ++i) {
    const std::uint64_t bits = found.bits == nullptr ? ~std::uint64_t{0} : (*found.bits)[i];
    if (bits == 0) continue;
    const auto y = static_cast<int>(i % kChunkEdge);
    const auto z = static_cast<int>(i / kChunkEdge);
    std::uint64_t coloured = 0;
    for (; next != found.coloured.end() && next->voxel / kChunkEdge == i; ++next) {
      const std::size_t x = next->voxel % kChunkEdge;
      QUOIN_ASSERT(next->material < types.by_entry.size(), "an entry with a type");
      row[x] = types.by_entry[next->material];
      coloured |= std::uint64_t{1} << x;
    }
    if (const std::uint64_t deep = bits & ~coloured; deep != 0) chunk.fill_row(y, z, deep, types.deep);
    if (coloured != 0) chunk.write_row(y, z, coloured, row);
  }
  QUOIN_ASSERT(next == found.coloured.end(), "coloured voxels are in the chunk, in order");
  return chunk;
}

/// Converts the results of chunks to grid voxels, a batch of chunks at a time: `make(i)` runs on any thread, `put(i,
/// made)` in order. Frees the results.
template <class Make, class Put>
void put_all(AllFound& found, Threads threads, const Make& make, const Put& put) {
  constexpr std::size_t kAtOnce = 256;
  std::vector<std::size_t> some;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] != nullptr) some.push_back(i);
  }
  std::vector<Chunk> chunks(std::min(kAtOnce, some.size()));
  for (std::size_t first = 0; first < some.size(); first += kAtOnce) {
    const std::size_t count = std::min(kAtOnce, some.size() - first);
    parallel_for(count, threads, [&](std::size_t i) { chunks[i] = make(*found[some[first + i]]); });
    for (std::size_t i = 0; i < count; ++i) {
      put(some[first + i], *found[some[first + i]], std::move(chunks[i]));
      found[some[first + i]].reset();
    }
  }
}

Result<Parts> prepare(const TriangleMesh& mesh, const VoxelLattice& lattice, double margin, bool needs_lines,
                      SolidVoxels solid, Threads threads, const Progress& progress) {
  auto frame = Frame::make(mesh, lattice, margin);
  if (!frame) return frame.error();
  Parts parts{std::move(*frame), {}, {}, {}, {}};
  if (!needs_lines || parts.frame.chunk_count() == 0) return parts;
  auto crossings = Crossings::find(parts.frame, solid, threads, progress);
  if (!crossings) return crossings.error();
  parts.crossings = std::make_unique<const Crossings>(std::move(*crossings));
  if (solid != SolidVoxels::None) parts.inside.emplace(*parts.crossings, solid, threads);
  return parts;
}

bool has_voxel_near(GridReader& voxels, IVec3 at) {
  if (voxels.get(at) != kAir) return true;
  for (int i = 0; i < 27; ++i) {
    if (voxels.get(at + IVec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)) != kAir) return true;
  }
  return false;
}

/// Warns of corners without a voxel next to them: a thin surface omits tips and pieces between the lines through voxel
/// centres. Corners of materials with cut-outs are ignored.
void warn_of_thin_parts(const TriangleMesh& mesh, const VoxelLattice& lattice, const SurfaceColours& colours,
                        const Grid& grid, std::vector<std::string>& warnings) {
  GridReader voxels(grid);
  std::vector<bool> is_known(mesh.positions.size());
  std::int64_t lost = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (colours.may_have_holes(static_cast<std::uint32_t>(i))) continue;
    for (const std::uint32_t index : mesh.triangles[i]) {
      if (is_known[index]) continue;
      is_known[index] = true;
      lost += has_voxel_near(voxels, voxel_of(lattice.grid_from_mesh(mesh.positions[index]))) ? 0 : 1;
    }
  }
  if (lost == 0) return;
  warnings.push_back("some parts thinner than a voxel were left out: " + with_thousands(lost) +
                     " mesh vertices have no adjacent voxel (--separating 26, or "
                     "SurfaceVoxels::Separating26 in code, keeps them)");
}

}  // namespace
}  // namespace voxelizing

using namespace voxelizing;

Result<VoxelizedMesh> voxelize(const TriangleMesh& mesh, const VoxelizeOptions& options, VoxelRegistry& types,
                               Threads threads, const Progress& progress) {
  const bool needs_lines = options.surface == SurfaceVoxels::Separating6 || options.solid != SolidVoxels::None;
  auto parts =
      prepare(mesh, options.lattice, 0.0, needs_lines, options.solid, threads, part_of(progress, 0.0, kLinesShare));
  if (!parts) return parts.error();
  VoxelizedMesh made;
  if (parts->frame.chunk_count() == 0) return made;
  parts->colours.emplace(parts->frame);
  parts->triangles.emplace(parts->frame, parts->colours->is_plain() ? 0.0 : double{kColourReach});
  auto found = find_all(parts->frame, threads, part_of(progress, kLinesShare, kFoundShare),
                        [&](std::size_t i, Scratch& scratch) { return find_voxels(*parts, i, options, scratch); });
  if (!found) return found.error();
  const auto by_entry = find_types(*parts->colours, *found, types, options.max_types, made.warnings);
  if (!by_entry) return by_entry.error();
  put_all(
      *found, threads, [&](const Found& chunk) { return types_of(chunk, *by_entry); },
      [&](std::size_t i, const Found&, Chunk&& voxels) {
        made.grid.put_chunk(parts->frame.first_chunk() + parts->frame.chunk_at(i), std::move(voxels));
      });
  if (options.surface == SurfaceVoxels::Separating6) {
    warn_of_thin_parts(mesh, options.lattice, *parts->colours, made.grid, made.warnings);
  }
  if (progress) (void)progress(1.0);
  return made;
}

Result<MeshDistanceField> distance_field(const TriangleMesh& mesh, const DistanceFieldOptions& options,
                                         VoxelRegistry& types, Threads threads, const Progress& progress) {
  if (options.solid == SolidVoxels::None) {
    return make_error(ErrorCode::InvalidArgument, "a distance field needs a rule for solid voxels");
  }
  if (!(options.band > 0.0F && options.band <= kMostBand)) {
    return make_error(ErrorCode::InvalidArgument, "band: must be more than 0 and at most 64");
  }
  MeshDistanceField made{DensityGrid(options.band), {}};
  DistanceFieldOptions own = options;
  own.band = made.field.band();
  auto parts =
      prepare(mesh, options.lattice, own.band + 1.0, true, options.solid, threads, part_of(progress, 0.0, kLinesShare));
  if (!parts) return parts.error();
  if (parts->frame.chunk_count() == 0) return made;
  parts->colours.emplace(parts->frame);
  parts->triangles.emplace(parts->frame, own.band);
  auto found = find_all(parts->frame, threads, part_of(progress, kLinesShare, kFoundShare),
                        [&](std::size_t i, Scratch& scratch) { return find_densities(*parts, i, own, scratch); });
  if (!found) return found.error();
  const auto by_entry = find_types(*parts->colours, *found, types, options.max_types, made.warnings);
  if (!by_entry) return by_entry.error();
  put_all(
      *found, threads, [&](const Found& chunk) { return types_of(chunk, *by_entry); },
      [&](std::size_t i, Found& chunk, Chunk&& materials) {
        chunk.densities->materials() = std::move(materials);
        made.field.put_chunk(parts->frame.first_chunk() + parts->frame.chunk_at(i), std::move(*chunk.densities));
      });
  if (progress) (void)progress(1.0);
  return made;
}

}  // namespace quoin
