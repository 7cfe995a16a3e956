#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

namespace [[gnu::visibility("default")]] quoin {

/// An edit as data, to be stored, sent and replayed. Its effect on a voxel or sample depends only on that voxel or
/// sample, so it can be applied chunk by chunk, as chunks are loaded.
struct WorldEdit {
  /// Like Grid::set for several voxels.
  struct SetVoxels {
    std::vector<PlacedVoxel> voxels;
    bool operator==(const SetVoxels&) const = default;
  };
  /// Like Grid::set_data.
  struct SetData {
    IVec3 voxel{0};
    std::uint32_t state = 0;
    std::vector<std::byte> bytes{};
    bool operator==(const SetData&) const = default;
  };
  /// Like Grid::fill_box.
  struct FillBox {
    IBox box;
    VoxelType type = kAir;
    bool operator==(const FillBox&) const = default;
  };
  /// Like Grid::fill_sphere.
  struct FillSphere {
    DVec3 centre{0.0};
    double radius = 0.0;
    VoxelType type = kAir;
    bool operator==(const FillSphere&) const = default;
  };
  /// Like DensityGrid::add_sphere, or remove_sphere with kAir.
  struct FieldSphere {
    DVec3 centre{0.0};
    double radius = 0.0;
    double blend = 0.0;
    VoxelType material = kAir;
    bool operator==(const FieldSphere&) const = default;
  };
  /// Like DensityGrid::add_box, or remove_box with kAir.
  struct FieldBox {
    DVec3 min{0.0};
    DVec3 max{0.0};
    double rounding = 0.0;
    double blend = 0.0;
    VoxelType material = kAir;
    bool operator==(const FieldBox&) const = default;
  };
  using Content = std::variant<SetVoxels, SetData, FillBox, FillSphere, FieldSphere, FieldBox>;

  std::uint32_t grid = 0;  ///< the grid's number in the world (StreamedWorld::number_of), equal on all machines
  Content content;

  bool operator==(const WorldEdit&) const = default;
};

/// Maximum number of chunks that one edit may touch.
inline constexpr std::size_t kMaxEditChunks = 1U << 16;

/// Returns the chunks that an edit may change, without duplicates, sorted by z, then y, then x. `band` is the
/// DensityGrid::band of the grid's field.
/// Errors: LimitExceeded for more than kMaxEditChunks; InvalidArgument for sizes, positions and blends that are not
///         finite, or sizes and blends that are negative.
[[nodiscard]] Result<std::vector<IVec3>> chunks_of_edit(const WorldEdit& edit, float band = 8.0F);

/// Applies an edit to the loaded chunks of a grid. Returns the number of changed voxels or samples.
std::int64_t apply_edit(const WorldEdit& edit, Grid& grid, DensityGrid& field);

/// An edit with its position in the global order.
struct LoggedEdit {
  std::uint64_t number = 0;  ///< greater is later
  std::uint32_t author = 0;  ///< orders edits with equal numbers: lower authors first
  WorldEdit edit;

  bool operator==(const LoggedEdit&) const = default;
};

/// An ordered log of edits, to send from a server to players or to store for replay.
///
/// Same bytes: equal logs applied to equal worlds give equal worlds, on any machine.
/// Merging:    logs of several authors are merged by number, then author. Merging a log twice has no further effect.
class EditLog {
 public:
  /// Appends an edit. Requires: its (number, author) is greater than the last edit's.
  void add(LoggedEdit edit);
  [[nodiscard]] const std::vector<LoggedEdit>& edits() const { return edits_; }
  [[nodiscard]] bool empty() const { return edits_.empty(); }

  /// Returns all edits of both logs, each (number, author) once. Errors: InvalidArgument if two different edits have
  /// the same number and author.
  [[nodiscard]] static Result<EditLog> merged(const EditLog& a, const EditLog& b);

  /// Encodes the log (docs/formats/edit_log.md), with a checksum per edit.
  [[nodiscard]] std::vector<std::byte> encode() const;
  /// Decodes a log. Errors: BadFormat, with the offset, for a wrong, missing or extra byte; no edits are returned.
  [[nodiscard]] static Result<EditLog> decode(std::span<const std::byte> bytes);

 private:
  std::vector<LoggedEdit> edits_;
};

}  // namespace quoin
