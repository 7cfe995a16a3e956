// Hundreds of ships that a player builds and shoots. Each ship is a grid; shots cut pieces off, which drift away as
// grids of their own, with their mass. Ships and props are whole grids of a world file; pieces are not saved.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <span>

#include "game_bench.h"

namespace {

using games::FrameMeter;
using games::require;
using games::Statistic;
using quoin::Direction;
using quoin::DVec3;
using quoin::IVec3;
using quoin::VoxelType;

enum Part : VoxelType { kHull = 1, kGlass, kEngine };
constexpr double kWidth = 48.0;  // between ships
constexpr std::int64_t kSmallestPiece = 6, kSmallestShip = 500;

quoin::Status add_parts(quoin::VoxelRegistry& types) {
  constexpr std::array kNames = {"", "hull", "glass", "engine"};
  for (const VoxelType type : {kHull, kGlass, kEngine}) {
    quoin::VoxelProperties part;
    part.name = kNames[type];
    part.colour = {200, static_cast<std::uint8_t>(60 * type), 90, 255};
    if (type == kGlass) part.visibility = quoin::Visibility::Transparent;
    if (const auto added = types.add(part); !added) return added.error();
  }
  return {};
}

double density_of(VoxelType type) {
  return type == kEngine ? 4.0 : type == kGlass ? 0.5 : 1.0;
}

// Two hulls with rooms, joined by thin rods, with fins and masts: shots cut many pieces off.
quoin::Grid build_ship(int number) {
  quoin::Grid ship;
  const int length = 20 + number % 5 * 3;
  for (const int x : {-length, 6}) {
    ship.fill_box({{x, -4, -5}, {x + length - 6, 5, 6}}, kHull);
    ship.fill_box({{x + 1, -3, -4}, {x + length - 7, 4, 5}}, quoin::kAir);
    ship.fill_box({{x + 3, 4, -2}, {x + 7, 5, 3}}, kGlass);
  }
  for (const int z : {-4, 0, 4}) ship.fill_box({{-8, 0, z}, {8, 1, z + 1}}, kHull);
  ship.fill_box({{-length - 3, -2, -3}, {-length, 3, 4}}, kEngine);
  for (int x = -length + 2; x < length - 2; x += 4) {
    if (std::abs(x) < 8) continue;
    ship.fill_box({{x, 5, 0}, {x + 1, 11, 1}}, kHull);        // a mast
    ship.fill_box({{x - 1, 11, -1}, {x + 2, 13, 2}}, kHull);  // and its top
    ship.fill_box({{x, -1, 6}, {x + 1, 0, 10}}, kHull);       // a rod
    ship.fill_box({{x, -2, 10}, {x + 3, 2, 12}}, kHull);      // and a fin
  }
  return ship;
}

// The game's own vertex: position, direction, type, occlusion.
using Vertex = std::array<std::uint16_t, 6>;

std::vector<Vertex> make_vertices(const quoin::ChunkSurface& surface) {
  std::vector<Vertex> vertices(quoin::vertices_needed(surface.quads.size()));
  quoin::for_each_vertex(surface.quads, [&](std::size_t i, const quoin::QuadVertex& from) {
    vertices[i] = {static_cast<std::uint16_t>(from.position.x),
                   static_cast<std::uint16_t>(from.position.y),
                   static_cast<std::uint16_t>(from.position.z),
                   static_cast<std::uint16_t>(from.direction),
                   from.type,
                   from.occlusion};
  });
  return vertices;
}

quoin::ConvertedSurface vertices_of(const quoin::SurfaceUpdate& update) {
  auto vertices = std::make_shared<const std::vector<Vertex>>(make_vertices(*update.surface));
  const std::size_t bytes = vertices->size() * sizeof(Vertex);
  return {std::move(vertices), bytes};
}

quoin::LiveMeshOptions mesh_options() {
  quoin::LiveMeshOptions options;
  options.convert = vertices_of;
  return options;
}

struct Ship {
  quoin::GridHandle grid;
  quoin::InstanceHandle instance;
  DVec3 home{0.0};
  quoin::ConnectedPieces pieces;
  quoin::SolidShapes shapes;
  int cuts_waiting = 0;
};

struct Debris {
  quoin::GridHandle grid;
  quoin::InstanceHandle instance;
  DVec3 velocity{0.0};
  int frames_left = 0;
};

// A face of a piece that is visible before and after it is cut off: exactly one of the two grids must show it.
struct Cut {
  std::size_t ship = 0;
  quoin::GridHandle piece;
  std::vector<std::pair<IVec3, Direction>> faces;
  std::uint64_t added_in = 0;  // state of the scene, LiveMeshes::update
  double start_ms = 0.0;
  bool was_torn = false, was_doubled = false;
};

class Game {
 public:
  explicit Game(const games::Options& options)
      : options_(options), world_(games::open_world(options.folder / "ships.quoin")), meshes_(mesh_options()) {
    quoin::Scene& scene = world_.scene();
    if (world_.is_new()) {
      require(add_parts(scene.types));
      const int count = options.is_short ? 40 : 300;
      for (int i = 0; i < count; ++i) add_ship(i);
    }
  }

