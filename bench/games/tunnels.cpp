// A smooth world of density fields: a capsule walks through hills and tunnels, and digs. Streaming, meshes and the
// tracer run on workers, with the default options of the library.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <span>

#include "game_bench.h"

namespace {

using games::FrameMeter;
using games::require;
using games::Statistic;
using quoin::DVec3;
using quoin::IVec3;
using quoin::VoxelType;

enum Material : VoxelType { kTurf = 1, kRock, kClay };
constexpr std::size_t kUploadBytes = std::size_t{4} << 20;
constexpr double kHole = 3.0;  // radius in samples

quoin::Status add_materials(quoin::VoxelRegistry& types) {
  constexpr std::array kNames = {"", "turf", "rock", "clay"};
  for (const VoxelType type : {kTurf, kRock, kClay}) {
    quoin::VoxelProperties material;
    material.name = kNames[type];
    material.colour = {static_cast<std::uint8_t>(70 * type), 130, 90, 255};
    if (const auto added = types.add(material); !added) return added.error();
  }
  return {};
}

// Hills with overhangs, and tunnels where two noises are near 0 at the same time.
class Hills final : public quoin::ChunkGenerator {
 public:
  [[nodiscard]] quoin::IBox chunks() const override { return {{-100'000, 0, -100'000}, {100'000, 3, 100'000}}; }

  [[nodiscard]] static double height(double x, double z) {
    return 84.0 + 30.0 * quoin::fractal2(21, x / 240.0, z / 240.0, 4);
  }

  [[nodiscard]] quoin::Result<quoin::StoredChunk> make(IVec3 chunk,
                                                       const quoin::Cancellation& /*cancelled*/) const override {
    const float band = quoin::DensityGrid().band();
    const Columns columns(64 * chunk);
    quoin::StoredChunk made;
    if (64 * chunk.y > columns.highest + 16.0 + band) {
      made.densities = quoin::DensityChunk(quoin::stored_density(band, band));
      return made;
    }
    const std::vector<Noise> noise = noise_of(64 * chunk);
    quoin::DensityChunk densities(quoin::stored_density(band, band));
    for (int z = 0; z < 64; ++z) {
      for (int y = 0; y < 64; ++y) write_row(64 * chunk, y, z, columns, noise, band, densities);
    }
    densities.compact();
    made.densities = std::move(densities);
    return made;
  }

 private:
  struct Columns {
    explicit Columns(IVec3 origin) : heights(64 * 64) {
      for (int z = 0; z < 64; ++z) {
        for (int x = 0; x < 64; ++x) {
          const double top = height(origin.x + x, origin.z + z);
          heights[static_cast<std::size_t>(64 * z + x)] = static_cast<float>(top);
          highest = std::max(highest, top);
        }
      }
    }
    std::vector<float> heights;
    double highest = -1e9;
  };
  struct Noise {
    float bump = 0.0F, first = 0.0F, second = 0.0F;
  };

  static std::size_t node(int x, int y, int z) { return static_cast<std::size_t>((z * 17 + y) * 17 + x); }

  // Noise at every fourth sample.
  static std::vector<Noise> noise_of(IVec3 origin) {
    std::vector<Noise> noise(17 * 17 * 17);
    for (int z = 0; z < 17; ++z) {
      for (int y = 0; y < 17; ++y) {
        for (int x = 0; x < 17; ++x) {
          const DVec3 at = DVec3(origin + 4 * IVec3{x, y, z});
          noise[node(x, y, z)] = {static_cast<float>(quoin::noise3(22, at.x / 36.0, at.y / 24.0, at.z / 36.0)),
                                  static_cast<float>(quoin::noise3(23, at.x / 64.0, at.y / 46.0, at.z / 64.0)),
                                  static_cast<float>(quoin::noise3(24, at.x / 64.0, at.y / 46.0, at.z / 64.0))};
        }
      }
    }
    return noise;
  }

