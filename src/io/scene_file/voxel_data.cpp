#include "io/scene_file/voxel_data.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/half.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "core/work/progress_steps.h"
#include "io/byte_stream.h"

namespace quoin {
namespace {

constexpr std::size_t kChunksPerPiece = 32;
constexpr std::size_t kFieldChunksPerPiece = 16;  // field chunks are twice as large
constexpr std::uint32_t kMixedSlab = 0xFFFF'FFFFU;
constexpr int kSlabs = 256;
constexpr std::size_t kSlabVoxels = 1'024;
constexpr std::size_t kMaxTypesOfChunk = 65'536;
// The outermost chunks of a grid stay air.
constexpr int kMaxPlace = (1 << (31 - kChunkShift)) - 2;
constexpr int kMinPlace = -kMaxPlace - 1;

// Upper bound of a piece: chunks of 65,536 types without uniform slabs.
constexpr std::size_t kMaxPieceBytes = std::size_t{32} << 20;
static_assert(kChunksPerPiece * (16 + 2 * kMaxTypesOfChunk + kSlabs * (4 + 2 * kSlabVoxels)) <= kMaxPieceBytes);

// Data can be cut into pieces between any two voxels.
constexpr std::size_t kDataPieceBytes = std::size_t{8} << 20;
static_assert(kDataPieceBytes + kMaxVoxelDataBytes < kMaxPieceBytes);
// Data sizes in addition to a voxel's bytes, and per chunk.
constexpr std::size_t kPlacedDataBytes = 12;
constexpr std::size_t kDataHeaderBytes = 16;

static_assert(kFieldChunksPerPiece * (16 + 2 * kMaxTypesOfChunk + 2 * kSlabs * (4 + 2 * kSlabVoxels)) <=
              kMaxPieceBytes);

// Real scenes take up to thirty times their text.
constexpr std::size_t kFreeBytes = std::size_t{64} << 20;
constexpr std::size_t kBytesPerFileByte = 64;
// Approximate size of the tree above a single chunk; with the chunk itself 1,040, the bound of old files.
constexpr std::size_t kBytesAboveChunk = 1'040 - sizeof(Chunk);

constexpr int bits_of(std::size_t types) {
  int bits = 1;
  while ((std::size_t{1} << bits) < types) bits *= 2;
  return bits;
}

using DenseChunk = std::vector<VoxelType>;  // x fastest, then y, then z

// Returns the start of a slab's rows in a dense chunk: four adjacent rows of y, four of z.
std::size_t first_of_slab(int slab) {
  QUOIN_ASSERT(slab >= 0 && slab < kSlabs, "0 <= slab < 256");
  return (static_cast<std::size_t>(slab / 16) * 4 * kChunkEdge + static_cast<std::size_t>(slab % 16) * 4) * kChunkEdge;
}
constexpr std::size_t kSlabRun = std::size_t{4} * kChunkEdge;  // adjacent voxels of a slab

/// Calls `visit(voxels of one z)` for the four runs of a slab.
template <class Voxels, class Visit>
void for_each_run(Voxels voxels, int slab, Visit visit) {
  for (std::size_t z = 0; z < 4; ++z) {
    visit(voxels.subspan(first_of_slab(slab) + z * kChunkEdge * kChunkEdge, kSlabRun));
  }
}

/// Writes chunks into bytes.
class PieceWriter {
 public:
  void put(IVec3 place, const Chunk& chunk) {
    put_number(static_cast<std::uint32_t>(place.x));
    put_number(static_cast<std::uint32_t>(place.y));
    put_number(static_cast<std::uint32_t>(place.z));
    if (const auto uniform = chunk.uniform()) return put_palette(std::array{*uniform});
    read(chunk);
    put_palette(palette_);
    if (palette_.size() > 1) {
      for (int slab = 0; slab < kSlabs; ++slab) put_slab(slab);
    }
    for (const VoxelType type : palette_) index_of_[type] = kNone;
  }
  void put(IVec3 place, const DensityChunk& chunk) {
    put(place, chunk.materials());
    if (const auto uniform = chunk.uniform()) return put_number(std::uint32_t{*uniform});
    put_number(kMixedSlab);
    halves_.resize(kChunkVoxels);
    auto row = halves_.begin();
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y, row += kChunkEdge) {
        chunk.read_row(y, z, std::span<Half, kChunkEdge>(row, kChunkEdge));
      }
    }
    for (int slab = 0; slab < kSlabs; ++slab) put_densities(slab);
  }
  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  static constexpr std::uint32_t kNone = 0xFFFF'FFFFU;

