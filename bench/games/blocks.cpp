// An endless world of blocks: a player walks, flies, digs and places blocks in daylight, and sand slides. Streaming,
// light, meshes and the tracer run on workers, with the library's default options.

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

enum Block : VoxelType { kStone = 1, kEarth, kGrass, kSand, kWater, kWood, kLeaves, kLamp, kBlocks };
constexpr int kSea = 58;
constexpr std::size_t kUploadBytes = std::size_t{4} << 20;

quoin::Status add_blocks(quoin::VoxelRegistry& types) {
  constexpr std::array kNames = {"", "stone", "earth", "grass", "sand", "water", "wood", "leaves", "lamp"};
  for (VoxelType type = kStone; type < kBlocks; ++type) {
    quoin::VoxelProperties block;
    block.name = kNames[type];
    block.colour = {static_cast<std::uint8_t>(30 * type), 140, static_cast<std::uint8_t>(255 - 25 * type), 255};
    if (type == kWater) block.colour.a = 150;
    if (type == kWater || type == kLeaves) block.visibility = quoin::Visibility::Transparent;
    block.collides = type != kWater;
    block.emission = type == kLamp ? 1.0F : 0.0F;
    if (const auto added = types.add(block); !added) return added.error();
  }
  return {};
}

// Hills, lakes, trees, and caves below them.
class Land final : public quoin::ChunkGenerator {
 public:
  [[nodiscard]] quoin::IBox chunks() const override { return {{-100'000, 0, -100'000}, {100'000, 3, 100'000}}; }

  [[nodiscard]] static int height(int x, int z) {
    const double hills = quoin::fractal2(11, x / 260.0, z / 260.0, 5);
    const double crest = quoin::ridged2(12, x / 640.0, z / 640.0, 4);
    return static_cast<int>(64.0 + 24.0 * hills + 44.0 * crest * crest);
  }

  [[nodiscard]] quoin::Result<quoin::StoredChunk> make(IVec3 chunk,
                                                       const quoin::Cancellation& /*cancelled*/) const override {
    const IVec3 origin = 64 * chunk;
    std::vector<int> heights(64 * 64);
    for (int z = 0; z < 64; ++z) {
      for (int x = 0; x < 64; ++x) heights[column(x, z)] = height(origin.x + x, origin.z + z);
    }
    const int highest = std::max(kSea, *std::max_element(heights.begin(), heights.end()) + kTreeHeight);
    if (origin.y > highest) return quoin::StoredChunk{};
    std::vector<VoxelType> voxels(quoin::kChunkVoxels, quoin::kAir);
    fill_ground(origin, heights, voxels);
    if (origin.y <= *std::min_element(heights.begin(), heights.end())) carve_caves(origin, heights, voxels);
    plant_trees(origin, voxels);
    return quoin::StoredChunk{
        quoin::Chunk::from_dense(std::span<const VoxelType, quoin::kChunkVoxels>(voxels.data(), voxels.size()))};
  }

 private:
  static constexpr int kTreeHeight = 8;

  static std::size_t column(int x, int z) { return static_cast<std::size_t>(64 * z + x); }
  static std::size_t index(IVec3 local) { return static_cast<std::size_t>((64 * local.z + local.y) * 64 + local.x); }

  static void fill_ground(IVec3 origin, const std::vector<int>& heights, std::vector<VoxelType>& voxels) {
    for (int z = 0; z < 64; ++z) {
      for (int x = 0; x < 64; ++x) {
        const int top = heights[column(x, z)];
        const int last = std::min(63, std::max(top, kSea) - origin.y);
        for (int y = 0; y <= last; ++y) {
          const int depth = top - (origin.y + y);
          const Block upper = top <= kSea + 1 ? kSand : depth == 0 ? kGrass : kEarth;
          voxels[index({x, y, z})] = depth < 0 ? kWater : depth > 4 ? kStone : upper;
        }
      }
    }
  }

  // Noise at every fourth voxel, interpolated along x.
  static void carve_caves(IVec3 origin, const std::vector<int>& heights, std::vector<VoxelType>& voxels) {
    for (int z = 0; z < 64; ++z) {
      for (int y = 0; y < 64; y += 2) {
        std::array<double, 17> at{};
        for (int i = 0; i < 17; ++i) {
          const double x = (origin.x + 4 * i) / 44.0, h = (origin.y + y) / 30.0, d = (origin.z + (z & ~1)) / 44.0;
          at[static_cast<std::size_t>(i)] = std::abs(quoin::noise3(13, x, h, d)) + std::abs(quoin::noise3(14, x, h, d));
        }
        for (int x = 0; x < 64; ++x) {
          const auto i = static_cast<std::size_t>(x / 4);
          const double part = (x % 4) / 4.0;
          if ((1 - part) * at[i] + part * at[i + 1] > 0.08) continue;
          for (int step = 0; step < 2; ++step) {
            const int world_y = origin.y + y + step;
            const int top = heights[column(x, z)];
            if (world_y > 3 && world_y <= top && (world_y < top - 6 || top > kSea + 2)) {
              voxels[index({x, y + step, z})] = quoin::kAir;
            }
          }
        }
      }
    }
  }

