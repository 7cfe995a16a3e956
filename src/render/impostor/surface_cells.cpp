#include "render/impostor/surface_cells.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <glm/common.hpp>

#include <tsl/robin_map.h>

#include <quoin/core/assert.h>
#include <quoin/core/hash.h>
#include <quoin/core/memory.h>

#include "render/impostor/seen_faces.h"
#include "render/impostor/snapshot.h"
#include "trace/tree_view.h"

namespace quoin {
namespace {

constexpr int kWidest = 10;           // log2 of the widest cells, voxels; the Morton curve's origin is a multiple
constexpr std::uint32_t kNone = ~0U;  // as a rank

// Returns the face's rectangle as a box without thickness.
IBox box_of(const ShellFace& face) {
  const FaceFrame& frame = frame_of(face.direction);
  IBox box{face.voxel, face.voxel + 1};
  (frame.sign > 0 ? box.min : box.max)[frame.axis] = (frame.sign > 0 ? box.max : box.min)[frame.axis];
  return box;
}

std::uint32_t hash_of(const ShellFace& face) {
  std::uint32_t hash =
      mix_bits(static_cast<std::uint32_t>(face.voxel.x) * 8U + static_cast<std::uint32_t>(face.direction));
  hash = mix_bits(hash ^ static_cast<std::uint32_t>(face.voxel.y));
  return mix_bits(hash ^ static_cast<std::uint32_t>(face.voxel.z));
}

// As above; pieces of one shape differ.
std::uint32_t hash_of(const SeenFace& seen) {
  std::uint32_t hash = hash_of(seen.face);
  if (!seen.in_shape) return hash;
  for (const float part : {seen.surfel->offset, seen.surfel->shift[0], seen.surfel->shift[1]}) {
    hash = mix_bits(hash ^ std::bit_cast<std::uint32_t>(part));
  }
  return hash;
}

// Ranks of faces for the views that saw them.
class Ranks {
 public:
  // `texel`: its width, voxels.
  explicit Ranks(double texel) : square_texel_(texel * texel) {
    for (int view = 0; view < kImpostorViews; ++view) {
      for (const Direction direction : kDirections) {
        const double turned = std::max(glm::dot(impostor_view(view), DVec3(normal_of(direction))), 1e-3);
        at(static_cast<std::size_t>(view), direction) = factor(turned);
      }
    }
  }
  // Returns the rank of a piece of a shape.
  [[nodiscard]] std::uint32_t rank(std::uint32_t hash, std::size_t view, const ImpostorFaces::Surfel& piece) const {
    const DVec3 normal(piece.normal);
    const DVec3 size = glm::abs(normal);
    const double area = 4.0 * piece.half[0] * piece.half[1] / std::max({size.x, size.y, size.z});
    const double turned = std::max(glm::dot(impostor_view(static_cast<int>(view)), normal), 1e-3);
    return ranked(hash, factor(std::max(turned * area, 1e-4)));
  }
  [[nodiscard]] std::uint32_t rank(std::uint32_t hash, std::size_t view, Direction direction) const {
    QUOIN_ASSERT(view < kImpostorViews, "one of the views");
    return ranked(hash, factors_[6 * view + static_cast<std::size_t>(direction)]);
  }