  template <class T>
  void put_number(T number) {
    for (std::size_t i = 0; i < sizeof(T); ++i) bytes_.push_back(static_cast<std::byte>(number >> (8 * i)));
  }
  void put_palette(std::span<const VoxelType> types) {
    QUOIN_ASSERT(!types.empty() && types.size() <= kMaxTypesOfChunk, "1 to 65,536 types");
    put_number(static_cast<std::uint32_t>(types.size()));
    for (const VoxelType type : types) put_number(type);
  }

  // The chunk's types, in order of first occurrence.
  void read(const Chunk& chunk) {
    palette_.clear();
    dense_.resize(kChunkVoxels);
    index_of_.resize(kMaxTypesOfChunk, kNone);
    auto row = dense_.begin();
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y, row += kChunkEdge) {
        chunk.read_row(y, z, std::span<VoxelType, kChunkEdge>(row, kChunkEdge));
      }
    }
    for (const VoxelType type : dense_) {
      if (index_of_[type] != kNone) continue;
      index_of_[type] = static_cast<std::uint32_t>(palette_.size());
      palette_.push_back(type);
    }
  }

  void put_slab(int slab) {
    const std::span<const VoxelType> voxels(dense_);
    const VoxelType first = voxels[first_of_slab(slab)];
    bool is_uniform = true;
    for_each_run(voxels, slab, [&](std::span<const VoxelType> run) {
      is_uniform = is_uniform && std::ranges::all_of(run, [first](VoxelType type) { return type == first; });
    });
    QUOIN_ASSERT(index_of_[first] < palette_.size(), "a type of the palette");
    put_number(is_uniform ? index_of_[first] : kMixedSlab);
    if (is_uniform) return;
    const int bits = bits_of(palette_.size());
    for_each_run(voxels, slab, [&](std::span<const VoxelType> run) {
      std::uint32_t gathered = 0;
      int filled = 0;
      for (const VoxelType type : run) {
        gathered |= index_of_[type] << filled;
        filled += bits;
        for (; filled >= 8; filled -= 8, gathered >>= 8) bytes_.push_back(static_cast<std::byte>(gathered));
      }
    });
  }

  void put_densities(int slab) {
    const std::span<const Half> halves(halves_);
    const Half first = halves[first_of_slab(slab)];
    std::vector<std::byte> high;
    const std::size_t begin = bytes_.size();
    put_number(kMixedSlab);
    bool is_uniform = true;
    for_each_run(halves, slab, [&](std::span<const Half> run) {
      for (std::size_t i = 0; i < run.size(); ++i) {
        const Half before = i % kChunkEdge == 0 ? Half{0} : run[i - 1];
        const auto difference = static_cast<std::uint16_t>(run[i] - before);
        is_uniform = is_uniform && run[i] == first;
        bytes_.push_back(static_cast<std::byte>(difference & 0xFF));
        high.push_back(static_cast<std::byte>(difference >> 8));
      }
    });
    if (is_uniform) {
      bytes_.resize(begin);
      return put_number(std::uint32_t{first});
    }
    bytes_.insert(bytes_.end(), high.begin(), high.end());
  }

  std::vector<std::byte> bytes_;
  DenseChunk dense_;
  std::vector<Half> halves_;
  std::vector<std::uint32_t> index_of_;  // by type; kNone except while a chunk is written
  std::vector<VoxelType> palette_;
};

std::string text_of(const std::vector<std::byte>& bytes, VoxelCompression compression) {
  constexpr int kLevel = 6;
  return to_base64(gzipped(bytes, compression == VoxelCompression::Small ? kLevel : 0));
}

