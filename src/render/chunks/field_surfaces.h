#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "render/chunks/surface_source.h"

namespace quoin {

/// The field of one grid.
///
/// Surfaces of neighbouring chunks share vertices. The chunks that one change reaches therefore form a group: they are
/// meshed from one snapshot with one choice of levels, and delivered together when the last is done. A change to a
/// chunk whose group is in progress waits until that group has been delivered. Loaded chunks that were never shown do
/// not wait. Groups with edited chunks belong to an epoch; groups of other levels of detail are on their own.
class FieldSurfaces final : public SurfaceSource {
 public:
  FieldSurfaces(GridHandle handle, const ChunkSurfaceOptions& options, SurfaceTotals& totals);

  void follow(const SceneGrid& content, const VoxelRegistry& types, SurfaceClock::time_point now) override;
  void leave() override;
  void forget() override;
  void discard() override;
  void mark_types(const SceneGrid& content, const ChangedTypes& changed, SurfaceClock::time_point now) override;

  [[nodiscard]] bool wants_levels() const override { return wants_levels_; }
  /// Chunks that were never shown get their levels at once. Other chunks change a few at a time, nearest first.
  void choose_levels(const ChunkDistances& distances, SurfaceClock::time_point now) override;
  void prepare(const SceneGrid& content, const VoxelRegistry& types) override;
  [[nodiscard]] const ChunkSet& waiting() const override { return waiting_; }
  [[nodiscard]] const IBox& box() const override { return box_; }
  [[nodiscard]] bool has_chunks() const override { return !chunks_.empty(); }
  [[nodiscard]] std::unique_ptr<SurfaceJob> make_job(SurfaceInputs& inputs, IVec3 chunk) override;
  void hand_over(IVec3 chunk, std::uint64_t serial) override;
  [[nodiscard]] bool is_current(const SurfaceJob& job) const override;
  void withdrawn(const SurfaceJob& job) override;
  void collect(SurfaceJob& job) override;
  [[nodiscard]] Turn turn_of(IVec3 chunk) const override;
  void take(IVec3 chunk, std::vector<SurfaceUpdate>& out) override;
  [[nodiscard]] std::size_t count_edited(bool& has_edits) const override;
  [[nodiscard]] bool may_begin_epoch() override;
  [[nodiscard]] bool is_urgent(IVec3 chunk) const override;
  void begin_epoch(SurfaceInputs* inputs, std::vector<std::unique_ptr<SurfaceJob>>& jobs) override;
  void give_epoch() override;
  void release_edits() override;

 private:
  struct Group {
    FieldSnapshot field;
    std::shared_ptr<const VoxelRegistry> types;
    std::shared_ptr<const FieldBodies> bodies;  // of the chunks that jobs read
    std::vector<IVec3> chunks;
    std::size_t unfinished = 0;  // of these
    std::uint64_t state = 0;     // of the scene that it shows
    bool is_in_epoch = false;    // given with the epoch
    bool is_urgent = false;      // an epoch waits for it
  };
  struct FieldChunk {
    std::shared_ptr<Group> group;   // that it is meshed in; null: in none
    std::uint64_t serial = 0;       // of the newest job
    std::uint64_t state = 0;        // of the scene: `surface` waits until it is complete
    SurfaceClock::time_point seen;  // time of the last change
    bool is_stale = false;          // it changed after it was meshed or put into a group
    bool is_edited = false;         // by an edit: its group belongs to the next epoch
    bool is_bound = false;          // the same change also reached neighbours
    bool is_working = false;        // a worker has the newest job
    bool is_done = false;           // in its group
    bool is_empty = false;          // there is nothing to mesh
    bool is_gone = false;           // it no longer exists in the field
    bool is_ready = false;          // `surface` is ready to be taken
    bool is_listed = false;         // in SurfaceTotals::ready
    bool is_shown = false;          // the last surface taken is not null
    bool was_given = false;         // a surface, or the report that there is none
    std::uint8_t level = 0;
    std::array<std::uint8_t, 27> levels{};        // in its group
    std::shared_ptr<const ChunkSurface> result;   // in its group
    std::shared_ptr<const ChunkSurface> surface;  // of the last group

    // Returns true if no other chunk depends on its level yet.
    [[nodiscard]] bool is_new() const { return !was_given && group == nullptr; }
    [[nodiscard]] bool is_unfinished() const { return is_stale || group != nullptr; }
    [[nodiscard]] bool is_pending() const { return is_unfinished() || is_ready; }
  };
  using Change = CountedChange<FieldChunk>;
  using Chunks = std::unordered_map<IVec3, FieldChunk, CoordinateHash>;
  using Members = std::vector<IVec3>;

  /// Reasons to mesh a chunk again. `Load`: on its own. `Level`: together with its neighbours that changed. `Edit`: so,
  /// and in an epoch.
  enum class Cause : std::uint8_t { Load, Level, Edit };

  void begin_anew(const DensityGrid& field, SurfaceClock::time_point now);
  void follow_changes(const DensityGrid& field, const DensityChanges& changes, SurfaceClock::time_point now);
  void see_whether_there(const DensityGrid& field, IVec3 chunk, Cause cause, SurfaceClock::time_point now);
  void mark(IVec3 chunk, Cause cause, SurfaceClock::time_point now);
  void set_level(IVec3 chunk, FieldChunk& state, int level, SurfaceClock::time_point now);
  [[nodiscard]] std::array<std::uint8_t, 27> levels_around(IVec3 chunk) const;
  [[nodiscard]] int reach_at(IVec3 chunk) const;
  [[nodiscard]] Members members_with(IVec3 chunk) const;
  [[nodiscard]] bool may_begin(const Members& members) const;
  [[nodiscard]] bool is_edited(const Members& members) const;
  [[nodiscard]] std::vector<Members> edited_groups() const;
  std::shared_ptr<Group> begin_group(const Members& members, bool is_in_epoch);
  void set_inputs(Group& group, SurfaceInputs& inputs);
  [[nodiscard]] std::unique_ptr<SurfaceJob> job_of(const SurfaceInputs& inputs, IVec3 chunk);
  [[nodiscard]] std::shared_ptr<const FieldBodies> bodies_around(const Members& members, const DensityGrid& field);
  void finish_chunk(FieldChunk& state, std::shared_ptr<const ChunkSurface> surface);
  void give(const Group& group);
  void abandon_groups();
  void make_ready(IVec3 chunk, FieldChunk& state);
  void erase_if_over(IVec3 chunk);

  GridHandle handle_;
  const ChunkSurfaceOptions& options_;
  SurfaceTotals& totals_;
  ChangeCursor followed_;
  Chunks chunks_;
  FieldBodies bodies_;  // of the field as it is
  ChunkSet stale_;      // chunks that are
  ChunkSet edited_;     // some of these
  ChunkSet waiting_;    // in a group that has begun, or one that may begin
  std::vector<std::shared_ptr<Group>> epoch_;
  bool has_left_ = false;      // the scene no longer shows the grid
  bool is_forgotten_ = false;  // memory ran out; groups may lack jobs
  bool is_prepared_ = true;
  bool is_blocked_ = false;  // some group waits for another
  bool wants_levels_ = false;
  Members changing_levels_;
  IBox box_;  // of all chunks that there were
};

}  // namespace quoin
