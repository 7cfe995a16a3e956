#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <tsl/robin_map.h>
#include <tsl/robin_set.h>

#include <quoin/core/hash.h>
#include <quoin/core/memory.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/io/scene_file.h>
#include <quoin/scene/scene.h>
#include <quoin/store/world_store.h>

#include "core/coordinates/chunk_order.h"
#include "core/memory/make_room.h"
#include "store/database/schema.h"
#include "store/world/world_reader.h"

namespace quoin::store {

struct ChunkAddressHash {
  std::size_t operator()(const ChunkAddress& place) const {
    std::uint32_t hash = mix_bits(place.grid ^ std::uint32_t{place.level} << 24);
    for (int axis = 0; axis < 3; ++axis) hash = mix_bits(hash ^ static_cast<std::uint32_t>(place.chunk[axis]));
    return hash;
  }
};

/// Chunks by address, in one block of memory: an entry needs no allocation of its own.
template <class T>
using ChunkMap = tsl::robin_map<ChunkAddress, T, ChunkAddressHash, std::equal_to<ChunkAddress>,
                                BlockAllocator<std::pair<ChunkAddress, T>>>;

/// Chunks that were edited since the last save began, each once, in the order of their first edits.
class EditedChunks {
 public:
  void add(IVec3 chunk) {
    quoin::make_room(chunks_);
    if (known_.insert(chunk).second) chunks_.push_back(chunk);
  }
  /// Returns the chunks and forgets them.
  [[nodiscard]] std::vector<IVec3> take() {
    known_.clear();
    return std::exchange(chunks_, {});
  }

 private:
  std::vector<IVec3> chunks_;
  tsl::robin_set<IVec3, CoordinateHash> known_;
};

/// The objects of a scene that changed since the last save began.
class ChangedObjects {
 public:
  /// A list of more than `most` objects, such as instances that came and went, is replaced by `all`.
  /// Requires: the lists of `changes` are sorted. Cost: O(objects of both); no allocation for known objects.
  void add(const SceneChanges& changes, std::size_t most);
  /// Any object may have changed.
  void add_all();
  /// Returns the changes, sorted, and forgets them.
  [[nodiscard]] SceneChanges take() { return std::exchange(changes_, {}); }

 private:
  SceneChanges changes_;
  SceneChanges united_;  // during `add`; kept for its memory
};

/// Reserves memory, so that adding `more` entries neither allocates nor throws.
template <class T>
void make_room(ChunkMap<T>& chunks, std::size_t more) {
  const std::size_t wanted = chunks.size() + more;
  if (static_cast<float>(wanted) <= chunks.max_load_factor() * static_cast<float>(chunks.bucket_count())) return;
  chunks.reserve(std::max(wanted, 2 * chunks.size()));
}

using PartBody = std::vector<std::byte>;
/// An instance with a name that several saves share. `placement.instance.name` is empty.
struct InstancePart {
  SceneFile::Placement placement;
  std::shared_ptr<const std::string> name;
};
/// Returns the instance with an empty name.
[[nodiscard]] Instance without_name(const Instance& instance);
/// Returns true if both have the same text.
[[nodiscard]] bool is_same(const InstancePart& a, const InstancePart& b);
/// Instances as a saver saved them last.
using SavedInstances =
    tsl::robin_map<InstanceHandle, InstancePart, std::hash<InstanceHandle>, std::equal_to<InstanceHandle>,
                   BlockAllocator<std::pair<InstanceHandle, InstancePart>>>;
/// The content of a part: its bytes, or an instance or a group whose text the writer makes on its own thread.
using PartContent = std::variant<PartBody, InstancePart, SceneFile::Group>;

/// Returns the bytes that the file stores, in `made` if the content has none yet. Lifetime: of both arguments.
[[nodiscard]] std::span<const std::byte> bytes_of(const PartContent& content, PartBody& made);
/// Returns the bytes that the file stores.
[[nodiscard]] PartBody body_of(PartContent content);

struct ChangeSet {
  std::set<std::uint32_t> removed_grids;  ///< applied first
  ChunkMap<std::optional<StoredChunk>> chunks;
  std::map<PartKey, std::optional<PartContent>> parts;

  [[nodiscard]] bool empty() const { return removed_grids.empty() && chunks.empty() && parts.empty(); }
  void remove_grid(std::uint32_t number);
  /// Adds later changes. If memory runs out, both sets are unchanged.
  void add(ChangeSet&& later);
};

/// The types and grids of a world, for checking chunks.
struct WorldRules {
  VoxelRegistry types;
  std::map<std::uint32_t, WorldGrid> grids;
  std::vector<std::string> damage;  ///< a line for each item replaced by a visible placeholder

  /// Returns the rules after changes. Errors: InvalidArgument, as WorldStore::save.
  [[nodiscard]] Result<WorldRules> after(const ChangeSet& changes) const;
  /// Returns true if changes include types or grids.
  [[nodiscard]] static bool concern(const ChangeSet& changes);
};

/// Reads the rules of a world on disk. Damaged types become magenta, so that their voxels are visible; damaged grids
/// lose their names.
[[nodiscard]] Result<WorldRules> read_rules(WorldReader& reader);
/// Returns the placeholder of a lost type: magenta, so that it is visible.
[[nodiscard]] VoxelProperties lost_type(std::int64_t number);
/// Returns a text such as "chunk (1, 2, 3) of grid 0".
[[nodiscard]] std::string about(const ChunkAddress& place);
/// Checks that a world can list the chunk. Errors: InvalidArgument for coordinates outside kAllChunks, or a grid number
/// above kMaxGridNumber.
[[nodiscard]] Status check_address(const ChunkAddress& place);
/// Checks changes as documented for WorldStore::save.
[[nodiscard]] Status check_changes(const ChangeSet& changes, const WorldRules& rules);

/// The time of a step, which copies some items of a save.
class StepTime {
 public:
  explicit StepTime(double seconds) : seconds_(seconds) {}
  /// Call before each item. Returns true if the step must end. It copies at least kItemsPerLook items.
  [[nodiscard]] bool is_over() {
    const bool is_time_to_look = items_ != 0 && items_ % kItemsPerLook == 0;
    ++items_;
    return is_time_to_look && passed() >= seconds_;
  }
  /// Returns true if little of the time has passed.
  [[nodiscard]] bool has_begun_only() const { return items_ == 0 || passed() < 0.5 * seconds_; }