/// Reads a piece number by number.
class PieceReader {
 public:
  PieceReader(std::span<const std::byte> bytes, std::size_t type_count) : bytes_(bytes), type_count_(type_count) {}

  [[nodiscard]] bool is_at_end() const { return at_ == bytes_.size(); }

  Result<PlacedChunk> read_chunk() {
    constexpr std::size_t kHeaderBytes = 16;
    if (!has(kHeaderBytes)) return cut_off();
    const auto place = read_place();
    if (!place) return place.error();
    PlacedChunk chunk;
    chunk.place = *place;
    const auto count = take<std::uint32_t>();
    if (count == 0 || count > kMaxTypesOfChunk) {
      return fault("invalid palette size " + std::to_string(count), at_ - sizeof(count));
    }
    if (auto read = read_palette(count); !read) return read.error();
    if (count == 1) {
      chunk.voxels = Chunk(palette_[0]);
      return chunk;
    }
    dense_.resize(kChunkVoxels);
    for (int slab = 0; slab < kSlabs; ++slab) {
      if (auto read = read_slab(slab); !read) return read.error();
    }
    chunk.voxels = Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(dense_));
    return chunk;
  }

  /// Calls `visit(index in the chunk, data)` for the voxels of a chunk's data. Returns the chunk.
  template <class Visit>
  Result<IVec3> read_data(Visit&& visit) {
    if (!has(kDataHeaderBytes)) return cut_off();
    const auto place = read_place();
    if (!place) return place.error();
    const auto count = take<std::uint32_t>();
    if (count == 0 || count > kChunkVoxels) {
      return fault("invalid number of voxels with data: " + std::to_string(count), at_ - sizeof(count));
    }
    std::uint32_t next = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      if (!has(kPlacedDataBytes)) return cut_off();
      const auto voxel = take<std::uint32_t>();
      const auto state = take<std::uint32_t>();
      const auto length = take<std::uint32_t>();
      const std::size_t begin = at_ - kPlacedDataBytes;
      if (voxel >= kChunkVoxels) return fault("a voxel is outside its chunk", begin);
      if (voxel < next) return fault("voxels with data are not in ascending order", begin);
      next = voxel + 1;
      if (length > kMaxVoxelDataBytes)
        return fault("invalid data length: " + std::to_string(length) + " bytes for one voxel", at_ - sizeof(length));
      if (state == 0 && length == 0) return fault("a voxel has no data", begin);
      if (!has(length)) return cut_off();
      visit(voxel, VoxelData{state, bytes_.subspan(at_, length)});
      at_ += length;
    }
    return *place;
  }

  Result<PlacedDensities> read_densities(float band) {
    auto materials = read_chunk();
    if (!materials) return materials.error();
    band_ = band;
    PlacedDensities chunk;
    chunk.place = materials->place;
    if (!has(sizeof(std::uint32_t))) return cut_off();
    const auto uniform = take<std::uint32_t>();
    if (uniform != kMixedSlab) {
      if (!is_density(uniform)) return wrong_density(uniform, at_ - sizeof(uniform));
      chunk.samples = DensityChunk(static_cast<Half>(uniform));
      chunk.samples.materials() = std::move(materials->voxels);
      return chunk;
    }
    halves_.resize(kChunkVoxels);
    for (int slab = 0; slab < kSlabs; ++slab) {
      if (auto read = read_slab_of_densities(slab); !read) return read.error();
    }
    auto row = halves_.cbegin();
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y, row += kChunkEdge) {
        chunk.samples.write_row(y, z, std::span<const Half, kChunkEdge>(row, kChunkEdge));
      }
    }
    chunk.samples.unite_slabs();
    chunk.samples.materials() = std::move(materials->voxels);
    return chunk;
  }

 private:
  [[nodiscard]] bool has(std::size_t count) const {
    QUOIN_ASSERT(at_ <= bytes_.size(), "a position within the bytes");
    return bytes_.size() - at_ >= count;
  }
  template <class T>
  T take() {
    QUOIN_ASSERT(has(sizeof(T)), "bytes that were seen to be there");
    const T number = load<T>(bytes_.data() + at_, std::endian::little);
    at_ += sizeof(T);
    return number;
  }
  static Error fault(const std::string& what, std::size_t at) {
    return make_error(ErrorCode::BadFormat, "byte " + std::to_string(at) + " of the voxel data: " + what);
  }
  [[nodiscard]] Error cut_off() const { return fault("cut off", bytes_.size()); }

  // Requires: the bytes are available.
  Result<IVec3> read_place() {
    const std::size_t begin = at_;
    IVec3 place{0};
    for (int axis = 0; axis < 3; ++axis) place[axis] = take<std::int32_t>();
    for (int axis = 0; axis < 3; ++axis) {
      if (place[axis] < kMinPlace || place[axis] > kMaxPlace) return fault("a chunk position is out of range", begin);
    }
    return place;
  }

  Status read_palette(std::uint32_t count) {
    if (!has(count * sizeof(VoxelType))) return cut_off();
    palette_.resize(count);
    for (VoxelType& type : palette_) {
      type = take<VoxelType>();
      if (type >= type_count_) {
        return fault(
            "type " + std::to_string(type) + ", but the last type of the file is " + std::to_string(type_count_ - 1),
            at_ - sizeof(type));
      }
    }
    return {};
  }

  Status read_slab(int slab) {
    if (!has(sizeof(std::uint32_t))) return cut_off();
    const auto index = take<std::uint32_t>();
    const std::span<VoxelType> voxels(dense_);
    if (index != kMixedSlab) {
      if (index >= palette_.size()) return wrong_index(index, at_ - sizeof(index));
      for_each_run(voxels, slab, [&](std::span<VoxelType> run) { std::ranges::fill(run, palette_[index]); });
      return {};
    }
    const int bits = bits_of(palette_.size());
    const std::size_t bytes = kSlabVoxels / 8 * static_cast<std::size_t>(bits);
    if (!has(bytes)) return cut_off();
    Status status;
    std::uint32_t gathered = 0;
    int filled = 0;
    for_each_run(voxels, slab, [&](std::span<VoxelType> run) {
      for (VoxelType& type : run) {
        for (; filled < bits; filled += 8) gathered |= std::to_integer<std::uint32_t>(bytes_[at_++]) << filled;
        const std::uint32_t found = gathered & ((1U << bits) - 1);
        gathered >>= bits;
        filled -= bits;
        if (found >= palette_.size() && status) status = wrong_index(found, at_ - 1);
        type = palette_[found < palette_.size() ? found : 0];
      }
    });
    return status;
  }
  // Returns true for results of `stored_density`: infinities and NaN are outside any band, and neither -0 nor subnormal
  // numbers occur.
  [[nodiscard]] bool is_density(std::uint32_t half) const {
    constexpr std::uint32_t kExponent = 0x7C00;
    if (half > 0xFFFF || (half != 0 && (half & kExponent) == 0)) return false;
    return std::abs(float_from_half(static_cast<Half>(half))) <= band_;
  }
  [[nodiscard]] Error wrong_density(std::uint32_t half, std::size_t at) const {
    const bool is_near_0 = half <= 0xFFFF && std::abs(float_from_half(static_cast<Half>(half))) <= band_;
    return fault(is_near_0 ? "a density is -0 or closer to 0 than 2^-14" : "a density is outside the band", at);
  }

  Status read_slab_of_densities(int slab) {
    if (!has(sizeof(std::uint32_t))) return cut_off();
    const auto uniform = take<std::uint32_t>();
    const std::span<Half> halves(halves_);
    if (uniform != kMixedSlab) {
      if (!is_density(uniform)) return wrong_density(uniform, at_ - sizeof(uniform));
      for_each_run(halves, slab, [&](std::span<Half> run) { std::ranges::fill(run, static_cast<Half>(uniform)); });
      return {};
    }
    if (!has(2 * kSlabVoxels)) return cut_off();
    Status status;
    for_each_run(halves, slab, [&](std::span<Half> run) {
      std::uint32_t before = 0;
      for (std::size_t i = 0; i < run.size(); ++i, ++at_) {
        if (i % kChunkEdge == 0) before = 0;
        const auto low = std::to_integer<std::uint32_t>(bytes_[at_]);
        const auto high = std::to_integer<std::uint32_t>(bytes_[at_ + kSlabVoxels]);
        before = (before + low + (high << 8)) & 0xFFFF;
        if (!is_density(before) && status) status = wrong_density(before, at_);
        run[i] = static_cast<Half>(before);
      }
    });
    at_ += kSlabVoxels;
    return status;
  }

  [[nodiscard]] Error wrong_index(std::uint32_t index, std::size_t at) const {
    return fault("index " + std::to_string(index) + " is beyond the palette of " + std::to_string(palette_.size()), at);
  }

  std::span<const std::byte> bytes_;
  std::size_t type_count_;
  std::size_t at_ = 0;
  std::vector<VoxelType> palette_;
  DenseChunk dense_;
  std::vector<Half> halves_;
  float band_ = 0.0F;
};