  static void write_row(IVec3 origin, int y, int z, const Columns& columns, const std::vector<Noise>& noise, float band,
                        quoin::DensityChunk& out) {
    std::array<float, 64> densities;
    std::array<VoxelType, 64> materials;
    const float part_y = static_cast<float>(y % 4) / 4.0F, part_z = static_cast<float>(z % 4) / 4.0F;
    std::array<Noise, 17> line;
    for (int i = 0; i < 17; ++i) {
      const auto mixed = [&](float Noise::*value) {
        const auto along_y = [&](int node_z) {
          return std::lerp(noise[node(i, y / 4, node_z)].*value, noise[node(i, y / 4 + 1, node_z)].*value, part_y);
        };
        return std::lerp(along_y(z / 4), along_y(z / 4 + 1), part_z);
      };
      line[static_cast<std::size_t>(i)] = {mixed(&Noise::bump), mixed(&Noise::first), mixed(&Noise::second)};
    }
    const auto world_y = static_cast<float>(origin.y + y);
    for (std::size_t x = 0; x < 64; ++x) {
      const Noise &a = line[x / 4], &b = line[x / 4 + 1];
      const float part = static_cast<float>(x % 4) / 4.0F;
      const float top = columns.heights[static_cast<std::size_t>(64 * z) + x];
      const float ground = 0.7F * (world_y - top + 14.0F * std::lerp(a.bump, b.bump, part));
      const float tunnel = 4.5F - 60.0F * std::max(std::abs(std::lerp(a.first, b.first, part)),
                                                   std::abs(std::lerp(a.second, b.second, part)));
      const float density = world_y < 4.0F ? world_y - 4.0F : std::max(ground, tunnel);
      densities[x] = density;
      materials[x] = density >= 4.0F ? quoin::kAir
                                     : static_cast<VoxelType>(ground > -3.0F    ? kTurf
                                                              : world_y < 60.0F ? kClay
                                                                                : kRock);
    }
    out.write_row(y, z, densities, band);
    out.materials().write_row(y, z, materials);
  }
};

// The game's own vertex.
struct Vertex {
  quoin::Vec3 position;
  std::array<std::int8_t, 4> normal{};
  std::array<std::uint8_t, 4> colour{};
};

quoin::ConvertedSurface vertices_of(const quoin::SurfaceUpdate& update) {
  const quoin::ChunkSurface& surface = *update.surface;
  auto vertices = std::make_shared<std::vector<Vertex>>(surface.smooth.positions.size());
  for (std::size_t i = 0; i < vertices->size(); ++i) {
    Vertex& to = (*vertices)[i];
    to.position = surface.smooth.positions[i];
    for (int axis = 0; axis < 3; ++axis) {
      const auto at = static_cast<std::size_t>(axis);
      to.normal[at] = static_cast<std::int8_t>(127.0F * surface.smooth.normals[i][axis]);
      to.colour[at] = static_cast<std::uint8_t>(surface.albedo[i][at] >> 8);
    }
    to.colour[3] = static_cast<std::uint8_t>(255.0F * (1.0F - surface.smooth.occlusion[i]));
  }
  const std::size_t bytes = vertices->size() * sizeof(Vertex);
  return {std::shared_ptr<const std::vector<Vertex>>(std::move(vertices)), bytes};
}

quoin::LiveMeshOptions mesh_options() {
  quoin::LiveMeshOptions options;
  options.convert = vertices_of;
  return options;
}

// A hole that is not shown yet. Its chunks must change in one frame.
struct Hole {
  DVec3 centre{0.0};
  double start_ms = 0.0, process_start_ms = 0.0;
  std::uint64_t state = 0;
  bool was_torn = false;
};

class Game {
 public:
  explicit Game(const games::Options& options)
      : options_(options), world_(games::open_world(options.folder / "tunnels.quoin")), meshes_(mesh_options()) {
    auto land = std::make_shared<Hills>();
    if (world_.is_new()) {
      require(add_materials(world_.scene().types));
      const auto added = world_.add_grid({.name = "land"}, land);
      require(added);
      land_ = *added;
      world_.scene().add_instance({.name = "land", .grid = land_});
    } else {
      land_ = world_.scene().grids().handles().at(0);
      world_.use_generator(land_, land);
    }
    viewer_.position = {8.0, Hills::height(8.0, 8.0) + 14.0, 8.0};
    viewer_.radius = options.radius;
  }

