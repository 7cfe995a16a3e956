// Shapes that quads do not contain: workers build doors and flowers from the voxels that they mesh. A door that opens
// is built again. The function is replaced while workers run, as when a game loads a plug-in again.

#include <bit>
#include <cstdio>
#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include <quoin/live/live_meshes.h>

namespace {

enum class Shape : unsigned char { ClosedDoor, OpenDoor, Flower, WitheredFlower };

// A shape in a voxel of a chunk. A renderer draws one instance of a small mesh for each.
struct Model {
  quoin::IVec3 voxel{0};
  Shape shape = Shape::Flower;
};
using Models = std::vector<Model>;

struct Types {
  quoin::VoxelType grass = quoin::kAir;
  quoin::VoxelType door = quoin::kAir;
  quoin::VoxelType flower = quoin::kAir;
};

quoin::Result<Types> add_types(quoin::Scene& scene) {
  using quoin::Visibility;
  const auto grass = scene.types.add({.name = "grass", .colour = {92, 138, 62, 255}});
  const auto door = scene.types.add({.name = "door",
                                     .colour = {134, 98, 66, 255},
                                     .visibility = Visibility::Transparent,
                                     .state_bits = 1,
                                     .remesh_on_data = true});
  const auto flower =
      scene.types.add({.name = "flower", .colour = {220, 60, 60, 255}, .visibility = Visibility::Transparent});
  for (const auto* type : {&grass, &door, &flower}) {
    if (!*type) return type->error();
  }
  return Types{*grass, *door, *flower};
}

template <class Visit>
void visit_voxels(const quoin::Chunk& chunk, quoin::VoxelType type, const Visit& visit) {
  for (int z = 0; z < quoin::kChunkEdge; ++z) {
    for (int y = 0; y < quoin::kChunkEdge; ++y) {
      for (auto row = chunk.row_mask(y, z, type); row != 0; row &= row - 1) {
        visit(quoin::IVec3{std::countr_zero(row), y, z});
      }
    }
  }
}

quoin::SurfaceConverter model_builder(const Types& types) {
  return [types](const quoin::SurfaceUpdate&, const quoin::SurfaceContext& context) {  // on a worker
    const quoin::Neighbourhood& voxels = context.voxels;  // of the chunk and its 26 neighbours
    auto models = std::make_shared<Models>();
    visit_voxels(*voxels.centre(), types.door, [&](quoin::IVec3 at) {
      models->push_back({at, voxels.data(at).state == 0 ? Shape::ClosedDoor : Shape::OpenDoor});
    });
    visit_voxels(*voxels.centre(), types.flower, [&](quoin::IVec3 at) {
      const bool has_ground = voxels.get(at - quoin::IVec3{0, 1, 0}) == types.grass;
      models->push_back({at, has_ground ? Shape::Flower : Shape::WitheredFlower});
    });
    return quoin::ConvertedSurface(models, models->size() * sizeof(Model));
  };
}

// The models that a renderer would draw.
class Shown {
 public:
  // Returns the number of chunks with new models.
  std::size_t apply(const std::vector<quoin::SurfaceUpdate>& updates) {
    for (const quoin::SurfaceUpdate& update : updates) {
      Models& models = chunks_[{update.chunk.x, update.chunk.y, update.chunk.z}];
      models.clear();
      if (update.surface == nullptr || update.surface->converted == nullptr) continue;
      models = *static_cast<const Models*>(update.surface->converted.get());
    }
    return updates.size();
  }
  [[nodiscard]] int count(Shape shape) const {
    int found = 0;
    for (const auto& [chunk, models] : chunks_) {
      for (const Model& model : models) found += model.shape == shape ? 1 : 0;
    }
    return found;
  }

 private:
  std::map<std::tuple<int, int, int>, Models> chunks_;
};

}  // namespace

int main() {
  quoin::Scene scene;
  const auto types = add_types(scene);
  if (!types) return 1;
  quoin::SceneGrid garden;
  garden.grid.fill_box({{0, 0, 0}, {192, 10, 192}}, types->grass);
  for (int i = 0; i < 192; i += 3) garden.grid.set({i, 10, i * 7 % 192}, types->flower);
  const quoin::IVec3 door{100, 10, 100};
  garden.grid.set(door, types->door);
  const quoin::GridHandle grid = scene.add_grid(std::move(garden));
  scene.add_instance({"", grid});

  quoin::LiveMeshOptions options;
  options.convert = model_builder(*types);
  quoin::LiveMeshes meshes(options);
  Shown shown;
  const auto frame = [&] {  // a game calls `update` and `take` in each frame instead
    meshes.finish(scene, quoin::DVec3(door));
    return shown.apply(meshes.take());
  };
  frame();
  std::printf("%d flowers, %d closed doors\n", shown.count(Shape::Flower), shown.count(Shape::ClosedDoor));

  scene.edit(grid).grid.set_data(door, {.state = 1});
  const std::size_t meshed = frame();
  std::printf("the door opens: %zu chunk meshed, %d open doors\n", meshed, shown.count(Shape::OpenDoor));

  scene.edit(grid).grid.set({0, 9, 0}, quoin::kAir);  // below the first flower
  frame();
  std::printf("%d withered flowers\n", shown.count(Shape::WitheredFlower));

  meshes.set_convert(model_builder(*types));  // the former function runs no more; all chunks are converted again
  const std::size_t again = frame();
  std::printf("after the reload: %zu chunks converted\n", again);
  return meshed == 1 && shown.count(Shape::OpenDoor) == 1 && shown.count(Shape::WitheredFlower) == 1 && again == 9 ? 0
                                                                                                                   : 1;
}
