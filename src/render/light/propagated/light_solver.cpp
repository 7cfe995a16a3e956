#include "render/light/propagated/light_solver.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <utility>

#include <quoin/core/assert.h>

#include "render/light/propagated/kernel/light_kernel.h"

namespace quoin::propagated {
namespace {

constexpr unsigned kBrightest = 15;

std::uint64_t bits_between(int begin, int end) {
  QUOIN_ASSERT(begin >= end || (begin >= 0 && end <= 64), "bits of a word");
  return begin >= end ? 0 : kAll >> (64 - (end - begin)) << begin;
}

// Returns the voxels with the given level.
std::uint64_t equal_to(const RowPlanes& planes, unsigned level) {
  std::uint64_t equal = kAll;
  for (std::size_t i = 0; i < kPlanes; ++i) equal &= (level >> i & 1U) != 0 ? planes[i] : ~planes[i];
  return equal;
}

unsigned level_at(const RowPlanes& planes, int x) {
  QUOIN_ASSERT(x >= 0 && x < 64, "0 <= x < 64");
  unsigned level = 0;
  for (std::size_t i = 0; i < kPlanes; ++i) level |= static_cast<unsigned>(planes[i] >> x & 1U) << i;
  return level;
}

// Bit i is set if the box contains row i of the slab that begins at (y, z); i = y % 4 + 4 (z % 4).
unsigned rows_of(const IBox& box, int y, int z) {
  if (y >= box.min.y && y + 4 <= box.max.y && z >= box.min.z && z + 4 <= box.max.z) return (1U << kSlabWords) - 1;
  const auto span = [](int begin, int end) {
    const int first = std::clamp(begin, 0, 4);
    return (1U << std::clamp(end, first, 4)) - (1U << first);
  };
  const unsigned of_y = span(box.min.y - y, box.max.y - y);
  const unsigned of_z = span(box.min.z - z, box.max.z - z);
  unsigned rows = 0;
  for (unsigned i = 0; i < 4; ++i) rows |= (of_z >> i & 1U) != 0 ? of_y << (4 * i) : 0;
  return rows;
}

// Adds the changed rows of a slab to a record. Rows inside the chunk are added together.
void add_slab(int y, int z, const std::uint64_t* changed, VoxelRecord& record) {
  QUOIN_ASSERT(((y | z) & ~(kChunkEdge - 4)) == 0, "multiples of 4 within the chunk");
  std::uint64_t any = 0;
  std::array<std::uint64_t, 4> by_y{};
  std::array<std::uint64_t, 4> by_z{};
  for (std::size_t row = 0; row < kSlabWords; ++row) {
    any |= changed[row];
    by_y[row & 3] |= changed[row];
    by_z[row >> 2] |= changed[row];
  }
  const auto bound = [](const std::array<std::uint64_t, 4>& layers, bool first) {
    int at = first ? 0 : 3;
    while (layers[static_cast<std::size_t>(at)] == 0) at += first ? 1 : -1;
    return at;
  };
  const bool is_at_side = y == 0 || z == 0 || y == kChunkEdge - 4 || z == kChunkEdge - 4;
  if (!is_at_side) {
    record.add(y + bound(by_y, true), z + bound(by_z, true), any);
    record.add(y + bound(by_y, false), z + bound(by_z, false), any);
    return;
  }
  for (int row = 0; row < static_cast<int>(kSlabWords); ++row) {
    if (changed[row] != 0) record.add(y + (row & 3), z + (row >> 2), changed[row]);
  }
}

}  // namespace

// The intersection of a region, or its rim, with a chunk.
struct LightSolver::Part {
  IVec3 chunk;
  IBox box;  // of the chunk
  const ChunkAround* around;
  int shift;           // bit of the chunk's first voxel in a row of the region
  std::uint64_t bits;  // voxels of a row: all of the box, or some of them

