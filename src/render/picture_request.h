#pragma once

#include <quoin/render/cpu_renderer.h>

namespace quoin {

/// InvalidArgument for sizes and cameras that no renderer takes.
[[nodiscard]] Status check_picture(const Camera& camera, int width, int height);

/// The errors of CpuRenderer::render, which are those of every renderer.
[[nodiscard]] Status check(const Camera& camera, const RenderOptions& options);

/// A picture of the size asked for, with depths if they are.
[[nodiscard]] Picture empty_picture(const RenderOptions& options);

}  // namespace quoin
