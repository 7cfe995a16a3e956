// Meshes that follow the edits of a world. Workers mesh snapshots, so the game's own thread never waits. The example
// blasts one crater per frame into a plain. OUT.png (default craters.png) shows the world at the end.

#include <cstdio>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include <quoin/io/image_files.h>
#include <quoin/live/live_meshes.h>
#include <quoin/mesh/vertex_writer.h>
#include <quoin/render/cpu_renderer.h>

namespace {

quoin::Result<quoin::GridHandle> add_plain(quoin::Scene& scene) {
  quoin::SceneGrid plain;
  int top = 0;
  for (const auto& [colour, height] :
       {std::pair{quoin::Rgba8{104, 100, 98, 255}, 10}, {{134, 98, 66, 255}, 6}, {{92, 138, 62, 255}, 2}}) {
    quoin::VoxelProperties properties;
    properties.colour = colour;
    const auto type = scene.types.add(properties);
    if (!type) return type.error();
    plain.grid.fill_box({{0, top, 0}, {256, top + height, 256}}, *type);
    top += height;
  }
  const quoin::GridHandle handle = scene.add_grid(std::move(plain));
  scene.add_instance({"", handle});
  return handle;
}

// The meshes that a renderer would hold, with the vertices to upload; this example only counts their triangles.
class Shown {
 public:
  void apply(const std::vector<quoin::SurfaceUpdate>& updates) {
    for (const quoin::SurfaceUpdate& update : updates) {
      surfaces_[{update.chunk.x, update.chunk.y, update.chunk.z}] = update.surface;  // null if the chunk has no surface
    }
  }
  [[nodiscard]] std::int64_t triangles() const {
    std::int64_t sum = 0;
    for (const auto& [chunk, surface] : surfaces_) sum += surface == nullptr ? 0 : surface->triangles();
    return sum;
  }

 private:
  std::map<std::tuple<int, int, int>, std::shared_ptr<const quoin::ChunkSurface>> surfaces_;
};

quoin::Status draw(const quoin::Scene& scene, const std::string& path) {
  quoin::RenderOptions options;
  options.width = 480;
  options.height = 270;
  options.samples = 4;
  const quoin::Camera camera = quoin::frame_scene(scene, quoin::View::Iso, 480.0 / 270.0);
  const auto image = quoin::CpuRenderer(scene).render(camera, options);
  if (!image) return image.error();
  const auto size = quoin::write_png(image->colour, path);
  return size ? quoin::Status() : size.error();
}

}  // namespace

int main(int argc, char** argv) {
  quoin::Scene scene;
  const auto plain = add_plain(scene);
  if (!plain) return 1;
  const quoin::DVec3 eye{128.0, 60.0, 128.0};  // near chunks are meshed first

  const quoin::VertexWriter writer({16,
                                    {{quoin::VertexAttribute::Position, quoin::VertexFormat::Float32x3, 0},
                                     {quoin::VertexAttribute::Colour, quoin::VertexFormat::Unorm8x4Srgb, 12}}},
                                   scene.types);
  quoin::LiveMeshOptions options;
  options.convert = [&](const quoin::SurfaceUpdate& update) {  // on a worker
    const quoin::QuadBuffer& quads = update.surface->quads;
    const quoin::ShapeFaceBuffer& shapes = update.surface->shapes;  // of types that are no cubes
    const std::size_t bytes_of_quads = writer.bytes_needed(quoin::vertices_needed(quads.size()));
    const std::size_t bytes = writer.bytes_needed(quoin::vertices_needed(quads.size() + shapes.size()));
    auto vertices = std::make_shared<std::vector<std::byte>>(bytes);
    const quoin::Vec3 origin(update.chunk * quoin::kChunkEdge);
    writer.write(quads, origin, *vertices);
    writer.write(shapes, origin, std::span(*vertices).subspan(bytes_of_quads));
    return quoin::ConvertedSurface(vertices, bytes);  // `take` counts these bytes
  };
  quoin::LiveMeshes meshes(options);
  Shown shown;
  unsigned random = 1;
  for (int frame = 0; frame < 60; ++frame) {
    random = random * 1'664'525U + 1'013'904'223U;
    const quoin::DVec3 blast{static_cast<double>(random >> 24), 18.0, static_cast<double>(random >> 16 & 255)};
    scene.edit(*plain).grid.fill_sphere(blast, 5.0 + frame % 9, quoin::kAir);
    meshes.update(scene, eye);   // follows the edits; the cost depends on the changes only
    shown.apply(meshes.take());  // uploads the meshes that the workers have finished
  }
  meshes.finish(scene, eye);
  shown.apply(meshes.take());
  const quoin::LiveMeshes::Stats stats = meshes.stats();
  std::printf("%lld triangles; chunks were meshed %lld times, the last in %.2f ms\n",
              static_cast<long long>(shown.triangles()), static_cast<long long>(stats.chunks_meshed),
              1e3 * stats.last_mesh_seconds);
  const quoin::Status status = draw(scene, argc > 1 ? argv[1] : "craters.png");
  if (!status) std::fprintf(stderr, "live_meshes: %s\n", quoin::to_string(status.error()).c_str());
  return status && shown.triangles() > 0 && meshes.pending() == 0 ? 0 : 1;
}
