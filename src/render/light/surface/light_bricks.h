#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include <quoin/core/changes.h>
#include <quoin/core/parallel.h>
#include <quoin/core/vec.h>
#include <quoin/render/propagated_light.h>
#include <quoin/scene/scene.h>

namespace quoin {

class LightRows;

/// The light around the surfaces of a scene's grids, as a shader-readable table of 8^3 bricks. It contains bricks with
/// voxels and their neighbours, and follows edits.
class LightBricks {
 public:
  static constexpr int kEdge = 8;
  /// 512 words of light, two per number, the lower x in the lower half; then one bit per voxel, set if light passes.
  static constexpr std::size_t kNumbers = 256 + 16;
  static constexpr std::uint32_t kIsUniform = 0x8000'0000U;
  static constexpr std::uint32_t kAllOpaque = 0xFFFF'FFFFU;

  /// Open addressing by `slot_of`.
  struct Brick {
    IVec3 brick{0};  ///< voxel coordinates / 8, rounded down
    std::int32_t grid = 0;
    std::uint32_t is_held = 0;        ///< 0: the slot is free
    std::uint32_t what = kAllOpaque;  ///< index of its first number; kIsUniform | light, if uniform and light passes;
                                      ///< or kAllOpaque, as for missing bricks
    std::uint32_t pad[2]{};
  };
  /// The changes since the last call.
  struct Changed {
    bool all = true;
    std::vector<std::uint32_t> slots{};
    std::vector<std::uint32_t> numbers{};  ///< index of each brick's first number
  };

  /// Takes over the changes of the scene. Requires: `light` is up to date.
  /// Cost: some microseconds per brick with changed light, or next to added or removed voxels; all bricks if types or
  /// grids were added, changed or removed.
  void update(const Scene& scene, const SceneLight& light, Threads threads);

  [[nodiscard]] std::span<const Brick> bricks() const { return bricks_; }  ///< a power of two
  [[nodiscard]] std::span<const std::uint32_t> numbers() const { return numbers_; }
  [[nodiscard]] static std::uint32_t slot_of(IVec3 brick, std::int32_t grid);
  /// Returns the index stored in a brick's `grid`. Requires: the scene of the last update contains the grid.
  [[nodiscard]] std::int32_t index_of(GridHandle grid) const;
  [[nodiscard]] Changed take_changes() { return std::exchange(changed_, {false, {}, {}}); }

 private:
  using Occupied = std::array<std::uint64_t, 8>;  // [z]: bit x + 8 y
  struct OfGrid {
    GridHandle handle;
    ChangeCursor followed_voxels;
    ChangeCursor followed_light;
    std::unordered_map<IVec3, Occupied, CoordinateHash> occupied;  // by chunk
  };
  // The computed content of a brick; no numbers if it is uniform or opaque.
  struct Found {
    IVec3 brick{0};
    std::uint32_t what = kAllOpaque;
    std::vector<std::uint32_t> numbers{};
  };

  void begin_anew(const Scene& scene);
  [[nodiscard]] static std::vector<IVec3> bricks_to_find(OfGrid& of, const GridLight& light, const GridChanges& voxels,
                                                         const GridChanges& levels);
  static void look_at_chunk(OfGrid& of, const GridLight& light, IVec3 chunk);
  [[nodiscard]] static bool is_at_surface(const OfGrid& of, IVec3 brick);
  [[nodiscard]] static Found find(const OfGrid& of, LightRows& rows, IVec3 brick);
  void put(std::int32_t grid, Found found);
  [[nodiscard]] std::size_t find_slot(IVec3 brick, std::int32_t grid) const;
  void grow();

  std::vector<Brick> bricks_{1};
  std::size_t held_ = 0;
  std::vector<std::uint32_t> numbers_;
  std::vector<std::uint32_t> free_;  // where numbers may begin
  std::vector<OfGrid> grids_;        // in the order of their handles
  ChangeCursor followed_types_;
  bool is_unfinished_ = false;  // the last update threw
  Changed changed_;
};

/// Keeps the light and bricks of a scene, updated at the first request after an `update`.
/// Threads: any number may request light; bricks are for one thread.
class LightCache {
 public:
  /// Call after the scene was edited or replaced.
  void update();
  /// Light that somebody else keeps, from now on; null: its own. It changes only together with the scene.
  void use(const SceneLight* light);
  /// Light of the scene as it is now, or that in use. Lifetime: until the next update.
  [[nodiscard]] const SceneLight& light(const Scene& scene, Threads threads);
  [[nodiscard]] LightBricks& bricks(const Scene& scene, Threads threads);

 private:
  std::mutex mutex_;
  SceneLight light_;
  const SceneLight* lent_ = nullptr;
  LightBricks bricks_;
  bool is_lit_ = false;
  bool has_bricks_ = false;
};

}  // namespace quoin