 private:
  static std::uint32_t ranked(std::uint32_t hash, std::uint32_t factor) {
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(std::uint64_t{hash} * factor >> 17, 0x7FFF'FFFFU));
  }
  // `seen`: the visible size in a view, in square voxels.
  [[nodiscard]] std::uint32_t factor(double seen) const {
    // Faces smaller than a texel are seen in proportion to their visible size, so they count alike.
    const double texels = seen / square_texel_;
    const double size = texels / (1.0 - std::exp(-texels)) / std::max(1.0, 1.0 / square_texel_);
    // The largest faces have ranks below 2^27, smaller ones more.
    return static_cast<std::uint32_t>(std::lround(4096.0 / std::max(size, 1e-3)));
  }
  [[nodiscard]] std::uint32_t& at(std::size_t view, Direction direction) {
    return factors_.at(6 * view + static_cast<std::size_t>(direction));
  }
  double square_texel_;
  std::array<std::uint32_t, std::size_t{6} * kImpostorViews> factors_{};
};

constexpr std::uint32_t kUnseen = 0x8000'0000U;  // the lowest rank of an unseen face

// For each view, all views sorted by distance; the first is the view itself.
const std::array<std::array<std::uint8_t, kImpostorViews>, kImpostorViews>& views_by_distance() {
  static const auto all = [] {
    std::array<std::array<std::uint8_t, kImpostorViews>, kImpostorViews> lists{};
    for (int view = 0; view < kImpostorViews; ++view) {
      auto& list = lists.at(static_cast<std::size_t>(view));
      std::iota(list.begin(), list.end(), std::uint8_t{0});
      const auto turned = [&](std::uint8_t other) { return glm::dot(impostor_view(view), impostor_view(other)); };
      std::stable_sort(list.begin(), list.end(), [&](std::uint8_t a, std::uint8_t b) { return turned(a) > turned(b); });
    }
    return lists;
  }();
  return all;
}

IVec3 least_voxel(const BlockVector<SeenFace>& faces) {
  if (faces.empty()) return IVec3(0);
  IVec3 least = faces[0].face.voxel;
  for (const SeenFace& seen : faces) least = glm::min(least, seen.face.voxel);
  return least;
}

// Returns the texel width in voxels of snapshots with `edge` texels per side.
double texel_of(const ContentSphere& content, int edge) {
  return 2.0 * snapshot_camera(content, 0, edge).half_size() / edge;
}

// The words of a tree, 4^3 voxels each, with a cache of the last bricks read.
class TreeWords {
 public:
  explicit TreeWords(const OccupancyTree& tree) : nodes_(tree) {}

  [[nodiscard]] std::uint64_t word(IVec3 at) {
    const IVec3 brick = at >> 2;
    Kept& kept = kept_[static_cast<std::size_t>((brick.x & 3) + 4 * (brick.y & 3) + 16 * (brick.z & 3))];
    if (!kept.is_known || kept.brick != brick) read(brick, kept);
    const IVec3 within = at - brick * 4;
    return kept.words[static_cast<std::size_t>(within.x + 4 * within.y + 16 * within.z)];
  }

 private:
  struct Kept {
    IVec3 brick{0};
    bool is_known = false;
    std::array<std::uint64_t, 64> words{};
  };
  void read(IVec3 brick, Kept& kept) {
    kept.brick = brick;
    kept.is_known = true;
    kept.words.fill(0);
    const IVec3 chunk = brick >> 2;
    const trace::ChunkNode* node = nodes_.find_chunk(chunk);
    if (node == nullptr) return;
    const IVec3 within = brick - chunk * 4;
    const trace::BrickCode code = node->bricks[static_cast<std::size_t>(within.x + 4 * within.y + 16 * within.z)];
    if (code == trace::kEmptyBrick) return;
    const trace::BrickWords words = nodes_.brick(code);
    for (std::size_t i = 0; i < 64; ++i) kept.words[i] = words[i];
  }