/// Returns an error whose position is within the data, not in the file.
Error placed(const Error& error, const std::string& unit, const std::string& of) {
  return make_error(error.code, unit + " " + std::to_string(error.byte_offset.value_or(0)) + of + ": " + error.message);
}

Result<std::vector<std::byte>> expanded(std::string_view piece) {
  const auto compressed = from_base64(piece);
  if (!compressed) return placed(compressed.error(), "character", "");
  if (!begins_gzip(*compressed)) return make_error(ErrorCode::BadFormat, "not a gzip stream");
  ByteStream stream(*compressed, 0, Compression::Gzip);
  constexpr std::size_t kStep = std::size_t{1} << 16;
  std::vector<std::byte> bytes;
  while (bytes.size() <= kMaxPieceBytes) {
    const std::size_t before = bytes.size();
    bytes.resize(before + std::max(kStep, before));
    const auto count = stream.read(std::span(bytes).subspan(before));
    if (!count) return placed(count.error(), "byte", " of the compressed data");
    bytes.resize(before + *count);
    if (*count == 0) break;
  }
  if (bytes.size() > kMaxPieceBytes) return make_error(ErrorCode::LimitExceeded, "expands to more than 32 MiB");
  if (stream.remaining() > 0) return make_error(ErrorCode::BadFormat, "bytes follow the compressed data");
  return bytes;
}

}  // namespace

