/* The C API on a small cloud: a ramp, with points and normals in one array. */

#include <iine/iine.h>

#include <math.h>
#include <stdio.h>

enum { WIDTH = 320, HEIGHT = 240 };

/* Any layout will do, as long as its strides are multiples of 4 bytes; this is one array for both. */
typedef struct point {
  float x, y, z;
  float nx, ny, nz, curvature;
} point;

static point cloud[HEIGHT * WIDTH];

static void make_ramp(void) {
  const float focal_length = 262.5f;
  int row, column;
  for (row = 0; row < HEIGHT; ++row) {
    for (column = 0; column < WIDTH; ++column) {
      point *p = &cloud[row * WIDTH + column];
      const float u = ((float)column - WIDTH / 2) / focal_length;
      const float v = ((float)row - HEIGHT / 2) / focal_length;
      p->z = 2.0f / (1.0f + 0.5f * v); /* the plane z + y / 2 = 2 */
      p->x = u * p->z;
      p->y = v * p->z;
    }
  }
}

int main(void) {
  iine_estimator *estimator = NULL;
  iine_points points = {0};
  iine_normals normals = {0};
  int32_t status;
  int i, covered = 0;

  make_ramp();

  points.struct_size = sizeof points;
  points.width = WIDTH;
  points.height = HEIGHT;
  points.x = &cloud[0].x;
  points.y = &cloud[0].y;
  points.z = &cloud[0].z;
  points.point_stride = sizeof(point);

  normals.struct_size = sizeof normals;
  normals.nx = &cloud[0].nx;
  normals.ny = &cloud[0].ny;
  normals.nz = &cloud[0].nz;
  normals.point_stride = sizeof(point);
  normals.curvature = &cloud[0].curvature;
  normals.curvature_point_stride = sizeof(point);

  /* One estimator for all frames: it keeps its scratch memory. */
  status = iine_estimator_new(&estimator);
  if (status == IINE_OK) {
    status = iine_estimator_set_method(estimator, IINE_METHOD_COVARIANCE_MATRIX);
  }
  if (status == IINE_OK) {
    status = iine_estimator_compute(estimator, &points, &normals);
  }
  iine_estimator_free(estimator);
  if (status != IINE_OK) {
    fprintf(stderr, "iine: %s\n", iine_status_string(status));
    return 1;
  }

  for (i = 0; i < WIDTH * HEIGHT; ++i) {
    covered += isnan(cloud[i].nx) ? 0 : 1; /* NaN: no normal */
  }
  i = HEIGHT / 2 * WIDTH + WIDTH / 2;
  printf("iine %s (%s): %d of %d pixels have a normal; in the middle (%.3f, %.3f, %.3f), curvature %.4f\n",
         iine_version_string(), iine_isa_name(), covered, WIDTH * HEIGHT, cloud[i].nx, cloud[i].ny, cloud[i].nz,
         cloud[i].curvature);
  return covered > 0 ? 0 : 1;
}
