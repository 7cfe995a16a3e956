#include "screen.h"

#include <array>
#include <cstdlib>

#include <gtest/gtest.h>

namespace quoin::viewer {
namespace {

TEST(SdlScreen, DetectsSoftwareOpenGl) {
  for (const char* const name :
       {"llvmpipe (LLVM 15.0.6, 256 bits)", "softpipe", "Mesa DRI swrast", "Software Rasterizer"}) {
    EXPECT_TRUE(is_software_opengl(name)) << name;
  }
  for (const char* const name : {"", "NVIDIA GeForce RTX 3060/PCIe/SSE2", "Mesa Intel(R) UHD Graphics 620 (KBL GT2)",
                                 "AMD Radeon RX 6700 XT (navi22, LLVM 15.0.6, DRM 3.49)"}) {
    EXPECT_FALSE(is_software_opengl(name)) << name;
  }
}

// On a display with Mesa's software OpenGL, such as Xvfb.
TEST(SdlWindow, AvoidsSoftwareOpenGl) {
  ::setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
  for (const char* const name : {"SDL_VIDEODRIVER", "SDL_RENDER_DRIVER", "SDL_FRAMEBUFFER_ACCELERATION"}) {
    ::unsetenv(name);
  }
  const auto video = SdlVideo::start();
  if (!video) GTEST_SKIP() << video.error().message;
  const auto screen = open_sdl_screen(160, 90);
  ASSERT_TRUE(screen) << to_string(screen.error());
  SDL_RendererInfo info{};
  ASSERT_EQ(SDL_GetRendererInfo(SDL_GetRenderer((*screen)->window()), &info), 0) << sdl_says();
  EXPECT_STREQ(info.name, "software");
  EXPECT_STREQ(SDL_GetHint(SDL_HINT_FRAMEBUFFER_ACCELERATION), "0") << "otherwise SDL shows its image through OpenGL";
}

}  // namespace
}  // namespace quoin::viewer