  // Trees may begin in a neighbouring chunk.
  static void plant_trees(IVec3 origin, std::vector<VoxelType>& voxels) {
    const auto put = [&](IVec3 world, VoxelType type) {
      const IVec3 local = world - origin;
      if (quoin::chunk_of(local) == IVec3{0}) voxels[index(local)] = type;
    };
    for (int z = origin.z - 2; z < origin.z + 66; ++z) {
      for (int x = origin.x - 2; x < origin.x + 66; ++x) {
        if (quoin::hash_of(15, x, z) % 400 != 0) continue;
        const int top = height(x, z);
        if (top <= kSea + 1) continue;
        for (int dy = 4; dy < kTreeHeight; ++dy) {
          const int reach = dy < 6 ? 2 : 1;
          for (int dz = -reach; dz <= reach; ++dz) {
            for (int dx = -reach; dx <= reach; ++dx) put({x + dx, top + dy, z + dz}, kLeaves);
          }
        }
        for (int dy = 1; dy < 6; ++dy) put({x, top + dy, z}, kWood);
      }
    }
  }
};

// The game's own vertex: 16 bytes.
struct Vertex {
  std::uint8_t x = 0, y = 0, z = 0, occlusion = 0;
  std::uint16_t texture = 0;  // by type and direction
  std::uint8_t u = 0, v = 0;
  std::uint32_t light = 0;
  std::uint32_t reserved = 0;
};
static_assert(sizeof(Vertex) == 16);

quoin::ConvertedSurface vertices_of(const quoin::SurfaceUpdate& update) {
  const quoin::ChunkSurface& surface = *update.surface;
  auto vertices = std::make_shared<std::vector<Vertex>>(quoin::vertices_needed(surface.quads.size()));
  quoin::for_each_vertex(surface.quads, [&](std::size_t i, const quoin::QuadVertex& from) {
    Vertex& to = (*vertices)[i];
    to.x = static_cast<std::uint8_t>(from.position.x);
    to.y = static_cast<std::uint8_t>(from.position.y);
    to.z = static_cast<std::uint8_t>(from.position.z);
    to.occlusion = from.occlusion;
    to.texture = static_cast<std::uint16_t>(6 * from.type + static_cast<unsigned>(from.direction));
    to.u = static_cast<std::uint8_t>(from.u);
    to.v = static_cast<std::uint8_t>(from.v);
    to.light = surface.light.empty() ? 0xFFU : surface.light[i / 4][from.corner];
  });
  const std::size_t bytes = vertices->size() * sizeof(Vertex);
  return {std::shared_ptr<const std::vector<Vertex>>(std::move(vertices)), bytes};
}

quoin::LiveMeshOptions mesh_options() {
  quoin::LiveMeshOptions options;
  options.convert = vertices_of;
  return options;
}

class Game {
 public:
  explicit Game(const games::Options& options)
      : options_(options), world_(games::open_world(options.folder / "blocks.quoin")), meshes_(mesh_options()) {
    meshes_.use_light(light_);
    auto land = std::make_shared<Land>();
    if (world_.is_new()) {
      require(add_blocks(world_.scene().types));
      const auto added = world_.add_grid({.name = "land"}, land);
      require(added);
      land_ = *added;
      world_.scene().add_instance({.name = "land", .grid = land_});
    } else {
      land_ = world_.scene().grids().handles().at(0);
      world_.use_generator(land_, land);
    }
    int shore = 8;
    while (Land::height(shore, 8) <= kSea + 4) ++shore;
    viewer_.position = {shore + 0.5, Land::height(shore, 8) + 3.0, 8.5};
    viewer_.radius = options.radius;
  }

  // Until everything within the radius is loaded, lit and meshed. Edits that are still not shown then are faults.
  void settle() {
    const auto is_busy = [this] { return !world_.stats().is_complete || meshes_.pending() != 0 || tracer_.is_late(); };
    games::settle([this](FrameMeter& unused) { frame(unused, [] {}); }, is_busy, [this] { return !watch_.empty(); });
  }

