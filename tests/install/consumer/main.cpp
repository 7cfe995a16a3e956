// A program outside Quoin's tree: fills a box and meshes it as blocks and as a smooth surface.

#include <cstdio>

#include <quoin/quoin.h>

int main() {
  quoin::Scene scene;
  quoin::VoxelProperties stone;
  stone.name = "stone";
  stone.colour = {130, 130, 135, 255};
  const auto type = scene.types.add(stone);
  if (!type) return 1;
  quoin::SceneGrid box;
  box.grid.fill_box({{0, 0, 0}, {10, 10, 10}}, *type);
  const quoin::GridHandle handle = scene.add_grid(std::move(box));
  quoin::Instance placed;
  placed.grid = handle;
  scene.add_instance(placed);

  const auto mesh = quoin::build_blocky_mesh(scene.grids()[handle].grid, scene.types, {});
  if (!mesh || mesh->quads != 6) return 1;
  // Linking must also find the features that only some builds have.
  auto smooth = quoin::build_smooth_mesh(*quoin::field_from_grid(scene.grids()[handle].grid), scene.types, {});
  if (!smooth || smooth->indices.empty()) return 1;
  if (quoin::simplify_smooth_mesh(*smooth, 0.1F).has_value() != quoin::can_simplify()) return 1;
  // Formats of worlds are registered before main; a static library must not lose them.
  if (!quoin::format_with_extension("home.quoin", quoin::FormatCapability::Read)) return 2;
  std::printf("%lld faces in %lld quads\n", static_cast<long long>(mesh->faces_visible),
              static_cast<long long>(mesh->quads));
  return 0;
}