  trace::TreeNodes nodes_;
  std::array<Kept, 64> kept_;
};

// The voxels of a word that have faces, and the box around these faces.
struct WordFaces {
  std::uint64_t voxels = 0;
  IVec3 low{0};
  IVec3 high{0};
};

WordFaces faces_of_word(TreeWords& words, IVec3 at) {
  WordFaces found;
  const std::uint64_t own = words.word(at);
  if (own == 0) return found;
  for (const Direction direction : kDirections) {
    const std::uint64_t exposed = exposed_bits(own, words.word(at + normal_of(direction)), direction);
    for (std::uint64_t left = exposed; left != 0; left &= left - 1) {
      const int bit = std::countr_zero(left);
      const IBox box = box_of({at * 4 + IVec3{bit & 3, bit >> 2 & 3, bit >> 4}, direction});
      found.low = found.voxels == 0 ? box.min : glm::min(found.low, box.min);
      found.high = found.voxels == 0 ? box.max : glm::max(found.high, box.max);
      found.voxels |= std::uint64_t{1} << bit;
    }
  }
  return found;
}

// Returns the bits of a voxel in its cell, which is 2^`log2_width` voxels wide: eight bits for width 2.
std::uint64_t bits_of_voxel(IVec3 in_cell, int log2_width) {
  QUOIN_ASSERT(log2_width >= 1 && ((in_cell.x | in_cell.y | in_cell.z) >> log2_width) == 0, "a voxel of the cell");
  const IVec3 at = log2_width == 1 ? in_cell * 2 : in_cell >> (log2_width - 2);
  const std::uint64_t cube = log2_width == 1 ? 0x0033'0033U : 1U;
  return cube << (at.x + 4 * at.y + 16 * at.z);
}

// Returns the bit of an eighth of a voxel. `half`: 0.5 for the upper half along an axis, otherwise 0.
std::uint64_t bit_of_eighth(IVec3 in_cell, DVec3 half, int log2_width) {
  if (log2_width > 1) return bits_of_voxel(in_cell, log2_width);
  const IVec3 at = in_cell * 2 + IVec3(half * 2.0);
  QUOIN_ASSERT(((at.x | at.y | at.z) & ~3) == 0, "an eighth in a cell of 2 voxels");
  return std::uint64_t{1} << (at.x + 4 * at.y + 16 * at.z);
}

// Reduces the 4^3 bits of a cell to 2^3 bits, in their octant of the cell of twice the width.
std::uint64_t halved_bits(std::uint64_t bits, unsigned octant) {
  QUOIN_ASSERT(octant < 8, "one of eight octants");
  bits |= bits >> 1, bits |= bits >> 4, bits |= bits >> 16;
  const std::uint64_t low = (bits & 1U) | (bits >> 1 & 2U) | (bits >> 4 & 16U) | (bits >> 5 & 32U);
  const std::uint64_t upper = bits >> 32;
  const std::uint64_t high = (upper & 1U) | (upper >> 1 & 2U) | (upper >> 4 & 16U) | (upper >> 5 & 32U);
  const unsigned shift = 2U * (octant & 1U) + 8U * (octant >> 1 & 1U) + 32U * (octant >> 2);
  return (low | high << 16) << shift;
}

// The cells of a field's lattice with eight solid corners.
class SolidCells {
 public:
  explicit SolidCells(const DensityGrid& field) : field_(&field) {}
  // `cell`: its lowest corner.
  [[nodiscard]] bool has(IVec3 cell) {
    for (int row = 0; row < 4; ++row) {
      const IVec3 low = cell + IVec3{0, row & 1, row >> 1};
      if (!is_solid(low) || !is_solid(low + IVec3{1, 0, 0})) return false;
    }
    return true;
  }

 private:
  [[nodiscard]] bool is_solid(IVec3 sample) {
    const IVec3 at = chunk_of(sample);
    if (!is_known_ || at != at_) chunk_ = field_->find_chunk(at), at_ = at, is_known_ = true;
    if (chunk_ == nullptr) return false;
    const IVec3 local = local_of(sample);
    return (chunk_->solid_row(local.y, local.z) >> local.x & 1U) != 0;
  }

  const DensityGrid* field_;
  const DensityChunk* chunk_ = nullptr;  // the chunk at `at_`
  IVec3 at_{0};
  bool is_known_ = false;
};

}  // namespace

// Makes cells of faces, one after the other.
class SurfaceCells::Collector {
 public:
  Collector(SurfaceCells& into, double texel) : into_(&into), ranks_(texel) {}

  void add_face(const SeenFace& seen, std::uint32_t index) {
    const IBox box = box_of(seen.face);
    Cell& cell = add(seen.face.voxel, DVec3(box.min), DVec3(box.max), seen, index);
    cell.bits |= bits_of_voxel(in_cell(seen.face.voxel), into_->log2_width_);
  }