  void settle() {
    const auto is_busy = [this] { return !world_.stats().is_complete || meshes_.pending() != 0 || tracer_.is_late(); };
    games::settle([this](FrameMeter& unused) { frame(unused, [] {}); }, is_busy, [this] { return !holes_.empty(); });
  }

  // The player digs ahead every half second.
  void walk(games::Report& report) {
    FrameMeter meter;
    games::Pace pace(options_);
    quoin::Capsule body{0.4, viewer_.position, {0.0, 0.5, 0.0}};
    quoin::SlideResult moved;
    double fall = 0.0;
    std::vector<double> moves_ms;
    for (int i = 0; i < options_.frames(900); ++i) {
      frame(meter, [&] {
        const double turn = 0.003 * i;
        viewer_.direction = {std::cos(turn), -0.4, std::sin(turn)};
        fall -= 20.0 / 60.0;
        quoin::SlideOptions slide;
        slide.floor = quoin::FloorOptions{.max_slope_degrees = 50.0, .step_height = 0.5, .snap_distance = 0.4};
        const DVec3 step{std::cos(turn) * 5.0 / 60.0, fall / 60.0, std::sin(turn) * 5.0 / 60.0};
        const double start = games::thread_ms();
        move_and_slide(tracer_.shown(), body, step, slide, moved);
        moves_ms.push_back(games::thread_ms() - start);
        body.centre = moved.centre;
        fall = moved.is_on_floor ? 0.0 : 60.0 * moved.displacement.y;
        viewer_.position = body.centre + DVec3(0.0, 0.6, 0.0);
        if (i % 30 == 15) dig_at(viewer_.position, glm::normalize(viewer_.direction), 8.0);
      });
      pace.wait();
    }
    meter.report(report, options_, "walking", {}, 0.0);
    report.samples("walking: step of the capsule", "ms", moves_ms, {{Statistic::P99, 0.2}});
    report.expect(viewer_.position.y > 3.0, "the player fell through the world");
  }

  void fly(games::Report& report) {
    FrameMeter meter;
    games::Pace pace(options_);
    viewer_.direction = {1.0, -0.3, 0.0};
    viewer_.position.y = 140.0;
    double nearest = viewer_.radius;
    for (int i = 0; i < options_.frames(900); ++i) {
      frame(meter, [&] { viewer_.position.x += 1.0; });
      if (i % 60 == 59) nearest = std::min(nearest, world_.stats().complete_radius);
      pace.wait();
    }
    meter.report(report, options_, "flight", {{Statistic::P99, 4.0}}, 20.0);
    report.value("flight: radius without complete chunks", "voxels", viewer_.radius - nearest);
  }

  // One hole in four frames, half of them at the border of chunks.
  void dig(games::Report& report) {
    FrameMeter meter;
    games::Pace pace(options_);
    const int wanted = std::max(20, options_.edits / 10);
    for (int i = 0; dug_ < wanted; ++i) {
      frame(meter, [&] {
        if (i % 4 == 0) dig_below(i / 4);
      });
      pace.wait();
    }
    settle();
    meter.report(report, options_, "digging", {{Statistic::P99, 4.0}}, std::nullopt);
    report.samples("digging: DensityGrid::remove_sphere", "ms", edits_ms_);
    report.samples("digging: edit to mesh, wall time", "ms", latencies_ms_,
                   {{Statistic::Median, 25.0}, {Statistic::P99, 60.0}});
    report.samples("digging: edit to mesh, processor time of the process", "ms", process_latencies_ms_);
    const auto holes = static_cast<std::int64_t>(latencies_ms_.size() + holes_.size());
    report.faults("digging: torn frames", torn_, holes, "holes");
    report.faults("digging: holes never shown", static_cast<std::int64_t>(holes_.size()), holes, "holes");
  }

