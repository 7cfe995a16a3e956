#include "light/propagated/light_solver.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "core/instruction_set.h"
#include "trace/chunk_rows.h"

namespace quoin::propagated {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};
constexpr std::size_t kSky = 0;
constexpr unsigned kBrightest = 15;

TypeLight light_of(const std::vector<TypeLight>& types, VoxelType type) {
  // What is not registered is opaque.
  return type < types.size() ? types[type] : TypeLight{0, 0};
}

const SpreadKernel& widest_kernel() {
#ifdef QUOIN_X86_KERNELS
  if (has_instruction_set(InstructionSet::Avx512)) return kSpreadAvx512;
  if (has_instruction_set(InstructionSet::Avx2)) return kSpreadAvx2;
#endif
  return kSpreadPlain;
}

// The blocks of rows from low to high.
std::uint8_t blocks_between(int low_y, int high_y) {
  const unsigned first = static_cast<unsigned>(low_y) / kBlock;
  const unsigned last = static_cast<unsigned>(high_y - 1) / kBlock;
  return static_cast<std::uint8_t>((2U << last) - (1U << first));
}

}  // namespace

LightSolver::LightSolver() : scratch_(std::make_unique<Scratch>()) {}

template <class Visit>
void LightSolver::for_each_row(Visit&& visit) const {
  for (int z = box_.min.z; z < box_.max.z; ++z) {
    for (int y = box_.min.y; y < box_.max.y; ++y) visit(y, z);
  }
}

// Of those that touch the box: y is their first row, which may lie outside.
template <class Visit>
void LightSolver::for_each_block(Visit&& visit) const {
  constexpr int kRows = kBlock;
  for (int z = box_.min.z; z < box_.max.z; ++z) {
    for (int y = box_.min.y & -kRows; y < box_.max.y; y += kRows) visit(y, z);
  }
}

void LightSolver::read_voxels(const Chunk* voxels, const std::vector<TypeLight>& types) {
  std::uint8_t any = 15;  // channels that pass by all that lets any pass
  std::vector<VoxelType> found;
  if (voxels != nullptr) found = voxels->types();
  for (const VoxelType type : found) {
    const std::uint8_t passes = type == kAir ? 15 : light_of(types, type).passes;
    if (passes != 0) any &= passes;
  }
  for (std::size_t channel = 0; channel < kChannels; ++channel) {
    const bool is_first = channel > 0 && (any >> channel & 1U) != 0 && (any & 1U) != 0;
    pass_of_[channel] = is_first ? 0 : channel;
    if (is_first) continue;
    Plane& pass = scratch_->pass[channel];
    for_each_block([&](int y, int z) { std::fill_n(&pass.rows[at(y, z)], kBlock, std::uint64_t{0}); });
    for_each_row([&](int y, int z) { pass.rows[at(y, z)] = inside_; });
    if (voxels == nullptr) continue;
    const auto stops = [&](VoxelType type) { return (light_of(types, type).passes >> channel & 1U) == 0; };
    const FunctionRef<bool(VoxelType)> asked(stops);
    trace::ChunkRows(*voxels, asked).for_each_row(box_, [&](int y, int z, std::uint64_t where) {
      pass.rows[at(y, z)] &= ~where;
    });
  }
}

void LightSolver::read_lamps(const Chunk& voxels, const std::vector<TypeLight>& types, ChunkLight& light) {
  std::vector<std::pair<trace::ChunkRows, std::uint16_t>> lamps;
  for (const VoxelType type : voxels.types()) {
    const std::uint16_t lamp = type == kAir ? std::uint16_t{0} : light_of(types, type).lamp;
    if (lamp != 0) lamps.emplace_back(trace::ChunkRows(voxels, type), lamp);
  }
  if (lamps.empty()) return;
  for (int slab_z = box_.min.z & -4; slab_z < box_.max.z; slab_z += 4) {
    for (int slab_y = box_.min.y & -4; slab_y < box_.max.y; slab_y += 4) {
      std::uint16_t& known = light.lamp_slabs[static_cast<std::size_t>(slab_z / 4)];
      const auto slab = static_cast<std::uint16_t>(1U << (slab_y / 4));
      if ((known & slab) == 0) continue;
      known &= static_cast<std::uint16_t>(~slab);
      const IBox all{{0, slab_y, slab_z}, {kChunkEdge, slab_y + 4, slab_z + 4}};
      for (const auto& lamp : lamps) {
        lamp.first.for_each_row(all, [&](int y, int z, std::uint64_t where) {
          known |= slab;
          const bool is_inside = y >= box_.min.y && y < box_.max.y && z >= box_.min.z && z < box_.max.z;
          if (is_inside && (where & inside_) != 0) lamps_.push_back({lamp.second, y, z, where & inside_});
        });
      }
    }
  }
}

