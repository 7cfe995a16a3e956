#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/ref.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

inline constexpr int kChunkShift = 6;
/// Voxels along a chunk's edge: the width of a machine word.
inline constexpr int kChunkEdge = 1 << kChunkShift;
inline constexpr std::size_t kChunkVoxels = std::size_t{1} << (3 * kChunkShift);

/// Chunk that holds a voxel; voxel -1 lies in chunk -1.
[[nodiscard]] inline IVec3 chunk_of(IVec3 voxel) {
  return {voxel.x >> kChunkShift, voxel.y >> kChunkShift, voxel.z >> kChunkShift};
}
template <std::floating_point T>
IVec3 chunk_of(Point<T> point) = delete;  // chunk_of(voxel_of(point))
/// Position of a voxel inside its chunk, 0..63 on each axis.
[[nodiscard]] inline IVec3 local_of(IVec3 voxel) {
  return {voxel.x & (kChunkEdge - 1), voxel.y & (kChunkEdge - 1), voxel.z & (kChunkEdge - 1)};
}
template <std::floating_point T>
IVec3 local_of(Point<T> point) = delete;

/// Bytes that one voxel can hold.
inline constexpr std::size_t kMaxVoxelDataBytes = std::size_t{1} << 16;

/// What a voxel holds besides its type: how a stair is turned, how high water stands, what is in a chest.
///
///   world.set(at, stairs, {.state = 3});                    // type and data in one; stairs has state_bits >= 2
///   world.set_data(at, {.state = world.data(at).state ^ 1});
///   world.set_data(chest, {.bytes = inventory});            // copied
///
/// A word for what many voxels have, whose bits the type declares (VoxelProperties::state_bits), and bytes for what
/// few have. Neither has a meaning to the engine; it is stored where it is not empty, and takes no types.
struct VoxelData {
  std::uint32_t state = 0;             ///< 0 is what a voxel has of which nothing was said
  std::span<const std::byte> bytes{};  ///< at most kMaxVoxelDataBytes. Lifetime: of a grid's until its next edit

  [[nodiscard]] bool empty() const { return state == 0 && bytes.empty(); }
  bool operator==(const VoxelData& other) const {
    return state == other.state && std::ranges::equal(bytes, other.bytes);
  }
};

class ChunkData;
struct ChunkStorage;

/// All of a chunk, in its own coordinates.
inline constexpr IBox kWholeChunk = {IVec3{0}, IVec3{kChunkEdge}};

/// 64^3 voxels, compressed by a palette to 1, 2, 4, 8 or 16 bits each.
///
/// Voxels lie in rows of 64 along x, so one bit plane of a row is one word. 4x4 rows (64x4x4 voxels) are a slab, the
/// unit of uniformity: a slab of one type has no planes, a chunk of one type only that type. VoxelData lies beside.
/// Writes notice that a slab or the chunk became uniform and that fewer bits would do, so that edits and their undoing
/// leave about the memory that a new chunk takes; `compact` gives back the rest.
/// Writes keep, at all times, how many voxels there are of each type and in each of the 3 x 64 layers, so counts and
/// tight bounds cost nothing to ask.
/// Voxels that are not air may have data besides (VoxelData). It goes when a write gives its voxel another type, and
/// stays when that is the type it has. A chunk without any pays a pointer; with some 2 KiB, and for each slab that has
/// some 0.2 KiB, 4 bytes a state, and 80 bytes besides the bytes of a voxel.
/// Copies share their storage until one of them is written, so that a copy costs no more than a pointer; a write to
/// what is shared copies its own place first: 512 words of voxels, and what is kept of the chunk as a whole.
/// Threads: copies may be read, written and destroyed on several threads, each copy by itself.
class Chunk {
 public:
  /// All voxels of one type.
  explicit Chunk(VoxelType uniform = kAir);
  Chunk(const Chunk& other);
  Chunk(Chunk&& other) noexcept;
  Chunk& operator=(const Chunk& other);
  Chunk& operator=(Chunk&& other) noexcept;
  ~Chunk();

  /// From 64^3 types, x fastest, then y, then z. The smallest storage that holds them.
  [[nodiscard]] static Chunk from_dense(std::span<const VoxelType, kChunkVoxels> types);