  static constexpr std::size_t kItemsPerLook = 16;

 private:
  using Clock = std::chrono::steady_clock;
  [[nodiscard]] double passed() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  double seconds_;
  std::size_t items_ = 0;
  Clock::time_point start_ = Clock::now();
};

/// A save that is copied in steps, with the state of the moment when it began:
///
///   begin   small parts -> changes    few chunks -> changes    other chunks: a snapshot of their grid
///           instances -> `instances`, as they are
///   step    instances -> changes, with their numbers           chunks of the snapshots -> changes
///
struct SaveInSteps {
  /// A grid with many changed chunks.
  struct OfGrid {
    std::uint32_t number;
    std::vector<IVec3> chunks;
    Grid voxels;
    DensityGrid field;
  };
  /// A changed instance.
  struct OfInstance {
    InstanceHandle handle{};
    bool is_saved = false;  ///< false: the scene does not have it, or leaves it out; the rest is empty
    Instance instance{};    ///< without its name
    std::shared_ptr<const std::string> name{};
  };
  WorldChanges changes;
  std::function<void(const Status&)> on_saved;
  BlockVector<OfInstance> instances;
  std::vector<OfGrid> grids;
  std::size_t next_instance = 0;
  std::size_t next_grid = 0;
  std::size_t next_chunk = 0;    ///< of this grid
  bool is_copied = false;        ///< nothing is left to copy
  bool is_full = false;          ///< the save contains everything, also instances that are as before
  std::vector<PartKey> removed;  ///< parts that the save removes
  bool had_view = false;         ///< it has new cameras

  /// Adds a chunk of a grid. Chunks that are not loaded are unchanged.
  void put_chunk(std::uint32_t number, const Grid& voxels, const DensityGrid& field, IVec3 chunk);
  /// Copies chunks of the snapshots. Returns true if all are copied.
  [[nodiscard]] bool copy_chunks(StepTime& time);
};

}  // namespace quoin::store

namespace quoin {

using store::PartBody;

/// Changes by the store's own modules, in addition to chunks and values.
struct WorldParts {
  /// Sets a part's body; nullopt removes the part.
  static void put(WorldChanges& changes, store::PartKey key, std::optional<PartBody> body);
  static void put(WorldChanges& changes, const char* kind, std::int64_t id, std::string_view text);
  /// Keeps the instance; the writer's thread makes its text. An instance that cannot be read again becomes text at
  /// once, and `save` refuses it.
  static void put(WorldChanges& changes, std::int64_t id, store::InstancePart instance);
  static void put(WorldChanges& changes, std::int64_t id, SceneFile::Placement instance);
  /// As for an instance.
  static void put(WorldChanges& changes, std::int64_t id, SceneFile::Group group);
  static void remove(WorldChanges& changes, const char* kind, std::int64_t id);
  /// Returns the part's body, saved or pending. Errors: BadFormat if it is damaged; CannotRead.
  [[nodiscard]] static Result<std::optional<PartBody>> find(const WorldStore& world, const store::PartKey& key);
  /// Calls `visit(part, is_sound)` for the saved or pending parts of a kind, in id order. Errors: CannotRead.
  [[nodiscard]] static Status each(const WorldStore& world, const char* kind,
                                   FunctionRef<void(const store::Part& part, bool is_sound)> visit);
  /// Calls `visit`, on the caller's thread, for the chunks of a grid and level on disk in key order, until it returns
  /// false. Damaged chunks are passed as errors. Decodes on several threads, in bounded memory.
  [[nodiscard]] static Status each_chunk(const WorldStore& world, std::uint32_t grid, std::uint8_t level,
                                         Threads threads,
                                         FunctionRef<bool(const ChunkAddress& place, Result<StoredChunk> chunk)> visit);
  /// Returns a line for each damaged type or grid found on opening.
  [[nodiscard]] static std::vector<std::string> damage(const WorldStore& world);

  /// `vfs`: a SQLite file system, for tests; null: the default, with a lock.
  [[nodiscard]] static Result<WorldStore> create(const std::filesystem::path& path, Threads threads, const char* vfs);
  [[nodiscard]] static Result<WorldStore> open(const std::filesystem::path& path, WorldAccess access, Threads threads,
                                               const char* vfs);
  /// Creates a world without crash safety: it is synced only when it is closed.
  [[nodiscard]] static Result<WorldStore> create_unsynced(const std::filesystem::path& path, Threads threads);
  /// Opens a world in memory for reading.
  [[nodiscard]] static Result<WorldStore> open(std::span<const std::byte> bytes);

 private:
  [[nodiscard]] static Result<WorldStore> begin(std::unique_ptr<WorldStore::Impl> impl,
                                                std::optional<Connection> writing, Threads threads);
};

}  // namespace quoin
