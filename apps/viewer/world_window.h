#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <quoin/scene/camera.h>
#include <quoin/store/world_maintenance.h>
#include <quoin/stream/streamed_world.h>

namespace quoin::viewer {

/// Options for opening a world on disk.
struct WorldOptions {
  std::size_t memory_bytes = 0;  ///< for chunks and derived data; 0: a quarter of `available_memory`
  /// Load distance around the camera in world units, if memory suffices; 0: 640 of the smallest voxels.
  double distance = 0.0;
  bool may_write = true;  ///< saves edits and generated chunks
};

/// A world on disk (`.quoin`). The surroundings of the camera are in memory; a small world is loaded as a whole.
///
/// Edits are saved as they are made. A world that another program writes, or that is not writable, opens read-only.
/// Threads: one at a time; `plan` only reads the scene, and other threads may read it meanwhile.
class WorldWindow {
 public:
  /// Opens a world without loading chunks. Errors: those of StreamedWorld::open.
  [[nodiscard]] static Result<WorldWindow> open(const std::filesystem::path& path, const WorldOptions& options);

  [[nodiscard]] Scene& scene() { return world_.scene(); }
  [[nodiscard]] const Scene& scene() const { return world_.scene(); }
  [[nodiscard]] const LoadedScene& opened() const { return world_.opened(); }
  /// Returns the reason to show if edits are not saved, else an empty string.
  [[nodiscard]] const std::string& why_not_written() const { return why_not_written_; }
  /// Returns the world's own camera, or one above the middle of the stored chunks or of the landscape.
  [[nodiscard]] Camera first_camera(double aspect) const;
  /// Returns true if all of the world is in memory once it is complete, wherever the camera is.
  [[nodiscard]] bool is_whole() const { return all_.has_value(); }
  /// Returns bounds of the visible parts around a point, the scale of speeds and distances.
  [[nodiscard]] DBox bounds(DVec3 from) const;

  /// Sets the bytes that the renderer holds for the scene; they count towards the world's memory.
  void set_other_bytes(std::size_t bytes) { *other_bytes_ = bytes; }
  /// Requests the chunks around the camera, and saves edits after a second. Errors: those of saving, which is retried.
  Status plan(const Camera& camera);
  /// Returns true if `move` would change the scene.
  [[nodiscard]] bool has_chunks_to_move() const { return world_.has_chunks_to_move(); }
  /// Inserts loaded chunks and removes others, for some milliseconds. Errors: those of plan.
  Status move(const Camera& camera);
  /// Returns true if all chunks requested for the camera are in place.
  [[nodiscard]] bool is_complete() const;
  /// Returns true if the ground around and below a point of the world is loaded, as far as it can be.
  [[nodiscard]] bool is_loaded_at(DVec3 point) const;
  /// Saves all edits and returns once they are on disk. Errors: those of StreamedWorld::flush.
  Status flush() { return world_.flush(); }
  /// Saves all edits and copies the world, replacing an existing file. Errors: those of flush and copy_world.
  Result<WorldCopy> copy_to(const std::filesystem::path& path, const Progress& progress = {});

  /// Returns the state to show, such as "1204 chunks, 96 MB, all within 420".
  [[nodiscard]] std::string text() const;
  [[nodiscard]] const StreamStats& stats() const { return stats_; }
  [[nodiscard]] std::vector<std::string> take_problems() { return world_.take_problems(); }

 private:
  WorldWindow(StreamedWorld world, const WorldOptions& options, std::shared_ptr<std::size_t> other_bytes);
  [[nodiscard]] std::vector<Viewer> viewers(const Camera& camera) const;
  [[nodiscard]] double chunks_around(double radius) const;

  StreamedWorld world_;
  WorldOptions options_;
  std::shared_ptr<std::size_t> other_bytes_;
  std::string why_not_written_;
  WorldExtent extent_;
  std::optional<Viewer> all_;  ///< covers all of a small world
  StreamStats stats_;
};

}  // namespace quoin::viewer