  [[nodiscard]] std::size_t ships() const { return ships_.size(); }

  // Until everything is loaded and meshed. Pieces that are still not shown then are faults. The tracer is always late,
  // because ships move in each frame.
  void settle() {
    const auto is_busy = [this] { return !world_.stats().is_complete || meshes_.pending() != 0; };
    games::settle([this](FrameMeter& unused) { frame(unused, 0); }, is_busy, [this] { return !cuts_.empty(); });
  }

  void move(games::Report& report) {
    FrameMeter meter;
    games::Pace pace(options_);
    for (int i = 0; i < options_.frames(600); ++i) {
      frame(meter, 0);
      pace.wait();
    }
    meter.report(report, options_, "moving " + std::to_string(ships_.size()) + " ships", {{Statistic::P99, 4.0}},
                 std::nullopt);
  }

  void shoot(games::Report& report) {
    FrameMeter meter;
    games::Pace pace(options_);
    for (shots_ = 0; shots_ < options_.edits;) {
      frame(meter, 3);
      pace.wait();
    }
    settle();
    meter.report(report, options_, "3 shots per frame", {{Statistic::P99, 4.0}}, std::nullopt);
    report.samples("cut to mesh, wall time", "ms", latencies_ms_, {{Statistic::Median, 20.0}});
    const auto cuts = static_cast<std::int64_t>(latencies_ms_.size() + cuts_.size());
    report.faults("pieces missing in a frame", torn_, cuts, "pieces");
    report.faults("pieces shown twice in a frame", doubled_, cuts, "pieces");
    report.faults("pieces never shown", static_cast<std::int64_t>(cuts_.size()), cuts, "pieces");
    report.faults("wrong shapes or masses", wrong_bodies_, bodies_, "ships");
    if (options_.is_short) report.faults("wrong vertices uploaded", wrong_uploads_, uploads_, "surfaces");
  }

  void report_memory(games::Report& report) {
    std::size_t voxels = 0, pieces = 0, shapes = 0;
    for (const Ship& ship : ships_) {
      voxels += world_.scene().grids()[ship.grid].grid.bytes();
      pieces += ship.pieces.bytes();
      shapes += ship.shapes.bytes();
    }
    const auto [surfaces, vertices] = shown_.bytes();
    games::report_memory(report, {{"voxels of ships", voxels},
                                  {"connected pieces", pieces},
                                  {"solid shapes", shapes},
                                  {"both sets of trees", 2 * tracer_.shown().bytes()},
                                  {"surfaces", surfaces},
                                  {"vertices of the game", vertices}});
  }

  void compare_with_new_meshes(games::Report& report) {
    report.faults("surfaces that differ from new ones", shown_.differences(world_.scene(), false, {}),
                  static_cast<std::int64_t>(shown_.chunks()), "surfaces");
  }

  // Voxels of the ships, by name.
  [[nodiscard]] std::map<std::string, std::uint64_t> hashes() const {
    std::map<std::string, std::uint64_t> hashes;
    for (const quoin::GridHandle handle : world_.scene().grids().handles()) {
      const quoin::SceneGrid& grid = world_.scene().grids()[handle];
      if (!grid.saved) continue;
      std::uint64_t hash = grid.grid.is_partial() ? 1 : 0;
      for (const auto& [chunk, of] : games::hashes_of(grid)) hash = 31 * hash + of;
      hashes[grid.name] = hash;
    }
    return hashes;
  }

