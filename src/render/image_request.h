#pragma once

#include <quoin/render/cpu_renderer.h>

namespace quoin {

/// Returns InvalidArgument for sizes and cameras that every renderer rejects.
[[nodiscard]] Status check_image(const Camera& camera, int width, int height);

/// Returns the argument errors of CpuRenderer::render, which all renderers share.
[[nodiscard]] Status check(const Camera& camera, const RenderOptions& options);

/// Returns an image of the requested size, with depths if requested.
[[nodiscard]] RenderedImage empty_image(const RenderOptions& options);

}  // namespace quoin