std::size_t max_voxel_bytes(std::size_t file_bytes) {
  return kFreeBytes + kBytesPerFileByte * file_bytes;
}

std::size_t voxel_bytes(const Chunk& chunk) {
  const std::size_t bytes = kBytesAboveChunk + chunk.bytes();
  // Two pieces may share a part of a chunk's data, which the reader then counts twice.
  return chunk.data_count() == 0 ? bytes : bytes + bytes / 32;
}

std::size_t voxel_bytes(const DensityChunk& chunk) {
  return kBytesAboveChunk + chunk.bytes();
}

namespace {

/// As encode_voxels, for any container of chunks.
template <class Any>
Result<std::vector<std::vector<std::string>>> encode(std::span<const Any* const> grids, std::size_t chunks_per_piece,
                                                     VoxelCompression compression, Threads threads,
                                                     const Progress& progress) {
  struct Piece {
    std::size_t grid;
    std::vector<IVec3> chunks;
  };
  std::vector<Piece> pieces;
  for (std::size_t i = 0; i < grids.size(); ++i) {
    const std::vector<IVec3> chunks = grids[i]->chunks();
    for (std::size_t at = 0; at < chunks.size(); at += chunks_per_piece) {
      const auto first = chunks.begin() + static_cast<std::ptrdiff_t>(at);
      const std::size_t count = std::min(chunks_per_piece, chunks.size() - at);
      pieces.push_back({i, {first, first + static_cast<std::ptrdiff_t>(count)}});
    }
  }
  std::vector<std::string> texts(pieces.size());
  ProgressSteps steps(progress, pieces.size());
  parallel_for(pieces.size(), threads, [&](std::size_t i) {
    if (steps.cancelled()) return;
    PieceWriter writer;
    const Any& grid = *grids[pieces[i].grid];
    for (const IVec3 chunk : pieces[i].chunks) writer.put(chunk, *grid.find_chunk(chunk));
    texts[i] = text_of(writer.bytes(), compression);
    steps.step();
  });
  if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  std::vector<std::vector<std::string>> of_grids(grids.size());
  for (std::size_t i = 0; i < pieces.size(); ++i) of_grids[pieces[i].grid].push_back(std::move(texts[i]));
  return of_grids;
}

/// Decodes the chunks of a piece with `read(reader)`.
template <class Placed, class Read>
Result<std::vector<Placed>> decode(std::string_view piece, std::size_t type_count, Read read) {
  const auto bytes = expanded(piece);
  if (!bytes) return bytes.error();
  std::vector<Placed> chunks;
  PieceReader reader(*bytes, type_count);
  while (!reader.is_at_end()) {
    auto chunk = read(reader);
    if (!chunk) return chunk.error();
    chunks.push_back(std::move(*chunk));
  }
  return chunks;
}

}  // namespace

