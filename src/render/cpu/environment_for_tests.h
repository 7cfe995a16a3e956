#pragma once

#include <quoin/render/path_tracer.h>
#include <quoin/scene/environment.h>

namespace quoin {

/// Returns the environment of an image's options to change it; the reference environment by default.
template <class Options>
[[nodiscard]] Environment& environment_in(Options& options) {
  if (!options.environment) options.environment = Environment::reference();
  return *options.environment;
}

/// Returns the natural environment with a physical sky.
[[nodiscard]] inline Environment physical_day() {
  Environment environment = Environment::natural();
  environment.sky.model = SkyModel::Physical;
  environment.exposure = 1.0;
  return environment;
}

/// Returns the environment of a path-traced image's options to change it; a day under a physical sky by default.
[[nodiscard]] inline Environment& physical_in(PathOptions& options) {
  if (!options.environment) options.environment = physical_day();
  return *options.environment;
}

}  // namespace quoin
