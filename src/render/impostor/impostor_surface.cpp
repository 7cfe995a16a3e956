#include "render/impostor/impostor_surface.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "core/coordinates/chunk_order.h"
#include "trace/density/density_glass.h"
#include "trace/tree_view.h"

namespace quoin {
namespace {

constexpr int kCellsAChunk = 16;
constexpr int kCellsABrick = 4;

// Returns the number of cells along each axis that touch the box or adjoin such a cell.
IVec3 cells_around(const IBox& box) {
  return ((box.max - 1) >> 2) - (box.min >> 2) + 3;
}

}  // namespace

bool comes_before(const ShellFace& a, const ShellFace& b) {
  if (a.direction != b.direction) return a.direction < b.direction;
  for (int axis = 2; axis >= 0; --axis) {
    const int cell_a = a.voxel[axis] >> 2;
    const int cell_b = b.voxel[axis] >> 2;
    if (cell_a != cell_b) return cell_a < cell_b;
  }
  for (int axis = 2; axis >= 0; --axis) {
    if (a.voxel[axis] != b.voxel[axis]) return a.voxel[axis] < b.voxel[axis];
  }
  return false;
}

std::uint64_t exposed_bits(std::uint64_t own, std::uint64_t next, Direction direction) {
  std::uint64_t neighbours = 0;
  switch (direction) {
    case Direction::PosX:
      neighbours = (own >> 1 & 0x7777'7777'7777'7777U) | (next << 3 & 0x8888'8888'8888'8888U);
      break;
    case Direction::NegX:
      neighbours = (own << 1 & 0xEEEE'EEEE'EEEE'EEEEU) | (next >> 3 & 0x1111'1111'1111'1111U);
      break;
    case Direction::PosY:
      neighbours = (own >> 4 & 0x0FFF'0FFF'0FFF'0FFFU) | (next << 12 & 0xF000'F000'F000'F000U);
      break;
    case Direction::NegY:
      neighbours = (own << 4 & 0xFFF0'FFF0'FFF0'FFF0U) | (next >> 12 & 0x000F'000F'000F'000FU);
      break;
    case Direction::PosZ:
      neighbours = own >> 16 | next << 48;
      break;
    case Direction::NegZ:
      neighbours = own << 16 | next >> 48;
      break;
  }
  return own & ~neighbours;
}

ImpostorShell::ImpostorShell(const IBox& box) : origin_(((box.min >> 2) - 1) * 4), size_(cells_around(box)) {
  cells_.resize(static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y) *
                static_cast<std::size_t>(size_.z));
}

std::optional<ImpostorShell> ImpostorShell::build(const OccupancyTree& tree, std::int64_t max_voxels,
                                                  std::int64_t max_faces) {
  const IBox box = tree.bounds();
  const IVec3 size = cells_around(box);
  std::int64_t max_cells = max_voxels / 64;
  for (int axis = 0; axis < 3; ++axis) max_cells /= size[axis];
  if (max_cells == 0) return std::nullopt;
  ImpostorShell shell(box);
  const IVec3 low = box.min >> 6;
  const IVec3 high = (box.max - 1) >> 6;
  for (int z = low.z; z <= high.z; ++z) {
    for (int y = low.y; y <= high.y; ++y) {
      for (int x = low.x; x <= high.x; ++x) shell.copy_chunk(tree, {x, y, z});
    }
  }
  if (shell.count_faces() > max_faces) return std::nullopt;
  return shell;
}

void ImpostorShell::copy_chunk(const OccupancyTree& tree, IVec3 chunk) {
  const trace::TreeNodes nodes(tree);
  const trace::ChunkNode* node = nodes.find_chunk(chunk);
  if (node == nullptr) return;
  const IVec3 first = chunk * kCellsAChunk - (origin_ >> 2);
  for (int brick = 0; brick < 64; ++brick) {
    const trace::BrickCode at = node->bricks[static_cast<std::size_t>(brick)];
    if (at == trace::kEmptyBrick) continue;
    const trace::BrickWords words = nodes.brick(at);
    const IVec3 corner = first + IVec3{brick & 3, brick >> 2 & 3, brick >> 4} * kCellsABrick;
    for (int word = 0; word < 64; ++word) {
      const std::uint64_t bits = words[static_cast<std::size_t>(word)];
      if (bits == 0) continue;  // may lie outside the box
      const IVec3 cell = corner + IVec3{word & 3, word >> 2 & 3, word >> 4};
      QUOIN_ASSERT((IBox{IVec3{0}, size_}.contains(cell)), "voxels within the tree's bounds");
      cells_[cell_of(cell * 4)] = bits;
    }
  }
}

