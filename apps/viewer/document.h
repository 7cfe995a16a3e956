#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <quoin/core/progress.h>
#include <quoin/io/file.h>
#include <quoin/io/vox.h>
#include <quoin/scene/scene_faces.h>
#include <quoin/scene/scene_query.h>

#include "brush.h"
#include "edit_history.h"
#include "sculpt.h"
#include "world_window.h"

namespace quoin::viewer {

/// A scene under edit, where it came from, and what can be undone. Of a world on disk it is a window: chunks come and
/// go, and edits are saved as they are made.
///
/// Edits need the scene to themselves; whoever draws it must have stopped (ViewBackend::pause).
class Document {
 public:
  /// An empty scene without a name.
  Document() = default;
  Document(LoadedScene loaded, std::filesystem::path path);
  Document(WorldWindow world, std::filesystem::path path);

  /// Reads any file that `load_scene` reads. What is hidden stays so, whatever the options say: who draws looks at all
  /// instances, or not. Of a world on disk no chunk is read yet. Errors: those of load_scene and WorldWindow::open.
  [[nodiscard]] static Result<std::unique_ptr<Document>> open(const std::filesystem::path& path,
                                                              const LoadOptions& options = {},
                                                              const Progress& progress = {},
                                                              const WorldOptions& world = {});

  [[nodiscard]] const Scene& scene() const { return loaded().scene; }
  [[nodiscard]] const LoadedScene& loaded() const { return world_ ? world_->opened() : loaded_; }
  /// Null where the document is no world on disk.
  [[nodiscard]] WorldWindow* world() { return world_.get(); }
  [[nodiscard]] const WorldWindow* world() const { return world_.get(); }
  /// Why it may not be edited, for people; null where it may.
  [[nodiscard]] const char* why_not_edited() const;
  /// Empty for a scene that came from nowhere.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Whether it may be saved under its own name without a question: that can be written, and it is no scene file that
  /// names others, whose models would then be in it.
  [[nodiscard]] bool can_save_in_place() const;
  /// The name to save it under that is proposed: its own, where that format is written and holds what is there, else
  /// one beside it of a format that does.
  [[nodiscard]] std::filesystem::path proposed_path() const;
  /// For titles: the file's name, or "empty scene".
  [[nodiscard]] std::string name() const;
  /// Whether something would be lost if it were closed now. A world on disk saves itself, also when it is closed: only
  /// what could not be saved (`note_saving`) would be.
  [[nodiscard]] bool is_dirty() const { return world_ ? has_failed_ : history_.state() != saved_state_; }
  /// What became of the last save of a world on disk.
  void note_saving(const Status& outcome) { has_failed_ = !outcome; }
  /// The faces of what is drawn, as of now. Cost: that of what was edited since the last time; all were counted when
  /// the document was made. Requires: no edit is under way on another thread.
  [[nodiscard]] const FaceCounts& faces() { return faces_.update(scene()); }

  /// Begins a stroke with its first touch, where the user points: of voxels, or of the field whose surface was hit.
  /// False, without a stroke, when the instance or its grid is gone, the brush's type is not registered, or the action
  /// is one of fields only and voxels were hit.
  bool begin_stroke(const Brush& brush, const SceneHit& hit);
  /// Goes on to where a ray of the world meets the layer, or plane, of the first touch, without gaps; to `hit` where
  /// the action follows the surface.
  /// Returns how many voxels changed.
  std::int64_t drag_to(const Ray& ray_in_world, const std::optional<SceneHit>& hit);
  /// The whole stroke is one step to undo.
  void end_stroke();
  [[nodiscard]] const Brush* stroke_brush() const { return stroke_ ? &stroke_->brush : nullptr; }

  [[nodiscard]] const EditHistory& history() const { return history_; }
  /// False when there is nothing to undo (redo), in a stroke, or where what it would change is not in memory.
  bool undo();
  bool redo();

  /// Shows or hides an instance, a group or a layer; a step to undo. False when it is not there, is so already, or in
  /// a stroke.
  bool show(const SceneNode& node, bool is_visible);

  /// An opaque type of that colour and emission, new if there is none. Errors: LimitExceeded.
  [[nodiscard]] Result<VoxelType> type_of_colour(Rgba8 colour, float emission = 0.0F);

  /// What saving under that name would lose, a line each, of what was not accepted before: what the format does not
  /// hold, and what another program put into the document's own file since it was read. Errors: those of
  /// losses_of_saving.
  [[nodiscard]] Result<std::vector<std::string>> losses(const std::filesystem::path& path) const;
  /// The user knows what is lost, and does not want to be asked again.
  void accept_losses(const std::vector<std::string>& losses) {
    accepted_losses_.insert(losses.begin(), losses.end());
    has_newly_accepted_ = true;
  }
  /// What `write` keeps the file as that is there now; empty where it keeps none.
  [[nodiscard]] std::filesystem::path kept_as(const std::filesystem::path& path) const;

  /// Writes .quoin, .vox, .json or .glb, by the name's ending, and only reads the scene. A world on disk saves itself
  /// under its own name, and is copied under others, which must end in .quoin. A file that is there already is kept
  /// as NAME~ (see FileBackup), unless it is a mesh. What was kept because saving lost something stays: later saves of
  /// the document under that name neither replace it nor keep more, until something else is lost.
  /// Errors: Unsupported for other endings; those of save_scene, FileBackup, mesh_scene and write_mesh; Cancelled.
  [[nodiscard]] Status write(const std::filesystem::path& path, std::vector<std::string>& warnings,
                             const Progress& progress = {}) const;
  /// What was written is what the state `state` held: not dirty while it is in force. A .vox or .json becomes the
  /// document's own file; a mesh is a copy only, which loses voxels, and changes nothing.
  void note_written(const std::filesystem::path& path, std::uint64_t state);

 private:
  struct Stroke {
    Brush brush;
    GridHandle grid;
    InstanceHandle instance;
    StrokeLayer layer;
    IVec3 last{0};
    std::optional<SurfacePlace> surface;  ///< of a field: where it began
    DVec3 last_point{0.0};
  };

  [[nodiscard]] Scene& edited_scene() { return world_ ? world_->scene() : loaded_.scene; }
  [[nodiscard]] Status write_world(const std::filesystem::path& path, std::vector<std::string>& warnings,
                                   const Progress& progress) const;
  std::int64_t touch(IVec3 voxel);
  std::int64_t touch_surface(DVec3 point);
  std::int64_t drag_surface(const Ray& ray_in_world, const std::optional<SceneHit>& hit, const Instance& instance,
                            const SceneGrid& grid);

  LoadedScene loaded_;                  // of anything but a world
  std::unique_ptr<WorldWindow> world_;  // null: it is none
  bool has_failed_ = false;             // the last save of that
  SceneFaces faces_;
  std::filesystem::path path_;
  EditHistory history_;
  std::uint64_t saved_state_ = 0;
  std::optional<FileStamp> stamp_;  ///< of `path_`, as it was read or written
  std::set<std::string> accepted_losses_;
  bool has_newly_accepted_ = false;            ///< since it was written
  std::set<std::filesystem::path> originals_;  ///< files of which a backup holds what was lost
  std::optional<Stroke> stroke_;
};

/// Whether a document can be saved under that name: it ends in .vox, .json or .glb.
[[nodiscard]] bool can_write(const std::filesystem::path& path);

}  // namespace quoin::viewer
