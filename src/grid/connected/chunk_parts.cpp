#include "grid/connected/chunk_parts.h"

#include <algorithm>

#include <quoin/core/assert.h>

namespace quoin {
namespace {

constexpr std::size_t kRows = std::size_t{kChunkEdge} * kChunkEdge;
// Up to this many types are searched one by one, in words.
constexpr std::size_t kFewTypes = 4;

constexpr std::uint32_t kNoPart = 0xFFFF'FFFFU;

void add_run(ChunkPart& part, int x, int last_x, int y, int z) {
  QUOIN_ASSERT(x >= 0 && x <= last_x && last_x < kChunkEdge, "0 <= x <= last_x < 64");
  const std::array<int, 3> min = {x, y, z};
  const std::array<int, 3> last = {last_x, y, z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    part.min[axis] = static_cast<std::uint8_t>(part.voxels == 0 ? min[axis] : std::min<int>(part.min[axis], min[axis]));
    part.last[axis] = static_cast<std::uint8_t>(std::max<int>(part.last[axis], last[axis]));
  }
  if (part.voxels == 0) part.first = static_cast<std::uint32_t>((z * kChunkEdge + y) * kChunkEdge + x);
  part.voxels += static_cast<std::uint32_t>(last_x - x + 1);
}

}  // namespace

ChunkParts::ChunkParts(const Chunk& chunk, const ConnectedOptions& options, Scratch& scratch) : chunk_(chunk) {
  choose_rule(options);
  if (const auto type = chunk_.uniform()) {
    if (row(0, 0) == 0) return;
    parts_.push_back({{0, 0, 0}, {63, 63, 63}, static_cast<std::uint32_t>(kChunkVoxels), 0});
    return;
  }
  read_rows(scratch);
  find_parts(scratch, options.connectivity);
}

void ChunkParts::choose_rule(const ConnectedOptions& options) {
  if (!options.belongs) return;
  std::vector<VoxelType> in;
  std::vector<VoxelType> out;
  for (const VoxelType type : chunk_.types()) (type != kAir && options.belongs(type) ? in : out).push_back(type);
  if (out.empty() || (out.size() == 1 && out[0] == kAir)) return;
  if (out.size() < in.size() && out.size() <= kFewTypes) {
    rule_ = Rule::AllButListed;
    types_ = std::move(out);
    return;
  }
  rule_ = in.size() <= kFewTypes ? Rule::OnlyListed : Rule::Search;
  types_ = std::move(in);
}

std::uint64_t ChunkParts::row(int y, int z) const {
  if (rule_ == Rule::AllButAir) return ~chunk_.row_mask(y, z, kAir);
  if (rule_ == Rule::Search) return search_row(y, z);
  std::uint64_t listed = 0;
  for (const VoxelType type : types_) listed |= chunk_.row_mask(y, z, type);
  return rule_ == Rule::OnlyListed ? listed : ~listed;
}

std::uint64_t ChunkParts::search_row(int y, int z) const {
  std::array<VoxelType, kChunkEdge> types{};
  chunk_.read_row(y, z, types);
  std::uint64_t found = 0;
  VoxelType last = kAir;
  bool is_in = false;
  for (std::size_t x = 0; x < types.size(); ++x) {
    if (types[x] != last) {
      last = types[x];
      is_in = std::binary_search(types_.begin(), types_.end(), last);
    }
    found |= std::uint64_t{is_in} << x;
  }
  return found;
}

void ChunkParts::read_rows(Scratch& scratch) const {
  std::uint32_t runs = 0;
  for (std::size_t i = 0; i < kRows; ++i) {
    scratch.rows[i] = row(static_cast<int>(i % kChunkEdge), static_cast<int>(i / kChunkEdge));
    scratch.first_runs[i] = runs;
    runs += count_runs(scratch.rows[i]);
  }
  scratch.runs.reset(runs);
}

void ChunkParts::find_parts(Scratch& scratch, Connectivity connectivity) {
  const auto join = [&](std::size_t a, std::size_t b) {
    const std::uint64_t row_a = scratch.rows[a];
    const std::uint64_t row_b = scratch.rows[b];
    for_each_contact(row_a, row_b, connectivity, [&](int x_a, int x_b) {
      scratch.runs.unite(scratch.first_runs[a] + run_of(row_a, x_a), scratch.first_runs[b] + run_of(row_b, x_b));
    });
  };
  for (std::size_t i = 0; i < kRows; ++i) {
    if (scratch.rows[i] == 0) continue;
    const std::size_t y = i % kChunkEdge;
    const bool has_before = i >= kChunkEdge;
    if (y > 0) join(i, i - 1);
    if (has_before) join(i, i - kChunkEdge);
    if (!has_before || connectivity == Connectivity::Faces6) continue;
    if (y > 0) join(i, i - kChunkEdge - 1);
    if (y + 1 < kChunkEdge) join(i, i - kChunkEdge + 1);
  }
  keep_runs(scratch);
}

// Numbers the parts by their first voxels: a set's lowest run is its first.
void ChunkParts::keep_runs(Scratch& scratch) {
  const std::size_t run_count = scratch.runs.size();
  scratch.part_of_root.assign(run_count, kNoPart);
  std::uint32_t parts = 0;
  for (std::uint32_t run = 0; run < run_count; ++run) {
    if (scratch.runs.find(run) == run) scratch.part_of_root[run] = parts++;
  }
  parts_.resize(parts);
  if (parts > 1) {
    layer_starts_.resize(kChunkEdge);
    row_starts_.resize(kRows);
    if (parts <= 256) {
      few_parts_.resize(run_count);
    } else {
      many_parts_.resize(run_count);
    }
  }
  std::uint32_t run = 0;
  for (std::size_t i = 0; i < kRows; ++i) {
    const int y = static_cast<int>(i % kChunkEdge);
    const int z = static_cast<int>(i / kChunkEdge);
    if (parts > 1) {
      if (y == 0) layer_starts_[i / kChunkEdge] = run;
      row_starts_[i] = static_cast<std::uint16_t>(run - layer_starts_[i / kChunkEdge]);
    }
    for (std::uint64_t left = scratch.rows[i]; left != 0; ++run) {
      const std::uint64_t rest = without_lowest_run(left);
      const std::uint32_t part = scratch.part_of_root[scratch.runs.find(run)];
      add_run(parts_[part], std::countr_zero(left), 63 - std::countl_zero(left ^ rest), y, z);
      if (!few_parts_.empty()) few_parts_[run] = static_cast<std::uint8_t>(part);
      if (!many_parts_.empty()) many_parts_[run] = part;
      left = rest;
    }
  }
  QUOIN_ASSERT(run == run_count, "each run is in one row");
}

std::uint64_t ChunkParts::row_of_part(std::uint64_t row, int y, int z, std::uint32_t part) const {
  QUOIN_ASSERT(part < parts_.size(), "a part of the chunk");
  if (parts_.size() == 1) return row;
  std::uint64_t of_part = 0;
  std::uint32_t run = first_run(y, z);
  for (std::uint64_t left = row; left != 0; ++run) {
    const std::uint64_t rest = without_lowest_run(left);
    if (part_of_run(run) == part) of_part |= left ^ rest;
    left = rest;
  }
  return of_part;
}

std::size_t ChunkParts::bytes() const {
  return sizeof(*this) + types_.capacity() * sizeof(VoxelType) + parts_.capacity() * sizeof(ChunkPart) +
         layer_starts_.capacity() * sizeof(std::uint32_t) + row_starts_.capacity() * sizeof(std::uint16_t) +
         few_parts_.capacity() + many_parts_.capacity() * sizeof(std::uint32_t);
}

}  // namespace quoin
