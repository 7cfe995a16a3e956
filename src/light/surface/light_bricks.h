#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/vec.h>
#include <quoin/light/scene_light.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// Light around the surfaces of a scene's grids as shaders read it: a table of bricks of 8^3 voxels, those with a voxel
/// of any kind and those beside them.
struct LightBricks {
  static constexpr int kEdge = 8;
  /// 512 words of light, two a number, the lower x in the lower half; then a bit a voxel: whether light gets there.
  static constexpr std::size_t kNumbers = 256 + 16;
  static constexpr std::uint32_t kIsUniform = 0x8000'0000U;

  /// Open addressing by `slot_of`.
  struct Brick {
    IVec3 brick{0};  ///< voxel coordinates / 8, rounded down
    std::int32_t grid = 0;
    std::uint32_t is_held = 0;  ///< 0: the slot is free
    std::uint32_t what = 0;     ///< where its numbers begin; or kIsUniform | light, where all of it is alike and passes
    std::uint32_t pad[2]{};
  };
  std::vector<Brick> bricks;  ///< a power of two. Of a brick that is not there all is opaque
  std::vector<std::uint32_t> numbers;
  std::vector<GridHandle> grids;  ///< in their order; a brick's grid is an index

  [[nodiscard]] static std::uint32_t slot_of(IVec3 brick, std::int32_t grid);
  /// Requires: it is one of `grids`.
  [[nodiscard]] std::int32_t index_of(GridHandle grid) const;
};

/// Keeps light and table of a scene, made when they are first asked for after an `update`.
/// Threads: any number may ask.
class LightCache {
 public:
  /// The scene was edited, or is another.
  void update();
  /// Light of the scene as it is now. Lifetime: until the next update.
  [[nodiscard]] const SceneLight& light(const Scene& scene, Threads threads);
  /// Cost: when it is made, beside that of the light, about 2 ms a chunk, of all chunks.
  [[nodiscard]] std::shared_ptr<const LightBricks> bricks(const Scene& scene, Threads threads);

 private:
  [[nodiscard]] const SceneLight& up_to_date(const Scene& scene, Threads threads);

  std::mutex mutex_;
  SceneLight light_;
  bool is_lit_ = false;
  std::shared_ptr<const LightBricks> bricks_;
};

}  // namespace quoin
