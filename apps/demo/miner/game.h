#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <quoin/live/live_meshes.h>
#include <quoin/scene/sweep.h>

namespace miner {

struct GameOptions {
  int units = 32;          ///< of 32 voxels along x and z; the world is 8 high
  int ships = 200;         ///< that fly about and bounce off what they meet
  int edits = 20;          ///< a frame, scattered over the land: what other players do
  int slide_chunks = 0;    ///< chunks that a landslide touches in a frame; 0: none
  std::uint64_t seed = 7;  ///< of the land, the ships and the edits
};

/// What the player wants in a frame.
struct Input {
  quoin::DVec3 walk{0.0};  ///< in the world, level, at most 1 long
  double yaw = 0.0;        ///< of the eye, in radians about y; 0 looks along -z
  double pitch = 0.0;      ///< above the horizon
  bool jumps = false;
  bool digs = false;    ///< a ball of radius 2 out of what is looked at
  bool lights = false;  ///< a torch onto what is looked at
};

/// What a frame took of the caller's thread, in milliseconds.
struct FrameTimes {
  enum Part : std::uint8_t { Edits, Sand, Tracer, Ships, Player, Meshes };
  static constexpr std::size_t kParts = 6;
  static constexpr std::array<const char*, kParts> kNames = {"edits", "sand", "tracer", "ships", "player", "meshes"};
  std::array<double, kParts> parts{};
  double total = 0.0;
};

/// A landscape of blocks with caves, a player who walks and digs in it, sand that falls, ships, and others' edits.
///
/// Threads: all calls come from one; meshes are made by workers.
class Game {
 public:
  /// Errors: as generate_terrain.
  [[nodiscard]] static quoin::Result<std::unique_ptr<Game>> create(const GameOptions& options);

  /// A sixtieth of a second.
  FrameTimes step(const Input& input);

  [[nodiscard]] const quoin::Scene& scene() const { return scene_; }
  [[nodiscard]] quoin::LiveMeshes& meshes() { return meshes_; }
  [[nodiscard]] quoin::DVec3 eye() const { return player_.centre + quoin::DVec3(0.0, 0.7, 0.0); }
  [[nodiscard]] const quoin::SlideResult& player() const { return moved_; }
  [[nodiscard]] std::int64_t sand_fallen() const { return sand_fallen_; }
  /// Bytes of the land's voxels and of all trees.
  struct Memory {
    std::size_t voxels = 0, trees = 0;
  };
  [[nodiscard]] Memory memory() const;

 private:
  struct Ship {
    quoin::InstanceHandle instance;
    quoin::OrientedBox box;
    quoin::DVec3 velocity{0.0};
  };

  explicit Game(const GameOptions& options) : options_(options), state_(options.seed) {}
  [[nodiscard]] quoin::Status make_land();
  [[nodiscard]] quoin::Status add_ships();
  void place_player();
  double random(double low, double high);
  [[nodiscard]] quoin::Grid& land() { return scene_.edit(land_).grid; }
  [[nodiscard]] int surface_at(int x, int z) const;
  void edit_elsewhere();
  void slide();
  void note_changes();
  void drop_sand();
  void act(const Input& input);
  void fly();
  void walk(const Input& input);

  GameOptions options_;
  std::uint64_t state_;
  quoin::Scene scene_;
  quoin::GridHandle land_;
  quoin::VoxelType sand_ = 0, torch_ = 0, stone_ = 0;
  quoin::IVec3 size_{0};
  std::vector<std::int16_t> heights_;  // as generated, by x and z
  std::optional<quoin::SceneTracer> tracer_;
  quoin::LiveMeshes meshes_;
  std::vector<Ship> ships_;
  quoin::OrientedBox player_{{0, 0, 0}, {0.3, 0.9, 0.3}};
  quoin::DVec3 falling_{0.0};
  quoin::SlideResult moved_;
  quoin::Instance floor_;  // as it was in the last frame
  quoin::ChangeCursor changes_;
  quoin::Grid known_;                // the land when `changes_` was read
  std::vector<quoin::IVec3> loose_;  // voxels whose support has to be looked at
  std::int64_t sand_fallen_ = 0;
};

}  // namespace miner
