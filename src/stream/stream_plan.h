#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <vector>

#include <tsl/robin_map.h>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/scene/scene.h>
#include <quoin/store/world_store.h>
#include <quoin/stream/streamed_world.h>

#include "core/coordinates/chunk_trie.h"

namespace quoin::stream {

/// A viewer in the space of a grid.
struct Eye {
  DVec3 position{0.0};      ///< voxels; finite
  DVec3 direction{0.0};     ///< unit; 0: no direction
  double radius = 0.0;      ///< voxels
  double voxel_size = 1.0;  ///< world units

  bool operator==(const Eye&) const = default;
};

/// Returns true if a loaded chunk may stay for a viewer: it lies within the radius or slightly beyond.
[[nodiscard]] bool stays_for(const Eye& eye, IVec3 chunk);

using Eyes = std::map<std::uint32_t, std::vector<Eye>>;  ///< by grid number in the world

/// Returns true if both sets of viewers want the same chunks: they moved and turned little.
[[nodiscard]] bool see_alike(const Eyes& a, const Eyes& b);

/// The chunks that the caller's thread requests.
struct StreamRequests {
  Eyes eyes;
  std::size_t max_chunks = 0;       ///< number of chunks that fit the budget
  std::vector<ChunkAddress> asked;  ///< chunks that edits need, at any distance
  std::uint64_t number = 0;         ///< set by the caller; increases with each request
};

/// Returns true if the requests need a chunk: it stays for an eye, or an edit waits for it.
[[nodiscard]] bool is_needed(const StreamRequests& requests, const ChunkAddress& place);

/// Selects the chunks to load, nearest first, and the chunks to unload.
///
///   unknown -> begun -> here -> unknown
///
/// Chunks outside of a grid's extent are air without being loaded: they have no state and no place in a plan.
/// Threads: one at a time.
class StreamPlan {
 public:
  enum class State : std::uint8_t { Unknown, Begun, Here, Broken };

  /// Sets the chunks of a grid that can be loaded: a box, and others outside of the box. Before the first call all
  /// chunks can. Takes effect with the next plan.
  void set_extent(std::uint32_t grid, const IBox& chunks, std::span<const IVec3> others);
  /// A chunk outside of the grid's box joins the others.
  void set_state(const ChunkAddress& place, State state);
  /// Wanted chunks are loaded again, after the others.
  void forget(const ChunkAddress& place) { set_state(place, State::Unknown); }

  /// Replaces the requests and computes the chunks to load from scratch.
  void plan(StreamRequests requests);
  /// Gets the next chunk to load and marks it as begun. Returns false if there is none. Without `has_room` this
  /// considers only chunks that edits wait for.
  bool next(ChunkAddress& place, bool has_room);
  [[nodiscard]] bool has_next(bool has_room) const {
    return asked_ < requests_.asked.size() || (has_room && next_ < queue_.size());
  }
  [[nodiscard]] std::size_t max_chunks() const { return requests_.max_chunks; }
  /// Takes the chunks to unload since the last call, farthest first.
  [[nodiscard]] std::vector<ChunkAddress> take_leaving();

  [[nodiscard]] std::size_t wanted() const { return wanted_.size(); }
  /// Returns the number of wanted chunks that are not loaded. Cost: O(1).
  [[nodiscard]] std::size_t missing() const { return missing_count_; }
  /// Returns the distance of the nearest of them in world units. Cost: O(wanted) in total from plan to plan, unless
  /// wanted chunks are forgotten.
  [[nodiscard]] double complete_radius();
  /// Returns the number of chunks with a state or in the plan.
  [[nodiscard]] std::size_t entries() const;

 private:
  struct Wanted {
    ChunkAddress place;
    double distance = 0.0;  ///< world units, of its nearest point from the nearest eye
    double rank = 0.0;      ///< lower ranks load first
  };
  struct Known {
    State state = State::Unknown;
    std::uint32_t wanted = kUnwanted;  ///< index in `wanted_`
  };
  using Grid =
      tsl::robin_map<IVec3, Known, CoordinateHash, std::equal_to<IVec3>, BlockAllocator<std::pair<IVec3, Known>>>;
  struct Mark {};
  struct Extent {
    IBox chunks;
    ChunkTrie<Mark> others;
  };
  static constexpr std::uint32_t kUnwanted = ~std::uint32_t{0};

  void begin_plan();
  void find_wanted();
  void add_wanted(std::uint32_t grid, const std::vector<Eye>& eyes);
  void cut_to_budget();
  void mark_wanted();
  void find_queue();
  void find_leaving();
  [[nodiscard]] double reach_of(const Eye& eye, const Extent& extent) const;
  [[nodiscard]] State state_of(const ChunkAddress& place) const;
  [[nodiscard]] static bool is_missing(State state) { return state == State::Unknown || state == State::Begun; }
  [[nodiscard]] static bool is_nearer(const Wanted& a, const Wanted& b);
  [[nodiscard]] Wanted measured(const ChunkAddress& place, const std::vector<Eye>& eyes) const;

