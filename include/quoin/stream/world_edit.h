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

namespace quoin {

/// An edit as data, which can be kept, sent and repeated elsewhere. What it does to a voxel or sample depends on that
/// alone, and on nothing beside it, so that it can be done chunk by chunk, each when it is loaded.
struct WorldEdit {
  /// As Grid::set of several.
  struct SetVoxels {
    std::vector<PlacedVoxel> voxels;
    bool operator==(const SetVoxels&) const = default;
  };
  /// As Grid::set_data.
  struct SetData {
    IVec3 voxel{0};
    std::uint32_t state = 0;
    std::vector<std::byte> bytes{};
    bool operator==(const SetData&) const = default;
  };
  /// As Grid::fill_box.
  struct FillBox {
    IBox box;
    VoxelType type = kAir;
    bool operator==(const FillBox&) const = default;
  };
  /// As Grid::fill_sphere.
  struct FillSphere {
    DVec3 centre{0.0};
    double radius = 0.0;
    VoxelType type = kAir;
    bool operator==(const FillSphere&) const = default;
  };
  /// As DensityGrid::add_sphere; with kAir remove_sphere.
  struct FieldSphere {
    DVec3 centre{0.0};
    double radius = 0.0;
    double blend = 0.0;
    VoxelType material = kAir;
    bool operator==(const FieldSphere&) const = default;
  };
  /// As DensityGrid::add_box; with kAir remove_box.
  struct FieldBox {
    DVec3 min{0.0};
    DVec3 max{0.0};
    double rounding = 0.0;
    double blend = 0.0;
    VoxelType material = kAir;
    bool operator==(const FieldBox&) const = default;
  };
  using Content = std::variant<SetVoxels, SetData, FillBox, FillSphere, FieldSphere, FieldBox>;

  std::uint32_t grid = 0;  ///< the grid's number in the world (StreamedWorld::number_of), the same on all machines
  Content content;

  bool operator==(const WorldEdit&) const = default;
};

/// Chunks of one edit at most.
inline constexpr std::size_t kMaxEditChunks = 1U << 16;

/// The chunks that an edit may change, each once, sorted by z, then y, then x. `band`: of the grid's field.
/// Errors: LimitExceeded where there are more than kMaxEditChunks; InvalidArgument for sizes, places and blends that
///         are not finite or negative.
[[nodiscard]] Result<std::vector<IVec3>> chunks_of_edit(const WorldEdit& edit, float band = 8.0F);

/// Does it to what is loaded of a grid. Returns how many voxels or samples changed.
std::int64_t apply_edit(const WorldEdit& edit, Grid& grid, DensityGrid& field);

/// An edit with its place in the order of all.
struct LoggedEdit {
  std::uint64_t number = 0;  ///< the greater the later
  std::uint32_t author = 0;  ///< of edits with one number that of the least author comes first
  WorldEdit edit;

  bool operator==(const LoggedEdit&) const = default;
};

/// Edits in their order: what a server sends to its players, or a game keeps to replay.
///
/// Same bytes: whoever applies equal logs to equal worlds has equal worlds, on any machine.
/// Merging:    logs of several authors are merged by number, then author. What was merged once may be merged again.
class EditLog {
 public:
  /// Requires: it comes after the last one (number, author).
  void add(LoggedEdit edit);
  [[nodiscard]] const std::vector<LoggedEdit>& edits() const { return edits_; }
  [[nodiscard]] bool empty() const { return edits_.empty(); }

  /// All edits of both, each (number, author) once. Errors: InvalidArgument where two of one number and author differ.
  [[nodiscard]] static Result<EditLog> merged(const EditLog& a, const EditLog& b);

  /// The log as bytes (docs/formats/edit_log.md), with a checksum an edit.
  [[nodiscard]] std::vector<std::byte> encode() const;
  /// Errors: BadFormat, with the offset, where a byte is wrong, missing or left over; nothing is taken then.
  [[nodiscard]] static Result<EditLog> decode(std::span<const std::byte> bytes);

 private:
  std::vector<LoggedEdit> edits_;
};

}  // namespace quoin
