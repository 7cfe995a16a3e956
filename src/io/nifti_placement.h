#pragma once

#include "io/nifti_fields.h"
#include "io/volume_header.h"

namespace quoin::nifti {

/// Sets spacing and world_from_voxel; warns of what a header says amiss and what was taken instead.
void place(const Fields& fields, Volume& volume);

}  // namespace quoin::nifti
