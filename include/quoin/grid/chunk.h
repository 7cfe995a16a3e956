#pragma once

#include <algorithm>
#include <array>
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

namespace [[gnu::visibility("default")]] quoin {

/// Maximum number of data bytes per voxel.
inline constexpr std::size_t kMaxVoxelDataBytes = std::size_t{1} << 16;

/// The data of a voxel in addition to its type: the orientation of a stair, a water level, the contents of a chest.
///
///   world.set(at, stairs, {.state = 3});                    // type and data in one; stairs has state_bits >= 2
///   world.set_data(at, {.state = world.data(at).state ^ 1});
///   world.set_data(chest, {.bytes = inventory});            // copied
///
/// Use the state word for small properties of many voxels; the type declares its bits (VoxelProperties::state_bits).
/// Use bytes for larger properties of few voxels. The engine does not interpret either. Empty data takes no memory.
/// Data does not need additional voxel types.
struct VoxelData {
  std::uint32_t state = 0;             ///< 0 by default
  std::span<const std::byte> bytes{};  ///< at most kMaxVoxelDataBytes; from a grid: valid until its next edit

  [[nodiscard]] bool empty() const { return state == 0 && bytes.empty(); }
  bool operator==(const VoxelData& other) const {
    return state == other.state && std::ranges::equal(bytes, other.bytes);
  }
};

class [[gnu::visibility("hidden")]] ChunkData;
struct [[gnu::visibility("hidden")]] ChunkStorage;

/// The box of all voxels of a chunk, in chunk coordinates.
inline constexpr IBox kWholeChunk = {IVec3{0}, IVec3{kChunkEdge}};

/// A chunk of 64^3 voxels, compressed by a palette to 1, 2, 4, 8 or 16 bits per voxel.
///
/// Layout:   voxels lie in rows of 64 along x, so a bit plane of a row is one word. A slab is 4x4 rows (64x4x4 voxels).
///           A slab of a single type stores no bit planes, and a chunk of a single type stores only the type.
/// Memory:   a write detects slabs or chunks that became uniform or need fewer bits. If edits are
///           undone, a chunk therefore takes about as much memory as a new one; `compact` frees the rest.
/// Counts:   every write updates the number of voxels per type and per layer (64 layers on each axis). Counts and tight
///           bounds are therefore cheap to query.
/// Data:     voxels other than air can have data (VoxelData). A write that changes a voxel's type removes its data. A
///           chunk without data pays a pointer. Otherwise it pays 2 KiB, 0.2 KiB per slab with data, 4 bytes per state,
///           and 80 bytes plus the bytes themselves per voxel with bytes.
/// Sharing:  a copy shares its storage with the original and costs a pointer. A write to shared storage first copies
///           the part that it changes: 512 words of voxels, and the per-chunk tables.
/// Threads:  several threads may read, write and destroy different copies at once.
class Chunk {
 public:
  /// Creates a chunk with all voxels of one type.
  explicit Chunk(VoxelType uniform = kAir);
  Chunk(const Chunk& other);
  Chunk(Chunk&& other) noexcept;
  Chunk& operator=(const Chunk& other);
  Chunk& operator=(Chunk&& other) noexcept;
  ~Chunk();

  /// Compresses 64^3 types (x fastest, then y, then z) into the smallest storage that holds them.
  [[nodiscard]] static Chunk from_dense(std::span<const VoxelType, kChunkVoxels> types);

  /// Returns the type of a voxel. Requires: 0 <= x, y, z < 64.
  [[nodiscard]] VoxelType get(int x, int y, int z) const;
  [[nodiscard]] VoxelType get(IVec3 local) const { return get(local.x, local.y, local.z); }