  // Adds a surfel as the eighths of voxels whose centres lie just below it: two per column, so that no ray passes
  // between two columns.
  void add_surfel(const SeenFace& seen, std::uint32_t index) {
    QUOIN_ASSERT(seen.surfel != nullptr, "a surfel");
    const FaceFrame& frame = frame_of(seen.face.direction);
    const ImpostorFaces::Surfel& surfel = *seen.surfel;
    const DVec3 middle = surfel.middle(DVec3(seen.face.voxel), seen.face.direction);
    for (int i = 0; i < 16; ++i) {
      const int column = i % 4, row = i / 4;
      const double u = (column - 1.5) * 0.5 * surfel.half[0];
      const double v = (row - 1.5) * 0.5 * surfel.half[1];
      DVec3 point = middle;
      point[frame.u] += u, point[frame.v] += v;
      point[frame.axis] += u * surfel.slope[0] + v * surfel.slope[1];
      for (int kept = 0; kept < 2; point[frame.axis] -= 0.5 * frame.sign) {
        const IVec3 voxel = voxel_of(point);
        const DVec3 eighth = glm::floor(point * 2.0) * 0.5;
        const DVec3 from_middle = eighth + 0.25 - middle;
        const double plane = from_middle[frame.u] * surfel.slope[0] + from_middle[frame.v] * surfel.slope[1];
        if ((from_middle[frame.axis] - plane) * frame.sign > 0.0) continue;
        ++kept;
        // The part of the eighth that the surfel may fill.
        const DVec3 low = glm::max(eighth, point - 0.3);
        const DVec3 high = glm::min(eighth + 0.5, point + 0.3);
        Cell& cell = add(voxel, low, high, seen, index);
        cell.has_pieces = true;
        cell.bits |= bit_of_eighth(in_cell(voxel), eighth - DVec3(voxel), into_->log2_width_);
      }
    }
  }

  // Adds a piece of a shape as the eighths of voxels that lie behind it.
  void add_shape(const SeenFace& seen, std::uint32_t index) {
    QUOIN_ASSERT(seen.surfel != nullptr && seen.in_shape, "a piece of a shape");
    const FaceFrame& frame = frame_of(seen.face.direction);
    const ImpostorFaces::Surfel& surfel = *seen.surfel;
    const DVec3 middle = surfel.middle(DVec3(seen.face.voxel), seen.face.direction);
    DVec3 reach(0.0);
    reach[frame.u] = surfel.half[0];
    reach[frame.v] = surfel.half[1];
    IVec3 at{0};  // an eighth
    const auto [first_u, end_u] = eighths(middle[frame.u] - reach[frame.u], middle[frame.u] + reach[frame.u]);
    const auto [first_v, end_v] = eighths(middle[frame.v] - reach[frame.v], middle[frame.v] + reach[frame.v]);
    for (at[frame.v] = first_v; at[frame.v] < end_v; ++at[frame.v]) {
      for (at[frame.u] = first_u; at[frame.u] < end_u; ++at[frame.u]) {
        DVec3 low = glm::max(middle - reach, 0.5 * DVec3(at));
        DVec3 high = glm::min(middle + reach, 0.5 * DVec3(at + 1));
        const DVec3 from = 0.5 * (low + high) - middle;
        const DVec3 half = 0.5 * (high - low);
        const double height = middle[frame.axis] + from[frame.u] * surfel.slope[0] + from[frame.v] * surfel.slope[1];
        const double rise = half[frame.u] * std::abs(surfel.slope[0]) + half[frame.v] * std::abs(surfel.slope[1]);
        constexpr double kInside = 1e-3;  // from a side to the eighth that it belongs to
        const double inside = height - kInside * frame.sign;
        const auto [first, end] = eighths(inside - rise, inside + rise);
        for (at[frame.axis] = first; at[frame.axis] < end; ++at[frame.axis]) {
          const double bottom = 0.5 * at[frame.axis];
          low[frame.axis] = std::clamp(height - rise, bottom, bottom + 0.5);
          high[frame.axis] = std::clamp(height + rise, bottom, bottom + 0.5);
          Cell& cell = add(at >> 1, low, high, seen, index);
          cell.has_pieces = true;
          cell.bits |= bit_of_eighth(in_cell(at >> 1), 0.5 * DVec3(at & 1), into_->log2_width_);
        }
      }
    }
  }

