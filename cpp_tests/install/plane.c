/* A user of the C API: the normal of the plane z = 1 faces the camera. */

#include <iine/iine.h>

#include <stdio.h>

enum { WIDTH = 64, HEIGHT = 48 };

static float points[HEIGHT][WIDTH][3];
static float normals[HEIGHT][WIDTH][3];

int main(void) {
  iine_estimator *estimator = NULL;
  iine_points in = {sizeof in, WIDTH, HEIGHT, points[0][0], points[0][0] + 1, points[0][0] + 2, 12, 0};
  iine_normals out = {sizeof out, normals[0][0], normals[0][0] + 1, normals[0][0] + 2, 12, 0, NULL, 0, 0};
  const float *center = normals[HEIGHT / 2][WIDTH / 2];
  int row, column, status;
  for (row = 0; row < HEIGHT; ++row) {
    for (column = 0; column < WIDTH; ++column) {
      points[row][column][0] = 0.01f * (float)column;
      points[row][column][1] = 0.01f * (float)row;
      points[row][column][2] = 1.0f;
    }
  }
  status = iine_estimator_new(&estimator);
  if (status == IINE_OK) {
    status = iine_estimator_compute(estimator, &in, &out);
  }
  iine_estimator_free(estimator);
  if (status != IINE_OK) {
    fprintf(stderr, "%s\n", iine_status_string(status));
    return 1;
  }
  printf("iine %s: (%g, %g, %g)\n", iine_version_string(), center[0], center[1], center[2]);
  return center[2] < -0.999f && iine_version_number() == IINE_VERSION_NUMBER ? 0 : 1;
}
