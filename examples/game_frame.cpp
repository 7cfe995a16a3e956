// The frame of a game in an endless world, as docs/games.md describes it. The player flies and digs every half second.
// Workers load chunks and compute meshes, light and the tracer. Prints the time of the frames; OUT.png (default
// game.png) shows the last one.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

#include <quoin/quoin.h>

namespace {

constexpr int kFrames = 120;
constexpr std::size_t kUploadBytes = std::size_t{4} << 20;

class Game {
 public:
  explicit Game(quoin::StreamedWorld world) : world_(std::move(world)) { meshes_.use_light(light_); }

  // Loads and meshes the surroundings before the first frame.
  quoin::Status load(const quoin::Viewer& player) {
    if (auto loaded = world_.load_all({&player, 1}); !loaded) return loaded;
    tracer_.finish(world_.scene());
    meshes_.finish(world_.scene(), player.position);
    upload(meshes_.take());
    return {};
  }

  quoin::Status frame(const quoin::Viewer& player, bool digs) {
    if (digs) dig(player);                                               // edit
    if (auto saved = world_.update({&player, 1}); !saved) return saved;  // chunks arrive and leave, edits are saved
    tracer_.update(world_.scene());                                      // start workers on the changes
    meshes_.update(world_.scene(), player.position);
    tracer_.take();  // show their finished results
    upload(meshes_.take(kUploadBytes));
    return {};
  }

  [[nodiscard]] std::size_t uploaded() const { return uploaded_; }
  quoin::Status flush() { return world_.flush(); }

  quoin::Status draw(const quoin::Viewer& player, const std::string& path) {
    quoin::RenderOptions options;
    options.width = 480;
    options.height = 270;
    const auto camera = quoin::look_along(player.position, player.direction, 1.1);
    if (!camera) return camera.error();
    const auto image = quoin::CpuRenderer(world_.scene()).render(*camera, options);
    if (!image) return image.error();
    const auto written = quoin::write_png(image->colour, path);
    return written ? quoin::Status() : quoin::Status(written.error());
  }

 private:
  // The rays hit the world of a few frames ago; the edit changes the world of now.
  void dig(const quoin::Viewer& player) {
    const auto hit = first_hit(tracer_.shown(), {player.position, player.direction}, 300.0);
    if (!hit) return;
    const quoin::Scene& shown = tracer_.shown().scene();
    world_.scene()
        .edit(shown.instances()[hit->instance].grid)
        .grid.fill_sphere(quoin::DVec3(hit->voxel), 4.0, quoin::kAir);
  }
  // A game copies the changed regions to its vertex buffers here.
  void upload(const std::vector<quoin::SurfaceUpdate>& updates) {
    for (const quoin::SurfaceUpdate& update : updates) {
      if (update.surface != nullptr) uploaded_ += update.surface->upload_bytes();
    }
  }

  quoin::StreamedWorld world_;
  quoin::LiveLight light_;
  quoin::LiveMeshes meshes_;
  quoin::LiveTracer tracer_;
  std::size_t uploaded_ = 0;
};

quoin::Status play(const std::string& path, const std::string& image) {
  auto world = quoin::StreamedWorld::open_or_create(path);
  if (!world) return world.error();
  if (world->is_new()) {
    if (const auto land = world->add_terrain({.seed = 11}); !land) return land.error();
  }
  Game game(std::move(*world));
  quoin::Viewer player;
  player.position = {0.5, 110.0, 0.5};
  player.direction = glm::normalize(quoin::DVec3(1.0, -0.6, 0.3));
  player.radius = 192.0;
  if (auto loaded = game.load(player); !loaded) return loaded;

  std::vector<double> milliseconds;
  for (int frame = 0; frame < kFrames; ++frame) {
    const auto start = std::chrono::steady_clock::now();
    player.position.x += 1.0;
    if (auto done = game.frame(player, frame % 30 == 10); !done) return done;
    milliseconds.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  std::sort(milliseconds.begin(), milliseconds.end());
  std::printf("frames without drawing: median %.3f ms, longest %.3f ms; %.1f MB of quads uploaded\n",
              milliseconds[kFrames / 2], milliseconds.back(), static_cast<double>(game.uploaded()) / 1e6);
  if (auto drawn = game.draw(player, image); !drawn) return drawn;
  return game.flush();
}

}  // namespace

int main(int argc, char** argv) {
  const std::string path = argc > 1 ? argv[1] : "game.quoin";
  if (argc <= 1) std::remove(path.c_str());
  const auto played = play(path, argc > 2 ? argv[2] : "game.png");
  if (!played) std::fprintf(stderr, "%s\n", quoin::to_string(played.error()).c_str());
  return played ? 0 : 1;
}