  /// Sets the voxels of a row along x whose bits are set in `mask`. Returns a mask of the voxels that changed type.
  /// Requires: 0 <= y, z < 64.
  std::uint64_t fill_row(int y, int z, std::uint64_t mask, VoxelType type);
  /// Sets the 64 voxels of a row. Returns a mask of the voxels that changed type. Requires: 0 <= y, z < 64.
  std::uint64_t write_row(int y, int z, std::span<const VoxelType, kChunkEdge> types) {
    return write_row(y, z, ~std::uint64_t{0}, types);
  }
  /// Sets the voxels of a row whose bits are set in `mask`, voxel i to `types[i]`. Returns a mask of the voxels that
  /// changed type. Requires: 0 <= y, z < 64.
  std::uint64_t write_row(int y, int z, std::uint64_t mask, std::span<const VoxelType, kChunkEdge> types);
  /// Copies the types of one row to `out`. Requires: 0 <= y, z < 64.
  void read_row(int y, int z, std::span<VoxelType, kChunkEdge> out) const;
  /// Sets a voxel. Returns true if its type changed. Requires: 0 <= x, y, z < 64.
  bool set(int x, int y, int z, VoxelType type);
  bool set(IVec3 local, VoxelType type) { return set(local.x, local.y, local.z, type); }
  /// Sets all voxels to one type.
  void fill(VoxelType type);
  /// Returns a copy in which each type is replaced by `number(type)`. Voxels keep their data.
  /// Requires: different types have different numbers, and only air has air's. Cost: O(types); O(voxels) if there are
  /// more than 256 types, or if edits left entries of the palette unused (`compact`).
  [[nodiscard]] Chunk renumbered(FunctionRef<VoxelType(VoxelType)> number) const;

  /// Returns the data of a voxel. Lifetime: until the chunk is written. Requires: 0 <= x, y, z < 64.
  [[nodiscard]] VoxelData data(IVec3 local) const;
  /// Replaces the data of a voxel. Returns true if it changed. Does nothing and returns false for air.
  /// Requires: 0 <= x, y, z < 64; at most kMaxVoxelDataBytes bytes.
  bool set_data(IVec3 local, const VoxelData& data);
  /// Returns the number of voxels with data. Cost: O(1).
  [[nodiscard]] int data_count() const;
  /// Calls `visit` for each voxel with data, by z, then y, then x. Requires: `visit` does not write the chunk.
  void for_each_data(FunctionRef<void(IVec3 local, const VoxelData& data)> visit) const;

  /// Sets the voxels of a box (clipped to the chunk). Calls `on_change` for each row with changed voxels; `changed` is
  /// their mask.
  void fill_box(const IBox& box, VoxelType type, FunctionRef<void(int y, int z, std::uint64_t changed)> on_change);

  /// Returns a mask of the voxels of a row that have this type. Requires: 0 <= y, z < 64.
  [[nodiscard]] std::uint64_t row_mask(int y, int z, VoxelType type) const;

  /// Returns the type of all voxels if the chunk is stored as uniform, nullopt otherwise.
  [[nodiscard]] std::optional<VoxelType> uniform() const {
    return storage_ == nullptr ? std::optional(uniform_) : std::nullopt;
  }
  /// Returns the number of voxels that are not air. Cost: O(1).
  [[nodiscard]] int non_air_count() const;
  /// Returns true if no voxel is air.
  [[nodiscard]] bool is_full() const { return non_air_count() == static_cast<int>(kChunkVoxels); }
  /// Returns true if both chunks still share their storage, as a copy and its original do until either is written. True
  /// implies that the chunks are equal. False implies nothing.
  [[nodiscard]] bool shares_storage_with(const Chunk& other) const {
    return storage_ == other.storage_ && (storage_ != nullptr || uniform_ == other.uniform_) && data_ == other.data_;
  }
  /// Returns true if all types and data are equal, however they are stored. Cost: O(1) if storage is shared, else
  /// O(voxels).
  [[nodiscard]] bool operator==(const Chunk& other) const;
  /// Returns a hash of the voxels that is independent of edit history and storage. Equal chunks have equal hashes on
  /// every machine. The hash does not resist deliberate collisions. Cost: up to 0.1 ms per call; the hash is not
  /// cached.
  [[nodiscard]] std::uint64_t content_hash() const;
  /// Returns the number of voxels of a type. Cost: O(palette), or O(voxels) at 16 bits per voxel.
  [[nodiscard]] int count(VoxelType type) const;
  /// Returns the types in use, ascending, including air. Cost: same as `count`.
  [[nodiscard]] std::vector<VoxelType> types() const;
  /// Returns the smallest box around the voxels that are not air, in chunk coordinates. Empty if all are air. Cost:
  /// O(64).
  [[nodiscard]] IBox bounds() const;
  /// Returns the memory in use, in bytes, including this object.
  [[nodiscard]] std::size_t bytes() const;
  /// Frees memory that edits left unused: palette entries, bits, and slabs that became uniform. Does nothing if a copy
  /// shares part of the storage, because the copy would keep that memory.
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
                 std::span<const std::uint32_t> index_of);
  void tidy();
  void repack(int bits);
  [[nodiscard]] std::size_t used_types() const;
  [[nodiscard]] bool is_one_entry() const;

