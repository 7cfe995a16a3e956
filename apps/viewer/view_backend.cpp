#include "view_backend.h"

namespace quoin::viewer {

namespace {

bool is_same(const LightOptions& a, const LightOptions& b) {
  return a.sun == b.sun && a.lit == b.lit && a.shadows == b.shadows && a.occlusion == b.occlusion &&
         a.occlusion_affects == b.occlusion_affects && a.occlusion_rays == b.occlusion_rays &&
         a.occlusion_distance == b.occlusion_distance && a.shadow_distance == b.shadow_distance &&
         a.exposure == b.exposure;
}

}  // namespace

bool is_same(const Camera& a, const Camera& b) {
  return a.position == b.position && a.right == b.right && a.up == b.up && a.forward == b.forward &&
         a.projection == b.projection && a.vertical_fov == b.vertical_fov && a.view_height == b.view_height;
}

bool is_same(const ViewRequest& a, const ViewRequest& b) {
  return a.width == b.width && a.height == b.height && a.samples == b.samples &&
         a.detail_by_pixels == b.detail_by_pixels && a.detail_colours == b.detail_colours && a.mode == b.mode &&
         a.shading == b.shading && a.wireframe == b.wireframe && is_same(a.camera, b.camera) &&
         is_same(a.light, b.light);
}

}  // namespace quoin::viewer