  void walk(games::Report& report) {
    FrameMeter meter;
    games::Pace pace(options_);
    quoin::OrientedBox body{viewer_.position, {0.3, 0.9, 0.3}};
    quoin::SlideResult moved;
    double fall = 0.0;
    for (int i = 0; i < options_.frames(900); ++i) {
      std::optional<games::EditWatch::Voxel> dug;
      const auto step_and_dig = [&] {
        const double turn = 0.002 * i;
        viewer_.direction = {std::cos(turn), -1.6, std::sin(turn)};
        fall -= 20.0 / 60.0;
        quoin::SlideOptions slide;
        slide.floor = quoin::FloorOptions{.step_height = 1.1, .snap_distance = 0.6};
        const DVec3 step{std::cos(turn) * 5.0 / 60.0, fall / 60.0, std::sin(turn) * 5.0 / 60.0};
        move_and_slide(tracer_.shown(), body, step, slide, moved);
        body.centre = moved.centre;
        fall = moved.is_on_floor ? 0.0 : 60.0 * moved.displacement.y;
        viewer_.position = body.centre + DVec3(0.0, 0.7, 0.0);
        if (i % 30 == 15) dug = dig_ahead();
      };
      frame(meter, step_and_dig, [&] {
        if (!dug) return;
        const quoin::Scene& scene = world_.scene();
        dug->after = games::expected_faces(scene.grids()[land_].grid, scene.types, dug->voxel);
        watch_.add({*dug});
      });
      pace.wait();
    }
    settle();
    meter.report(report, options_, "walking", {}, 0.0);
    watch_.report(report, "walking", {{Statistic::Median, 20.0}});
    report.expect(viewer_.position.y > 4.0, "the player fell through the world");
  }