  // Adds the first solid lattice cells below a surfel, and the cells below those, in the four columns around its edge.
  void add_behind(const SeenFace& seen, std::uint32_t index, SolidCells& solid) {
    constexpr int kDeepest = 4;
    const FaceFrame& frame = frame_of(seen.face.direction);
    for (int column = 0; column < 4; ++column) {
      IVec3 at = seen.face.voxel;
      at[frame.u] -= column & 1;
      at[frame.v] -= column >> 1;
      int found = 0;
      for (int depth = 1; depth <= kDeepest && found < 2; ++depth) {
        at[frame.axis] -= frame.sign > 0 ? 1 : -1;
        if (!solid.has(at)) continue;
        ++found;
        Cell& cell = add(at, DVec3(at), DVec3(at + 1), seen, index);
        cell.has_pieces = true;
        cell.bits |= bits_of_voxel(in_cell(at), into_->log2_width_);
      }
    }
  }

 private:
  [[nodiscard]] IVec3 in_cell(IVec3 voxel) const { return (voxel - into_->origin_) & ((1 << into_->log2_width_) - 1); }

  // Returns the halves of voxels along an axis that an interval overlaps, at least one: the first, and after the last.
  static std::pair<int, int> eighths(double low, double high) {
    constexpr double kRounding = 1e-4;
    const int first = static_cast<int>(std::floor(2.0 * low + kRounding));
    return {first, std::max(first + 1, static_cast<int>(std::ceil(2.0 * high - kRounding)))};
  }

  // `low` and `high`: of the part of the face that lies in the voxel's cell.
  Cell& add(IVec3 voxel, DVec3 low, DVec3 high, const SeenFace& seen, std::uint32_t index) {
    Cell& cell = cell_at(voxel);
    const DVec3 centre = into_->content_.centre;
    cell.low = glm::min(cell.low, Vec3(low - centre)), cell.high = glm::max(cell.high, Vec3(high - centre));
    const std::uint32_t hash = hash_of(seen);
    if (seen.views == 0) {
      // In cells that hold only such faces, every view shows one.
      const std::uint32_t rank = kUnseen | hash >> 2;
      for (std::size_t view = 0; view < (rank < cell.rank[0] ? kImpostorViews : 0); ++view) {
        if (rank < cell.rank[view]) cell.rank[view] = rank, cell.face[view] = index;
      }
    }
    for (std::uint32_t left = seen.views; left != 0; left &= left - 1) {
      const auto view = static_cast<std::size_t>(std::countr_zero(left));
      const std::uint32_t rank =
          seen.in_shape ? ranks_.rank(hash, view, *seen.surfel) : ranks_.rank(hash, view, seen.face.direction);
      if (rank < cell.rank[view]) cell.rank[view] = rank, cell.face[view] = index;
    }
    return cell;
  }

  Cell& cell_at(IVec3 voxel) {
    const IVec3 at = (voxel - into_->origin_) >> into_->log2_width_;
    // Consecutive faces mostly lie in one cell.
    if (at == last_at_) return into_->cells_[last_];
    last_at_ = at;
    const std::uint64_t code = morton_code(at);
    // The cells of the previous row occur again.
    Recent& recent = recent_[MortonHash()(code) % recent_.size()];
    if (recent.is_known && recent.code == code) return into_->cells_[last_ = recent.cell];
    const auto [found, is_new] = index_.try_emplace(code, static_cast<std::uint32_t>(into_->cells_.size()));
    recent = {code, found->second, true};
    if (is_new) {
      Cell& cell = into_->cells_.emplace_back();
      cell.code = code;
      constexpr float kInfinity = std::numeric_limits<float>::infinity();
      cell.low = Vec3(kInfinity), cell.high = Vec3(-kInfinity);
      cell.rank.fill(kNone);
    }
    last_ = found->second;
    return into_->cells_[last_];
  }

