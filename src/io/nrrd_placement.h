#pragma once

#include "io/nrrd_fields.h"
#include "io/volume_header.h"

namespace quoin::nrrd {

/// Sets spacing, world_from_voxel and units of a volume whose axes are the first three of `dimensions`.
/// Errors: BadFormat for fields that are no vectors or numbers; Unsupported for axes that are none of space.
[[nodiscard]] Status place(const Fields& fields, std::size_t dimensions, Volume& volume);

}  // namespace quoin::nrrd
