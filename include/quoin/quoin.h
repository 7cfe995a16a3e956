#pragma once

/// All of Quoin. Including one folder's headers instead builds faster.

#include <quoin/core/direction.h>
#include <quoin/core/image.h>
#include <quoin/core/instruction_set.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/slot_map.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/neighbourhood.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/io/file.h>
#include <quoin/io/formats.h>
#include <quoin/io/gltf.h>
#include <quoin/io/obj.h>
#include <quoin/io/picture_files.h>
#include <quoin/io/scene_meshes.h>
#include <quoin/io/vox.h>
#include <quoin/light/light_options.h>
#include <quoin/mesh/blocky.h>
#include <quoin/mesh/blocky_mesh.h>
#include <quoin/mesh/occlusion.h>
#include <quoin/mesh/quad.h>
#include <quoin/mesh/visible_faces.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_tracer.h>
#include <quoin/terrain/noise.h>
#include <quoin/terrain/terrain.h>
#include <quoin/trace/occupancy_tree.h>
#include <quoin/trace/packet.h>
#include <quoin/trace/ray.h>