  struct Recent {
    std::uint64_t code = 0;
    std::uint32_t cell = 0;
    bool is_known = false;
  };

  SurfaceCells* into_;
  Ranks ranks_;
  std::array<Recent, 1024> recent_{};
  tsl::robin_map<std::uint64_t, std::uint32_t, MortonHash> index_;
  IVec3 last_at_{std::numeric_limits<int>::min()};
  std::size_t last_ = 0;  // its cell
};

SurfaceCells::SurfaceCells(const ContentSphere& content, IVec3 least, int log2_width)
    : content_(content), origin_(((least - 4) >> kWidest) * (1 << kWidest)), log2_width_(log2_width) {
  QUOIN_ASSERT(log2_width >= 1 && log2_width <= kWidest, "cells of 2 to 1,024 voxels");
}

SurfaceCells::SurfaceCells(const BlockVector<SeenFace>& faces, const ContentSphere& content, int edge, int log2_width)
    : SurfaceCells(content, least_voxel(faces), log2_width) {
  Collector collector(*this, texel_of(content, edge));
  cells_.reserve(faces.size() / 4);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const auto index = static_cast<std::uint32_t>(i);
    if (faces[i].in_shape) {
      collector.add_shape(faces[i], index);
    } else {
      faces[i].surfel == nullptr ? collector.add_face(faces[i], index) : collector.add_surfel(faces[i], index);
    }
  }
  sort();
}

SurfaceCells SurfaceCells::behind(const BlockVector<SeenFace>& faces, const DensityGrid& field,
                                  const ContentSphere& content, int edge) {
  SurfaceCells cells(content, least_voxel(faces), 1);
  Collector collector(cells, texel_of(content, edge));
  SolidCells solid(field);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const auto index = static_cast<std::uint32_t>(i);
    if (faces[i].surfel != nullptr && !faces[i].in_shape) {
      collector.add_behind(faces[i], index, solid);
    } else if (faces[i].views == 0) {
      faces[i].in_shape ? collector.add_shape(faces[i], index) : collector.add_face(faces[i], index);
    }
  }
  cells.sort();
  return cells;
}

void SurfaceCells::sort() {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
  for (std::size_t i = 0; i < cells_.size(); ++i) order.emplace_back(cells_[i].code, static_cast<std::uint32_t>(i));
  std::sort(order.begin(), order.end());
  BlockVector<Cell> sorted;
  sorted.reserve(cells_.size());
  for (const auto& [code, i] : order) sorted.push_back(cells_[i]);
  cells_ = std::move(sorted);
}

IVec3 SurfaceCells::corner_of(const Cell& cell) const {
  return origin_ + morton_position(cell.code) * (1 << log2_width_);
}

void SurfaceCells::halve() {
  ++log2_width_;
  std::size_t count = 0;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    Cell& cell = cells_[i];
    cell.bits = halved_bits(cell.bits, static_cast<unsigned>(cell.code & 7U));
    cell.code >>= 3;
    if (count == 0 || cells_[count - 1].code != cell.code) {
      if (count != i) cells_[count] = cell;
      ++count;
      continue;
    }
    Cell& into = cells_[count - 1];
    into.bits |= cell.bits;
    into.low = glm::min(into.low, cell.low), into.high = glm::max(into.high, cell.high);
    into.has_pieces |= cell.has_pieces;
    for (std::size_t view = 0; view < kImpostorViews; ++view) {
      if (cell.rank[view] < into.rank[view]) into.rank[view] = cell.rank[view], into.face[view] = cell.face[view];
    }
  }
  cells_.resize(count);
}