  void report_memory(games::Report& report) {
    const auto [surfaces, vertices] = shown_.bytes();
    games::report_memory(report, {{"fields", world_.stats().loaded_bytes},
                                  {"both sets of trees", 2 * tracer_.shown().bytes()},
                                  {"surfaces", surfaces},
                                  {"vertices of the game", vertices}});
  }

  void compare_with_new_meshes(games::Report& report) {
    report.faults("surfaces that differ from new ones", shown_.differences(world_.scene(), false, viewer_.position),
                  static_cast<std::int64_t>(shown_.chunks()), "surfaces");
  }

  [[nodiscard]] auto hashes() const { return games::hashes_of(world_.scene().grids()[land_]); }
  [[nodiscard]] DVec3 position() const { return viewer_.position; }
  void go_to(DVec3 position) { viewer_.position = position; }
  void flush() { require(world_.flush()); }
  std::vector<std::string> problems() { return world_.take_problems(); }

 private:
  template <class Edit>
  void frame(FrameMeter& meter, Edit&& edit) {
    meter.begin();
    const std::size_t holes_before = holes_.size();
    edit();
    meter.part("edit");
    require(world_.update({&viewer_, 1}));
    meter.part("StreamedWorld::update");
    tracer_.update(world_.scene());
    meter.part("LiveTracer::update");
    const std::uint64_t state = meshes_.update(world_.scene(), viewer_.position);
    meter.part("LiveMeshes::update");
    const auto upload = [this](const quoin::SurfaceUpdate& update) {
      if (update.surface == nullptr || update.surface->converted == nullptr) return;
      const auto& vertices = *static_cast<const std::vector<Vertex>*>(update.surface->converted.get());
      staging_.copy(std::as_bytes(std::span(vertices)));
    };
    const auto updates = games::end_frame(meter, tracer_, meshes_, kUploadBytes, shown_, upload);
    for (std::size_t i = holes_before; i < holes_.size(); ++i) holes_[i].state = state;
    check_holes(updates);
  }

  // Digs where a ray meets the ground, as the tracer shows it.
  bool dig_at(DVec3 from, DVec3 direction, double reach) {
    const auto hit = first_hit(tracer_.shown(), {from, direction}, reach);
    if (!hit) return false;
    const double start = games::thread_ms();
    world_.scene().edit(land_).field.remove_sphere(hit->position, kHole, 1.0);
    edits_ms_.push_back(games::thread_ms() - start);
    holes_.push_back({hit->position, games::wall_ms(), games::process_ms()});
    return true;
  }

  void dig_below(int number) {
    const int reach = std::min(100, static_cast<int>(viewer_.radius) / 3);
    const auto random = [&](int seed) {
      return static_cast<int>(quoin::hash_of(31, number, seed) % (2U * static_cast<unsigned>(reach))) - reach;
    };
    DVec3 from{viewer_.position.x + random(1), 190.0, viewer_.position.z + random(2)};
    if (number % 2 == 0) from.x = 64.0 * std::round(from.x / 64.0);
    if (dig_at(from, {0.0, -1.0, 0.0}, 190.0)) ++dug_;
  }