  void flush() { require(world_.flush()); }

 private:
  void add_ship(int number) {
    Ship ship;
    quoin::SceneGrid grid{.name = "ship " + std::to_string(number)};
    grid.grid = build_ship(number);
    ship.home = {kWidth * 2.0 * (number % 10), kWidth * (number / 100), kWidth * (number / 10 % 10)};
    ship.grid = world_.scene().add_grid(std::move(grid));
    ship.instance = world_.scene().add_instance({.name = "ship", .grid = ship.grid, .position = ship.home});
    ship.pieces.update(world_.scene().grids()[ship.grid].grid);
    ships_.push_back(std::move(ship));
  }

  void frame(FrameMeter& meter, int shots) {
    meter.begin();
    quoin::Scene& scene = world_.scene();
    move_all(scene);
    meter.part("move");
    const std::size_t cuts_before = cuts_.size();
    for (int i = 0; i < shots; ++i) shoot_once(scene);
    meter.part("shots");
    check_bodies(scene);
    meter.skip();
    const quoin::Viewer viewer{.position = {200.0, 100.0, 200.0}};
    require(world_.update({&viewer, 1}));
    meter.part("StreamedWorld::update");
    tracer_.update(scene);
    meter.part("LiveTracer::update");
    const std::uint64_t state = meshes_.update(scene, viewer.position);
    meter.part("LiveMeshes::update");
    constexpr auto kAll = std::numeric_limits<std::size_t>::max();
    games::end_frame(meter, tracer_, meshes_, kAll, shown_, [this](const auto& update) { upload(update); });
    for (std::size_t i = cuts_before; i < cuts_.size(); ++i) cuts_[i].added_in = state;
    check_cuts();
  }

  // Copies the vertices of a surface. The short version compares the copy with the surface.
  void upload(const quoin::SurfaceUpdate& update) {
    if (update.surface == nullptr || update.surface->converted == nullptr) return;
    const auto& vertices = *static_cast<const std::vector<Vertex>*>(update.surface->converted.get());
    staging_.copy(std::as_bytes(std::span(vertices)));
    if (!options_.is_short) return;
    const std::vector<Vertex> expected = make_vertices(*update.surface);
    wrong_uploads_ += staging_.ends_with(std::as_bytes(std::span(expected))) ? 0 : 1;
    ++uploads_;
  }

  void move_all(quoin::Scene& scene) {
    time_ += 1.0 / 60.0;
    for (std::size_t i = 0; i < ships_.size(); ++i) {
      const double phase = 0.3 * time_ + 0.7 * static_cast<double>(i);
      quoin::Instance& instance = scene.edit(ships_[i].instance);
      instance.position = ships_[i].home + 4.0 * DVec3(std::cos(phase), std::sin(1.3 * phase), std::sin(phase));
      instance.rotation = glm::angleAxis(0.2 * std::sin(phase), glm::normalize(DVec3(1.0, 2.0, 0.5)));
    }
    std::erase_if(debris_, [&](Debris& piece) {
      const auto waits = [&](const Cut& cut) { return cut.piece == piece.grid; };
      if (--piece.frames_left <= 0 && std::none_of(cuts_.begin(), cuts_.end(), waits)) {
        scene.remove_grid(piece.grid);
        return true;
      }
      scene.edit(piece.instance).position += piece.velocity;
      return false;
    });
  }

