#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <unordered_map>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/store/stored_chunk.h>

namespace quoin::stream {

/// A viewer in the space of a grid.
struct Eye {
  DVec3 position{0.0};      ///< voxels
  DVec3 direction{0.0};     ///< unit; 0: nowhere in particular
  double radius = 0.0;      ///< voxels
  double voxel_size = 1.0;  ///< world units

  bool operator==(const Eye&) const = default;
};

/// Whether a chunk that is loaded may stay for a viewer: it lies within the radius, or little beyond.
[[nodiscard]] bool stays_for(const Eye& eye, IVec3 chunk);

using Eyes = std::map<std::uint32_t, std::vector<Eye>>;  ///< of each grid, by its number in the world

/// Whether nothing else is wanted for these than for those: they moved and turned little.
[[nodiscard]] bool see_alike(const Eyes& a, const Eyes& b);

/// What is wanted, as the caller's thread says it.
struct Wishes {
  Eyes eyes;
  std::size_t max_chunks = 0;     ///< that the budget suffices for
  std::vector<ChunkPlace> asked;  ///< for edits: wherever they lie
  std::uint64_t number = 0;       ///< the caller's own; greater for later ones
};

/// Which chunks are to be loaded, nearest first, and which are to go.
///
///   unknown -> begun -> here -> unknown
///
/// Threads: one at a time.
class StreamPlan {
 public:
  enum class State : std::uint8_t { Begun, Here, Broken };

  void set_state(const ChunkPlace& place, State state);
  void forget(const ChunkPlace& place);

  /// Takes over what is wanted, and finds anew what is to be loaded.
  void plan(Wishes wishes);
  /// The next chunk to load, which then counts as begun. False where there is none. Without `has_room` only what edits
  /// wait for is loaded.
  bool next(ChunkPlace& place, bool has_room);
  [[nodiscard]] bool has_next(bool has_room) const {
    return asked_ < wishes_.asked.size() || (has_room && next_ < queue_.size());
  }
  [[nodiscard]] std::size_t max_chunks() const { return wishes_.max_chunks; }
  /// Those that are to go, farthest first, since the last call.
  [[nodiscard]] std::vector<ChunkPlace> take_leaving();

  [[nodiscard]] std::size_t wanted() const { return wanted_.size(); }
  /// Of these, that are not here; and how far the nearest of them is, world units. Cost: O(wanted) after a change.
  [[nodiscard]] std::size_t missing();
  [[nodiscard]] double complete_radius();

 private:
  struct Wanted {
    ChunkPlace place;
    double distance = 0.0;  ///< world units, of its nearest point from the nearest eye
    double rank = 0.0;      ///< the less the sooner
  };
  using States = std::unordered_map<IVec3, State, CoordinateHash>;

  void find_wanted();
  void cut_to_budget();
  void find_queue();
  void find_leaving();
  [[nodiscard]] const State* state_of(const ChunkPlace& place) const;
  [[nodiscard]] static bool is_nearer(const Wanted& a, const Wanted& b);
  [[nodiscard]] Wanted measured(const ChunkPlace& place, const std::vector<Eye>& eyes) const;

  Wishes wishes_;
  std::map<std::uint32_t, States> states_;
  std::vector<Wanted> wanted_;  ///< by distance
  bool is_cut_ = false;         ///< the budget did not suffice
  std::vector<ChunkPlace> queue_;
  std::size_t next_ = 0;
  std::size_t asked_ = 0;
  std::vector<ChunkPlace> leaving_;
  std::size_t here_ = 0;           ///< of `wanted_`, all before it are here
  std::size_t missing_count_ = 0;  ///< as of the last count
  bool is_counted_ = false;
};

}  // namespace quoin::stream
