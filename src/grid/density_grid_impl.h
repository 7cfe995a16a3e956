#pragma once

#include "grid/density_store.h"

namespace quoin {

struct DensityGrid::Impl {
  DensityStore store;
};

}  // namespace quoin
