#include "view_backend.h"

namespace quoin::viewer {

double seconds_known(double known, double measured) {
  constexpr double kNews = 0.3;  // the share of what is new
  return known > 0.0 ? known + kNews * (measured - known) : measured;
}

bool is_same(const ViewRequest& a, const ViewRequest& b) {
  return a.width == b.width && a.height == b.height && a.samples == b.samples &&
         a.detail_by_pixels == b.detail_by_pixels && a.detail_colours == b.detail_colours && a.mode == b.mode &&
         a.wireframe == b.wireframe && a.look == b.look && a.slice == b.slice && a.whole_only == b.whole_only &&
         a.camera == b.camera && a.light == b.light;
}

}  // namespace quoin::viewer
