// The frame of a game in an endless world, as docs/games.md describes it. The player flies over the land and digs every
// half second. Workers load chunks and compute meshes, light and the tracer. Prints the time of the frames.
//
// usage: example_game_frame [WORLD [IMAGE]]
//   WORLD (default game.quoin) is created. If it exists, the game continues in it, with the holes of earlier runs.
//   IMAGE (default game.png) shows the last frame.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include <quoin/quoin.h>

namespace {

constexpr int kFrames = 120;
constexpr std::size_t kUploadBytes = std::size_t{4} << 20;

// The memory of the game. Here it is that of malloc, counted.
class Arena {
 public:
  void* allocate(std::size_t bytes, std::size_t alignment) noexcept {
    void* const block = std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
    if (block == nullptr) return nullptr;
    const std::size_t used = used_ += bytes;
    for (std::size_t most = most_; used > most && !most_.compare_exchange_weak(most, used);) continue;
    return block;
  }
  void free(void* block, std::size_t bytes) noexcept {
    used_ -= bytes;
    std::free(block);
  }
  [[nodiscard]] std::size_t most() const { return most_; }

 private:
  std::atomic<std::size_t> used_{0};
  std::atomic<std::size_t> most_{0};
};

class Game {
 public:
  Game() { meshes_.use_light(light_); }

  quoin::Status open(const std::string& path) {
    quoin::StreamOptions options;
    options.budget_bytes = std::size_t{512} << 20;
    options.other_bytes = [this] { return derived_bytes(); };  // counts in the budget
    auto world = quoin::StreamedWorld::open_or_create(path, options);
    if (!world) return world.error();
    world_.emplace(std::move(*world));
    if (!world_->is_new()) return {};
    const auto land = world_->add_terrain({.seed = 11});
    return land ? quoin::Status() : quoin::Status(land.error());
  }

  // Loads and meshes the surroundings before the first frame.
  quoin::Status load(const quoin::Viewer& player) {
    if (auto loaded = world_->load_all({&player, 1}); !loaded) return loaded;
    tracer_.finish(world_->scene());
    meshes_.finish(world_->scene(), player.position);
    upload(meshes_.take());
    return {};
  }

  void frame(quoin::Viewer& player, bool digs) {
    move(player);                          // physics
    if (digs) dig(player);                 // edit
    report(world_->update({&player, 1}));  // chunks arrive and leave, edits are saved
    tracer_.update(world_->scene());       // start workers on the changes
    meshes_.update(world_->scene(), player.position);
    tracer_.take();  // show their finished results
    upload(meshes_.take(kUploadBytes));
  }

  [[nodiscard]] std::size_t uploaded() const { return uploaded_; }

  // Saves everything. After an error the edits are still in memory: a game asks the player to free disk space, and
  // calls it again.
  quoin::Status flush() {
    for (const std::string& problem : world_->take_problems()) show(problem);
    return world_->flush();
  }

  quoin::Status draw(const quoin::Viewer& player, const std::string& path) {
    quoin::RenderOptions options;
    options.width = 480;
    options.height = 270;
    const auto camera = quoin::look_along(player.position, player.direction, 1.1);
    if (!camera) return camera.error();
    const auto image = quoin::CpuRenderer(world_->scene()).render(*camera, options);
    if (!image) return image.error();
    const auto written = quoin::write_png(image->colour, path);
    return written ? quoin::Status() : quoin::Status(written.error());
  }

 private:
  using SurfaceKey = std::tuple<quoin::GridHandle, quoin::SurfaceContent, int, int, int>;

  // The physics step: the player stays about 40 voxels above the ground that a ray finds.
  void move(quoin::Viewer& player) const {
    player.position.x += 1.0;
    const auto ground = first_hit(tracer_.shown(), {player.position, {0.0, -1.0, 0.0}});
    if (ground) player.position.y += std::clamp(40.0 - ground->t, -3.0, 3.0);
  }

  // Digs at the centre of the voxel that the player looks at. The ray hits the scene of a few frames ago; the edit
  // changes the current scene. If a chunk was unloaded meanwhile, `apply` still edits it; a direct edit would not.
  void dig(const quoin::Viewer& player) {
    const auto hit = first_hit(tracer_.shown(), {player.position, player.direction}, 300.0);
    if (!hit) return;
    const quoin::GridHandle grid = tracer_.shown().scene().instances()[hit->instance].grid;
    const auto number = world_->number_of(grid);
    if (!number) return;  // a whole grid: all of it is loaded, so Scene::edit and Grid::fill_sphere dig there
    const quoin::WorldEdit::FillSphere hole{quoin::DVec3(hit->voxel) + 0.5, 4.0, quoin::kAir};
    if (const auto dug = world_->apply({*number, hole}); !dug) show(quoin::to_string(dug.error()));
  }

