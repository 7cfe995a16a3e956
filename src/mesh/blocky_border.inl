// Opacity around the chunk, from its 26 neighbours. Part of the mesher's kernel.

// Which of a chunk's voxels are opaque.
class OpaqueVoxels {
 public:
  OpaqueVoxels(const Chunk* chunk, const VoxelRegistry& types) : types_(&types) {
    if (chunk == nullptr) return;
    voxels_ = chunk->mixed();
    if (voxels_ == nullptr) {
      all_ = types.is_opaque(*chunk->uniform());
      return;
    }
    if (voxels_->direct()) return;
    for (std::size_t i = 0; i < voxels_->palette.size(); ++i) {
      is_opaque_[i] = types.is_opaque(voxels_->palette[i]);
      if (is_opaque_[i] == 0 && voxels_->counts[i] != 0) others_[other_count_++] = static_cast<std::uint8_t>(i);
    }
  }

  [[nodiscard]] bool none() const { return voxels_ == nullptr && !all_; }

  // Bit x: the voxel at x.
  [[nodiscard]] std::uint64_t row(int y, int z) const {
    if (voxels_ == nullptr) return std::uint64_t{0} - static_cast<std::uint64_t>(all_);
    const std::uint32_t slab = voxels_->slabs[Chunk::slab_index(y, z)];
    if ((slab & Chunk::kUniformSlab) != 0) return std::uint64_t{0} - is_opaque(slab & ~Chunk::kUniformSlab);
    const std::uint64_t* cells = voxels_->row(slab, Chunk::row_in_slab(y, z));
    switch (voxels_->bits) {
      case 1:
        return narrow_row<1>(cells);
      case 2:
        return narrow_row<2>(cells);
      case 4:
        return narrow_row<4>(cells);
      default:
        return wide_row(cells);
    }
  }

  // Bit i: the voxel at the row's first or last place in row i of a slab.
  template <bool kLast>
  [[nodiscard]] std::uint64_t ends_of_slab(std::size_t slab) const {
    constexpr std::uint64_t kAllRows = 0xFFFF;
    if (voxels_ == nullptr) return all_ ? kAllRows : 0;
    const std::uint32_t entry = voxels_->slabs[slab];
    if ((entry & Chunk::kUniformSlab) != 0) return is_opaque(entry & ~Chunk::kUniformSlab) != 0 ? kAllRows : 0;
    const auto step = static_cast<std::size_t>(voxels_->bits);
    const std::uint64_t* word = voxels_->row(entry, 0) + (kLast ? step - 1 : 0);
    const unsigned shift = kLast ? 64U - static_cast<unsigned>(step) : 0U;
    const std::uint64_t mask = (std::uint64_t{1} << step) - 1;
    std::uint64_t rows = 0;
    for (unsigned i = 0; i < 16; ++i, word += step) {
      rows |= is_opaque(static_cast<std::uint32_t>(*word >> shift & mask)) << i;
    }
    return rows;
  }

 private:
  [[nodiscard]] QUOIN_INLINE std::uint64_t is_opaque(std::uint32_t index) const {
    if (__builtin_expect(voxels_->direct(), 0)) return types_->is_opaque(static_cast<VoxelType>(index));
    return is_opaque_[index];
  }

  template <int kBits>
  [[nodiscard]] std::uint64_t narrow_row(const std::uint64_t* cells) const {
    std::uint64_t planes[kBits];
    for (int k = 0; k < kBits; ++k) planes[k] = plane_of_row<kBits>(cells, k);
    std::uint64_t open = 0;
    for (int i = 0; i < other_count_; ++i) {
      std::uint64_t differs = 0;
      for (int k = 0; k < kBits; ++k) differs |= planes[k] ^ (std::uint64_t{0} - (others_[i] >> k & 1U));
      open |= ~differs;
    }
    return ~open;
  }

  [[nodiscard]] std::uint64_t wide_row(const std::uint64_t* cells) const {
    std::uint64_t mask = 0;
    if (voxels_->direct()) {
      for (int x = 0; x < kChunkEdge; ++x) mask |= is_opaque(packed_row::read(cells, 16, x)) << x;
      return mask;
    }
    for (int i = 0; i < other_count_; ++i) {
      std::uint64_t pattern[8];
      for (std::uint64_t& word : pattern) word = packed_row::repeat(8, others_[i]);
      mask |= equal_cells<8>(cells, pattern);
    }
    return ~mask;
  }

  const Chunk::Mixed* voxels_ = nullptr;  // null: all or none are opaque
  const VoxelRegistry* types_;
  bool all_ = false;
  int other_count_ = 0;
  std::uint8_t others_[256];  // palette indices that are in use and not opaque
  std::uint8_t is_opaque_[256];
};