  // A ray through a ship, as the tracer shows it; the ship of now loses a ball of voxels.
  void shoot_once(quoin::Scene& scene) {
    ++shots_;
    const auto random = [&](int seed, double range) {
      return range * (quoin::hash_of(5, shots_, seed) % 1'000U / 1'000.0 - 0.5);
    };
    const auto aimed = static_cast<std::size_t>(quoin::hash_of(5, shots_, 9) % ships_.size());
    const DVec3 target =
        scene.instances()[ships_[aimed].instance].position + DVec3(random(1, 44.0), random(2, 16.0), random(3, 16.0));
    const DVec3 from = target + DVec3(random(4, 20.0), 20.0, random(5, 20.0));
    const auto hit = first_hit(tracer_.shown(), {from, target - from}, 2.0);
    if (!hit) return;
    const auto ship =
        std::find_if(ships_.begin(), ships_.end(), [&](const Ship& other) { return other.instance == hit->instance; });
    // A ship whose last cut is not shown yet would make the check of that cut ambiguous.
    if (ship == ships_.end() || ship->cuts_waiting > 0) return;
    quoin::Grid& voxels = scene.edit(ship->grid).grid;
    voxels.fill_sphere(DVec3(hit->voxel) + 0.5, 2.2, quoin::kAir);
    cut_pieces(scene, *ship, voxels);
    if (voxels.voxel_count() < kSmallestShip && ship->cuts_waiting == 0) {
      for (const IVec3 chunk : voxels.chunks()) voxels.put_chunk(chunk, quoin::Chunk());
      const quoin::Grid rebuilt = build_ship(static_cast<int>(ship - ships_.begin()));
      for (const IVec3 chunk : rebuilt.chunks()) voxels.put_chunk(chunk, *rebuilt.find_chunk(chunk));
      ship->pieces.update(voxels);
    }
    ship->shapes.update(voxels, scene.types);
    changed_ships_.push_back(static_cast<std::size_t>(ship - ships_.begin()));
  }

  // Everything except the largest piece becomes debris; crumbs disappear.
  void cut_pieces(quoin::Scene& scene, Ship& ship, quoin::Grid& voxels) {
    ship.pieces.update(voxels);
    const auto pieces = ship.pieces.pieces();
    const auto by_voxels = [](const quoin::ConnectedPiece& a, const quoin::ConnectedPiece& b) {
      return a.voxels < b.voxels;
    };
    const auto largest =
        static_cast<std::size_t>(std::max_element(pieces.begin(), pieces.end(), by_voxels) - pieces.begin());
    bool is_cut = false;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      if (i == largest) continue;
      if (pieces[i].voxels >= kSmallestPiece) add_debris(scene, ship, i);
      ship.pieces.remove_from(voxels, i);
      is_cut = true;
    }
    if (is_cut) ship.pieces.update(voxels);
  }

  void add_debris(quoin::Scene& scene, Ship& ship, std::size_t piece) {
    const quoin::MassProperties body = mass_properties(ship.pieces, piece, density_of);
    quoin::SceneGrid grid{.name = "debris", .pivot = body.centre, .saved = false};
    grid.grid = ship.pieces.extract(piece);
    Cut cut{
        .ship = static_cast<std::size_t>(&ship - ships_.data()), .piece = {}, .faces = probes(scene, ship, grid.grid)};
    const quoin::Instance of_ship = scene.instances()[ship.instance];
    quoin::Instance instance = of_ship;
    instance.name = "debris";
    instance.saved = false;
    instance.position = world_from_grid(of_ship, scene.grids()[ship.grid], body.centre);
    instance.grid = cut.piece = scene.add_grid(std::move(grid));
    const DVec3 away = instance.position - of_ship.position;
    const double length = glm::length(away);
    const DVec3 velocity = length > 0.0 ? away * (0.5 / (length * (1.0 + std::cbrt(body.mass)))) : DVec3(0.0);
    debris_.push_back({cut.piece, scene.add_instance(instance), velocity, 300});
    if (cut.faces.empty()) return;
    cut.start_ms = games::wall_ms();
    ++ship.cuts_waiting;
    cuts_.push_back(std::move(cut));
  }

  // Faces that the ship shows at the moment, of voxels of the piece.
  std::vector<std::pair<IVec3, Direction>> probes(const quoin::Scene& scene, const Ship& ship,
                                                  const quoin::Grid& piece) const {
    std::vector<std::pair<IVec3, Direction>> faces;
    piece.for_each([&](IVec3 voxel, VoxelType type) {
      if (faces.size() >= 8 || !scene.types.is_opaque(type)) return;
      for (const Direction side : quoin::kDirections) {
        if (piece.get(voxel + quoin::normal_of(side)) == quoin::kAir && shown_.face(ship.grid, voxel, side)) {
          faces.emplace_back(voxel, side);
        }
      }
    });
    return faces;
  }

