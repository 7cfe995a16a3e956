// A small game on Quoin. Without a window: plays itself for some frames and says what they took.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "game.h"

namespace {

double percentile(std::vector<double> all, double share) {
  if (all.empty()) return 0.0;
  std::sort(all.begin(), all.end());
  const auto i = static_cast<std::size_t>(std::lround(share * static_cast<double>(all.size() - 1)));
  return all[i];
}

// Walks in a wide circle, jumps now and then, digs and lights.
miner::Input played(int frame) {
  miner::Input input;
  input.yaw = 0.004 * frame;
  input.pitch = -0.9;
  input.walk = {-std::sin(input.yaw), 0.0, -std::cos(input.yaw)};
  input.jumps = frame % 90 == 60;
  input.digs = frame % 15 == 0;
  input.lights = frame % 300 == 299;
  return input;
}

struct Run {
  int frames = 600;
  int warm_up = 60;
  bool paced = true;
  bool json = false;
};

int play(miner::Game& game, const Run& run) {
  using Clock = std::chrono::steady_clock;
  std::vector<double> totals;
  std::vector<std::vector<double>> parts(miner::FrameTimes::kParts);
  game.meshes().finish(game.scene(), game.eye());
  (void)game.meshes().take();
  auto next = Clock::now();
  for (int frame = 0; frame < run.frames + run.warm_up; ++frame) {
    const miner::FrameTimes times = game.step(played(frame));
    next += std::chrono::microseconds(16'667);
    if (run.paced) std::this_thread::sleep_until(next);
    if (frame < run.warm_up) continue;
    totals.push_back(times.total);
    for (std::size_t i = 0; i < parts.size(); ++i) parts[i].push_back(times.parts.at(i));
  }
  const miner::Game::Memory memory = game.memory();
  const auto solid = game.scene().voxel_count();
  nlohmann::ordered_json json{{"frames", run.frames}, {"solid_voxels", solid}};
  json["frame_ms"] = {
      {"median", percentile(totals, 0.5)}, {"p99", percentile(totals, 0.99)}, {"max", percentile(totals, 1.0)}};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    json["parts_ms"][miner::FrameTimes::kNames.at(i)] = {{"median", percentile(parts[i], 0.5)},
                                                         {"p99", percentile(parts[i], 0.99)}};
  }
  json["tree_bytes_a_voxel"] = double(memory.trees) / double(solid);
  json["voxel_bytes"] = memory.voxels;
  json["sand_fallen"] = game.sand_fallen();
  json["player"] = {game.player().centre.x, game.player().centre.y, game.player().centre.z};
  json["pending"] = game.meshes().pending();
  if (run.json) {
    std::printf("%s\n", json.dump(2).c_str());
  } else {
    std::printf("%d frames of the caller's thread: median %.2f ms, 99th percentile %.2f, longest %.2f\n", run.frames,
                percentile(totals, 0.5), percentile(totals, 0.99), percentile(totals, 1.0));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("A small game on Quoin: walk, dig and light a landscape of blocks, among ships.");
  miner::GameOptions options;
  Run run;
  app.add_option("--frames", run.frames, "play itself for so many frames, without a window")
      ->check(CLI::PositiveNumber);
  app.add_option("--units", options.units, "of 32 voxels: how wide the world is")->check(CLI::Range(4, 128));
  app.add_option("--ships", options.ships, "how many fly about")->check(CLI::Range(0, 10'000));
  app.add_option("--edits", options.edits, "a frame, all over the land")->check(CLI::Range(0, 10'000));
  app.add_option("--landslides", options.slide_chunks, "chunks that a landslide touches a frame")
      ->check(CLI::Range(0, 10'000));
  app.add_option("--seed", options.seed, "of the land");
  app.add_flag("!--unpaced", run.paced, "without waiting for a sixtieth of a second a frame");
  app.add_flag("--json", run.json, "figures as JSON");
  CLI11_PARSE(app, argc, argv);
  const auto game = miner::Game::create(options);
  if (!game) {
    std::fprintf(stderr, "quoin_miner: %s\n", quoin::to_string(game.error()).c_str());
    return 1;
  }
  return play(**game, run);
}
