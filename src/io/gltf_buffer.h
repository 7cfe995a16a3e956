#pragma once

#include "io/block_writer.h"
#include "io/gltf_layout.h"

namespace quoin {

/// Writes the buffer that `layout` describes, converting vertex by vertex; ends on a multiple of four.
///
/// Requires: the writer stands at a multiple of four.
void write_gltf_buffer(const GltfLayout& layout, BlockWriter& out);

}  // namespace quoin