void SurfaceCells::fill_from(const OccupancyTree& tree) {
  QUOIN_ASSERT(log2_width_ >= 2, "cells of whole words");
  TreeWords words(tree);
  const int across = 1 << (log2_width_ - 2);
  for (Cell& cell : cells_) {
    const IVec3 corner = corner_of(cell);
    for (int i = 0; i < across * across * across; ++i) {
      const IVec3 in_cell{i % across, i / across % across, i / across / across};
      const WordFaces found = faces_of_word(words, (corner >> 2) + in_cell);
      if (found.voxels == 0) continue;
      cell.low = glm::min(cell.low, Vec3(DVec3(found.low) - content_.centre));
      cell.high = glm::max(cell.high, Vec3(DVec3(found.high) - content_.centre));
      for (std::uint64_t left = found.voxels; left != 0; left &= left - 1) {
        const int bit = std::countr_zero(left);
        cell.bits |= bits_of_voxel(in_cell * 4 + IVec3{bit & 3, bit >> 2 & 3, bit >> 4}, log2_width_);
      }
    }
  }
}

namespace {

// Returns the layer of voxels against a side of a box.
IBox layer_at(IBox box, Direction direction) {
  const FaceFrame& frame = frame_of(direction);
  const int layer = frame.sign > 0 ? box.max[frame.axis] : box.min[frame.axis] - 1;
  box.min[frame.axis] = layer, box.max[frame.axis] = layer + 1;
  return box;
}

}  // namespace

ImpostorFaces::Cell SurfaceCells::finished(const Cell& cell) const {
  ImpostorFaces::Cell out;
  out.corner = Vec3(DVec3(corner_of(cell)) - content_.centre);
  out.bits = cell.bits;
  out.face = cell.face;
  std::uint32_t seeing = 0;
  for (std::size_t view = 0; view < kImpostorViews; ++view) seeing |= std::uint32_t{cell.rank[view] < kUnseen} << view;
  if (seeing == 0) return out;
  // Views that saw none show the face of the nearest view that saw any.
  for (std::uint32_t left = ~seeing & kAllImpostorViews; left != 0; left &= left - 1) {
    const auto view = static_cast<std::size_t>(std::countr_zero(left));
    const auto& others = views_by_distance()[view];
    const auto nearest =
        std::find_if(others.begin(), others.end(), [&](std::uint8_t other) { return (seeing >> other & 1U) != 0; });
    out.face[view] = cell.face[*nearest];
  }
  return out;
}

ImpostorFaces::Level SurfaceCells::level(FunctionRef<bool(const IBox&)> is_solid) const {
  LevelMaker maker(content_);
  std::vector<IBox> boxes;  // of cells without surfels, in voxels
  boxes.reserve(cells_.size());
  for (const Cell& cell : cells_) {
    boxes.push_back(
        {voxel_of(DVec3(cell.low) + content_.centre + 0.5), voxel_of(DVec3(cell.high) + content_.centre + 0.5)});
  }
  for (const Direction direction : kDirections) {
    const FaceFrame& frame = frame_of(direction);
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      const Cell& cell = cells_[i];
      Rectangle side;
      side.centre = 0.5F * (cell.low + cell.high);
      side.centre[frame.axis] = (frame.sign > 0 ? cell.high : cell.low)[frame.axis];
      side.direction = direction;
      side.reach = {0.5F * (cell.high - cell.low)[frame.u], 0.5F * (cell.high - cell.low)[frame.v]};
      if (!(side.reach[0] > 0.0F && side.reach[1] > 0.0F)) continue;
      // No ray comes through solid voxels that lie against all of a side.
      if (!cell.has_pieces && is_solid(layer_at(boxes[i], direction))) continue;
      maker.add(side, kAllImpostorViews, static_cast<std::uint32_t>(i));
    }
  }
  ImpostorFaces::Level level = std::move(maker).level();
  level.step = static_cast<float>(std::ldexp(0.25, log2_width_));
  level.cells.reserve(cells_.size());
  for (const Cell& cell : cells_) level.cells.push_back(finished(cell));
  return level;
}

}  // namespace quoin
