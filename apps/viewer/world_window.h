#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <quoin/scene/camera.h>
#include <quoin/store/world_care.h>
#include <quoin/stream/streamed_world.h>

namespace quoin::viewer {

/// How a world on disk is opened.
struct WorldOptions {
  std::size_t memory_bytes = 0;  ///< for its chunks and what is made of them; 0: a quarter of `available_memory`
  /// World units around the camera within which all is loaded, where memory suffices; 0: 640 of the smallest voxels.
  double distance = 0.0;
  bool may_write = true;  ///< what is edited, and what generators make, is saved
};

/// A world on disk (`.quoin`) of which what lies around the camera is in memory; a small one is there as a whole.
///
/// Edits are saved as they are made. A world that another program writes, or that may not be written, is opened to be
/// looked at.
/// Threads: one at a time; `plan` only reads the scene, which others may read meanwhile.
class WorldWindow {
 public:
  /// Nothing of it is loaded yet. Errors: as StreamedWorld::open.
  [[nodiscard]] static Result<WorldWindow> open(const std::filesystem::path& path, const WorldOptions& options);

  [[nodiscard]] Scene& scene() { return world_.scene(); }
  [[nodiscard]] const Scene& scene() const { return world_.scene(); }
  [[nodiscard]] const LoadedScene& opened() const { return world_.opened(); }
  /// Empty where edits are saved; else why not, for people.
  [[nodiscard]] const std::string& why_not_written() const { return why_not_written_; }
  /// Where one stands at first: what the world says, else above the middle of what is stored, or of the landscape.
  [[nodiscard]] Camera first_camera(double aspect) const;
  /// Whether all of it is in memory once it is complete, wherever the camera is.
  [[nodiscard]] bool is_whole() const { return all_.has_value(); }
  /// Of what there is to be seen from a place: for speeds and distances.
  [[nodiscard]] DBox bounds(DVec3 from) const;

  /// Bytes that whoever draws the scene holds because of it; they count as the world's.
  void set_other_bytes(std::size_t bytes) { *other_bytes_ = bytes; }
  /// Says where the camera is, and saves what was edited a second ago. Errors: those of saving: it is tried again.
  Status plan(const Camera& camera);
  /// Whether `move` would change the scene.
  [[nodiscard]] bool has_chunks_to_move() const { return world_.has_chunks_to_move(); }
  /// Puts chunks in place and takes others away, for some milliseconds. Errors: as plan.
  Status move(const Camera& camera);
  /// Whether all that is wanted from where the camera is is in place.
  [[nodiscard]] bool is_complete() const;
  /// Whether the ground around a point of the world, and below it, is in memory, as far as it will ever be.
  [[nodiscard]] bool is_loaded_at(DVec3 point) const;
  /// Saves all that was edited, and returns once it is on disk. Errors: as StreamedWorld::flush.
  Status flush() { return world_.flush(); }
  /// Saves all, and copies the world, in place of what is there. Errors: as flush and copy_world.
  Result<WorldCopy> copy_to(const std::filesystem::path& path, const Progress& progress = {});

  /// For people: "1204 chunks, 96 MB, all within 420".
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
  std::optional<Viewer> all_;  ///< of a small world
  StreamStats stats_;
};

}  // namespace quoin::viewer