Result<std::vector<std::vector<std::string>>> encode_voxels(std::span<const Grid* const> grids,
                                                            VoxelCompression compression, Threads threads,
                                                            const Progress& progress) {
  return encode(grids, kChunksPerPiece, compression, threads, progress);
}

Result<std::vector<std::vector<std::string>>> encode_fields(std::span<const DensityGrid* const> fields,
                                                            VoxelCompression compression, Threads threads,
                                                            const Progress& progress) {
  return encode(fields, kFieldChunksPerPiece, compression, threads, progress);
}

namespace {

/// Writes the data of chunks, cut into pieces.
class DataWriter {
 public:
  void put(IVec3 chunk, std::uint32_t place, const VoxelData& data) {
    const bool is_full = !pieces_.empty() && pieces_.back().size() >= kDataPieceBytes;
    if (pieces_.empty() || is_full) pieces_.emplace_back();
    if (chunk != chunk_ || pieces_.back().empty()) begin(chunk);
    put_number(place);
    put_number(data.state);
    put_number(static_cast<std::uint32_t>(data.bytes.size()));
    pieces_.back().insert(pieces_.back().end(), data.bytes.begin(), data.bytes.end());
    ++count_;
    QUOIN_ASSERT(count_ <= kChunkVoxels, "at most the voxels of a chunk");
    for (std::size_t i = 0; i < sizeof(count_); ++i) {
      pieces_.back()[count_at_ + i] = static_cast<std::byte>(count_ >> (8 * i));
    }
  }
  [[nodiscard]] const std::vector<std::vector<std::byte>>& pieces() const { return pieces_; }

 private:
  void begin(IVec3 chunk) {
    chunk_ = chunk;
    for (int axis = 0; axis < 3; ++axis) put_number(static_cast<std::uint32_t>(chunk[axis]));
    count_at_ = pieces_.back().size();
    count_ = 0;
    put_number(count_);
  }
  void put_number(std::uint32_t number) {
    for (std::size_t i = 0; i < sizeof(number); ++i) {
      pieces_.back().push_back(static_cast<std::byte>(number >> (8 * i)));
    }
  }

  std::vector<std::vector<std::byte>> pieces_;
  IVec3 chunk_{0};
  std::size_t count_at_ = 0;  // number of this chunk's voxels in the last piece
  std::uint32_t count_ = 0;
};

std::uint32_t place_of(IVec3 local) {
  QUOIN_ASSERT(((local.x | local.y | local.z) & ~(kChunkEdge - 1)) == 0, "a voxel of the chunk");
  return static_cast<std::uint32_t>((local.z * kChunkEdge + local.y) * kChunkEdge + local.x);
}

}  // namespace