std::uint64_t ImpostorShell::exposed(Direction direction, std::size_t cell) const {
  const IVec3 towards = normal_of(direction);
  const std::ptrdiff_t step = (std::ptrdiff_t{towards.z} * size_.y + towards.y) * size_.x + towards.x;
  const auto next = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(cell) + step);
  QUOIN_ASSERT(cell < cells_.size() && next < cells_.size(), "a cell within the margin");
  return exposed_bits(cells_[cell], cells_[next], direction);
}

namespace {

// Returns a mask with `unit` bits for each of the positions from `first` to `end` that lie in a row of four.
std::uint64_t bits_of_row(int first, int end, int unit) {
  first = std::max(first, 0), end = std::min(end, 4);
  QUOIN_ASSERT(first < end, "at least one of four");
  return ~std::uint64_t{0} >> (64 - unit * end) & ~std::uint64_t{0} << unit * first;
}

}  // namespace

bool ImpostorShell::is_full(const IBox& box) const {
  if (box.empty()) return true;
  const IVec3 low = box.min - origin_;
  const IVec3 high = box.max - origin_;
  QUOIN_ASSERT((unite({IVec3{0}, size_ * 4}, {low, high}) == IBox{IVec3{0}, size_ * 4}),
               "positions in the box or next to it");
  for (int z = low.z & ~3; z < high.z; z += 4) {
    const std::uint64_t in_z = bits_of_row(low.z - z, high.z - z, 16);
    for (int y = low.y & ~3; y < high.y; y += 4) {
      const std::uint64_t in_y = in_z & bits_of_row(low.y - y, high.y - y, 4) * 0x0001'0001'0001'0001U;
      for (int x = low.x & ~3; x < high.x; x += 4) {
        const std::uint64_t wanted = in_y & bits_of_row(low.x - x, high.x - x, 1) * 0x1111'1111'1111'1111U;
        if ((~cells_[cell_of({x, y, z})] & wanted) != 0) return false;
      }
    }
  }
  return true;
}

std::int64_t ImpostorShell::count_faces() const {
  std::int64_t count = 0;
  for (std::size_t cell = 0; cell < cells_.size(); ++cell) {
    if (cells_[cell] == 0) continue;
    for (const Direction direction : kDirections) count += std::popcount(exposed(direction, cell));
  }
  return count;
}

BlockVector<ShellFace> ImpostorShell::faces() const {
  BlockVector<ShellFace> all;
  const auto count = static_cast<std::size_t>(count_faces());
  all.reserve(count);
  for (const Direction direction : kDirections) {
    std::size_t cell = 0;
    for (int z = 0; z < size_.z; ++z) {
      for (int y = 0; y < size_.y; ++y) {
        for (int x = 0; x < size_.x; ++x, ++cell) {
          if (cells_[cell] == 0) continue;
          const IVec3 corner = origin_ + IVec3{x, y, z} * 4;
          for (std::uint64_t left = exposed(direction, cell); left != 0; left &= left - 1) {
            const int bit = std::countr_zero(left);
            all.push_back({corner + IVec3{bit & 3, bit >> 2 & 3, bit >> 4}, direction});
          }
        }
      }
    }
  }
  QUOIN_ASSERT(all.size() == count, "the counted faces");
  return all;
}

void SurfacePieces::add(SurfacePieces&& of_shapes) {
  QUOIN_ASSERT(shapes.empty() && of_shapes.shapes.size() == of_shapes.faces.size(), "a field's pieces, and shapes'");
  if (of_shapes.faces.empty()) return;
  shapes.resize(faces.size());
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  append(faces, of_shapes.faces);
  append(surfels, of_shapes.surfels);
  append(types, of_shapes.types);
  append(shapes, of_shapes.shapes);
  sort();
}