  StreamRequests requests_;
  std::map<std::uint32_t, Grid> known_;
  std::map<std::uint32_t, Extent> extents_;
  std::vector<Wanted> wanted_;  ///< by distance
  bool is_cut_ = false;         ///< the budget limited the plan
  std::vector<ChunkAddress> queue_;
  std::size_t next_ = 0;
  std::size_t asked_ = 0;
  std::vector<ChunkAddress> leaving_;
  std::size_t here_ = 0;           ///< all entries of `wanted_` before this index are loaded
  std::vector<bool> is_missing_;   ///< of `wanted_`
  std::size_t missing_count_ = 0;  ///< true entries of `is_missing_`
};

/// Grows a world-space box to hold a box of voxels, as an instance places it.
void extend(DBox& world, const Scene& scene, const Instance& instance, const DBox& voxels);

/// The placements of one grid in a scene, nearest first: chunks loaded for these also serve the others.
///
///   [ the nearest kNearest, checked each time | the others, checked a few at a time ]
///
/// So the cost of an update does not grow with the instances. If thousands come nearer at once, the right ones are
/// found a few updates later. Exact for up to kNearest placements.
class Placements {
 public:
  static constexpr std::size_t kNearest = 64;

  void clear();
  /// Adds or moves an instance, or removes it if it no longer places this grid.
  void put(InstanceHandle instance);
  void remove(InstanceHandle instance);
  [[nodiscard]] bool contains(InstanceHandle instance) const { return index_.contains(instance); }
  /// Grows a world-space box to hold a box of chunks (half open), as all instances place it.
  void extend(DBox& world, const Scene& scene, const IBox& chunks) const;
  /// Replaces `eyes` by the viewers in the grid's space: at most kNearest, nearest first if there are that many. Does
  /// not allocate if the vector and earlier calls have enough memory.
  void find_eyes(const Scene& scene, const SceneGrid& grid, std::span<const Viewer> viewers, std::vector<Eye>& eyes);
  /// Makes the next `eyes` check all instances.
  void look_at_all() { looked_at_ = false; }

 private:
  struct Placed {
    InstanceHandle instance;
    double distance = std::numeric_limits<double>::infinity();  // to the nearest viewer, at the last check
  };

  void swap(std::size_t a, std::size_t b);
  void look(const Scene& scene, const SceneGrid& grid, std::span<const Viewer> viewers);

  std::vector<Placed> placed_;
  std::map<InstanceHandle, std::size_t> index_;
  std::vector<InstanceHandle> near_;   // during `find_eyes`; kept for its memory
  std::vector<InstanceHandle> moved_;  // instances outside the nearest set that moved since the last update
  std::size_t next_ = kNearest;
  bool looked_at_ = false;
};

/// Returns the bytes of a chunk once it is loaded: its voxels, densities, marks, sizes and states.
[[nodiscard]] std::size_t loaded_bytes(const StoredChunk& chunk);
/// Returns the bytes of a loaded chunk of a grid.
[[nodiscard]] std::size_t loaded_bytes(const SceneGrid& content, IVec3 chunk);

/// Tracks how much of a byte budget is taken by chunks and by data derived from them, and how many chunks still fit.
///
///   | fixed | chunks | derived data: ratio * chunks | on its way to the disk | room |
///
/// Derived data (meshes, trees) appears after its chunks, so it is reserved in advance: first by a guess, then by the
/// measured ratio.
class StreamBudget {
 public:
  using Clock = std::chrono::steady_clock;

  /// `has_others`: true if data is derived from chunks.
  StreamBudget(std::size_t bytes, bool has_others);

  void add_chunk(std::size_t bytes) {
    ++chunks_;
    chunk_bytes_ += bytes;
  }
  void remove_chunk(std::size_t bytes) {
    QUOIN_ASSERT(chunks_ > 0 && chunk_bytes_ >= bytes, "a chunk that was added");
    --chunks_;
    chunk_bytes_ -= bytes;
  }
  void resize_chunk(std::size_t before, std::size_t now) {
    QUOIN_ASSERT(chunk_bytes_ >= before, "a chunk that was added");
    chunk_bytes_ = chunk_bytes_ - before + now;
  }
  /// Sets the bytes of chunks that were read but not put in place yet.
  void set_arrived(std::size_t bytes) { arrived_bytes_ = bytes; }
  /// Sets the other memory in use. `is_quiet`: no chunk came or went for some time, so all derived data is complete.
  void set_others(std::size_t reported, std::size_t pending, bool is_quiet, Clock::time_point now);

  [[nodiscard]] std::size_t loaded_chunks() const { return chunks_; }
  [[nodiscard]] std::size_t loaded_bytes() const { return chunk_bytes_; }
  [[nodiscard]] std::size_t reported_bytes() const { return reported_; }
  /// Returns true if the memory in use exceeds the budget.
  [[nodiscard]] bool is_over() const { return used() > static_cast<double>(budget_); }
  /// Returns the bytes of chunks that may still be read while workers process `begun` chunks; negative if too many
  /// bytes are already expected.
  [[nodiscard]] std::int64_t room(std::size_t begun) const;
  /// Returns the expected bytes of an unknown chunk.
  [[nodiscard]] std::int64_t guess() const;
  /// Returns the number of chunks that the budget allows. `planned`: chunks in the last plan. `is_cut`: the budget
  /// limited that plan. `missing`: share of the planned chunks that is not loaded yet.
  [[nodiscard]] std::size_t chunks(std::size_t planned, bool is_cut, double missing) const;

 private:
  [[nodiscard]] double used() const;
  [[nodiscard]] double expected() const;
  [[nodiscard]] double limit() const;

  std::size_t budget_;
  std::size_t chunks_ = 0;
  std::size_t chunk_bytes_ = 0;
  std::size_t arrived_bytes_ = 0;
  std::size_t reported_ = 0;
  std::size_t pending_ = 0;
  std::size_t fixed_ = 0;  // reported bytes that do not depend on chunks
  double ratio_ = 0.0;     // bytes of derived data per byte of chunks
  bool is_reported_ = false;
  Clock::time_point announced_{};
};

}  // namespace quoin::stream