  // Shows an error of `update` once. No edits are lost: they stay in memory, and a later `update` saves them. Each
  // `update` until then returns the error.
  void report(const quoin::Status& saved) {
    const std::string error = saved ? "" : quoin::to_string(saved.error());
    if (!error.empty() && error != save_error_) show(error);
    save_error_ = error;
  }
  static void show(const std::string& message) { std::fprintf(stderr, "%s\n", message.c_str()); }

  // A game copies the changed regions to its vertex buffers here, and deletes the buffers of a chunk without a surface.
  void upload(const std::vector<quoin::SurfaceUpdate>& updates) {
    for (const quoin::SurfaceUpdate& update : updates) {
      const SurfaceKey key{update.grid, update.content, update.chunk.x, update.chunk.y, update.chunk.z};
      const auto former = surfaces_.find(key);
      if (former != surfaces_.end()) {
        mesh_bytes_ -= former->second->bytes();
        surfaces_.erase(former);
      }
      if (update.surface == nullptr) continue;
      uploaded_ += update.surface->upload_bytes();
      mesh_bytes_ += update.surface->bytes();
      surfaces_[key] = update.surface;
    }
  }

  // Returns the memory of the data derived from loaded chunks. A LiveTracer has two tracers.
  [[nodiscard]] std::size_t derived_bytes() const {
    return mesh_bytes_ + light_.shown().bytes() + 2 * tracer_.shown().bytes();
  }

  std::optional<quoin::StreamedWorld> world_;
  quoin::LiveLight light_;
  quoin::LiveMeshes meshes_;
  quoin::LiveTracer tracer_;
  std::map<SurfaceKey, std::shared_ptr<const quoin::ChunkSurface>> surfaces_;
  std::size_t mesh_bytes_ = 0;  // of `surfaces_`
  std::size_t uploaded_ = 0;
  std::string save_error_;  // of the last `update`; empty if it had none
};

quoin::Status play(const std::string& path, const std::string& image) {
  Game game;
  if (auto opened = game.open(path); !opened) return opened;
  quoin::Viewer player;
  player.position = {0.5, 110.0, 0.5};
  player.direction = glm::normalize(quoin::DVec3(1.0, -0.6, 0.3));
  player.radius = 192.0;
  if (auto loaded = game.load(player); !loaded) return loaded;

  std::vector<double> milliseconds;
  for (int frame = 0; frame < kFrames; ++frame) {
    const auto start = std::chrono::steady_clock::now();
    game.frame(player, frame % 30 == 10);
    milliseconds.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    std::this_thread::sleep_until(start + std::chrono::microseconds(16'667));  // a game draws here
  }
  std::sort(milliseconds.begin(), milliseconds.end());
  std::printf("frames without drawing: median %.3f ms, longest %.3f ms; %.1f MB of quads uploaded\n",
              milliseconds[kFrames / 2], milliseconds.back(), static_cast<double>(game.uploaded()) / 1e6);
  if (auto saved = game.flush(); !saved) return saved;
  return game.draw(player, image);
}

}  // namespace

int main(int argc, char** argv) {
  quoin::return_freed_memory();  // so that the memory of the process also stays within the budget
  static Arena arena;            // not destroyed before the scratch memory of this thread
  quoin::BlockFunctions functions;
  functions.allocate = [](std::size_t bytes, std::size_t alignment, void* context) noexcept {
    return static_cast<Arena*>(context)->allocate(bytes, alignment);  // null: no memory left
  };
  functions.free = [](void* block, std::size_t bytes, std::size_t /*alignment*/, void* context) noexcept {
    static_cast<Arena*>(context)->free(block, bytes);
  };
  functions.context = &arena;
  if (!quoin::set_block_functions(functions)) return 1;  // Quoin has already made a large block

  quoin::set_job_system(quoin::make_worker_pool({.count = 3}));  // before the first object
  const auto played = play(argc > 1 ? argv[1] : "game.quoin", argc > 2 ? argv[2] : "game.png");
  if (!played) std::fprintf(stderr, "%s\n", quoin::to_string(played.error()).c_str());
  std::printf("at most %.1f MB from the arena\n", 1e-6 * static_cast<double>(arena.most()));
  return played ? 0 : 1;
}
