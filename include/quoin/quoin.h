#pragma once

/// Includes all of Quoin. Including only the headers of one folder builds faster.
///
/// These rules hold everywhere unless a header says otherwise:
///
/// Space:    right-handed, +Y up. Voxel (i, j, k) fills the cube from (i, j, k) to (i + 1, j + 1, k + 1) of its grid.
///           Voxel boxes exclude their `max`. Angles are in radians unless a name says degrees.
/// Errors:   failures caused by external input (files, options, devices) give a Result; absence gives an optional or a
///           null pointer. A violated `Requires:` is a programming error: see QUOIN_ASSERT. Functions throw only
///           bad_alloc, and std::system_error if threads cannot be started.
/// Threads:  any number of threads may read an object at once; changing it needs exclusive access. Functions that take
///           Threads return when all their threads are done, with the same result at any thread count. Threads{0} means
///           the same everywhere, and `set_job_system` sets one limit for all work: see quoin/core/parallel.h.
/// Lifetime: arguments are read during the call and not kept. Headers document each exception and its required
///           lifetime.
/// Moving:   a moved-from object may only be assigned to or destroyed.

#include <quoin/core/assert.h>
#include <quoin/core/axis_orientation.h>
#include <quoin/core/buffer.h>
#include <quoin/core/changes.h>
#include <quoin/core/direction.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/half.h>
#include <quoin/core/hash.h>
#include <quoin/core/image.h>
#include <quoin/core/memory.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/ref.h>
#include <quoin/core/result.h>
#include <quoin/core/slot_map.h>
#include <quoin/core/thousands.h>
#include <quoin/core/vec.h>
#include <quoin/grid/changes.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/connected.h>
#include <quoin/grid/copy_box.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/downsample.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/mass.h>
#include <quoin/grid/texture.h>
#include <quoin/grid/volume.h>
#include <quoin/grid/voxel_field.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/grid/voxel_shape.h>
#include <quoin/io/block_packs.h>
#include <quoin/io/chunk_source.h>
#include <quoin/io/file.h>
#include <quoin/io/file_format.h>
#include <quoin/io/formats.h>
#include <quoin/io/heights.h>
#include <quoin/io/image_files.h>
#include <quoin/io/loaded_scene.h>
#include <quoin/io/mesh_file.h>
#include <quoin/io/scene_file.h>
#include <quoin/io/volume.h>
#include <quoin/io/vox.h>
#include <quoin/live/live_light.h>
#include <quoin/live/live_meshes.h>
#include <quoin/live/live_tracer.h>
#include <quoin/map/world_map.h>
#include <quoin/mesh/array_surface.h>
#include <quoin/mesh/blocky.h>
#include <quoin/mesh/label_surfaces.h>
#include <quoin/mesh/mesh_view.h>
#include <quoin/mesh/occlusion.h>
#include <quoin/mesh/quad.h>
#include <quoin/mesh/quad_triangles.h>
#include <quoin/mesh/smooth.h>
#include <quoin/mesh/smooth_mesh.h>
#include <quoin/mesh/smooth_occlusion.h>
#include <quoin/mesh/vertex_writer.h>
#include <quoin/mesh/visible_faces.h>
#include <quoin/render/chunk_surface.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/render/impostor.h>
#include <quoin/render/impostor_cache.h>
#include <quoin/render/light_options.h>
#include <quoin/render/lit_meshes.h>
#include <quoin/render/path_history.h>
#include <quoin/render/path_tracer.h>
#include <quoin/render/propagated_light.h>
#include <quoin/render/surface_light.h>
#include <quoin/render/vulkan_device.h>
#include <quoin/render/vulkan_image.h>
#include <quoin/render/vulkan_mesh_renderer.h>
#include <quoin/render/vulkan_renderer.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/environment.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_animation.h>
#include <quoin/scene/scene_faces.h>
#include <quoin/scene/scene_meshes.h>
#include <quoin/scene/scene_query.h>
#include <quoin/scene/scene_tracer.h>
#include <quoin/scene/smooth_scene.h>
#include <quoin/scene/solid_shapes.h>
#include <quoin/scene/sweep.h>
#include <quoin/scene/volume_scene.h>
#include <quoin/store/world_import.h>
#include <quoin/store/world_maintenance.h>
#include <quoin/store/world_meshes.h>
#include <quoin/store/world_saver.h>
#include <quoin/store/world_store.h>
#include <quoin/stream/streamed_world.h>
#include <quoin/stream/world_edit.h>
#include <quoin/terrain/noise.h>
#include <quoin/terrain/terrain.h>
#include <quoin/trace/density_ray.h>
#include <quoin/trace/occupancy_tree.h>
#include <quoin/trace/packet.h>
#include <quoin/trace/ray.h>
#include <quoin/version.h>
#include <quoin/voxelize/triangle_mesh.h>
#include <quoin/voxelize/voxelize.h>