  // The instance of a piece is drawn as soon as the state that added it is shown (LiveMeshes, "Instances").
  void check_cuts() {
    const std::uint64_t state = meshes_.shown_update();
    std::erase_if(cuts_, [&](Cut& cut) {
      const bool draws_piece = state >= cut.added_in;
      std::size_t in_ship = 0, in_piece = 0;
      for (const auto& [voxel, side] : cut.faces) {
        const bool ship_shows = shown_.face(ships_[cut.ship].grid, voxel, side).has_value();
        const bool piece_shows = draws_piece && shown_.face(cut.piece, voxel, side).has_value();
        in_ship += ship_shows ? 1U : 0U;
        in_piece += piece_shows ? 1U : 0U;
        if (ship_shows && piece_shows) cut.was_doubled = true;
        if (!ship_shows && !piece_shows) cut.was_torn = true;
      }
      if (in_piece != cut.faces.size() || in_ship != 0) return false;
      torn_ += cut.was_torn ? 1 : 0;
      doubled_ += cut.was_doubled ? 1 : 0;
      latencies_ms_.push_back(games::wall_ms() - cut.start_ms);
      --ships_[cut.ship].cuts_waiting;
      return true;
    });
  }

  // Boxes and mass of the ships that were hit, against their voxels. The shapes of 50 ships are compared.
  void check_bodies(const quoin::Scene& scene) {
    for (const std::size_t changed : changed_ships_) {
      if (bodies_ >= 50) break;
      const Ship& ship = ships_[changed];
      const quoin::Grid& voxels = scene.grids()[ship.grid].grid;
      std::int64_t in_boxes = 0;
      for (const IVec3 chunk : voxels.chunks()) {
        for (const quoin::IBox& box : ship.shapes.boxes(chunk)) {
          const IVec3 size = box.size();
          in_boxes += std::int64_t{size.x} * size.y * size.z;
        }
      }
      double mass = 0.0;
      DVec3 moment{0.0};
      voxels.for_each([&](IVec3 voxel, VoxelType type) {
        mass += density_of(type);
        moment += density_of(type) * (DVec3(voxel) + 0.5);
      });
      const quoin::MassProperties body = mass_properties(voxels, density_of);
      const bool is_right = in_boxes == voxels.voxel_count() && std::abs(body.mass - mass) < 1e-6 * mass &&
                            glm::length(body.centre - moment / mass) < 1e-6;
      wrong_bodies_ += is_right ? 0 : 1;
      ++bodies_;
    }
    changed_ships_.clear();
  }

  games::Options options_;
  quoin::StreamedWorld world_;
  quoin::LiveMeshes meshes_;
  quoin::LiveTracer tracer_;
  std::vector<Ship> ships_;
  std::vector<Debris> debris_;
  std::vector<Cut> cuts_;
  std::vector<std::size_t> changed_ships_;
  std::vector<double> latencies_ms_;
  games::Shown shown_;
  games::Staging staging_{std::size_t{4} << 20};
  double time_ = 0.0;
  int shots_ = 0;
  std::int64_t torn_ = 0, doubled_ = 0, wrong_bodies_ = 0, bodies_ = 0, wrong_uploads_ = 0, uploads_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  quoin::return_freed_memory();
  const games::Options options = games::parse(argc, argv);
  games::Report report("ships", options);
  std::filesystem::remove(options.folder / "ships.quoin");
  std::map<std::string, std::uint64_t> saved;
  {
    const double wall = games::wall_ms(), process = games::process_ms();
    Game game(options);
    game.settle();
    report_loading(report, wall, process, std::nullopt);
    game.move(report);
    game.shoot(report);
    game.report_memory(report);
    if (options.is_short) game.compare_with_new_meshes(report);
    game.flush();
    saved = game.hashes();
  }
  const Game again(options);
  const auto opened = again.hashes();
  std::int64_t different = opened.size() == saved.size() ? 0 : 1;
  for (const auto& [name, hash] : saved) {
    const auto found = opened.find(name);
    different += found == opened.end() || found->second != hash ? 1 : 0;
  }
  report.faults("differ after opening the world again", different, static_cast<std::int64_t>(saved.size()), "ships");
  return report.finish();
}
