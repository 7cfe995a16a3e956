// A small game on Quoin, in a window; with --frames it plays itself and prints the frame times.
#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "game.h"

namespace {

// Walks in a wide circle, jumps now and then, digs and places torches.
miner::Input played(int frame) {
  miner::Input input;
  input.yaw = 0.004 * frame;
  input.pitch = -0.9;
  input.ahead = 1.0;
  input.jumps = frame % 90 == 60;
  input.digs = frame % 15 == 0;
  input.torch = frame % 300 == 299 ? frame / 300 % 3 : -1;
  return input;
}

nlohmann::ordered_json percentiles(std::vector<double> all) {
  std::sort(all.begin(), all.end());
  const auto at = [&](double share) { return all.at(std::size_t(std::lround(share * double(all.size() - 1)))); };
  return {{"median", at(0.5)}, {"p99", at(0.99)}, {"max", at(1.0)}};
}

// Returns the resident bytes of the process, after glibc has returned freed memory.
double resident_bytes() {
  malloc_trim(0);
  double all = 0.0, resident = 0.0;
  std::ifstream("/proc/self/statm") >> all >> resident;
  return 4096.0 * resident;
}

quoin::Status play(miner::Game& game, int frames, bool paced, bool as_json) {
  std::map<std::string, std::vector<double>> times;
  game.meshes().finish(game.scene(), game.eye());
  game.light().finish(game.scene());
  auto next = std::chrono::steady_clock::now();
  for (int frame = -60; frame < frames; ++frame) {
    for (const auto& [part, milliseconds] : game.step(played(frame))) {
      if (frame >= 0) times[part].push_back(milliseconds);
    }
    next += std::chrono::microseconds(16'667);
    if (paced) std::this_thread::sleep_until(next);
  }
  const auto solid = double(game.scene().voxel_count());
  nlohmann::ordered_json json{{"frames", frames}, {"solid_voxels", game.scene().voxel_count()}};
  json["frame_ms"] = percentiles(times.extract("frame").mapped());
  for (const auto& [part, all] : times) json["parts_ms"][part] = percentiles(all);
  const std::size_t trees = game.tracer().bytes(), light = game.light().shown().bytes();
  json["tree_bytes_a_voxel"] = double(trees) / solid;
  json["light_bytes_a_voxel"] = double(light) / solid;
  json["voxel_bytes"] = game.voxel_bytes();
  json["other_bytes"] = resident_bytes() - double(trees + light + game.voxel_bytes());
  json["sand_fallen"] = game.sand_fallen();
  json["player"] = {game.player().centre.x, game.player().centre.y, game.player().centre.z};
  json["pending"] = game.meshes().pending();
  std::printf("%s\n", as_json ? json.dump(2).c_str() : json["frame_ms"].dump().c_str());
  return {};
}

}  // namespace

#ifndef MINER_HAS_WINDOW
quoin::Status miner::play_in_window(Game&, const std::string&) {
  return quoin::make_error(quoin::ErrorCode::Unsupported, "cannot open a window: built without SDL2; use --frames");
}
#endif

int main(int argc, char** argv) {
  CLI::App app("A small game: walk (WASD, space, mouse), dig and place (buttons), torches (1 to 3), sand (L).");
  miner::GameOptions options;
  int frames = 0;
  bool paced = true, as_json = false;
  std::string device;
  app.add_option("--frames", frames, "Play this many frames automatically, without a window")
      ->check(CLI::PositiveNumber);
  app.add_option("--device", device, "Vulkan device to draw with, by name or number; cpu for none");
  app.add_option("--units", options.units, "Width of the world (units of 32 voxels)")->check(CLI::Range(4, 128));
  app.add_option("--ships", options.ships, "Number of flying ships")->check(CLI::Range(0, 10'000));
  app.add_option("--edits", options.edits, "Edits per frame, scattered over the land")->check(CLI::Range(0, 10'000));
  app.add_option("--landslides", options.slide_chunks, "Landslide size per frame (chunks)")
      ->check(CLI::Range(0, 10'000));
  app.add_option("--world", options.world, "World file (.quoin) that stores the land and the player's position");
  app.add_option("--seed", options.seed, "Seed of the land");
  app.add_flag("!--unpaced", paced, "Do not wait for 1/60 s per frame");
  app.add_flag("--json", as_json, "Print all figures as JSON");
  CLI11_PARSE(app, argc, argv);
  options.meshes = frames > 0;
  const auto game = miner::Game::create(options);
  quoin::Status ended = !game        ? quoin::Status(game.error())
                        : frames > 0 ? play(**game, frames, paced, as_json)
                                     : miner::play_in_window(**game, device);
  if (const auto kept = game ? (*game)->finish() : quoin::Status{}; ended) ended = kept;
  if (!ended) std::fprintf(stderr, "quoin_miner: %s\n", quoin::to_string(ended.error()).c_str());
  return ended ? 0 : 1;
}