unsigned LightSolver::Side::uniform() const {
  return light == nullptr ? level : light->uniform().value_or(kBrightest + 1);
}

std::array<std::uint64_t, kPlanes> LightSolver::Side::row(int y, int z) const {
  if (light != nullptr) return light->row(y & (kChunkEdge - 1), z & (kChunkEdge - 1));
  std::array<std::uint64_t, kPlanes> planes;
  for (std::size_t bit = 0; bit < kPlanes; ++bit) planes[bit] = std::uint64_t{0} - (level >> bit & 1U);
  return planes;
}

LightSolver::Side LightSolver::side(Direction direction, std::size_t channel, const LightBorder& border,
                                    const ChunkLight& light) const {
  const FaceFrame& frame = frame_of(direction);
  const bool leaves = frame.sign > 0 ? box_.max[frame.axis] == kChunkEdge : box_.min[frame.axis] == 0;
  if (!leaves) return {&light.channels[channel], 0};
  const auto i = static_cast<std::size_t>(direction);
  if (border.chunk[i] != nullptr) return {&border.chunk[i]->channels[channel], 0};
  return {nullptr, border.beyond[i] >> (4 * channel) & 15U};
}

// Voxels that get the level for the first time.
void LightSolver::set(unsigned level, std::size_t row, std::uint64_t voxels) {
  scratch_->open.rows[row] &= ~voxels;
  for (std::size_t bit = 0; bit < kPlanes; ++bit) {
    if ((level >> bit & 1U) != 0) scratch_->level[bit].rows[row] |= voxels;
  }
}

void LightSolver::begin_channel(std::size_t channel) {
  for (std::vector<Source>& sources : sources_) sources.clear();
  const Plane& pass = scratch_->pass[pass_of_[channel]];
  for_each_block([&](int y, int z) {
    const std::size_t row = at(y, z);
    std::copy_n(&pass.rows[row], kBlock, &scratch_->open.rows[row]);
  });
}

void LightSolver::add(unsigned level, int y, int z, std::uint64_t voxels) {
  const std::size_t block = ChannelLight::block_of(y, z);
  sources_[level].push_back({static_cast<std::uint32_t>(at(y, z)), static_cast<std::uint32_t>(block), voxels});
}

// Without loss, straight down.
void LightSolver::let_sky_fall(const Side& above) {
  Front& front = scratch_->fronts[kBrightest & 1U];
  for (int z = box_.min.z; z < box_.max.z; ++z) {
    std::uint64_t falling = kAll;
    for (const std::uint64_t plane : above.row(box_.max.y, z)) falling &= plane;
    for (int y = box_.max.y - 1; y >= box_.min.y; --y) {
      const std::size_t row = at(y, z);
      falling &= scratch_->open.rows[row];
      if (falling == 0) break;
      front.plane.rows[row] = falling;
      set(kBrightest, row, falling);
      front.lit[static_cast<std::size_t>(z)] |= static_cast<std::uint8_t>(1U << (static_cast<unsigned>(y) / kBlock));
    }
  }
}

// The light beside a row becomes sources in it.
void LightSolver::add_row(const std::array<std::uint64_t, kPlanes>& planes, int y, int z) {
  std::uint64_t left = (planes[1] | planes[2] | planes[3]) & scratch_->open.rows[at(y, z)];  // 2 and more
  while (left != 0) {
    const int x = std::countr_zero(left);
    unsigned level = 0;
    std::uint64_t equal = left;
    for (std::size_t bit = 0; bit < kPlanes; ++bit) {
      const unsigned is_set = planes[bit] >> x & 1U;
      level |= is_set << bit;
      equal &= is_set != 0 ? planes[bit] : ~planes[bit];
    }
    add(level - 1, y, z, equal);
    left &= ~equal;
  }
}

