#pragma once

#include "grid/density/density_store.h"

namespace quoin {

struct DensityGrid::Impl {
  explicit Impl(float band) : store(band) {}
  DensityStore store;
};

}  // namespace quoin