  VoxelType uniform_;
  Ref<ChunkStorage> storage_;
  Ref<ChunkData> data_;  // null if no voxel has data
};

/// A chunk and its 26 neighbours: all the input for meshing one chunk.
///
/// A null chunk reads as air.
/// Lifetime: non-owning. The grid must outlive it, and an edit of the grid invalidates it.
struct Neighbourhood {
  /// Chunks at index [(dz + 1) * 9 + (dy + 1) * 3 + (dx + 1)]; the centre is 13.
  std::array<const Chunk*, 27> chunks{};
  /// Position of the centre chunk's minimum corner in voxels of the grid. Shapes may depend on it (PositionShare).
  IVec3 origin{0};

  /// Returns the offset of the chunk at an index, -1 to 1 on each axis. The inverse of `index`.
  /// Requires: 0 <= index < 27.
  [[nodiscard]] static IVec3 offset(int index) {
    QUOIN_ASSERT(index >= 0 && index < 27, "0 <= index < 27");
    return {index % 3 - 1, index / 3 % 3 - 1, index / 9 - 1};
  }
  /// Returns the index of the chunk at an offset. Requires: -1 <= dx, dy, dz <= 1.
  [[nodiscard]] static std::size_t index(int dx, int dy, int dz) {
    QUOIN_ASSERT(dx * dx <= 1 && dy * dy <= 1 && dz * dz <= 1, "-1 <= dx, dy, dz <= 1");
    return static_cast<std::size_t>((dz + 1) * 9 + (dy + 1) * 3 + (dx + 1));
  }
  /// Returns the chunk at an offset, or null. Requires: -1 <= dx, dy, dz <= 1.
  [[nodiscard]] const Chunk* at(int dx, int dy, int dz) const { return chunks[index(dx, dy, dz)]; }
  [[nodiscard]] const Chunk* centre() const { return chunks[13]; }

  /// Returns the voxel at a position relative to the centre chunk. For example, (-1, -1, z) lies in an edge neighbour.
  /// Requires: -64 <= local.x, local.y, local.z < 128.
  [[nodiscard]] VoxelType get(IVec3 local) const {
    const IVec3 chunk = chunk_of(local);
    const Chunk* found = at(chunk.x, chunk.y, chunk.z);
    return found == nullptr ? kAir : found->get(local_of(local));
  }
  /// Returns the data of the voxel at a position relative to the centre chunk. Requires: as `get`. Lifetime: as
  /// Chunk::data.
  [[nodiscard]] VoxelData data(IVec3 local) const {
    const IVec3 chunk = chunk_of(local);
    const Chunk* found = at(chunk.x, chunk.y, chunk.z);
    return found == nullptr ? VoxelData{} : found->data(local_of(local));
  }
};

/// Returns the shape of the voxel at a position relative to the centre chunk, as state, neighbours and position in the
/// grid select it; null if its type has no shapes. Lifetime: until the type is replaced.
/// Requires: -63 <= local.x, local.y, local.z < 127.
[[nodiscard]] const ShapeModel* shape_at(const Neighbourhood& chunks, const VoxelRegistry& types, IVec3 local);

/// The fluid next to the shape of a voxel (ShapeRules::fluid).
struct InnerFluid {
  std::uint32_t groups = 0;           ///< 0: there is none
  VoxelType type = kAir;              ///< the type that shows it; kAir: no fluid of these groups is registered
  const ShapeModel* model = nullptr;  ///< the fluid's shape; null if `type` is kAir
};

/// Returns the fluid next to the shape of a voxel. Lifetime and requirements: as `shape_at`.
[[nodiscard]] InnerFluid fluid_at(const Neighbourhood& chunks, const VoxelRegistry& types, IVec3 local);

/// Returns a neighbourhood of a chunk without neighbours, with the origin 0. Lifetime: same as Neighbourhood.
[[nodiscard]] inline Neighbourhood isolated(const Chunk& chunk) {
  Neighbourhood n;
  n.chunks[13] = &chunk;
  return n;
}

}  // namespace quoin