Result<std::vector<std::vector<std::string>>> encode_data(std::span<const Grid* const> grids,
                                                          VoxelCompression compression, Threads threads,
                                                          const Progress& progress) {
  std::vector<std::vector<std::string>> of_grids(grids.size());
  for (std::size_t i = 0; i < grids.size(); ++i) {
    DataWriter writer;
    grids[i]->for_each_data([&](IVec3 voxel, VoxelType, const VoxelData& data) {
      writer.put(chunk_of(voxel), place_of(local_of(voxel)), data);
    });
    of_grids[i].resize(writer.pieces().size());
    const auto share = [&](std::size_t done) { return static_cast<double>(done) / static_cast<double>(grids.size()); };
    const Progress of_grid = part_of(progress, share(i), share(i + 1));
    ProgressSteps steps(of_grid, writer.pieces().size());
    parallel_for(writer.pieces().size(), threads, [&](std::size_t piece) {
      if (steps.cancelled()) return;
      of_grids[i][piece] = text_of(writer.pieces()[piece], compression);
      steps.step();
    });
    if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  }
  return of_grids;
}

std::string find_state_error(IVec3 voxel, const VoxelData& data, const VoxelProperties& type) {
  if (static_cast<int>(std::bit_width(data.state)) <= type.state_bits) return "";
  return "state " + std::to_string(data.state) + " of voxel (" + std::to_string(voxel.x) + ", " +
         std::to_string(voxel.y) + ", " + std::to_string(voxel.z) + ") has more than the " +
         std::to_string(type.state_bits) + " bits of its type";
}

Result<DataPiece> decode_data(std::string_view text) {
  auto bytes = expanded(text);
  if (!bytes) return bytes.error();
  DataPiece piece;
  PieceReader reader(*bytes, 0);
  while (!reader.is_at_end()) {
    // Chunk, slabs, states and bytes, as stored in memory.
    constexpr std::size_t kOfChunk = 2'048;
    constexpr std::size_t kOfSlab = 180;
    constexpr std::size_t kBesideBytes = 48;
    std::array<bool, kSlabs> has_data{};
    const auto read = reader.read_data([&](std::uint32_t place, const VoxelData& data) {
      QUOIN_ASSERT(place < kChunkVoxels, "a voxel of the chunk");
      const std::size_t slab = (place >> 14) * 16 + (place >> 8 & 15);
      piece.memory += std::exchange(has_data[slab], true) ? 0 : kOfSlab;
      piece.memory += data.state == 0 ? 0 : sizeof(data.state);
      piece.memory += data.bytes.empty() ? 0 : kBesideBytes + data.bytes.size();
    });
    if (!read) return read.error();
    piece.memory += kOfChunk;
  }
  piece.bytes = std::move(*bytes);
  return piece;
}

void for_each_data(const DataPiece& piece, FunctionRef<bool(IVec3 voxel, const VoxelData& data)> visit) {
  std::size_t at = 0;
  const auto take = [&] {
    QUOIN_ASSERT(at + sizeof(std::uint32_t) <= piece.bytes.size(), "a whole piece");
    const auto number = load<std::uint32_t>(piece.bytes.data() + at, std::endian::little);
    at += sizeof(number);
    return number;
  };
  while (at < piece.bytes.size()) {
    IVec3 chunk{0};
    for (int axis = 0; axis < 3; ++axis) chunk[axis] = static_cast<int>(take());
    for (std::uint32_t left = take(); left > 0; --left) {
      const auto place = static_cast<int>(take());
      const std::uint32_t state = take();
      const std::uint32_t length = take();
      const IVec3 local{place % kChunkEdge, place / kChunkEdge % kChunkEdge, place / kChunkEdge / kChunkEdge};
      const VoxelData data{state, std::span(piece.bytes).subspan(at, length)};
      at += length;
      if (!visit(chunk * kChunkEdge + local, data)) return;
    }
  }
}

Result<std::vector<PlacedChunk>> decode_voxels(std::string_view piece, std::size_t type_count) {
  return decode<PlacedChunk>(piece, type_count, [](PieceReader& reader) { return reader.read_chunk(); });
}

Result<std::vector<PlacedDensities>> decode_field(std::string_view piece, std::size_t type_count, float band) {
  return decode<PlacedDensities>(piece, type_count, [&](PieceReader& reader) { return reader.read_densities(band); });
}

}  // namespace quoin
