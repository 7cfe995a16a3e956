#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/progress.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/vox.h>
#include <quoin/scene/scene_faces.h>
#include <quoin/scene/scene_query.h>

#include "brush.h"
#include "edit_history.h"
#include "world_window.h"

namespace quoin::viewer {

/// The behaviour if the resource packs of LoadOptions cannot be opened.
enum class PackFallback : std::uint8_t {
  Error,   ///< opening the file fails
  OwnPack  ///< kBuiltinPack is used instead, and the loaded scene has a warning
};

/// Types with the looks of resource packs. `warning` lists the missing files; empty if none is missing.
struct PackedTypes {
  VoxelRegistry types;
  std::string warning;
};

/// Gives types the looks of packs (BlockPacks). No packs: returns `plain`. Errors: those of BlockPacks::open.
[[nodiscard]] Result<PackedTypes> packed_types(VoxelRegistry plain, std::span<const std::filesystem::path> packs);

/// A scene under edit, its file, and its undo history. A world on disk is streamed: chunks come and go, and edits are
/// saved as they are made.
///
/// Edits need exclusive access to the scene: its renderer must be paused (ViewBackend::pause).
class Document {
 public:
  /// An empty scene without a name.
  Document() = default;
  Document(LoadedScene loaded, std::filesystem::path path);
  Document(WorldWindow world, std::filesystem::path path);

  /// Reads any file that `load_scene` reads. Ignores `show_hidden`: hidden parts stay hidden, and the renderer may draw
  /// them. No chunk of a world on disk is read yet. Errors: those of load_scene and WorldWindow::open.
  [[nodiscard]] static Result<std::unique_ptr<Document>> open(const std::filesystem::path& path,
                                                              const LoadOptions& options = {},
                                                              const Progress& progress = {},
                                                              const WorldOptions& world = {},
                                                              PackFallback fallback = PackFallback::Error);

  [[nodiscard]] const Scene& scene() const { return loaded().scene; }
  [[nodiscard]] const LoadedScene& loaded() const { return world_ ? world_->opened() : loaded_; }
  /// Null if the document is not a world on disk.
  [[nodiscard]] WorldWindow* world() { return world_.get(); }
  [[nodiscard]] const WorldWindow* world() const { return world_.get(); }
  /// Returns the types as read, before LoadOptions::packs gave them looks. Null for a world on disk, whose file stores
  /// its looks, and for a scene file (reopens_for_looks).
  [[nodiscard]] const VoxelRegistry* plain_types() const { return world_ || is_scene_file_ ? nullptr : &plain_types_; }
  /// Returns true if the file must be read again to show the looks of other packs: a scene file can name packs, which
  /// form one stack with those of LoadOptions.
  [[nodiscard]] bool reopens_for_looks() const { return is_scene_file_; }
  /// Replaces the looks of the types that were read. Types that the user added stay. Not an undo step, and no change to
  /// save. Requires: plain_types() is not null, and `types` were made of them (packed_types).
  void set_looks(const VoxelRegistry& types);
  /// Returns the reason to show if the document cannot be edited, else null.
  [[nodiscard]] const char* why_not_edited() const;
  /// Empty if the scene has no file.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Returns true if the document can be saved to its own file without asking: the format can be written, and the file
  /// is not a scene file that refers to model files, whose models would be written into it.
  [[nodiscard]] bool can_save_in_place() const;
  /// Returns the path to propose for saving: its own if that format can be written and holds the content, else one in
  /// the same folder with a format that does.
  [[nodiscard]] std::filesystem::path proposed_path() const;
  /// Returns the name for titles: the file's name, or "empty scene".
  [[nodiscard]] std::string name() const;
  /// Returns true if closing now would lose changes. A world on disk saves itself, also when it is closed, and loses
  /// only changes whose save failed (`note_saving`).
  [[nodiscard]] bool is_dirty() const { return world_ ? has_failed_ : history_.state() != saved_state_; }
  /// Records the outcome of the last save of a world on disk.
  void note_saving(const Status& outcome) { has_failed_ = !outcome; }
  /// Returns the current face counts of the drawn parts. Cost: that of the edits since the last call; the constructor
  /// counts all faces. Requires: no edit is under way on another thread.
  [[nodiscard]] const FaceCounts& faces() { return faces_.update(scene()); }