// Rows of the 8 neighbours with the centre's x. Answers whether a voxel of those with another z may be opaque.
bool gather_rows(const Job& job, Scratch& s) {
  const auto first = [](int d) { return d > 0 ? 64 : d; };
  const auto last = [](int d) { return d < 0 ? -1 : d > 0 ? 64 : 63; };
  bool other_z = false;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      if (dy == 0 && dz == 0) continue;
      const OpaqueVoxels voxels(job.chunks->at(0, dy, dz), *job.types);
      other_z |= dz != 0 && !voxels.none();
      for (int z = first(dz); z <= last(dz); ++z) {
        for (int y = first(dy); y <= last(dy); ++y) {
          s.z.opaque.words[word_index(z, y)] = voxels.row(y & 63, z & 63);
        }
      }
    }
  }
  return other_z;
}

// Whether a voxel of the 18 neighbours with another x may be opaque: their palettes need not be read for that.
bool has_row_ends(const Job& job) {
  const auto may_be_opaque = [&](const Chunk* chunk) {
    return chunk != nullptr && (chunk->mixed() != nullptr || job.types->is_opaque(*chunk->uniform()));
  };
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      if (may_be_opaque(job.chunks->at(-1, dy, dz)) || may_be_opaque(job.chunks->at(1, dy, dz))) return true;
    }
  }
  return false;
}

// What stands before and after the rows of one neighbour with the centre's x, or of the centre.
void gather_row_ends(const Job& job, int dy, int dz, Scratch& s) {
  const OpaqueVoxels before(job.chunks->at(-1, dy, dz), *job.types);
  const OpaqueVoxels after(job.chunks->at(1, dy, dz), *job.types);
  const auto first = [](int d) { return d < 0 ? 63 : 0; };
  const auto last = [](int d) { return d > 0 ? 0 : 63; };
  for (int z = first(dz) & ~3; z <= last(dz); z += 4) {
    for (int y = first(dy) & ~3; y <= last(dy); y += 4) {
      const std::size_t slab = Chunk::slab_index(y, z);
      const Four rows_before = Four{} + before.ends_of_slab<true>(slab);
      const Four rows_after = Four{} + after.ends_of_slab<false>(slab);
      for (int i = 0; i < 4; ++i) {
        const int row_z = z + i + 64 * dz;
        if (row_z < -1 || row_z > 64) continue;
        const Four shift = Four{0, 1, 2, 3} + static_cast<std::uint64_t>(4 * i);
        const Four ends = ((rows_before >> shift) << 63) | (rows_after >> shift & 1);
        std::uint64_t* out = s.z.ends.words + word_index(row_z, y + 64 * dy);
        if (dy == 0) {
          *reinterpret_cast<UnalignedFour*>(out) = ends;
        } else {
          (dy < 0 ? out[3] : out[0]) = dy < 0 ? ends[3] : ends[0];
        }
      }
    }
  }
}

// Rows of opacity around the chunk, from its 26 neighbours, into the z view. Answers whether any voxel before or after
// a row of any view may be opaque; only then is `ends` written.
bool gather_border(const Job& job, Scratch& s) {
  // The x view's rows lie along z, so what stands before and after those are voxels of the neighbours in z.
  const bool other_z = gather_rows(job, s);
  if (!other_z && !has_row_ends(job)) return false;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) gather_row_ends(job, dy, dz, s);
  }
  return true;
}

// Visible faces where some types are transparent: the z view's faces and `sides`, from the z view's other layers. A
// face is hidden by an opaque voxel, and by a transparent one of its own type.
void find_faces_of_all_types(const Job& job, bool row_ends, Scratch& s) {
  for (int z = job.region.min.z; z < job.region.max.z; ++z) {
    for (int y = rounded_down(job.region.min.y); y < job.region.max.y; y += kLanes) {
      const int at = word_index(z, y);
      const std::uint64_t* here = s.z.opaque.words + at;
      const Words opaque = load(here);
      const Words solid = job.has_transparent ? load(s.solid.words + at) : opaque;
      const auto put = [&](Layer& faces, Words opaque_front, Words same) {
        store(faces.words + at, solid & ~opaque_front & (opaque | ~same));
      };
      const Words same_x = load(s.z.same_bit.words + at) & (~std::uint64_t{0} >> 1);
      const Words ends = row_ends ? load(s.z.ends.words + at) : Words{};
      put(s.sides[0], opaque >> 1 | ends << 63, same_x);
      put(s.sides[1], opaque << 1 | ends >> 63, same_x << 1);
      put(s.sides[2], load(here + 1), load(s.z.same_row.words + at));
      put(s.sides[3], load(here - 1), load(s.z.same_row.words + at - 1));
      put(s.z.faces[0], load(here + kRowStride), load(s.same_z.words + at));
      put(s.z.faces[1], load(here - kRowStride), load(s.same_z.words + at - kRowStride));
    }
  }
  if (job.has_transparent) hide_faces_at_border(job, s);
}