  /// Requires: 0 <= x, y, z < 64.
  [[nodiscard]] VoxelType get(int x, int y, int z) const;
  [[nodiscard]] VoxelType get(IVec3 local) const { return get(local.x, local.y, local.z); }

  /// Sets the voxels of one row along x whose bits are set in `mask`; returns which of them had another type before.
  /// Requires: 0 <= y, z < 64.
  std::uint64_t fill_row(int y, int z, std::uint64_t mask, VoxelType type);
  /// Sets the 64 voxels of one row; returns which of them had another type before. Requires: 0 <= y, z < 64.
  std::uint64_t write_row(int y, int z, std::span<const VoxelType, kChunkEdge> types) {
    return write_row(y, z, ~std::uint64_t{0}, types);
  }
  /// Sets those of the 64 voxels of one row whose bits are set in `mask`; returns which had another type before.
  /// Requires: 0 <= y, z < 64.
  std::uint64_t write_row(int y, int z, std::uint64_t mask, std::span<const VoxelType, kChunkEdge> types);
  /// Copies the types of one row to `out`. Requires: 0 <= y, z < 64.
  void read_row(int y, int z, std::span<VoxelType, kChunkEdge> out) const;
  /// Returns true when the voxel had another type before. Requires: 0 <= x, y, z < 64.
  bool set(int x, int y, int z, VoxelType type);
  bool set(IVec3 local, VoxelType type) { return set(local.x, local.y, local.z, type); }
  /// Makes the whole chunk one type.
  void fill(VoxelType type);

  /// What a voxel holds besides its type. Lifetime: until the chunk is written. Requires: 0 <= x, y, z < 64.
  [[nodiscard]] VoxelData data(IVec3 local) const;
  /// Puts that in the place of what there was; true when it was another. False, and nothing is put, where the voxel is
  /// air. Requires: 0 <= x, y, z < 64; at most kMaxVoxelDataBytes bytes.
  bool set_data(IVec3 local, const VoxelData& data);
  /// Voxels with data. Cost: O(1).
  [[nodiscard]] int data_count() const;
  /// Calls `visit` for them by z, then y, then x; it must not write the chunk.
  void for_each_data(FunctionRef<void(IVec3 local, const VoxelData& data)> visit) const;

  /// Sets the voxels of a box (clipped to the chunk); calls `on_change` for every row in which some had another type.
  void fill_box(const IBox& box, VoxelType type, FunctionRef<void(int y, int z, std::uint64_t changed)> on_change);

  /// Which of a row's voxels have this type. Requires: 0 <= y, z < 64.
  [[nodiscard]] std::uint64_t row_mask(int y, int z, VoxelType type) const;

  /// The one type of the whole chunk, if it is stored as such.
  [[nodiscard]] std::optional<VoxelType> uniform() const {
    return storage_ == nullptr ? std::optional(uniform_) : std::nullopt;
  }
  /// Cost: O(1), as every count of voxels but `count`.
  [[nodiscard]] int non_air_count() const;
  /// Whether no voxel is air.
  [[nodiscard]] bool is_full() const { return non_air_count() == static_cast<int>(kChunkVoxels); }
  /// Whether both still share one storage, as a copy and its original do until one of them is written. True means that
  /// they are equal; false means nothing.
  [[nodiscard]] bool shares_storage_with(const Chunk& other) const {
    return storage_ == other.storage_ && (storage_ != nullptr || uniform_ == other.uniform_) && data_ == other.data_;
  }
  /// The same types and data everywhere, however stored. Cost: none where storage is shared; O(voxels) otherwise.
  [[nodiscard]] bool operator==(const Chunk& other) const;
  /// A number that says what the voxels are, whatever edits led to them and however they are stored: equal for equal
  /// chunks, on every machine. Not collision-resistant against an adversary. Cost: up to 0.1 ms; it is not kept.
  [[nodiscard]] std::uint64_t content_hash() const;
  /// How many voxels have this type. Cost: O(palette), or O(voxels) at 16 bits a voxel.
  [[nodiscard]] int count(VoxelType type) const;
  /// The types that occur, ascending. Cost: as `count`.
  [[nodiscard]] std::vector<VoxelType> types() const;
  /// The smallest box around the non-air voxels, in chunk coordinates; empty when all is air. Cost: O(64).
  [[nodiscard]] IBox bounds() const;
  /// Bytes held, this object included.
  [[nodiscard]] std::size_t bytes() const;
  /// Gives back what edits left behind: unused palette entries, bits, slabs that became uniform. Does nothing where
  /// copies share some of it, which would keep that all the same.
  void compact();