void SurfacePieces::sort() {
  std::vector<std::uint32_t> order(faces.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto is_flat = [&](std::uint32_t i) { return in_shape(i) && !surfels[i].is_inclined(); };
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return is_flat(a) != is_flat(b) ? is_flat(a) : comes_before(faces[a], faces[b]);
  });
  const auto put_in_order = [&](auto& list) {
    if (list.empty()) return;
    auto sorted = list;
    for (std::size_t i = 0; i < order.size(); ++i) sorted[i] = list[order[i]];
    list = std::move(sorted);
  };
  put_in_order(faces);
  put_in_order(surfels);
  put_in_order(types);
  put_in_order(shapes);
}

namespace {

constexpr double kOfLargest = 0.8;
constexpr double kEnough = 0.55;
constexpr int kThin = 3;  // samples

// Collects the surface's crossings with the lattice edges that begin in each chunk.
class SurfelMaker {
 public:
  SurfelMaker(const DensityGrid& field, std::size_t max_count) : field_(&field), max_count_(max_count) {}

  // Returns false if there are too many surfels.
  bool take_chunk(IVec3 chunk) {
    for (int i = 0; i < 4; ++i) {
      IVec3 offset{0};
      if (i > 0) offset[i - 1] = 1;
      near_[static_cast<std::size_t>(i)] = field_->find_chunk(chunk + offset);
    }
    const IVec3 corner = chunk * kChunkEdge;
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y) {
        const std::uint64_t own = signs(0, y, z);
        const std::uint64_t along_x = own >> 1 | signs(1, y, z) << 63;
        const std::uint64_t along_y = y + 1 < kChunkEdge ? signs(0, y + 1, z) : signs(2, 0, z);
        const std::uint64_t along_z = z + 1 < kChunkEdge ? signs(0, y, z + 1) : signs(3, y, 0);
        take_row(corner + IVec3{0, y, z}, 0, own, along_x);
        take_row(corner + IVec3{0, y, z}, 1, own, along_y);
        take_row(corner + IVec3{0, y, z}, 2, own, along_z);
      }
    }
    return made_.faces.size() <= max_count_;
  }

  [[nodiscard]] bool is_thin() const { return 4 * thin_ > made_.faces.size(); }

  SurfacePieces sorted() && {
    made_.sort();
    return std::move(made_);
  }

 private:
  // Returns a mask of the solid samples in a row of this chunk or the next along x, y or z.
  [[nodiscard]] std::uint64_t signs(std::size_t of, int y, int z) const {
    return near_[of] == nullptr ? 0 : near_[of]->solid_row(y, z);
  }
  void take_row(IVec3 first, int axis, std::uint64_t low, std::uint64_t high) {
    for (std::uint64_t left = low ^ high; left != 0; left &= left - 1) {
      const int x = std::countr_zero(left);
      take_edge(first + IVec3{x, 0, 0}, axis, (low >> x & 1U) != 0);
    }
  }
  void take_edge(IVec3 sample, int axis, bool is_solid_below) {
    const auto direction = static_cast<Direction>(2 * axis + (is_solid_below ? 0 : 1));
    const std::optional<double> crossing = height(sample, axis, is_solid_below);
    QUOIN_ASSERT(crossing.has_value(), "an edge that the surface crosses");
    const double offset = *crossing;
    DVec3 point(sample);
    point[axis] += offset;
    const DVec3 normal = normal_at(point);
    const DVec3 size = glm::abs(normal);
    const double largest = std::max({size.x, size.y, size.z});
    const bool is_outward = (normal[axis] > 0.0) == is_solid_below && normal[axis] != 0.0;
    if (!is_outward || size[axis] < std::min(kEnough, kOfLargest * largest)) return;
    IVec3 solid = sample;
    if (!is_solid_below) ++solid[axis];
    IVec3 inwards{0};
    inwards[axis] = is_solid_below ? -1 : 1;
    bool is_thin = false;
    for (int i = 1; i <= kThin; ++i) is_thin |= !(field_->density(solid + i * inwards) < 0.0F);
    thin_ += is_thin ? 1 : 0;
    ImpostorFaces::Surfel surfel;
    surfel.normal = Vec3(normal);
    double rise = offset;
    for (std::size_t i = 0; i < 2; ++i) {
      const FaceFrame& frame = frame_of(direction);
      const Side side = side_of(sample, axis, static_cast<int>(i == 0 ? frame.u : frame.v), is_solid_below, offset);
      // Rounded to steps that fit in a few bits on the device.
      surfel.half[i] = static_cast<float>(std::round(512.0 * (side.low + side.high)) / 1024.0);
      surfel.shift[i] = static_cast<float>(0.5 * (side.high - side.low));
      surfel.slope[i] = static_cast<float>(side.slope);
      rise += side.slope * 0.5 * (side.high - side.low);
    }
    surfel.offset = static_cast<float>(rise);
    made_.faces.push_back({sample, direction});
    made_.surfels.push_back(surfel);
    made_.types.push_back(field_->material(solid));
  }

  // The extent of a surfel along another axis: its reach to both sides, and its rise.
  struct Side {
    double low = 0.5;
    double high = 0.5;
    double slope = 0.0;
  };
  [[nodiscard]] Side side_of(IVec3 sample, int axis, int along, bool is_solid_below, double offset) const {
    std::array<std::optional<double>, 2> adjacent;
    Side side;
    for (int i = 0; i < 2; ++i) {
      IVec3 step{0};
      step[along] = i == 0 ? -1 : 1;
      auto& found = adjacent[static_cast<std::size_t>(i)];
      found = height_near(sample + step, axis, is_solid_below);
      if (!found) (i == 0 ? side.low : side.high) = reach_to(sample, step, axis, is_solid_below);
    }
    if (adjacent[0] && adjacent[1]) {
      side.slope = 0.5 * (*adjacent[1] - *adjacent[0]);
    } else if (adjacent[0]) {
      side.slope = offset - *adjacent[0];
    } else if (adjacent[1]) {
      side.slope = *adjacent[1] - offset;
    }
    return side;
  }
  // Returns the height of the surface's crossing with an edge above its lower end; nullopt without one, or for the
  // opposite side.
  [[nodiscard]] std::optional<double> height(IVec3 sample, int axis, bool is_solid_below) const {
    IVec3 next = sample;
    ++next[axis];
    const double below = field_->density(sample);
    const double above = field_->density(next);
    if ((below < 0.0) != is_solid_below || (above < 0.0) == is_solid_below) return std::nullopt;
    return std::clamp(below / (below - above), 0.0, 1.0);
  }
  // As `height`, for the edge, or the edge below or above it.
  [[nodiscard]] std::optional<double> height_near(IVec3 sample, int axis, bool is_solid_below) const {
    for (const int up : {0, -1, 1}) {
      IVec3 at = sample;
      at[axis] += up;
      if (const std::optional<double> found = height(at, axis, is_solid_below)) return *found + up;
    }
    return std::nullopt;
  }
  // Returns the extent of the surface from an edge if it does not cross the next edge: up to its bend, or to a wall.
  [[nodiscard]] double reach_to(IVec3 sample, IVec3 step, int axis, bool is_solid_below) const {
    IVec3 solid = sample;
    IVec3 air = sample;
    ++(is_solid_below ? air : solid)[axis];
    const double own = field_->density(solid);
    const double next = field_->density(solid + step);
    if (!(next < 0.0)) return std::clamp(own / (own - next), 0.0, 1.0);
    const double before = field_->density(air);
    const double wall = field_->density(air + step);
    return wall < 0.0 ? std::clamp(before / (before - wall), 0.0, 1.0) : 0.5;
  }
  [[nodiscard]] DVec3 normal_at(const DVec3& point) const {
    DensityHit hit;
    const DVec3 gradient = field_->gradient_at(point);
    const double length = glm::length(gradient);
    if (length > 0.0) hit.normal = gradient / length;
    return smooth_normal(*field_, point, hit);
  }

  const DensityGrid* field_;
  std::size_t max_count_;
  std::array<const DensityChunk*, 4> near_{};
  SurfacePieces made_;
  std::size_t thin_ = 0;
};

}  // namespace

std::optional<SurfacePieces> surfels_of(const DensityGrid& field, std::size_t max_count) {
  std::vector<IVec3> chunks;
  for (const IVec3 chunk : field.chunks()) {
    chunks.push_back(chunk);
    for (int axis = 0; axis < 3; ++axis) {
      chunks.push_back(chunk);
      --chunks.back()[axis];
    }
  }
  sort_and_unite(chunks);
  SurfelMaker maker(field, max_count);
  for (const IVec3 chunk : chunks) {
    if (!maker.take_chunk(chunk)) return std::nullopt;
  }
  if (maker.is_thin()) return std::nullopt;
  return std::move(maker).sorted();
}

}  // namespace quoin
