#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <quoin/scene/scene.h>

namespace quoin::viewer {

/// Something of a scene that can be shown and hidden.
using SceneNode = std::variant<InstanceHandle, GroupHandle, LayerHandle>;

/// Its own switch; nothing when it is not there.
[[nodiscard]] std::optional<bool> visibility_of(const Scene& scene, const SceneNode& node);

/// What edits to the grids of a scene replaced, a step a stroke of the brush, and what was shown and
/// hidden, so that they can be undone and redone.
///
/// Kept are the chunks that a step changed, before and after; the oldest steps go when they take more than the limit.
class EditHistory {
 public:
  explicit EditHistory(std::size_t max_bytes = std::size_t{256} << 20) : max_bytes_(max_bytes) {}

  /// Begins a step, ending the one under way.
  void begin(std::string name);
  /// Says that voxels of a box are about to be changed. Requires: a step is under way, `grid` is the scene's `handle`.
  void touch(GridHandle handle, const Grid& grid, const IBox& box);
  /// The same of samples of the grid's field.
  void touch(GridHandle handle, const DensityGrid& field, const IBox& box);
  /// Ends the step; one that changed nothing leaves no trace. Steps that were undone before are forgotten otherwise.
  void end(const Scene& scene);
  /// Shows or hides it: a step of its own. Requires: no step is under way, it is there.
  void show(Scene& scene, const SceneNode& node, bool is_visible);

  [[nodiscard]] bool can_undo() const { return done_ > 0; }
  [[nodiscard]] bool can_redo() const { return done_ < steps_.size(); }
  /// The names of what would be undone or redone; empty when nothing would.
  [[nodiscard]] std::string undo_name() const;
  [[nodiscard]] std::string redo_name() const;
  /// False when there is nothing to undo (redo), or where chunks that it would change are not loaded: then nothing is
  /// changed. Requires: no step is under way.
  bool undo(Scene& scene);
  bool redo(Scene& scene);
  void clear();

  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] std::size_t steps() const { return steps_.size(); }
  /// Tells the states of the scene apart: the same number after an undo as before what was undone.
  [[nodiscard]] std::uint64_t state() const { return done_ == 0 ? base_state_ : steps_[done_ - 1].state; }

 private:
  template <class Content>
  struct Changed {
    GridHandle grid;
    IVec3 place{0};
    Content before;
    Content after;
  };
  using ChangedChunk = Changed<Chunk>;
  using ChangedSamples = Changed<DensityChunk>;
  struct Step {
    std::string name;
    std::uint64_t state = 0;
    std::vector<ChangedChunk> chunks;
    std::vector<ChangedSamples> samples;
    std::optional<SceneNode> switched;  // shown or hidden
    bool is_visible_after = false;
    std::size_t bytes = 0;
  };

  void keep(Step step);
  template <class Content, class Grid>
  void touch_chunks(std::vector<Changed<Content>>& known, GridHandle handle, const Grid& grid, const IBox& box);
  template <class Content>
  void finish(const Scene& scene, std::vector<Changed<Content>>& changed, std::size_t& bytes);
  [[nodiscard]] static bool is_loaded(const Scene& scene, const Step& step);
  static void put(Scene& scene, const Step& step, bool after);

  std::size_t max_bytes_;
  std::deque<Step> steps_;
  std::size_t done_ = 0;  // steps that are in force; those from here on can be redone
  std::size_t bytes_ = 0;
  std::uint64_t base_state_ = 0;
  std::uint64_t last_state_ = 0;
  std::optional<Step> open_;
};

}  // namespace quoin::viewer