  void fly(games::Report& report) {
    FrameMeter meter;
    games::Pace pace(options_);
    viewer_.direction = {1.0, -0.3, 0.0};
    double nearest = viewer_.radius;
    viewer_.position.y = 150.0;
    for (int i = 0; i < options_.frames(1'200); ++i) {
      frame(meter, [&] { viewer_.position.x += 1.0; });
      if (i % 60 == 59) nearest = std::min(nearest, world_.stats().complete_radius);
      pace.wait();
    }
    meter.report(report, options_, "flight", {{Statistic::P99, 4.0}}, 20.0);
    report.value("flight: radius without complete chunks", "voxels", viewer_.radius - nearest, 64.0);
  }

  void dig(games::Report& report) {
    FrameMeter meter;
    games::Pace pace(options_);
    std::uint32_t dice = 0;
    for (int edits = 0; edits < options_.edits;) {
      const std::vector<quoin::PlacedVoxel> wanted = choose_edits(dice, std::min(4, options_.edits - edits));
      std::vector<games::EditWatch::Voxel> watched;
      quoin::Scene& scene = world_.scene();
      const quoin::Grid& voxels = scene.grids()[land_].grid;
      for (const quoin::PlacedVoxel& edit : wanted) {
        const bool in_daylight = edit.type == quoin::kAir;
        watched.push_back({land_, edit.voxel, games::expected_faces(voxels, scene.types, edit.voxel), 0, in_daylight});
      }
      const auto edit = [&] {
        for (const quoin::PlacedVoxel& voxel : wanted) scene.edit(land_).grid.set(voxel.voxel, voxel.type);
      };
      frame(meter, edit, [&] {
        for (auto& voxel : watched) voxel.after = games::expected_faces(voxels, scene.types, voxel.voxel);
        if (!watched.empty()) watch_.add(std::move(watched));
      });
      edits += static_cast<int>(wanted.size());
      pace.wait();
    }
    settle();
    meter.report(report, options_, "digging", {}, std::nullopt);
    watch_.report(report, "digging", {});
  }

  // Sand falls in many chunks at once, one voxel per frame.
  void slide(games::Report& report) {
    FrameMeter meter;
    games::Pace pace(options_);
    std::vector<IVec3> grains = start_grains(options_.is_short ? 200 : 9'400);
    const quoin::Grid& voxels = world_.scene().grids()[land_].grid;
    std::vector<quoin::PlacedVoxel> moves;
    for (int i = 0; i < options_.frames(300); ++i) {
      frame(meter, [&] {
        moves.clear();
        for (IVec3& grain : grains) {
          const IVec3 below = grain - IVec3{0, 1, 0};
          moves.push_back({grain, quoin::kAir});
          grain = voxels.get(below) == quoin::kAir ? below : grain + IVec3{0, 16, 0};
          moves.push_back({grain, kSand});
        }
        world_.scene().edit(land_).grid.set(moves);
      });
      pace.wait();
    }
    settle();
    meter.report(report, options_, "landslides", {{Statistic::P99, 12.0}}, std::nullopt);
  }

  void report_memory(games::Report& report) {
    const auto [surfaces, vertices] = shown_.bytes();
    games::report_memory(report, {{"voxels", world_.stats().loaded_bytes},
                                  {"light", light_.shown().bytes()},
                                  {"both sets of trees", 2 * tracer_.shown().bytes()},
                                  {"surfaces", surfaces},
                                  {"vertices of the game", vertices}});
  }

  void compare_with_new_meshes(games::Report& report) {
    const int differences = shown_.differences(world_.scene(), true, viewer_.position);
    report.faults("surfaces that differ from new ones", differences, static_cast<std::int64_t>(shown_.chunks()),
                  "surfaces");
  }

  [[nodiscard]] auto hashes() const { return games::hashes_of(world_.scene().grids()[land_]); }
  [[nodiscard]] DVec3 position() const { return viewer_.position; }
  void go_to(DVec3 position) { viewer_.position = position; }
  void flush() { require(world_.flush()); }
  std::vector<std::string> problems() { return world_.take_problems(); }

 private:
  template <class Edit>
  void frame(FrameMeter& meter, Edit&& edit) {
    frame(meter, edit, [] {});
  }

  // `note` is not part of the game: it runs after the edit.
  template <class Edit, class Note>
  void frame(FrameMeter& meter, Edit&& edit, Note&& note) {
    meter.begin();
    edit();
    meter.part("edit");
    note();
    meter.skip();
    require(world_.update({&viewer_, 1}));
    meter.part("StreamedWorld::update");
    tracer_.update(world_.scene());
    meter.part("LiveTracer::update");
    meshes_.update(world_.scene(), viewer_.position);
    meter.part("LiveMeshes::update");
    games::end_frame(meter, tracer_, meshes_, kUploadBytes, shown_, [this](const auto& update) { upload(update); });
    watch_.check(shown_);
  }

  // Copies the vertices of changed regions.
  void upload(const quoin::SurfaceUpdate& update) {
    if (update.surface == nullptr || update.surface->converted == nullptr) return;
    const auto& vertices = *static_cast<const std::vector<Vertex>*>(update.surface->converted.get());
    for (const quoin::SurfaceRegion& region : update.surface->regions) {
      const int bit = region.region.x + 4 * (region.region.y + 4 * region.region.z);
      if ((update.changed_regions >> bit & 1U) == 0) continue;
      for (const auto& range : {region.opaque, region.transparent}) {
        const std::size_t count = quoin::vertices_needed(range[6] - range[0]);
        staging_.copy(std::as_bytes(std::span(vertices).subspan(quoin::vertices_needed(range[0]), count)));
      }
    }
  }

  // The player digs the block in front, as the tracer shows it. Returns it to be watched.
  std::optional<games::EditWatch::Voxel> dig_ahead() {
    const auto hit = first_hit(tracer_.shown(), {viewer_.position, glm::normalize(viewer_.direction)}, 8.0,
                               {.types = quoin::QueryTypes::Opaque});
    // An edit next to one that is not shown yet would make the check of that one ambiguous.
    if (!hit || watch_.waits_near(hit->voxel) || !is_plain_around(hit->voxel)) return std::nullopt;
    quoin::Scene& scene = world_.scene();
    quoin::Grid& voxels = scene.edit(land_).grid;
    games::EditWatch::Voxel dug{land_, hit->voxel, games::expected_faces(voxels, scene.types, hit->voxel)};
    return voxels.set(hit->voxel, quoin::kAir) ? std::optional(dug) : std::nullopt;
  }

  // True if the voxels next to one are opaque or air: transparent ones hide faces by other rules.
  [[nodiscard]] bool is_plain_around(IVec3 voxel) const {
    const quoin::Scene& scene = world_.scene();
    return std::all_of(quoin::kDirections.begin(), quoin::kDirections.end(), [&](quoin::Direction side) {
      const VoxelType type = scene.grids()[land_].grid.get(voxel + quoin::normal_of(side));
      return type == quoin::kAir || scene.types.is_opaque(type);
    });
  }

  // The highest voxel of a column, if it and the voxels around it are opaque or air, and light and meshes know them.
  [[nodiscard]] std::optional<IVec3> find_top(int x, int z) const {
    const quoin::Scene& scene = world_.scene();
    const quoin::Grid& voxels = scene.grids()[land_].grid;
    IVec3 at{x, 188, z};
    while (at.y > 2 && voxels.get(at) == quoin::kAir) --at.y;
    if (at.y < 3 || at.y > 180 || !voxels.is_loaded_around(quoin::chunk_of(at))) return std::nullopt;
    if (!is_plain_around(at) || !is_plain_around(at + IVec3{0, 1, 0})) return std::nullopt;
    return scene.types.is_opaque(voxels.get(at)) ? std::optional(at) : std::nullopt;
  }

  // Returns edits in daylight: three of four dig, every other one at the border of two chunks.
  std::vector<quoin::PlacedVoxel> choose_edits(std::uint32_t& dice, int count) const {
    std::vector<quoin::PlacedVoxel> edits;
    const int reach = std::min(100, static_cast<int>(viewer_.radius) / 3);
    for (int tries = 0; tries < 64 && static_cast<int>(edits.size()) < count; ++tries) {
      const auto random = [&](int seed) {
        return static_cast<int>(quoin::hash_of(77, static_cast<int>(dice), seed) %
                                (2U * static_cast<unsigned>(reach))) -
               reach;
      };
      int x = static_cast<int>(viewer_.position.x) + random(1);
      const int z = static_cast<int>(viewer_.position.z) + random(2);
      if (dice % 2 == 0) x = (x & ~63) - static_cast<int>(dice / 2 % 2);
      const bool places = dice % 4 == 3;
      const VoxelType block = dice % 64 == 3 ? kLamp : kStone;
      ++dice;
      const auto top = find_top(x, z);
      if (!top) continue;
      const IVec3 at = places ? *top + IVec3{0, 1, 0} : *top;
      const bool is_near = std::any_of(edits.begin(), edits.end(), [&](const quoin::PlacedVoxel& other) {
        const IVec3 distance = glm::abs(other.voxel - at);
        return std::max({distance.x, distance.y, distance.z}) < 3;
      });
      if (!is_near && !watch_.waits_near(at)) edits.push_back({at, places ? block : VoxelType{quoin::kAir}});
    }
    return edits;
  }

  // Grains above the ground of the chunks around the player.
  [[nodiscard]] std::vector<IVec3> start_grains(int count) const {
    std::vector<IVec3> grains;
    const int edge = 2 * std::min(560, static_cast<int>(viewer_.radius * 0.7));
    for (int i = 0; i < count; ++i) {
      const auto random = [&](int seed) {
        return static_cast<int>(quoin::hash_of(78, i, seed) % static_cast<unsigned>(edge)) - edge / 2;
      };
      const int x = static_cast<int>(viewer_.position.x) + random(1);
      const int z = static_cast<int>(viewer_.position.z) + random(2);
      grains.push_back({x, std::max(kSea, Land::height(x, z)) + 12 + random(3) % 8, z});
    }
    const auto column = [](IVec3 a) { return std::pair(a.x, a.z); };
    std::sort(grains.begin(), grains.end(), [&](IVec3 a, IVec3 b) { return column(a) < column(b); });
    const auto same = [&](IVec3 a, IVec3 b) { return column(a) == column(b); };
    grains.erase(std::unique(grains.begin(), grains.end(), same), grains.end());
    return grains;
  }

  games::Options options_;
  quoin::StreamedWorld world_;
  quoin::GridHandle land_;
  quoin::Viewer viewer_;
  quoin::LiveLight light_;
  quoin::LiveMeshes meshes_;
  quoin::LiveTracer tracer_;
  games::Shown shown_;
  games::EditWatch watch_;
  games::Staging staging_{std::size_t{4} << 20};
};

}  // namespace

int main(int argc, char** argv) {
  quoin::return_freed_memory();
  const games::Options options = games::parse(argc, argv);
  games::Report report("blocks", options);
  std::filesystem::remove(options.folder / "blocks.quoin");
  std::map<IVec3, std::uint64_t, quoin::ByZyx> saved;
  DVec3 end{0.0};
  {
    Game game(options);
    const double wall = games::wall_ms(), process = games::process_ms();
    game.settle();
    report_loading(report, wall, process, options.radius == 1024.0 ? std::optional(12.0) : std::nullopt);
    game.walk(report);
    game.fly(report);
    game.settle();
    game.dig(report);
    game.slide(report);
    game.report_memory(report);
    if (options.is_short) game.compare_with_new_meshes(report);
    game.flush();
    for (const std::string& problem : game.problems()) report.expect(false, problem);
    saved = game.hashes();
    end = game.position();
  }
  Game again(options);
  again.go_to(end);
  const double wall = games::wall_ms(), process = games::process_ms();
  again.settle();
  report.value("loading from disk: wall time", "s", 1e-3 * (games::wall_ms() - wall));
  report.value("loading from disk: processor time of the process", "s", 1e-3 * (games::process_ms() - process));
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