  // New surfaces near a hole must be closed: those of only one side of a chunk border are not. To find their open edges
  // takes longer than a frame, so the times of all holes are taken before.
  void check_holes(const std::vector<quoin::SurfaceUpdate>& updates) {
    const std::uint64_t shown = meshes_.shown_update();
    const double now_ms = games::wall_ms(), process_now_ms = games::process_ms();
    std::erase_if(holes_, [&](Hole& hole) {
      const IVec3 min = quoin::chunk_of(quoin::voxel_of(hole.centre - (kHole + 4.0)));
      const IVec3 max = quoin::chunk_of(quoin::voxel_of(hole.centre + (kHole + 4.0))) + 1;
      const quoin::IBox box{min - 1, max + 1};
      const bool has_changed = std::any_of(updates.begin(), updates.end(), [&](const quoin::SurfaceUpdate& update) {
        return glm::all(glm::greaterThanEqual(update.chunk, min)) && glm::all(glm::lessThan(update.chunk, max));
      });
      if (has_changed && is_meshed(box) && shown_.open_edges(land_, {min, max}) != 0) hole.was_torn = true;
      if (shown < hole.state) return false;
      if (has_solid_left(hole)) hole.was_torn = true;
      torn_ += hole.was_torn ? 1 : 0;
      latencies_ms_.push_back(now_ms - hole.start_ms);
      process_latencies_ms_.push_back(process_now_ms - hole.process_start_ms);
      return true;
    });
  }

  // Chunks at the edge of the loaded world have no surfaces.
  [[nodiscard]] bool is_meshed(const quoin::IBox& chunks) const {
    const quoin::IBox samples{64 * chunks.min, 64 * chunks.max};
    return world_.scene().grids()[land_].field.is_loaded_within(samples);
  }

  // True if a vertex is shown well inside of a hole that is said to be shown.
  [[nodiscard]] bool has_solid_left(const Hole& hole) const {
    const IVec3 chunk = quoin::chunk_of(quoin::voxel_of(hole.centre));
    const quoin::ChunkSurface* const surface = shown_.find(land_, chunk, quoin::SurfaceContent::Field);
    if (surface == nullptr) return false;
    return std::any_of(surface->smooth.positions.begin(), surface->smooth.positions.end(), [&](const quoin::Vec3& p) {
      return glm::length(DVec3(p) + DVec3(64 * chunk) - hole.centre) < kHole - 1.5;
    });
  }

  games::Options options_;
  quoin::StreamedWorld world_;
  quoin::GridHandle land_;
  quoin::Viewer viewer_;
  quoin::LiveMeshes meshes_;
  quoin::LiveTracer tracer_;
  games::Shown shown_;
  games::Staging staging_{std::size_t{4} << 20};
  std::vector<Hole> holes_;
  std::vector<double> latencies_ms_, process_latencies_ms_, edits_ms_;
  int dug_ = 0;
  std::int64_t torn_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  quoin::return_freed_memory();
  games::Options options = games::parse(argc, argv);
  // A sample of a field costs about ten times a voxel.
  options.radius = std::min(options.radius, 256.0);
  games::Report report("tunnels", options);
  std::filesystem::remove(options.folder / "tunnels.quoin");
  std::map<IVec3, std::uint64_t, quoin::ByZyx> saved;
  DVec3 end{0.0};
  {
    Game game(options);
    const double wall = games::wall_ms(), process = games::process_ms();
    game.settle();
    report_loading(report, wall, process, std::nullopt);
    game.walk(report);
    game.fly(report);
    game.settle();
    game.dig(report);
    game.report_memory(report);
    if (options.is_short) game.compare_with_new_meshes(report);
    game.flush();
    for (const std::string& problem : game.problems()) report.expect(false, problem);
    saved = game.hashes();
    end = game.position();
  }
  Game again(options);
  again.go_to(end);
  again.settle();
  std::int64_t compared = 0, different = 0;
  for (const auto& [chunk, hash] : again.hashes()) {
    const auto before = saved.find(chunk);
    if (before == saved.end()) continue;
    ++compared;
    different += before->second != hash ? 1 : 0;
  }
  report.faults("differ after opening the world again", different, compared, "chunks");
  return report.finish();
}
