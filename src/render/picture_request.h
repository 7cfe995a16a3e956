#pragma once

#include <quoin/render/cpu_renderer.h>

namespace quoin {

/// The errors of CpuRenderer::render, which are those of every renderer.
[[nodiscard]] Status check(const Camera& camera, const RenderOptions& options);

/// A picture of the size asked for, with depths if they are.
[[nodiscard]] Picture empty_picture(const RenderOptions& options);

}  // namespace quoin