// The rows beside the box along y or z.
void LightSolver::add_rows(Direction direction, const Side& beside) {
  if (beside.uniform() <= 1) return;
  const FaceFrame& frame = frame_of(direction);
  IBox rows = box_;
  (frame.sign > 0 ? rows.min : rows.max)[frame.axis] =
      frame.sign > 0 ? box_.max[frame.axis] - 1 : box_.min[frame.axis] + 1;
  const IVec3 normal = normal_of(direction);
  for (int z = rows.min.z; z < rows.max.z; ++z) {
    for (int y = rows.min.y; y < rows.max.y; ++y) add_row(beside.row(y + normal.y, z + normal.z), y, z);
  }
}

// The voxels beside the box along x.
void LightSolver::add_end(Direction direction, const Side& beside) {
  if (beside.uniform() <= 1) return;
  const bool is_up = direction == Direction::PosX;
  const int inner = is_up ? box_.max.x - 1 : box_.min.x;
  const int outer = (is_up ? box_.max.x : box_.min.x - 1) & (kChunkEdge - 1);
  const std::uint64_t voxel = std::uint64_t{1} << inner;
  for_each_block([&](int first, int z) {
    unsigned level = beside.level;
    const LevelBlock* block = nullptr;
    if (beside.light != nullptr) block = beside.light->block(ChannelLight::block_of(first, z), level);
    if (block == nullptr && level <= 1) return;
    const std::uint64_t* const open = &scratch_->open.rows[at(first, z)];
    for (int i = 0; i < static_cast<int>(kBlock); ++i) {
      if ((open[i] & voxel) == 0) continue;  // as in rows outside of the box
      if (block != nullptr) level = block->at(outer, i);
      if (level > 1) add(level - 1, first + i, z, voxel);
    }
  });
}

void LightSolver::add_lamps(std::size_t channel) {
  for (const Lamp& lamp : lamps_) {
    const unsigned level = lamp.light >> (4 * channel) & 15U;
    if (level > 0) add(level, lamp.y, lamp.z, lamp.voxels);
  }
}

// Returns whether any voxel has the level.
bool LightSolver::spread_to(std::size_t channel, unsigned level, Front& from, Front& to) {
  Scratch& scratch = *scratch_;
  const std::uint8_t in_box = blocks_between(box_.min.y, box_.max.y);
  const auto low = static_cast<std::size_t>(box_.min.z);
  const auto high = static_cast<std::size_t>(box_.max.z);
  for (std::size_t z = low; z < high; ++z) {
    const unsigned own = from.lit[z];
    const unsigned beside = (z > low ? from.lit[z - 1] : 0U) | (z + 1 < high ? from.lit[z + 1] : 0U);
    const unsigned look = (own | own << 1 | own >> 1 | beside) & in_box;
    scratch.blocks[z] = static_cast<std::uint8_t>(look);
    clear(to.plane, z, to.lit[z] & ~look);
  }
  SpreadStep step{from.plane.rows.data(), to.plane.rows.data(), scratch.open.rows.data(), {}, &scratch.blocks, &to.lit};
  for (std::size_t bit = 0; bit < kPlanes; ++bit) {
    step.level[bit] = (level >> bit & 1U) != 0 ? scratch.level[bit].rows.data() : nullptr;
  }
  kernel_->spread(step, box_.min.z, box_.max.z);
  const Plane& pass = scratch.pass[pass_of_[channel]];
  for (const Source& source : sources_[level]) {
    // A lamp's own voxel need not let light pass.
    const std::uint64_t voxels = source.voxels & (scratch.open.rows[source.row] | ~pass.rows[source.row]);
    if (voxels == 0) continue;
    to.plane.rows[source.row] |= voxels;
    set(level, source.row, voxels);
    to.lit[source.block / 8] |= static_cast<std::uint8_t>(1U << source.block % 8);
  }
  return std::any_of(to.lit.begin() + box_.min.z, to.lit.begin() + box_.max.z,
                     [](std::uint8_t lit) { return lit != 0; });
}

