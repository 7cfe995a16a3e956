#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <quoin/quoin.h>

namespace miner {

inline constexpr double kFrame = 1.0 / 60.0;

struct GameOptions {
  int units = 32;          ///< world size along x and z, in units of 32 voxels; the world is 8 units high
  int ships = 200;         ///< ships that fly about and bounce off obstacles
  int edits = 20;          ///< edits per frame, scattered over the land like those of other players
  int slide_chunks = 0;    ///< chunks that a landslide touches per frame; 0: none
  bool meshes = true;      ///< makes meshes for a renderer
  std::uint64_t seed = 7;  ///< for the land, the ships and the edits
  std::string world;       ///< the .quoin file that stores the land; empty: none
};

/// The player's input of a frame.
struct Input {
  double ahead = 0.0, aside = 0.0;  ///< -1 to 1
  double yaw = 0.0, pitch = 0.0;    ///< view direction in radians: yaw 0 looks along -z; pitch is above the horizon
  bool jumps = false;
  bool digs = false, places = false, slides = false;  ///< at the targeted voxel: dig, place a stone, drop sand
  int torch = -1;                                     ///< colour, 0 to 2, of a torch to place there; -1: none
};

/// The time that a frame and its parts took on the caller's thread, in milliseconds.
using FrameTimes = std::map<std::string, double>;

/// A block landscape with caves, a player who walks and digs, falling sand, ships, and edits by other players.
class Game {
 public:
  /// Continues an existing world. Errors: those of generate_terrain and of the world file.
  [[nodiscard]] static quoin::Result<std::unique_ptr<Game>> create(const GameOptions& options);

  /// Advances the game by 1/60 s.
  FrameTimes step(const Input& input);
  /// Returns once all of the world is on disk. Errors: those of saving.
  [[nodiscard]] quoin::Status finish();

  [[nodiscard]] const quoin::Scene& scene() const { return scene_; }
  [[nodiscard]] const quoin::SceneTracer& tracer() const { return *tracer_; }
  [[nodiscard]] quoin::LiveLight& light() { return light_; }
  [[nodiscard]] quoin::LiveMeshes& meshes() { return meshes_; }
  [[nodiscard]] quoin::DVec3 eye() const { return player_.centre + quoin::DVec3(0.0, 0.7, 0.0); }
  [[nodiscard]] quoin::Camera camera() const { return quoin::look_along(eye(), gaze_, 1.2).value(); }
  [[nodiscard]] const quoin::SlideResult& player() const { return moved_; }
  [[nodiscard]] std::int64_t sand_fallen() const { return sand_fallen_; }
  /// Returns the player's position and the light levels there, of sky and lamps.
  [[nodiscard]] std::string status() const;
  [[nodiscard]] std::size_t voxel_bytes() const { return known_.bytes(); }

 private:
  struct Ship {
    quoin::InstanceHandle instance;
    quoin::OrientedBox box;
    quoin::DVec3 velocity{0.0};
  };

  explicit Game(const GameOptions& options) : options_(options), state_(options.seed) {}
  [[nodiscard]] quoin::Status open_world();
  void save();
  [[nodiscard]] quoin::Status make_land();
  [[nodiscard]] quoin::Status add_ships();
  void place_player();
  double random(double low, double high);
  [[nodiscard]] quoin::Grid& land() { return scene_.edit(land_).grid; }
  [[nodiscard]] int surface_at(int x, int z) const;
  void edit_elsewhere();
  void drop_sand();
  void act(const Input& input);
  void fly();
  void walk(const Input& input);

  GameOptions options_;
  std::uint64_t state_;
  quoin::Scene scene_;
  quoin::GridHandle land_;
  quoin::VoxelType sand_ = 0, stone_ = 0;
  std::array<quoin::VoxelType, 3> torches_{};
  quoin::IVec3 size_{0};
  std::optional<quoin::SceneTracer> tracer_;
  quoin::LiveMeshes meshes_;
  quoin::LiveLight light_;
  std::vector<Ship> ships_;
  std::optional<quoin::WorldStore> world_;
  quoin::WorldSaver saver_;
  quoin::Status saved_;
  int frame_ = 0;
  quoin::OrientedBox player_{{0, 0, 0}, {0.3, 0.9, 0.3}};
  quoin::DVec3 falling_{0.0}, gaze_{0, 0, -1};
  quoin::SlideResult moved_;
  quoin::Instance floor_;  // as it was in the last frame
  quoin::ChangeCursor changes_;
  quoin::Grid known_;                // the land when `changes_` was read
  std::vector<quoin::IVec3> loose_;  // voxels whose support must be checked
  std::int64_t sand_fallen_ = 0;
};

/// Plays in a window until it is closed. `device` is the name or number of a Vulkan device; empty: a graphics card.
/// The processor draws if there is none or `device` is `cpu`. Errors: Unsupported without a display or such a device.
[[nodiscard]] quoin::Status play_in_window(Game& game, const std::string& device);

}  // namespace miner