  /// Begins a stroke with its first touch at `hit`, on voxels or on the surface of a field. Returns false and begins
  /// none if the instance or its grid is gone, the brush's type is not registered, or the action works on fields only
  /// and voxels were hit. `look`: direction of the view at the hit, in the world; voxels turn by it (Brush::turns).
  bool begin_stroke(const Brush& brush, const SceneHit& hit, DVec3 look = DVec3(0.0));
  /// Continues the stroke without gaps to the point where a ray of the world meets the layer or plane of the first
  /// touch, or to `hit` if the action follows the surface. Returns the number of voxels changed.
  std::int64_t drag_to(const Ray& ray_in_world, const std::optional<SceneHit>& hit);
  /// Ends the stroke; all of it is one undo step.
  void end_stroke();
  [[nodiscard]] const Brush* stroke_brush() const { return stroke_ ? &stroke_->brush : nullptr; }

  [[nodiscard]] const EditHistory& history() const { return history_; }
  /// Return false if there is no step to undo (redo), during a stroke, or if chunks of the step are not in memory.
  bool undo();
  bool redo();

  /// Shows or hides an instance, a group or a layer, as an undo step. Returns false if the node does not exist, is
  /// already so, or during a stroke.
  bool show(const SceneNode& node, bool is_visible);

  /// Returns an opaque type of that colour and emission, and adds one if there is none. Errors: LimitExceeded.
  [[nodiscard]] Result<VoxelType> type_of_colour(Rgba8 colour, float emission = 0.0F);

  /// Returns the losses of saving to that path, a line each, except accepted ones: content that the format does not
  /// hold, and changes by another program to the document's own file since it was read. Errors: those of
  /// unsupported_features.
  [[nodiscard]] Result<std::vector<std::string>> losses(const std::filesystem::path& path) const;
  /// Records that the user accepts these losses; later saves do not ask about them again.
  void accept_unsupported(const std::vector<std::string>& losses) {
    accepted_unsupported_.insert(losses.begin(), losses.end());
    has_newly_accepted_ = true;
  }
  /// Returns the path of the backup that `write` makes of an existing file; empty if it makes none.
  [[nodiscard]] std::filesystem::path kept_as(const std::filesystem::path& path) const;

  /// Writes .quoin, .vox, .json or .glb, by the extension. Only reads the scene. A world on disk is flushed to its own
  /// path, or copied to another path, which must end in .quoin. An existing file is kept as NAME~ (see FileBackup),
  /// unless it is a mesh. A backup made because saving lost something stays: later saves to that path neither replace
  /// it nor make another, until something else is lost.
  /// Errors: Unsupported for other endings; those of save_scene, FileBackup, mesh_scene and write_mesh; Cancelled.
  [[nodiscard]] Status write(const std::filesystem::path& path, std::vector<std::string>& warnings,
                             const Progress& progress = {}) const;
  /// Records that `state` was written: the document is not dirty while it is in that state. A .vox or .json becomes the
  /// document's own file. A mesh is only a copy, which loses voxels, and changes nothing here.
  void note_written(const std::filesystem::path& path, std::uint64_t state);

 private:
  struct Stroke {
    Brush brush;
    GridHandle grid;
    InstanceHandle instance;
    StrokeLayer layer;
    IVec3 last{0};
    std::optional<SurfacePlace> surface;  ///< start of a stroke on a field
    DVec3 last_point{0.0};
  };

  [[nodiscard]] static Result<std::unique_ptr<Document>> open_scene_file(const DetectedFile& file, LoadOptions options,
                                                                         const Progress& progress,
                                                                         PackFallback fallback,
                                                                         const std::optional<FileStamp>& stamp);
  [[nodiscard]] Scene& edited_scene() { return world_ ? world_->scene() : loaded_.scene; }
  [[nodiscard]] Status write_world(const std::filesystem::path& path, std::vector<std::string>& warnings,
                                   const Progress& progress) const;
  std::int64_t touch(IVec3 voxel);
  std::int64_t touch_surface(DVec3 point);
  std::int64_t drag_surface(const Ray& ray_in_world, const std::optional<SceneHit>& hit, const Instance& instance,
                            const SceneGrid& grid);

  LoadedScene loaded_;                  // unused if this is a world
  VoxelRegistry plain_types_;           // of `loaded_` as read, without packs
  bool is_scene_file_ = false;          // as opened
  std::unique_ptr<WorldWindow> world_;  // null if this is not a world
  bool has_failed_ = false;             // the world's last save
  SceneFaces faces_;
  std::filesystem::path path_;
  EditHistory history_;
  std::uint64_t saved_state_ = 0;
  std::optional<FileStamp> stamp_;  ///< stamp of `path_` when it was read or written
  std::set<std::string> accepted_unsupported_;
  bool has_newly_accepted_ = false;            ///< since the last write
  std::set<std::filesystem::path> originals_;  ///< files whose backup holds content that saving lost
  std::optional<Stroke> stroke_;
};

/// Returns true if a document can be saved to that path: it ends in .vox, .json or .glb.
[[nodiscard]] bool can_write(const std::filesystem::path& path);

}  // namespace quoin::viewer
