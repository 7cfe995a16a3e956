// Reads a MagicaVoxel file and writes it as GLB: vox_to_glb IN.vox OUT.glb. Without arguments it creates its own input.

#include <cstdio>
#include <string>

#include <quoin/quoin.h>

namespace {

quoin::Status write_sample(const std::string& path) {
  quoin::Scene scene;
  quoin::VoxelProperties brick;
  brick.name = "brick";
  brick.colour = {170, 74, 60, 255};
  const auto type = scene.types.add(brick);
  if (!type) return type.error();
  quoin::SceneGrid stairs;
  stairs.name = "stairs";
  for (int step = 0; step < 8; ++step) stairs.grid.fill_box({{0, 0, step}, {6, step + 1, step + 1}}, *type);
  quoin::Instance placed;
  placed.grid = scene.add_grid(std::move(stairs));
  scene.add_instance(placed);
  const auto saved = quoin::save_scene(scene, path);
  if (!saved) return saved.error();
  return {};
}

quoin::Status convert(const std::string& in, const std::string& out) {
  const auto loaded = quoin::load_scene(in, {});
  if (!loaded) return loaded.error();
  const auto meshes = quoin::mesh_scene(loaded->scene);
  if (!meshes) return meshes.error();
  const auto size = quoin::write_mesh(*meshes, out);
  if (!size) return size.error();
  std::printf("%lld quads, %llu bytes\n", static_cast<long long>(meshes->stats.quads),
              static_cast<unsigned long long>(*size));
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 || argc > 3) {
    std::fprintf(stderr, "usage: vox_to_glb [IN.vox OUT.glb]\n");
    return 2;
  }
  const bool has_input = argc == 3;
  const std::string in = has_input ? argv[1] : "stairs.vox";
  const std::string out = has_input ? argv[2] : "stairs.glb";
  quoin::Status status = has_input ? quoin::Status{} : write_sample(in);
  if (status) status = convert(in, out);
  if (!status) std::fprintf(stderr, "vox_to_glb: %s\n", quoin::to_string(status.error()).c_str());
  return status ? 0 : 1;
}
