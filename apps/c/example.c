/* Makes a hill of two voxel types with a slab on its top, meshes it, renders it, casts a ray at it and saves it. */
#include <stdio.h>
#include <stdlib.h>

#include "quoin.h"

static void must(quoin_status status) {
  if (status == QUOIN_OK) return;
  fprintf(stderr, "quoin: %s\n", quoin_last_error());
  exit(1);
}

/* Adds a type of half cubes. */
static uint16_t add_slab(quoin_scene scene) {
  quoin_type type = QUOIN_INIT(quoin_type);
  type.rgba[0] = 170, type.rgba[1] = 170, type.rgba[2] = 165, type.rgba[3] = 255, type.roughness = 1.0F;
  uint16_t slab = 0;
  must(quoin_type_add(scene, &type, &slab));
  quoin_shape_element box = QUOIN_INIT(quoin_shape_element);
  box.max[0] = 16.0F, box.max[1] = 8.0F, box.max[2] = 16.0F; /* sixteenths of a voxel */
  quoin_shape_part part = QUOIN_INIT(quoin_shape_part);
  part.element_count = 1;
  quoin_shapes shapes = QUOIN_INIT(quoin_shapes);
  shapes.parts = &part, shapes.part_count = 1;
  shapes.elements = &box, shapes.element_count = 1;
  shapes.groups = 1;
  must(quoin_type_set_shapes(scene, slab, &shapes));
  return slab;
}

int main(void) {
  enum { EDGE = 32, WIDTH = 160, HEIGHT = 120 };
  static uint8_t voxels[EDGE][EDGE][EDGE]; /* x, y, z */
  static uint8_t image[HEIGHT][WIDTH][3];
  for (int x = 0; x < EDGE; ++x) {
    for (int z = 0; z < EDGE; ++z) {
      const int dx = x - EDGE / 2, dz = z - EDGE / 2;
      const int top = 20 - (dx * dx + dz * dz) / 16;
      for (int y = 0; y <= top; ++y) voxels[x][y][z] = y == top ? 2 : 1;
    }
  }

  quoin_scene scene = 0;
  must(quoin_scene_create(&scene));
  quoin_type rock = QUOIN_INIT(quoin_type), grass = QUOIN_INIT(quoin_type);
  rock.rgba[0] = 130, rock.rgba[1] = 125, rock.rgba[2] = 120, rock.rgba[3] = 255, rock.roughness = 1.0F;
  grass.rgba[0] = 90, grass.rgba[1] = 160, grass.rgba[2] = 70, grass.rgba[3] = 255, grass.roughness = 1.0F;
  uint16_t type = 0;
  must(quoin_type_add(scene, &rock, &type));
  must(quoin_type_add(scene, &grass, &type));

  quoin_array array = QUOIN_INIT(quoin_array);
  array.data = voxels;
  array.scalar = QUOIN_UINT8;
  array.shape[0] = array.shape[1] = array.shape[2] = EDGE;
  array.strides[0] = EDGE * EDGE, array.strides[1] = EDGE, array.strides[2] = 1;
  must(quoin_grid_add(scene, &array, "hill", NULL));
  const uint16_t slab = add_slab(scene);
  array.data = &slab;
  array.scalar = QUOIN_UINT16;
  array.shape[0] = array.shape[1] = array.shape[2] = 1;
  array.origin[0] = array.origin[2] = EDGE / 2, array.origin[1] = 21.0;
  must(quoin_grid_write(scene, 0, &array));

  quoin_mesh mesh = 0;
  quoin_mesh_data data = QUOIN_INIT(quoin_mesh_data);
  must(quoin_grid_mesh(scene, 0, NULL, &mesh));
  must(quoin_mesh_view(mesh, &data));
  printf("%zu triangles, %zu vertices\n", data.index_count / 3, data.vertex_count);

  quoin_render_options options = QUOIN_INIT(quoin_render_options);
  options.width = WIDTH;
  options.height = HEIGHT;
  must(quoin_scene_render(scene, &options, &image[0][0][0], sizeof image));

  const double origin[3] = {EDGE / 2 + 0.5, 100.0, EDGE / 2 + 0.5}, down[3] = {0.0, -1.0, 0.0};
  double t = 0.0;
  quoin_hits hits = QUOIN_INIT(quoin_hits);
  hits.t = &t;
  must(quoin_scene_rays(scene, 1, origin, down, 1000.0, &hits));
  printf("the slab on the hill is %g below\n", t);

  must(quoin_scene_save(scene, "hill.vox"));
  must(quoin_scene_save(scene, "hill.glb"));
  must(quoin_free(mesh));
  must(quoin_free(scene));
  return t == 78.5 && data.index_count > 0 ? 0 : 1;
}