void LightSolver::spread(std::size_t channel) {
  std::array<Front, 2>& fronts = scratch_->fronts;
  // Sky of level 15 has fallen already.
  scratch_->touched = fronts[kBrightest & 1U].lit;
  bool goes_on = channel == kSky;
  for (unsigned level = channel == kSky ? kBrightest - 1 : kBrightest; level > 0; --level) {
    if (!goes_on && sources_[level].empty()) continue;
    Front& to = fronts[level & 1U];
    goes_on = spread_to(channel, level, fronts[(level + 1) & 1U], to);
    for (std::size_t z = 0; z < kChunkEdge; ++z) scratch_->touched[z] |= to.lit[z];
  }
  for (Front& front : fronts) {
    for (std::size_t z = 0; z < kChunkEdge; ++z) clear(front.plane, z, front.lit[z]);
    front.lit.fill(0);
  }
}

void LightSolver::clear(Plane& plane, std::size_t z, unsigned blocks) const {
  for (unsigned left = blocks; left != 0; left &= left - 1) {
    const int y = std::countr_zero(left) * static_cast<int>(kBlock);
    std::fill_n(&plane.rows[at(y, static_cast<int>(z))], kBlock, std::uint64_t{0});
  }
}

// What was found becomes the light of the box, and is forgotten.
void LightSolver::replace(ChannelLight& light, ChangedRows& changed) {
  Scratch& scratch = *scratch_;
  const bool was_dark = light.uniform() == 0U;
  std::array<std::uint64_t, kBlock> where;
  std::array<std::uint64_t, kBlock> differs;
  for_each_block([&](int y, int z) {
    const auto i = static_cast<std::size_t>(z);
    const bool is_touched = (scratch.touched[i] >> (static_cast<unsigned>(y) / kBlock) & 1U) != 0;
    if (!is_touched && was_dark) return;
    const std::size_t block = ChannelLight::block_of(y, z);
    unsigned level = 0;
    const LevelBlock* const before = light.block(block, level);
    if (!is_touched && before == nullptr && level == 0) return;
    for (int row = y; row < y + static_cast<int>(kBlock); ++row) {
      where[static_cast<std::size_t>(row - y)] = row >= box_.min.y && row < box_.max.y ? inside_ : 0;
    }
    std::array<const std::uint64_t*, kPlanes> planes;
    for (std::size_t bit = 0; bit < kPlanes; ++bit) planes[bit] = &scratch.level[bit].rows[at(y, z)];
    LevelBlock now = before != nullptr ? *before : LevelBlock::uniform(level);
    if (!kernel_->replace(planes, where, now, differs)) return;
    changed.add_block(block, differs);
    light.put(block, now);
  });
  light.tidy();
  for (Plane& plane : scratch.level) {
    for (std::size_t z = 0; z < kChunkEdge; ++z) clear(plane, z, scratch.touched[z]);
  }
}

ChangedRows LightSolver::solve(const Chunk* voxels, const std::vector<TypeLight>& types, const LightBorder& border,
                               const IBox& box, ChunkLight& light) {
  kernel_ = &widest_kernel();
  box_ = box;
  const int width = box.max.x - box.min.x;
  inside_ = (width == kChunkEdge ? kAll : (std::uint64_t{1} << width) - 1) << box.min.x;
  read_voxels(voxels, types);
  lamps_.clear();
  if (voxels != nullptr) read_lamps(*voxels, types, light);
  ChangedRows changed;
  for (std::size_t channel = 0; channel < kChannels; ++channel) {
    begin_channel(channel);
    if (channel == kSky) let_sky_fall(side(Direction::PosY, channel, border, light));
    for (const Direction direction : kDirections) {
      const Side beside = side(direction, channel, border, light);
      frame_of(direction).axis == 0 ? add_end(direction, beside) : add_rows(direction, beside);
    }
    add_lamps(channel);
    spread(channel);
    replace(light.channels[channel], changed);
  }
  return changed;
}

}  // namespace quoin::propagated