  [[nodiscard]] bool is_whole() const { return box == kWholeChunk; }
  // Calls `visit(y, z)` with the first row of each slab.
  template <class Visit>
  void for_each_slab(Visit&& visit) const {
    for (int z = box.min.z & ~3; z < box.max.z; z += 4) {
      for (int y = box.min.y & ~3; y < box.max.y; y += 4) visit(y, z);
    }
  }
};

bool LightSolver::fits(IVec3 size) {
  const int columns = (size.x + 2 + 63) / 64;
  const int blocks = (size.y + 2 + 7) / 8;
  return columns * blocks <= 64 && size.z <= 128;
}

IBox LightSolver::widened(const LightRegion::Box& box) {
  const auto words = [](const IBox& voxels) { return (voxels.size().x + 2 + 63) / 64; };
  IBox all = box.voxels;
  for (const bool is_high : {false, true}) {
    IBox wide = all;
    if (is_high) {
      wide.max.x = std::max(all.max.x, box.wanted.max.x + kReach);
    } else {
      wide.min.x = std::min(all.min.x, box.wanted.min.x - kReach);
    }
    const bool is_in_chunk_of_rim =
        chunk_of(wide.min).x >= chunk_of(all.min - 1).x && chunk_of(wide.max - 1).x <= chunk_of(all.max).x;
    if (is_in_chunk_of_rim && words(wide) == words(all)) all = wide;
  }
  return all;
}

void LightSolver::shape(const LightRegion::Box& box) {
  QUOIN_ASSERT(fits(box.voxels.size()) && intersect(box.wanted, box.voxels) == box.wanted,
               "a box that is not too large");
  box_ = box;
  size_ = box.voxels.max - box.voxels.min;
  origin_ = box.voxels.min - 1;
  columns_ = static_cast<std::size_t>((size_.x + 2 + 63) / 64);
  blocks_ = static_cast<std::size_t>((size_.y + 2 + 7) / 8);
  column_ = blocks_ * kBlockRows;
  layer_ = columns_ * column_;
  const std::size_t layers = static_cast<std::size_t>(size_.z) + 2;
  const auto grow = [](BlockVector<std::uint64_t>& words, std::size_t size) {
    if (words.size() < size) words.resize(size);
  };
  grow(pass_, layers * layer_);
  grow(rest_, layers * layer_);
  grow(front_, layers * layer_);
  grow(next_, layers * layer_);
  // Slabs that reach out of the region are read with words before its first and behind its last ones.
  for (std::size_t i = 0; i < kPlanes; ++i) {
    grow(plane_words_[i], layers * layer_ + 2 * kBlockRows);
    planes_[i] = plane_words_[i].data() + kBlockRows;
  }
  passable_.resize(layers);
  wanted_bits_.resize(columns_);
  for (std::size_t column = 0; column < columns_; ++column) {
    const int first = origin_.x + static_cast<int>(column) * 64;
    const int begin = std::clamp(box.wanted.min.x - first, 0, 64);
    wanted_bits_[column] = bits_between(begin, std::clamp(box.wanted.max.x - first, begin, 64));
  }
  for (auto* blocks : {&active_, &touched_, &in_front_, &in_next_}) blocks->assign(layers, 0);
  for (auto& of_channel : sources_) {
    for (BlockVector<Source>& of_level : of_channel) of_level.clear();
  }
}

template <class Visit>
void LightSolver::for_each_part(const IBox& box, Visit&& visit) const {
  const IVec3 first = chunk_of(box.min);
  const IVec3 last = chunk_of(box.max - 1);
  for (int z = first.z; z <= last.z; ++z) {
    for (int y = first.y; y <= last.y; ++y) {
      for (int x = first.x; x <= last.x; ++x) {
        const IVec3 chunk{x, y, z};
        const IVec3 low = chunk * kChunkEdge;
        const IBox inside = intersect({box.min - low, box.max - low}, kWholeChunk);
        visit(Part{chunk, inside, &region_->at(chunk), low.x - origin_.x, bits_between(inside.min.x, inside.max.x)});
      }
    }
  }
}

void LightSolver::add_word(std::size_t channel, unsigned level, int column, IVec3 at, std::uint64_t where) {
  if (where == 0) return;
  const IVec3 p = at - origin_;
  QUOIN_ASSERT(channel < kChannels && level > 0 && level <= kBrightest, "a level of a channel");
  QUOIN_ASSERT(column >= 0 && static_cast<std::size_t>(column) < columns_ && p.y >= 0 && p.y <= size_.y + 1 &&
                   p.z >= 0 && p.z <= size_.z + 1,
               "a word of the region or its rim");
  const std::size_t in_layer = static_cast<std::size_t>(column) * column_ + static_cast<std::size_t>(p.y);
  sources_[channel][level].push_back({static_cast<std::uint32_t>(static_cast<std::size_t>(p.z) * layer_ + in_layer),
                                      static_cast<std::uint16_t>(p.z),
                                      static_cast<std::uint16_t>(in_layer / kBlockRows), where});
}

// A mask (`where`) of the chunk row that starts at `first`.
void LightSolver::add_source(std::size_t channel, unsigned level, IVec3 first, std::uint64_t where) {
  const int shift = first.x - origin_.x;
  const int bit = shift & 63;
  const int column = shift >> 6;
  add_word(channel, level, column, first, where << bit);
  if (bit != 0) add_word(channel, level, column + 1, first, where >> (64 - bit));
}

// Light of level 1 lights no other voxel.
void LightSolver::add_sources(std::size_t channel, const RowPlanes& planes, IVec3 first, std::uint64_t mask) {
  std::uint64_t left = (planes[1] | planes[2] | planes[3]) & mask;
  while (left != 0) {
    const unsigned level = level_at(planes, std::countr_zero(left));
    const bool is_last = (left & (left - 1)) == 0;
    const std::uint64_t where = is_last ? left : equal_to(planes, level) & left;
    add_source(channel, level, first, where);
    left &= ~where;
  }
}

// Skips sides that no wanted voxel is within reach of. Sky light falls from any height.
void LightSolver::read_rim() {
  const IBox& voxels = box_.voxels;
  const auto is_near = [&](int axis, bool is_high) {
    const int margin = is_high ? voxels.max[axis] - box_.wanted.max[axis] : box_.wanted.min[axis] - voxels.min[axis];
    return margin < kReach || (axis == 1 && is_high);
  };
  for (const int axis : {1, 2}) {
    for (const bool is_high : {false, true}) {
      if (!is_near(axis, is_high)) continue;
      IBox side = voxels;
      side.min[axis] = is_high ? side.max[axis] : side.min[axis] - 1;
      side.max[axis] = side.min[axis] + 1;
      for_each_part(side, [&](const Part& part) { read_light(part); });
    }
  }
  // Handles both ends of rows together.
  const IVec3 along_x{1, 0, 0};
  for_each_part({voxels.min - along_x, voxels.max + along_x}, [&](Part part) {
    const int low = voxels.min.x - 1 - part.chunk.x * kChunkEdge;
    const int high = voxels.max.x - part.chunk.x * kChunkEdge;
    part.bits = 0;
    if (low >= 0 && is_near(0, false)) part.bits |= bits_between(low, low + 1);
    if (high < kChunkEdge && is_near(0, true)) part.bits |= bits_between(high, high + 1);
    if (part.bits != 0) read_light(part);
  });
}

// Sky light of level 15 in a mask of the chunk row that starts at `first`. It needs no source: see take_sky.
void LightSolver::add_sky(IVec3 first, std::uint64_t where) {
  if (where == 0) return;
  const IVec3 p = first - origin_;
  QUOIN_ASSERT(p.y >= 0 && p.y <= size_.y + 1 && p.z >= 0 && p.z <= size_.z + 1, "a row of the region or its rim");
  has_sky_ = true;
  const auto add = [&](int column, std::uint64_t bits) {
    if (bits == 0) return;
    QUOIN_ASSERT(column >= 0 && static_cast<std::size_t>(column) < columns_, "a word of the region or its rim");
    front_[static_cast<std::size_t>(p.z) * layer_ + static_cast<std::size_t>(column) * column_ +
           static_cast<std::size_t>(p.y)] |= bits;
  };
  const int bit = p.x & 63;
  add(p.x >> 6, where << bit);
  if (bit != 0) add((p.x >> 6) + 1, where >> (64 - bit));
}

// Reads the known light of a part of the rim.
void LightSolver::read_light(const Part& part) {
  const ChunkAround& around = *part.around;
  if (!around.is_held) {
    if (around.is_open) open(part);
    return;
  }
  const IBox unknown = intersect(around.unknown, part.box);
  if (around.light == nullptr || unknown == part.box) return;
  for (std::size_t channel = 0; channel < kChannels; ++channel) {
    const ChannelLight& light = around.light->channels[channel];
    if ((channels_ >> channel & 1U) == 0 || (light.is_uniform() && light.level() == 0)) continue;
    if (channel == kSky && light.is_uniform() && light.level() == kBrightest && unknown.empty()) {
      open(part);
    } else {
      read_channel(part, channel, light, unknown);
    }
  }
}

void LightSolver::read_channel(const Part& part, std::size_t channel, const ChannelLight& light, const IBox& unknown) {
  const IVec3 low = part.chunk * kChunkEdge;
  const LightSlab uniform(light.is_uniform() ? light.level() : 0);
  const std::uint64_t known = part.bits & ~bits_between(unknown.min.x, unknown.max.x);
  SlabPlanes planes;
  part.for_each_slab([&](int y, int z) {
    const LightSlab& slab = light.is_uniform() ? uniform : light.stored(slab_index(y, z));
    if (slab.is_uniform() && slab.level() <= 1) return;
    slab.read(planes);
    unsigned rows = planes.lit_rows(part.bits) & rows_of(part.box, y, z);
    const unsigned unknown_rows = unknown.empty() ? 0 : rows_of(unknown, y, z);
    for (; rows != 0; rows &= rows - 1) {
      const auto row = static_cast<unsigned>(std::countr_zero(rows));
      std::uint64_t mask = (unknown_rows >> row & 1U) != 0 ? known : part.bits;
      if (has_tolls_ && part.around->masks != nullptr) {
        const auto of_slab = static_cast<int>(row);
        mask &= ~part.around->masks->absorbing(channel, y + (of_slab & 3), z + (of_slab >> 2));
      }
      const IVec3 first = low + IVec3(0, y + static_cast<int>(row & 3), z + static_cast<int>(row >> 2));
      const RowPlanes of_row = planes.row(row);
      if (channel == kSky) {
        const std::uint64_t sky = of_row[0] & of_row[1] & of_row[2] & of_row[3] & mask;
        add_sky(first, sky);
        mask &= ~sky;
      }
      add_sources(channel, of_row, first, mask);
    }
  });
}

// The sky lights all of it.
void LightSolver::open(const Part& part) {
  if ((channels_ >> kSky & 1U) == 0) return;
  has_sky_ = true;
  std::array<std::uint64_t, kChunkEdge> all;
  all.fill(kAll);
  std::array<std::uint64_t, kChunkEdge> none{};
  const IVec3 p = part.chunk * kChunkEdge + part.box.min - origin_;
  const int column = part.shift >> 6;
  for (int z = 0; z < part.box.max.z - part.box.min.z; ++z) {
    std::uint64_t* first = front_.data() + static_cast<std::size_t>(p.z + z) * layer_ + static_cast<std::size_t>(p.y);
    const auto of_column = [&](int i) {
      const bool is_inside = i >= 0 && i < static_cast<int>(columns_);
      return is_inside ? first + static_cast<std::size_t>(i) * column_ : none.data();
    };
    kernel().shift_in(all.data(), static_cast<std::size_t>(part.box.max.y - part.box.min.y), part.bits,
                      static_cast<unsigned>(part.shift & 63), of_column(column), of_column(column + 1));
  }
}

// Lamps, and the light of chunks that keep theirs.
void LightSolver::read_inside() {
  for_each_part(box_.voxels, [&](const Part& part) {
    if (!part.around->is_held) return read_light(part);
    for (const ChunkMasks::LampRow& row : part.around->masks->lamps()) {
      if (!part.box.contains({part.box.min.x, row.y, row.z})) continue;
      for (std::size_t channel = 0; channel < kChannels; ++channel) {
        const unsigned level = row.lamp >> (4 * channel) & 15U;
        if (level == 0 || (channels_ >> channel & 1U) == 0) continue;
        add_source(channel, level, part.chunk * kChunkEdge + IVec3(0, row.y, row.z), row.where & part.bits);
      }
    }
  });
}

// Adds a part's rows to the words of a region. `rows`: of the chunk, [y + 64 z]; null: all are `uniform`.
void LightSolver::put_rows(const Part& part, const std::uint64_t* rows, std::uint64_t uniform,
                           BlockVector<std::uint64_t>& to) {
  std::array<std::uint64_t, kChunkEdge> same;
  if (rows == nullptr) same.fill(uniform);
  const auto count = static_cast<std::size_t>(part.box.max.y - part.box.min.y);
  const auto y = static_cast<std::size_t>(part.chunk.y * kChunkEdge + part.box.min.y - origin_.y);
  // The column before the first is written only where it is masked.
  const std::ptrdiff_t column = part.shift >> 6;
  for (int z = part.box.min.z; z < part.box.max.z; ++z) {
    const std::uint64_t* from = rows == nullptr ? same.data() : rows + part.box.min.y + kChunkEdge * z;
    const auto layer = static_cast<std::size_t>(part.chunk.z * kChunkEdge + z - origin_.z) * layer_;
    std::uint64_t* low = to.data() + layer + y + column * static_cast<std::ptrdiff_t>(column_);
    kernel().shift_in(from, count, part.bits, static_cast<unsigned>(part.shift & 63), low, low + column_);
  }
}

void LightSolver::read_pass(std::size_t channel) {
  std::fill_n(pass_.begin(), (static_cast<std::size_t>(size_.z) + 2) * layer_, 0);
  for_each_part(box_.voxels, [&](const Part& part) {
    if (!part.around->is_held) return;
    const std::uint64_t* rows = part.around->masks->rows(channel);
    put_rows(part, rows, rows == nullptr ? part.around->masks->uniform(channel) : 0, pass_);
  });
}

// Closes sides towards the next lower voxels along an axis. `where`: voxels of the chunk row that starts at `first`.
void LightSolver::close_sides(int axis, IVec3 first, std::uint64_t where) {
  const IVec3 p = first - origin_;
  if (p.y > size_.y + 1 || p.z > size_.z + 1) return;
  QUOIN_ASSERT(p.y >= 0 && p.z >= 0, "a row of the region or its rim");
  const auto close = [&](int column, std::uint64_t bits) {
    if (bits == 0 || column < 0 || column >= static_cast<int>(columns_)) return;
    open_sides_[static_cast<std::size_t>(axis)][static_cast<std::size_t>(p.z) * layer_ +
                                                static_cast<std::size_t>(column) * column_ +
                                                static_cast<std::size_t>(p.y)] &= ~bits;
  };
  const int bit = p.x & 63;
  close(p.x >> 6, where << bit);
  if (bit != 0) close((p.x >> 6) + 1, where >> (64 - bit));
}

// Sets the masks of open sides.
void LightSolver::read_sides() {
  if (!has_sides_) return;
  const std::size_t words = (static_cast<std::size_t>(size_.z) + 2) * layer_ + 1;
  for (BlockVector<std::uint64_t>& sides : open_sides_) sides.assign(words, kAll);
  for_each_part({box_.voxels.min - 1, box_.voxels.max + 1}, [&](const Part& part) {
    if (!part.around->is_held || part.around->masks == nullptr) return;
    for (const ChunkMasks::SideRow& row : part.around->masks->side_rows()) {
      if (!part.box.contains({part.box.min.x, row.y, row.z})) continue;
      const IVec3 first = part.chunk * kChunkEdge + IVec3(0, row.y, row.z);
      for (const Direction side : kDirections) {
        const FaceFrame& frame = frame_of(side);
        IVec3 upper = first;  // the side is that between the voxel `upper` and the next lower one
        if (frame.sign > 0) ++upper[frame.axis];
        close_sides(frame.axis, upper, row.covered[static_cast<std::size_t>(side)] & part.bits);
      }
    }
  });
}

// Sets the tolls of a channel.
void LightSolver::read_tolls(std::size_t channel) {
  toll_count_ = 0;
  if (!has_tolls_) return;
  const std::size_t layers = static_cast<std::size_t>(size_.z) + 2;
  const auto toll_like = [&](const TypeLight& type) -> Toll& {
    for (std::size_t i = 0; i < toll_count_; ++i) {
      if (tolls_[i].cost == type.cost && tolls_[i].absorbs == type.absorbs) return tolls_[i];
    }
    if (toll_count_ == tolls_.size()) tolls_.emplace_back();
    Toll& toll = tolls_[toll_count_++];
    toll.cost = type.cost;
    toll.absorbs = type.absorbs;
    toll.left.assign(layers * layer_, 0);
    return toll;
  };
  for_each_part(box_.voxels, [&](const Part& part) {
    if (!part.around->is_held) return;
    for (const ChunkMasks::Toll& toll : part.around->masks->tolls()) {
      if ((toll.like.tolls >> channel & 1U) == 0) continue;
      put_rows(part, toll.rows(), toll.uniform, toll_like(toll.like).left);
    }
  });
  if (toll_count_ == 0) return;
  lit_tolls_.assign(layers * layer_, 0);
  for (std::size_t i = 0; i < toll_count_; ++i) {
    tolls_[i].blocks.resize(layers);
    for (std::size_t z = 0; z < layers; ++z) {
      tolls_[i].blocks[z] = kernel().find_blocks(tolls_[i].left.data() + z * layer_, columns_ * blocks_);
    }
  }
}

// Finds the blocks that light can reach.
void LightSolver::find_passable() {
  for (std::size_t z = 0; z < passable_.size(); ++z) {
    passable_[z] = kernel().find_blocks(pass_.data() + z * layer_, columns_ * blocks_);
  }
}

bool LightSolver::has_sources(std::size_t channel) const {
  return (channel == kSky && has_sky_) ||
         std::any_of(sources_[channel].begin(), sources_[channel].end(),
                     [](const BlockVector<Source>& sources) { return !sources.empty(); });
}

// Prepares the block of a source for light.
void LightSolver::touch(const Source& source) {
  const std::uint64_t block = std::uint64_t{1} << source.block;
  if ((touched_[source.z] & block) != 0) return;
  touched_[source.z] |= block;
  const std::size_t first = source.at & ~(kBlockRows - 1);
  std::copy_n(pass_.data() + first, kBlockRows, rest_.data() + first);
  for (std::uint64_t* plane : planes_) std::fill_n(plane + first, kBlockRows, 0);
}

// Gives this level to voxels that light does not leave.
void LightSolver::absorb(const Source& source, unsigned level) {
  touch(source);
  for (std::size_t i = 0; i < kPlanes; ++i) {
    if ((level >> i & 1U) != 0) planes_[i][source.at] |= source.where;
  }
}

// Gives this level to voxels without a higher one. A voxel that blocks light has only one source; a voxel with a cost
// has one for each lamp and at most one more.
void LightSolver::light_up(const Source& source, unsigned level) {
  QUOIN_ASSERT(source.at < pass_.size() && source.block < 64 && source.z < touched_.size(), "a word of the region");
  const std::uint64_t block = std::uint64_t{1} << source.block;
  const bool is_touched = (touched_[source.z] & block) != 0;
  const std::uint64_t dark = is_touched ? rest_[source.at] : pass_[source.at];
  std::uint64_t fresh = source.where & (dark | ~pass_[source.at]);
  if (toll_count_ > 0) {
    fresh &= ~lit_tolls_[source.at];
    lit_tolls_[source.at] |= fresh;
  }
  if (fresh == 0) return;
  if (!is_touched) touch(source);
  in_front_[source.z] |= block;
  front_[source.at] |= fresh;
  rest_[source.at] &= ~fresh;
  for (std::size_t i = 0; i < kPlanes; ++i) {
    if ((level >> i & 1U) != 0) planes_[i][source.at] |= fresh;
  }
}

// For each layer: blocks within `margin` of the wanted box along y.
std::uint64_t LightSolver::blocks_near(int margin) const {
  const int low = std::max(box_.wanted.min.y - margin - origin_.y, 1);
  const int high = std::min(box_.wanted.max.y + margin - origin_.y, size_.y + 1);
  const std::uint64_t of_column = bits_between(low / 8, (high + 7) / 8);
  std::uint64_t blocks = 0;
  for (std::size_t column = 0; column < columns_; ++column) blocks |= of_column << (column * blocks_);
  return blocks;
}

// Returns the blocks of a layer that have voxels of the front or are next to them.
std::uint64_t LightSolver::blocks_near_front(std::size_t z) const {
  const std::uint64_t own = in_front_[z];
  std::uint64_t adjacent = own | own << 1 | own >> 1 | in_front_[z - 1] | in_front_[z + 1];
  if (columns_ > 1) adjacent |= own << blocks_ | own >> blocks_;
  return adjacent;
}

// Makes sources of the voxels of a block that the front reaches. They are not at the region's rim.
template <bool kHasSides>
void LightSolver::pay_toll(Toll& toll, std::size_t z, unsigned block, BlockVector<Source>& out) {
  const std::size_t first = z * layer_ + block * kBlockRows;
  const std::size_t column = block / blocks_;
  for (std::size_t at = first; at < first + kBlockRows; ++at) {
    if (toll.left[at] == 0) continue;
    const std::uint64_t own = front_[at];
    const auto open = [&](std::size_t axis, std::size_t word) {
      if constexpr (kHasSides) return open_sides_[axis][word];
      return kAll;
    };
    std::uint64_t around = (own << 1 & open(0, at)) | (own & open(0, at)) >> 1;
    around |= (front_[at - 1] & open(1, at)) | (front_[at + 1] & open(1, at + 1));
    around |= (front_[at - layer_] & open(2, at)) | (front_[at + layer_] & open(2, at + layer_));
    if (column > 0) around |= front_[at - column_] >> 63 & open(0, at);
    if (column + 1 < columns_) around |= (front_[at + column_] & open(0, at + column_)) << 63;
    const std::uint64_t reached = around & toll.left[at];
    if (reached == 0) continue;
    toll.left[at] &= ~reached;
    out.push_back(
        {static_cast<std::uint32_t>(at), static_cast<std::uint16_t>(z), static_cast<std::uint16_t>(block), reached});
  }
}

// Makes sources of the voxels with a cost next to the front, of the level above `level`.
void LightSolver::pay_tolls(std::size_t channel, unsigned level) {
  for (std::size_t i = 0; i < toll_count_; ++i) {
    Toll& toll = tolls_[i];
    if (toll.cost > level) continue;
    const unsigned reached = level + 1 - toll.cost;
    BlockVector<Source>& out = toll.absorbs ? absorbed_[reached] : sources_[channel][reached];
    for (std::size_t z = 1; z <= static_cast<std::size_t>(size_.z); ++z) {
      for (std::uint64_t left = blocks_near_front(z) & toll.blocks[z]; left != 0; left &= left - 1) {
        const auto block = static_cast<unsigned>(std::countr_zero(left));
        has_sides_ ? pay_toll<true>(toll, z, block, out) : pay_toll<false>(toll, z, block, out);
      }
    }
  }
}

// Activates the blocks next to those that changed, if light of this level can still reach the wanted box from there.
void LightSolver::activate(unsigned level) {
  const int margin = static_cast<int>(level) - 1;
  const std::uint64_t near = blocks_near(margin);
  const int low = box_.wanted.min.z - margin - origin_.z;
  const int high = box_.wanted.max.z + margin - origin_.z;
  for (std::size_t z = 1; z <= static_cast<std::size_t>(size_.z); ++z) {
    const bool is_near = static_cast<int>(z) >= low && static_cast<int>(z) < high;
    active_[z] = is_near ? blocks_near_front(z) & open_[z] & near : 0;
  }
}

LevelPass LightSolver::step_to(unsigned level) {
  LevelPass step{level,
                 layer_,
                 column_,
                 touched_.size(),
                 pass_.data(),
                 {},
                 rest_.data(),
                 front_.data(),
                 next_.data(),
                 {},
                 static_cast<std::size_t>(box_.wanted.min.z - origin_.z),
                 static_cast<std::size_t>(box_.wanted.max.z - origin_.z),
                 blocks_near(0),
                 wanted_bits_.data(),
                 active_.data(),
                 in_next_.data(),
                 touched_.data(),
                 open_.data()};
  for (std::size_t plane = 0; plane < kPlanes; ++plane) step.planes[plane] = planes_[plane];
  for (std::size_t axis = 0; has_sides_ && axis < 3; ++axis) step.open_sides[axis] = open_sides_[axis].data();
  return step;
}

void LightSolver::spread(std::size_t channel) {
  const auto& sources = sources_[channel];
  read_tolls(channel);
  open_ = passable_;
  outcome_ = Outcome::Mixed;
  for (const Source& source : sources[kBrightest]) light_up(source, kBrightest);
  if (channel == kSky) {
    LevelPass sky = step_to(kBrightest);
    sky.changed = in_front_.data();
    if (!kernel().take_sky(sky) && toll_count_ == 0) outcome_ = Outcome::Open;
  }
  for (unsigned level = kBrightest - 1; level > 0 && outcome_ != Outcome::Open; --level) {
    if (toll_count_ > 0) pay_tolls(channel, level);
    activate(level);
    kernel().spread(step_to(level));
    std::swap(front_, next_);
    std::swap(in_front_, in_next_);
    for (const Source& source : sources[level]) light_up(source, level);
    for (const Source& source : absorbed_[level]) absorb(source, level);
    absorbed_[level].clear();
  }
  clear_fronts();
}

void LightSolver::clear_fronts() {
  for (std::size_t z = 0; z < touched_.size(); ++z) {
    for (std::uint64_t left = in_front_[z] | in_next_[z]; left != 0; left &= left - 1) {
      const std::size_t at = z * layer_ + kBlockRows * static_cast<std::size_t>(std::countr_zero(left));
      std::fill_n(front_.data() + at, kBlockRows, 0);
      std::fill_n(next_.data() + at, kBlockRows, 0);
    }
    in_front_[z] = in_next_[z] = 0;
  }
}

// Darkens the wanted blocks that share a slab with a touched block, except the touched ones.
void LightSolver::complete_planes() {
  const std::uint64_t all = kAll >> (64 - columns_ * blocks_);
  const int begin = box_.wanted.min.z - origin_.z;
  const int end = box_.wanted.max.z - origin_.z;
  for (int z = begin; z < end; ++z) {
    std::uint64_t near = 0;
    for (int i = std::max(z - 3, 0); i < std::min(z + 4, size_.z + 2); ++i)
      near |= touched_[static_cast<std::size_t>(i)];
    near |= near << 1 | near >> 1;
    if (columns_ > 1) near |= near << blocks_ | near >> blocks_;
    const auto layer = static_cast<std::size_t>(z);
    for (std::uint64_t left = near & ~touched_[layer] & all; left != 0; left &= left - 1) {
      const std::size_t at = layer * layer_ + kBlockRows * static_cast<std::size_t>(std::countr_zero(left));
      for (std::uint64_t* plane : planes_) std::fill_n(plane + at, kBlockRows, 0);
    }
  }
}

// Returns the blocks along y, of any column of the part, in which a voxel of the slabs at z is lit.
std::uint64_t LightSolver::touched_blocks(const Part& part, int z) const {
  const int p = part.chunk.z * kChunkEdge + z - origin_.z;
  std::uint64_t touched = 0;
  for (int i = std::max(p, 1); i < std::min(p + 4, size_.z + 1); ++i) touched |= touched_[static_cast<std::size_t>(i)];
  std::uint64_t blocks = 0;
  for (int column = std::max(part.shift >> 6, 0); column <= (part.shift >> 6) + 1; ++column) {
    if (column < static_cast<int>(columns_)) blocks |= touched >> (static_cast<std::size_t>(column) * blocks_);
  }
  return blocks & kAll >> (64 - blocks_);
}

// Returns the blocks along y that contain rows of a slab.
std::uint64_t LightSolver::blocks_of_slab(const Part& part, int y) const {
  const int p = part.chunk.y * kChunkEdge + y - origin_.y;
  return bits_between(std::max(p, 0) / 8, std::min((p + 3) / 8, static_cast<int>(blocks_) - 1) + 1);
}

void LightSolver::read_slab(const Part& part, int y, int z, SlabPlanes& now) const {
  const IVec3 p = part.chunk * kChunkEdge + IVec3(0, y, z) - origin_;
  const std::ptrdiff_t at =
      p.z * static_cast<std::ptrdiff_t>(layer_) + (part.shift >> 6) * static_cast<std::ptrdiff_t>(column_) + p.y;
  SlabRead read{{},
                layer_,
                column_,
                static_cast<unsigned>(part.shift & 63),
                static_cast<std::size_t>(std::max(1 - p.z, 0)),
                static_cast<std::size_t>(std::min(size_.z + 1 - p.z, 4))};
  QUOIN_ASSERT(read.begin < read.end && read.end <= 4, "a slab with layers in the region");
  for (std::size_t plane = 0; plane < kPlanes; ++plane) read.planes[plane] = planes_[plane] + at;
  kernel().read_slab(read, now.words.data());
}

// Returns true if all of a chunk is open sky and its light was uniform.
bool LightSolver::write_open(const Part& part, const ChannelLight& before, ChunkLightChange& change) const {
  const ChunkMasks& masks = *part.around->masks;
  const bool is_open = outcome_ == Outcome::Open && part.is_whole() && before.is_uniform() &&
                       masks.rows(kSky) == nullptr && masks.uniform(kSky) == kAll;
  if (!is_open || before.level() == kBrightest) return is_open;
  change.channels[kSky].is_uniform = true;
  change.channels[kSky].level = kBrightest;
  change.record.add_all();
  return true;
}

void LightSolver::write_chunk(const Part& part, std::size_t channel, ChunkLightChange& change) {
  static const ChannelLight dark;
  static const SlabPlanes dark_slab{};
  const ChannelLight& before = part.around->light == nullptr ? dark : part.around->light->channels[channel];
  if (outcome_ == Outcome::Dark && before.is_uniform() && before.level() == 0) return;
  if (write_open(part, before, change)) return;
  const bool is_new = part.is_whole() && part.around->light == nullptr;
  const LightSlab uniform(before.is_uniform() ? before.level() : 0);
  SlabPlanes now;
  SlabPlanes old;
  alignas(64) std::array<std::uint64_t, kSlabWords> inside;
  alignas(64) std::array<std::uint64_t, kSlabWords> changed;
  unsigned rows_inside = 0;  // the rows that `inside` has
  int touched_z = -1;        // the slabs that `touched` is about
  std::uint64_t touched = 0;
  inside.fill(0);
  part.for_each_slab([&](int y, int z) {
    if (z != std::exchange(touched_z, z)) touched = outcome_ == Outcome::Dark ? 0 : touched_blocks(part, z);
    const std::size_t index = slab_index(y, z);
    const LightSlab& was = before.is_uniform() ? uniform : before.stored(index);
    const bool is_dark = (touched & blocks_of_slab(part, y)) == 0;
    const bool was_dark = was.is_uniform() && was.level() == 0;
    if (is_dark && was_dark) return;
    if (const unsigned rows = rows_of(part.box, y, z); rows != std::exchange(rows_inside, rows)) {
      for (std::size_t row = 0; row < kSlabWords; ++row) inside[row] = (rows >> row & 1U) != 0 ? part.bits : 0;
    }
    is_dark ? now.words.fill(0) : read_slab(part, y, z, now);
    if (!was_dark) was.read(old);
    const SlabPlanes& other = was_dark ? dark_slab : old;
    const SlabKinds kinds = kernel().merge(other.words.data(), inside.data(), now.words.data(), changed.data());
    if (!kinds.is_changed) return;
    change.channels[channel].slabs.push_back({index, LightSlab::of(now, kinds)});
    is_new ? change.record.add_all() : add_slab(y, z, changed.data(), change.record);
  });
}

void LightSolver::write(std::size_t channel, std::vector<ChunkLightChange>& changes) {
  const IVec3 first = chunk_of(region_->all.wanted.min);
  const IVec3 size = chunk_of(region_->all.wanted.max - 1) + 1 - first;
  for_each_part(box_.wanted, [&](const Part& part) {
    const IVec3 p = part.chunk - first;
    const auto index = static_cast<std::size_t>(p.x + size.x * (p.y + size.y * p.z));
    QUOIN_ASSERT(index < changes.size(), "a change per chunk with wanted voxels");
    ChunkLightChange& change = changes[index];
    QUOIN_ASSERT(change.chunk == part.chunk, "changes are in the order of chunks");
    if (part.around->is_held) write_chunk(part, channel, change);
  });
}

// Channels of the same box.
void LightSolver::solve(const LightRegion::Box& box, unsigned channels, std::vector<ChunkLightChange>& changes) {
  shape(box);
  channels_ = channels;
  has_sky_ = false;
  read_rim();
  read_inside();
  read_sides();
  std::size_t passes = kChannels;  // the channel stored in `pass_`
  for (std::size_t channel = 0; channel < kChannels; ++channel) {
    if ((channels >> channel & 1U) == 0) continue;
    outcome_ = Outcome::Dark;
    if (has_sources(channel)) {
      const auto is_alike = [&](const ChunkAround& around) {
        return around.masks == nullptr || around.masks->are_alike(channel, passes);
      };
      if (passes == kChannels || !std::all_of(region_->around.begin(), region_->around.end(), is_alike)) {
        read_pass(channel);
        find_passable();
      }
      passes = channel;
      spread(channel);
      complete_planes();
    }
    write(channel, changes);
    std::fill(touched_.begin(), touched_.end(), 0);
  }
}

void LightSolver::solve(const LightRegion& region, std::vector<ChunkLightChange>& changes) {
  QUOIN_ASSERT(fits(region.all.voxels.size()), "a region that is not too large");
  QUOIN_ASSERT(region.around.size() == region.index(region.chunks.max - 1) + 1, "a chunk for each index");
  region_ = &region;
  has_sides_ = std::ranges::any_of(region.around, [](const ChunkAround& around) {
    return around.masks != nullptr && !around.masks->side_rows().empty();
  });
  has_tolls_ = std::ranges::any_of(region.around, [](const ChunkAround& around) {
    return around.masks != nullptr && !around.masks->tolls().empty();
  });
  box_ = region.all;
  if (!std::exchange(is_clean_, false)) {
    for (auto* words : {&front_, &next_}) std::fill(words->begin(), words->end(), 0);
    for (BlockVector<Source>& of_level : absorbed_) of_level.clear();
  }
  changes.clear();
  for_each_part(region.all.wanted, [&](const Part& part) {
    changes.push_back({part.chunk, {}, {}, {}});
    if (part.around->masks != nullptr) changes.back().without_lamps = part.around->masks->without_lamps();
  });
  unsigned done = 0;
  for (std::size_t channel = 0; channel < kChannels; ++channel) {
    const LightRegion::Box& box = region.channels[channel];
    if ((done >> channel & 1U) != 0 || box.wanted.empty()) continue;
    unsigned alike = 0;
    for (std::size_t c = channel; c < kChannels; ++c) alike |= static_cast<unsigned>(region.channels[c] == box) << c;
    solve(box, alike, changes);
    done |= alike;
  }
  is_clean_ = true;
}

}  // namespace quoin::propagated
