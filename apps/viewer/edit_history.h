#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <quoin/scene/scene.h>

namespace quoin::viewer {

/// A part of a scene that can be shown and hidden.
using SceneNode = std::variant<InstanceHandle, GroupHandle, LayerHandle>;

/// Returns the node's own visibility, regardless of its parents; empty if the node does not exist.
[[nodiscard]] std::optional<bool> visibility_of(const Scene& scene, const SceneNode& node);

/// Undo history of a scene: grid edits, one step per brush stroke, and changes of visibility.
///
/// A step stores the changed chunks before and after. The oldest steps are dropped when they exceed the memory limit.
class EditHistory {
 public:
  explicit EditHistory(std::size_t max_bytes = std::size_t{256} << 20) : max_bytes_(max_bytes) {}

  /// Begins a step. Requires: no step is under way.
  void begin(std::string name);
  /// Announces changes to the voxels of a box. Requires: a step is under way; `grid` is the scene's `handle`.
  void touch(GridHandle handle, const Grid& grid, const IBox& box);
  /// Announces changes to samples of the grid's field.
  void touch(GridHandle handle, const DensityGrid& field, const IBox& box);
  /// Ends the step. Drops it if it changed nothing; otherwise drops the steps that could be redone.
  void end(const Scene& scene);
  /// Shows or hides a node as a step. Requires: no step is under way; the node exists.
  void show(Scene& scene, const SceneNode& node, bool is_visible);

  [[nodiscard]] bool can_undo() const { return done_ > 0; }
  [[nodiscard]] bool can_redo() const { return done_ < steps_.size(); }
  /// Return the name of the step to undo or redo; empty if there is none.
  [[nodiscard]] std::string undo_name() const;
  [[nodiscard]] std::string redo_name() const;
  /// Return false, and change nothing, if there is no step to undo (redo) or chunks that it changes are not loaded.
  /// Requires: no step is under way.
  bool undo(Scene& scene);
  bool redo(Scene& scene);
  void clear();

  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] std::size_t steps() const { return steps_.size(); }
  /// Returns a number that identifies the scene's state: undoing a step restores the number from before the step.
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
  std::size_t done_ = 0;  // applied steps; the others can be redone
  std::size_t bytes_ = 0;
  std::uint64_t base_state_ = 0;
  std::uint64_t last_state_ = 0;
  std::optional<Step> open_;
};

}  // namespace quoin::viewer