 private:
  friend struct ChunkStorage;
  friend class ChunkData;
  inline ChunkStorage& own();
  void copy_storage();
  void make_mixed();
  std::uint32_t index_for(VoxelType type);
  std::uint32_t find_or_add(VoxelType type);
  std::uint32_t slot_for_writing(std::size_t slab);
  void release_slot(std::size_t slab, std::uint32_t index);
  void count_change(int y, int z, std::uint64_t became_air, std::uint64_t became_solid);
  std::uint32_t replace(int y, int z, std::uint64_t changed, VoxelType type);
  void types_will_change(int y, int z, std::uint64_t voxels) {
    if (data_ != nullptr) [[unlikely]]
      clear_data(y, z, voxels);
  }
  void clear_data(int y, int z, std::uint64_t voxels);
  bool set_anywhere(int x, int y, int z, VoxelType type);
  void after_writing(int y, int z, std::uint32_t index, std::uint32_t changed);
  void pack_slab(std::size_t slab, std::span<const VoxelType, kChunkVoxels> types,
                 const std::vector<std::uint32_t>& index_of);
  void tidy();
  void repack(int bits);
  [[nodiscard]] std::size_t used_types() const;
  [[nodiscard]] bool is_one_entry() const;

  VoxelType uniform_;
  Ref<ChunkStorage> storage_;
  Ref<ChunkData> data_;  // null where no voxel has any
};

/// A chunk and its 26 neighbours: everything that meshing a chunk may read, in one object.
///
/// A null chunk reads as air.
/// Lifetime: owns nothing; the grid must outlive it, and an edit of the grid ends it.
struct Neighbourhood {
  /// [(dz + 1) * 9 + (dy + 1) * 3 + (dx + 1)]; the centre is 13.
  std::array<const Chunk*, 27> chunks{};

  /// The offset of the chunk at an index, the inverse of `index`: -1 to 1 on each axis. Requires: 0 <= index < 27.
  [[nodiscard]] static IVec3 offset(int index) {
    QUOIN_ASSERT(index >= 0 && index < 27, "0 <= index < 27");
    return {index % 3 - 1, index / 3 % 3 - 1, index / 9 - 1};
  }
  /// The index of the chunk at an offset. Requires: -1 <= dx, dy, dz <= 1.
  [[nodiscard]] static std::size_t index(int dx, int dy, int dz) {
    QUOIN_ASSERT(dx * dx <= 1 && dy * dy <= 1 && dz * dz <= 1, "-1 <= dx, dy, dz <= 1");
    return static_cast<std::size_t>((dz + 1) * 9 + (dy + 1) * 3 + (dx + 1));
  }
  /// The chunk at an offset. Requires: -1 <= dx, dy, dz <= 1.
  [[nodiscard]] const Chunk* at(int dx, int dy, int dz) const { return chunks[index(dx, dy, dz)]; }
  [[nodiscard]] const Chunk* centre() const { return chunks[13]; }

  /// The voxel at a position relative to the centre chunk: (-1, -1, z) is in the edge neighbour.
  /// Requires: -64 <= local.x, local.y, local.z < 128.
  [[nodiscard]] VoxelType get(IVec3 local) const {
    const IVec3 chunk = chunk_of(local);
    const Chunk* found = at(chunk.x, chunk.y, chunk.z);
    return found == nullptr ? kAir : found->get(local_of(local));
  }
};

/// A neighbourhood of a chunk with nothing around it. Lifetime: as Neighbourhood.
[[nodiscard]] inline Neighbourhood isolated(const Chunk& chunk) {
  Neighbourhood n;
  n.chunks[13] = &chunk;
  return n;
}

}  // namespace quoin
