#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <tsl/robin_map.h>

#include <quoin/grid/grid.h>
#include <quoin/render/impostor.h>

#include "render/impostor_faces.h"

namespace quoin {

/// Finds the faces that snapshots of a grid see.
class ImpostorBuilder {
 public:
  /// All must outlive it. `opaque`: the grid's tree of opaque voxels, which is not empty.
  ImpostorBuilder(const Grid& grid, const VoxelRegistry& types, const OccupancyTree& opaque,
                  const ContentSphere& content);

  [[nodiscard]] ImpostorFaces build(InstructionSet instructions);

 private:
  static constexpr int kLevels = ImpostorFaces::kLevels;
  struct Place {
    IVec3 voxel{0};
    Direction direction = Direction::PosX;
    bool operator==(const Place&) const = default;
  };
  struct PlaceHash {
    std::size_t operator()(const Place& place) const;
  };
  struct Seen {
    Place place;
    std::array<std::uint32_t, kLevels> views{};  // by level
  };

  void take(int view, InstructionSet instructions);
  void see(const Place& place, int view, int column, int row);
  Seen& seen_at(const Place& place);
  // Adds the faces that share an edge with one that was seen: slivers that no texel's ray met.
  void add_neighbours();
  [[nodiscard]] Place neighbour(const Place& place, int axis, int sign) const;
  void sort();
  void put_faces(ImpostorFaces& faces) const;
  void put_level(int level, ImpostorFaces& faces) const;

  const Grid* grid_;
  const VoxelRegistry* types_;
  const OccupancyTree* opaque_;
  ContentSphere content_;
  std::vector<Seen> seen_;
  tsl::robin_map<Place, std::uint32_t, PlaceHash> index_;
  std::uint32_t last_ = 0;
};

}  // namespace quoin
