/* Every function of the C API, as a C99 program and, the same text, as a C++ one: what it computes, what it
 * refuses, and that it has written nothing when it refuses. Prints what failed; exits with 1 if anything did. */

#include <iine/iine.h>

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The composed version must be usable by the preprocessor. */
#if IINE_VERSION_NUMBER != IINE_VERSION_MAJOR * 10000 + IINE_VERSION_MINOR * 100 + IINE_VERSION_PATCH
#error "IINE_VERSION_NUMBER"
#endif

enum { WIDTH = 40, HEIGHT = 30, PIXELS = WIDTH * HEIGHT };

static int failures = 0;

static void check(int passed, const char *text, int line) {
  if (!passed) {
    printf("c_api.c:%d: %s\n", line, text);
    failures += 1;
  }
}
#define CHECK(condition) check((condition) ? 1 : 0, #condition, __LINE__)

static void check_status(int32_t status, int32_t expected, const char *text, int line) {
  if (status != expected) {
    printf("c_api.c:%d: %s is %d (%s), not %d\n", line, text, (int)status, iine_status_string(status),
           (int)expected);
    failures += 1;
  }
}
#define STATUS(expected, call) check_status((call), (expected), #call, __LINE__)

/* A pixel as PCL's point types with normals have it, with room for other fields. */
typedef struct pixel {
  float x, y, z, other;
  float nx, ny, nz, color;
  float curvature, more[3];
} pixel;

static pixel cloud[PIXELS];
static pixel before[PIXELS];

/* A tilted plane with a step in depth, a missing point, and every other byte a pattern. */
static void fill_cloud(void) {
  int row, column;
  memset(cloud, 0x5a, sizeof cloud);
  for (row = 0; row < HEIGHT; ++row) {
    for (column = 0; column < WIDTH; ++column) {
      pixel *p = &cloud[row * WIDTH + column];
      const float z = 1.0f + 0.01f * (float)column + (column < WIDTH / 2 ? 0.0f : 1.0f);
      p->x = 0.002f * (float)(column - WIDTH / 2) * z;
      p->y = 0.002f * (float)(row - HEIGHT / 2) * z;
      p->z = z;
    }
  }
  cloud[20 * WIDTH + 10].x = NAN;
  cloud[20 * WIDTH + 10].y = NAN;
  cloud[20 * WIDTH + 10].z = NAN;
  memcpy(before, cloud, sizeof cloud);
}

static iine_points cloud_points(void) {
  iine_points points;
  memset(&points, 0, sizeof points);
  points.struct_size = sizeof points;
  points.width = WIDTH;
  points.height = HEIGHT;
  points.x = &cloud[0].x;
  points.y = &cloud[0].y;
  points.z = &cloud[0].z;
  points.point_stride = sizeof(pixel);
  return points;
}

/* Normals into other fields of the same array. */
static iine_normals cloud_normals(void) {
  iine_normals normals;
  memset(&normals, 0, sizeof normals);
  normals.struct_size = sizeof normals;
  normals.nx = &cloud[0].nx;
  normals.ny = &cloud[0].ny;
  normals.nz = &cloud[0].nz;
  normals.point_stride = sizeof(pixel);
  normals.curvature = &cloud[0].curvature;
  normals.curvature_point_stride = sizeof(pixel);
  return normals;
}

static float normals_out[4 * PIXELS];

/* Normals and curvature into an array of their own, four floats a pixel. */
static iine_normals packed_normals(float *to) {
  iine_normals normals = cloud_normals();
  normals.nx = to;
  normals.ny = to + 1;
  normals.nz = to + 2;
  normals.point_stride = 4 * sizeof(float);
  normals.curvature = to + 3;
  normals.curvature_point_stride = 4 * sizeof(float);
  return normals;
}

static float *misaligned(float *pointer) { return (float *)(void *)((char *)pointer + 2); }

static iine_estimator *new_estimator(void) {
  iine_estimator *estimator = NULL;
  STATUS(IINE_OK, iine_estimator_new(&estimator));
  CHECK(estimator != NULL);
  return estimator;
}

static void test_version(void) {
  char text[32];
  CHECK(iine_version_number() == IINE_VERSION_NUMBER);
  snprintf(text, sizeof text, "%d.%d.%d", IINE_VERSION_MAJOR, IINE_VERSION_MINOR, IINE_VERSION_PATCH);
  CHECK(strcmp(iine_version_string(), text) == 0);
}

static void test_isa_name(void) {
  static const char *const names[] = {"avx512", "avx2", "sse2", "neon", "portable", "scalar"};
#if defined __x86_64__
  static const char least[] = "sse2";
#elif defined __aarch64__
  static const char least[] = "neon";
#else
  static const char least[] = "portable";
#endif
  const char *const asked = getenv("IINE_ISA");
  size_t i, found = 0;
  for (i = 0; i < sizeof names / sizeof *names; ++i) {
    found += strcmp(iine_isa_name(), names[i]) == 0;
  }
  CHECK(found == 1);
  /* What every processor has is taken if it is asked for. */
  if (asked != NULL && (strcmp(asked, "scalar") == 0 || strcmp(asked, least) == 0)) {
    CHECK(strcmp(iine_isa_name(), asked) == 0);
  }
}

static void test_status_strings(void) {
  static const int32_t statuses[] = {
      IINE_OK,                 IINE_ERROR_NULL_POINTER, IINE_ERROR_STRUCT_SIZE,  IINE_ERROR_SIZE,
      IINE_ERROR_STRIDE,       IINE_ERROR_MISALIGNED,   IINE_ERROR_OVERLAP,      IINE_ERROR_OPTION_VALUE,
      IINE_ERROR_UNSUPPORTED,  IINE_ERROR_INDEX,        IINE_ERROR_OUT_OF_MEMORY, IINE_ERROR_THREADS,
      IINE_ERROR_INTERNAL};
  static const char *const words[] = {"ok",     "NULL",  "struct_size", "width",  "stride",  "aligned", "overlap",
                                      "option", "together", "index",    "memory", "threads", "internal"};
  const char *const unknown = iine_status_string(-1);
  int32_t i, j;
  CHECK(unknown[0] != '\0');
  CHECK(iine_status_string(INT32_MAX) == unknown && iine_status_string(INT32_MIN) == unknown);
  for (i = 0; i < (int32_t)(sizeof statuses / sizeof *statuses); ++i) {
    CHECK(statuses[i] == i);
    CHECK(strstr(iine_status_string(i), words[i]) != NULL);
    CHECK(strcmp(iine_status_string(i), unknown) != 0);
    for (j = 0; j < i; ++j) {
      CHECK(strcmp(iine_status_string(i), iine_status_string(j)) != 0);
    }
  }
}

static void test_new_and_free(void) {
  union {
    iine_estimator *pointers[2];
    char bytes[2 * sizeof(iine_estimator *)];
  } place;
  memset(&place, 0, sizeof place);
  STATUS(IINE_ERROR_NULL_POINTER, iine_estimator_new(NULL));
  STATUS(IINE_ERROR_MISALIGNED, iine_estimator_new((iine_estimator **)(void *)(place.bytes + 1)));
  CHECK(place.pointers[0] == NULL && place.pointers[1] == NULL);
  iine_estimator_free(NULL);
  iine_estimator_free(new_estimator());
}

/* One setter of an enum of two numbers or of a switch: what is known is taken, all else and NULL refused. */
static void check_numbers(int32_t (*set)(iine_estimator *, int32_t), int line) {
  static const int32_t unknown[] = {-1, 2, 99, INT32_MAX, INT32_MIN};
  iine_estimator *const e = new_estimator();
  int32_t i;
  for (i = 0; i <= 1; ++i) {
    check_status(set(e, i), IINE_OK, "a known number", line);
    check_status(set(NULL, i), IINE_ERROR_NULL_POINTER, "NULL", line);
  }
  for (i = 0; i < (int32_t)(sizeof unknown / sizeof *unknown); ++i) {
    check_status(set(e, unknown[i]), IINE_ERROR_OPTION_VALUE, "an unknown number", line);
  }
  iine_estimator_free(e);
}

/* One setter of a finite number above 0. */
static void check_positive(int32_t (*set)(iine_estimator *, float), int line) {
  static const float refused[] = {0.0f, -0.0f, -1.0f, NAN, INFINITY, -INFINITY};
  iine_estimator *const e = new_estimator();
  size_t i;
  check_status(set(e, 1e-30f), IINE_OK, "small", line);
  check_status(set(e, 1e30f), IINE_OK, "large", line);
  check_status(set(NULL, 1.0f), IINE_ERROR_NULL_POINTER, "NULL", line);
  for (i = 0; i < sizeof refused / sizeof *refused; ++i) {
    check_status(set(e, refused[i]), IINE_ERROR_OPTION_VALUE, "not a finite number above 0", line);
  }
  iine_estimator_free(e);
}

static void test_options(void) {
  iine_estimator *const e = new_estimator();
  int32_t i;
  for (i = IINE_METHOD_COVARIANCE_MATRIX; i <= IINE_METHOD_SIMPLE_3D_GRADIENT; ++i) {
    STATUS(IINE_OK, iine_estimator_set_method(e, i));
  }
  STATUS(IINE_ERROR_OPTION_VALUE, iine_estimator_set_method(e, -1));
  STATUS(IINE_ERROR_OPTION_VALUE, iine_estimator_set_method(e, INT32_MAX));
  STATUS(IINE_ERROR_NULL_POINTER, iine_estimator_set_method(NULL, IINE_METHOD_COVARIANCE_MATRIX));

  check_numbers(iine_estimator_set_border_policy, __LINE__);
  check_numbers(iine_estimator_set_depth_dependent_smoothing, __LINE__);
  check_positive(iine_estimator_set_normal_smoothing_size, __LINE__);

  STATUS(IINE_OK, iine_estimator_set_max_depth_change_factor(e, 0.02f));
  STATUS(IINE_ERROR_NULL_POINTER, iine_estimator_set_max_depth_change_factor(NULL, 0.02f));

  STATUS(IINE_OK, iine_estimator_set_viewpoint(e, 0.0f, 0.0f, 0.0f));
  STATUS(IINE_ERROR_NULL_POINTER, iine_estimator_set_viewpoint(NULL, 0.0f, 0.0f, 0.0f));

  STATUS(IINE_OK, iine_estimator_set_threads(e, 0));
  STATUS(IINE_OK, iine_estimator_set_threads(e, 1024));
  STATUS(IINE_ERROR_OPTION_VALUE, iine_estimator_set_threads(e, 1025));
  STATUS(IINE_ERROR_OPTION_VALUE, iine_estimator_set_threads(e, UINT32_MAX));
  STATUS(IINE_ERROR_NULL_POINTER, iine_estimator_set_threads(NULL, 1));
  iine_estimator_free(e);
}

static void test_paper_options(void) {
  iine_estimator *const e = new_estimator();
  CHECK(IINE_SEMANTICS_PCL == 0 && IINE_SEMANTICS_PAPER == 1);
  CHECK(IINE_DISTANCE_METRIC_EUCLIDEAN == 0 && IINE_DISTANCE_METRIC_CHAMFER == 1);
  CHECK(IINE_DEPTH_Z == 0 && IINE_DEPTH_RANGE == 1);
  check_numbers(iine_estimator_set_semantics, __LINE__);
  check_numbers(iine_estimator_set_paper_distance_metric, __LINE__);
  check_numbers(iine_estimator_set_paper_depth, __LINE__);
  check_numbers(iine_estimator_set_zero_is_missing, __LINE__);
  check_numbers(iine_estimator_set_one_sided_windows, __LINE__);
  check_numbers(iine_estimator_set_crease_windows, __LINE__);
  check_positive(iine_estimator_set_paper_alpha, __LINE__);
  check_positive(iine_estimator_set_paper_beta, __LINE__);
  check_positive(iine_estimator_set_paper_gamma, __LINE__);

  STATUS(IINE_OK, iine_estimator_set_paper_radii(e, 1, 1, 1));
  STATUS(IINE_OK, iine_estimator_set_paper_radii(e, 1000, 1000, 1000));
  STATUS(IINE_OK, iine_estimator_set_paper_radii(e, 2, 5, 20));
  STATUS(IINE_ERROR_OPTION_VALUE, iine_estimator_set_paper_radii(e, 0, 5, 20));
  STATUS(IINE_ERROR_OPTION_VALUE, iine_estimator_set_paper_radii(e, 6, 5, 20));
  STATUS(IINE_ERROR_OPTION_VALUE, iine_estimator_set_paper_radii(e, 2, 21, 20));
  STATUS(IINE_ERROR_OPTION_VALUE, iine_estimator_set_paper_radii(e, 2, 5, 1001));
  STATUS(IINE_ERROR_OPTION_VALUE, iine_estimator_set_paper_radii(e, 2, 5, UINT32_MAX));
  STATUS(IINE_ERROR_NULL_POINTER, iine_estimator_set_paper_radii(NULL, 2, 5, 20));
  iine_estimator_free(e);

  CHECK(fabsf(iine_alpha_of_sensor(0.125f, 580.0f, 0.075f) - 0.0028736f) < 1e-7f);
  CHECK(!(iine_alpha_of_sensor(0.125f, 0.0f, 0.075f) < INFINITY));
}

/* An option that was refused has not changed: results stay those of the last accepted ones. */
static void test_refused_options_change_nothing(void) {
  static float expected[4 * PIXELS];
  iine_estimator *const e = new_estimator();
  const iine_points points = cloud_points();
  const iine_normals to_expected = packed_normals(expected), to_actual = packed_normals(normals_out);
  STATUS(IINE_OK, iine_estimator_compute(e, &points, &to_expected));
  iine_estimator_set_method(e, 99);
  iine_estimator_set_border_policy(e, 99);
  iine_estimator_set_normal_smoothing_size(e, NAN);
  iine_estimator_set_depth_dependent_smoothing(e, 99);
  iine_estimator_set_threads(e, 9999);
  iine_estimator_set_semantics(e, 99);
  iine_estimator_set_zero_is_missing(e, 99);
  iine_estimator_set_one_sided_windows(e, 99);
  iine_estimator_set_crease_windows(e, 99);
  STATUS(IINE_OK, iine_estimator_compute(e, &points, &to_actual));
  CHECK(memcmp(expected, normals_out, sizeof expected) == 0);
  iine_estimator_free(e);
}

static void test_compute(void) {
  iine_estimator *const e = new_estimator();
  const iine_points points = cloud_points();
  const iine_normals normals = cloud_normals();
  const int inside = 12 * WIDTH + 12; /* far from step, hole and border */
  int32_t method;
  int i;
  for (method = 0; method <= IINE_METHOD_SIMPLE_3D_GRADIENT; ++method) {
    int with_normal = 0;
    fill_cloud();
    STATUS(IINE_OK, iine_estimator_set_method(e, method));
    STATUS(IINE_OK, iine_estimator_set_normal_smoothing_size(e, 5.0f));
    STATUS(IINE_OK, iine_estimator_compute(e, &points, &normals));
    for (i = 0; i < PIXELS; ++i) {
      const pixel *const p = &cloud[i];
      const float length = sqrtf(p->nx * p->nx + p->ny * p->ny + p->nz * p->nz);
      const int row = i / WIDTH, column = i % WIDTH;
      const int border = row < 5 || column < 5 || row >= HEIGHT - 5 || column >= WIDTH - 5;
      if (isnan(p->nx)) {
        CHECK(isnan(p->ny) && isnan(p->nz) && isnan(p->curvature));
      } else {
        CHECK(!border);
        CHECK(fabsf(length - 1.0f) < 1e-5f);
        CHECK(p->nx * p->x + p->ny * p->y + p->nz * p->z <= 0.0f); /* towards the viewpoint */
        CHECK(isnan(p->curvature) == (method != IINE_METHOD_COVARIANCE_MATRIX));
        with_normal += 1;
      }
      /* The other fields of the array are as they were. */
      CHECK(memcmp(&p->x, &before[i].x, 4 * sizeof(float)) == 0);
      CHECK(memcmp(&p->color, &before[i].color, sizeof(float)) == 0);
      CHECK(memcmp(p->more, before[i].more, sizeof p->more) == 0);
    }
    CHECK(with_normal > PIXELS / 8);
    /* The surface there rises along x; AVERAGE_DEPTH_CHANGE, as PCL's, is far off on so coarse a slope. */
    CHECK(cloud[inside].nx > (method == IINE_METHOD_AVERAGE_DEPTH_CHANGE ? 0.7f : 0.97f));
    CHECK(isnan(cloud[20 * WIDTH + 10].nx));
    CHECK(isnan(cloud[15 * WIDTH + WIDTH / 2].nx));
  }

  /* Without a curvature, its field stays as it was. */
  {
    iine_normals three = normals;
    three.curvature = NULL;
    three.curvature_point_stride = 1; /* not read */
    fill_cloud();
    STATUS(IINE_OK, iine_estimator_set_method(e, IINE_METHOD_COVARIANCE_MATRIX));
    STATUS(IINE_OK, iine_estimator_compute(e, &points, &three));
    CHECK(!isnan(cloud[inside].nx));
    for (i = 0; i < PIXELS; ++i) {
      CHECK(memcmp(&cloud[i].curvature, &before[i].curvature, sizeof(float)) == 0);
    }
  }

  /* The viewpoint decides the side. */
  {
    const float nx = cloud[inside].nx;
    STATUS(IINE_OK, iine_estimator_set_viewpoint(e, 0.0f, 0.0f, 100.0f));
    STATUS(IINE_OK, iine_estimator_compute(e, &points, &normals));
    CHECK(cloud[inside].nx == -nx);
  }
  iine_estimator_free(e);
}

/* Rows with padding and separate planes give the same bytes as interleaved points, and padding stays as it was. */
static void test_layouts(void) {
  enum { STRIDE = WIDTH + 3 };
  static float planes[3][HEIGHT * STRIDE], out[4][HEIGHT * STRIDE], expected[4 * PIXELS];
  iine_estimator *const e = new_estimator();
  iine_points points = cloud_points();
  iine_normals normals = packed_normals(expected);
  float pattern;
  int row, column, k;
  STATUS(IINE_OK, iine_estimator_set_method(e, IINE_METHOD_COVARIANCE_MATRIX));
  STATUS(IINE_OK, iine_estimator_compute(e, &points, &normals));

  for (row = 0; row < HEIGHT; ++row) {
    for (column = 0; column < WIDTH; ++column) {
      const pixel *const p = &cloud[row * WIDTH + column];
      planes[0][row * STRIDE + column] = p->x;
      planes[1][row * STRIDE + column] = p->y;
      planes[2][row * STRIDE + column] = p->z;
    }
  }
  memset(out, 0x5a, sizeof out);
  memset(&pattern, 0x5a, sizeof pattern);
  points.x = planes[0];
  points.y = planes[1];
  points.z = planes[2];
  points.point_stride = sizeof(float);
  points.row_stride = STRIDE * sizeof(float);
  normals.nx = out[0];
  normals.ny = out[1];
  normals.nz = out[2];
  normals.curvature = out[3];
  normals.point_stride = normals.curvature_point_stride = sizeof(float);
  normals.row_stride = normals.curvature_row_stride = STRIDE * sizeof(float);
  STATUS(IINE_OK, iine_estimator_compute(e, &points, &normals));
  for (row = 0; row < HEIGHT; ++row) {
    for (k = 0; k < 4; ++k) {
      for (column = 0; column < WIDTH; ++column) {
        const float *const a = &out[k][row * STRIDE + column];
        CHECK(memcmp(a, &expected[4 * (row * WIDTH + column) + k], sizeof *a) == 0);
      }
      for (; column < STRIDE; ++column) {
        CHECK(memcmp(&out[k][row * STRIDE + column], &pattern, sizeof pattern) == 0);
      }
    }
  }
  iine_estimator_free(e);
}

static void test_threads_do_not_change_the_result(void) {
  static const uint32_t threads[] = {2, 3, 7, 0};
  static float expected[4 * PIXELS];
  iine_estimator *const e = new_estimator();
  const iine_points points = cloud_points();
  const iine_normals to_expected = packed_normals(expected), to_actual = packed_normals(normals_out);
  int32_t method;
  size_t i;
  for (method = 0; method <= IINE_METHOD_SIMPLE_3D_GRADIENT; ++method) {
    STATUS(IINE_OK, iine_estimator_set_method(e, method));
    STATUS(IINE_OK, iine_estimator_set_threads(e, 1));
    STATUS(IINE_OK, iine_estimator_compute(e, &points, &to_expected));
    for (i = 0; i < sizeof threads / sizeof *threads; ++i) {
      memset(normals_out, 0, sizeof normals_out);
      STATUS(IINE_OK, iine_estimator_set_threads(e, threads[i]));
      STATUS(IINE_OK, iine_estimator_compute(e, &points, &to_actual));
      CHECK(memcmp(expected, normals_out, sizeof expected) == 0);
    }
  }
  iine_estimator_free(e);
}

/* One refused call of compute, of compute_indices with the same arguments, and of neither a byte written. */
static void refuse(int32_t expected, iine_estimator *e, const iine_points *points, const iine_normals *normals,
                   int line) {
  static float out_before[4 * PIXELS];
  const int32_t index = 0;
  memcpy(out_before, normals_out, sizeof out_before);
  memcpy(before, cloud, sizeof cloud);
  check_status(iine_estimator_compute(e, points, normals), expected, "compute", line);
  check(memcmp(before, cloud, sizeof cloud) == 0, "compute: the cloud is untouched", line);
  check(memcmp(out_before, normals_out, sizeof out_before) == 0, "compute: the output is untouched", line);
  /* A single element has no rows to be wrong about, and overlaps only what it covers. */
  if (expected != IINE_ERROR_STRIDE && expected != IINE_ERROR_SIZE && expected != IINE_ERROR_OVERLAP) {
    check_status(iine_estimator_compute_indices(e, points, &index, 1, normals), expected, "compute_indices",
                 line);
    check(memcmp(before, cloud, sizeof cloud) == 0, "compute_indices: the cloud is untouched", line);
    check(memcmp(out_before, normals_out, sizeof out_before) == 0, "compute_indices: untouched", line);
  }
}
#define REFUSE_POINTS(expected, change)                \
  do {                                                 \
    iine_points points = cloud_points();               \
    const iine_normals out = packed_normals(normals_out); \
    change;                                            \
    refuse((expected), e, &points, &out, __LINE__);    \
  } while (0)
#define REFUSE_NORMALS(expected, change)               \
  do {                                                 \
    const iine_points points = cloud_points();         \
    iine_normals out = packed_normals(normals_out);    \
    change;                                            \
    refuse((expected), e, &points, &out, __LINE__);    \
  } while (0)

static void test_compute_refuses(void) {
  iine_estimator *const e = new_estimator();
  const iine_points good_points = cloud_points();
  const iine_normals good_normals = packed_normals(normals_out);
  union {
    iine_points points[2];
    iine_normals normals[2];
    char bytes[1];
  } place;
  const size_t half = sizeof(size_t) / 2; /* of what structs are aligned to */
  const iine_points *const odd_points = (const iine_points *)(const void *)(place.bytes + half);
  const iine_normals *const odd_normals = (const iine_normals *)(const void *)(place.bytes + half);
  memset(&place, 0, sizeof place);

  refuse(IINE_ERROR_NULL_POINTER, NULL, &good_points, &good_normals, __LINE__);
  refuse(IINE_ERROR_NULL_POINTER, e, NULL, &good_normals, __LINE__);
  refuse(IINE_ERROR_NULL_POINTER, e, &good_points, NULL, __LINE__);
  refuse(IINE_ERROR_MISALIGNED, e, odd_points, &good_normals, __LINE__);
  refuse(IINE_ERROR_MISALIGNED, e, &good_points, odd_normals, __LINE__);

  REFUSE_POINTS(IINE_ERROR_STRUCT_SIZE, points.struct_size = 0);
  REFUSE_POINTS(IINE_ERROR_STRUCT_SIZE, points.struct_size -= 1);
  REFUSE_POINTS(IINE_ERROR_STRUCT_SIZE, points.struct_size += sizeof(void *));
  REFUSE_POINTS(IINE_ERROR_STRUCT_SIZE, points.struct_size = SIZE_MAX);
  REFUSE_NORMALS(IINE_ERROR_STRUCT_SIZE, out.struct_size = 0);
  REFUSE_NORMALS(IINE_ERROR_STRUCT_SIZE, out.struct_size -= 1);
  REFUSE_NORMALS(IINE_ERROR_STRUCT_SIZE, out.struct_size = SIZE_MAX);

  REFUSE_POINTS(IINE_ERROR_NULL_POINTER, points.x = NULL);
  REFUSE_POINTS(IINE_ERROR_NULL_POINTER, points.y = NULL);
  REFUSE_POINTS(IINE_ERROR_NULL_POINTER, points.z = NULL);
  REFUSE_NORMALS(IINE_ERROR_NULL_POINTER, out.nx = NULL);
  REFUSE_NORMALS(IINE_ERROR_NULL_POINTER, out.ny = NULL);
  REFUSE_NORMALS(IINE_ERROR_NULL_POINTER, out.nz = NULL);

  REFUSE_POINTS(IINE_ERROR_MISALIGNED, points.x = misaligned(&cloud[0].x));
  REFUSE_POINTS(IINE_ERROR_MISALIGNED, points.y = misaligned(&cloud[0].y));
  REFUSE_POINTS(IINE_ERROR_MISALIGNED, points.z = misaligned(&cloud[0].z));
  REFUSE_NORMALS(IINE_ERROR_MISALIGNED, out.nx = misaligned(out.nx));
  REFUSE_NORMALS(IINE_ERROR_MISALIGNED, out.ny = misaligned(out.ny));
  REFUSE_NORMALS(IINE_ERROR_MISALIGNED, out.nz = misaligned(out.nz));
  REFUSE_NORMALS(IINE_ERROR_MISALIGNED, out.curvature = misaligned(out.curvature));

  REFUSE_POINTS(IINE_ERROR_SIZE, points.x = (const float *)(UINTPTR_MAX - 15)); /* the addresses end there */
  REFUSE_POINTS(IINE_ERROR_SIZE, points.width = 0);
  REFUSE_POINTS(IINE_ERROR_SIZE, points.height = 0);
  REFUSE_POINTS(IINE_ERROR_SIZE, (points.width = 65536, points.height = 32768));
  REFUSE_POINTS(IINE_ERROR_SIZE, points.width = UINT32_MAX);
  REFUSE_POINTS(IINE_ERROR_SIZE, points.height = UINT32_MAX);
  REFUSE_POINTS(IINE_ERROR_SIZE, points.point_stride = SIZE_MAX - 3);
  REFUSE_POINTS(IINE_ERROR_SIZE, points.row_stride = SIZE_MAX - 3);
  REFUSE_POINTS(IINE_ERROR_SIZE, points.row_stride = SIZE_MAX / (2 * HEIGHT) * 2 + 4);
  REFUSE_NORMALS(IINE_ERROR_SIZE, out.point_stride = SIZE_MAX - 3);
  REFUSE_NORMALS(IINE_ERROR_SIZE, out.row_stride = SIZE_MAX - 3);
  REFUSE_NORMALS(IINE_ERROR_SIZE, out.curvature_point_stride = SIZE_MAX - 3);
  REFUSE_NORMALS(IINE_ERROR_SIZE, out.curvature_row_stride = SIZE_MAX - 3);

  REFUSE_POINTS(IINE_ERROR_STRIDE, points.point_stride = 0);
  REFUSE_POINTS(IINE_ERROR_STRIDE, points.point_stride = 6);
  REFUSE_POINTS(IINE_ERROR_STRIDE, points.row_stride = WIDTH * sizeof(pixel) - 4);
  REFUSE_POINTS(IINE_ERROR_STRIDE, points.row_stride = WIDTH * sizeof(pixel) + 2);
  REFUSE_NORMALS(IINE_ERROR_STRIDE, out.point_stride = 0);
  REFUSE_NORMALS(IINE_ERROR_STRIDE, out.point_stride = 6);
  REFUSE_NORMALS(IINE_ERROR_STRIDE, out.row_stride = 4);
  REFUSE_NORMALS(IINE_ERROR_STRIDE, out.row_stride = 4 * WIDTH * sizeof(float) + 1);
  REFUSE_NORMALS(IINE_ERROR_STRIDE, out.curvature_point_stride = 0);
  REFUSE_NORMALS(IINE_ERROR_STRIDE, out.curvature_row_stride = 4);

  /* Output on the points' own coordinates, of any pixel; outputs on each other; unlike strides that meet. */
  {
    iine_normals same = cloud_normals();
    same.nx = &cloud[0].x;
    refuse(IINE_ERROR_OVERLAP, e, &good_points, &same, __LINE__);
    same = cloud_normals();
    same.curvature = &cloud[0].z;
    refuse(IINE_ERROR_OVERLAP, e, &good_points, &same, __LINE__);
    same = cloud_normals();
    same.nz = &cloud[1].x;
    refuse(IINE_ERROR_OVERLAP, e, &good_points, &same, __LINE__);
    same = packed_normals(&cloud[0].nx);
    refuse(IINE_ERROR_OVERLAP, e, &good_points, &same, __LINE__);
  }
  REFUSE_NORMALS(IINE_ERROR_OVERLAP, out.ny = out.nx);
  REFUSE_NORMALS(IINE_ERROR_OVERLAP, out.curvature = out.nz);
  REFUSE_NORMALS(IINE_ERROR_OVERLAP, out.curvature_point_stride = sizeof(float));

  STATUS(IINE_OK, iine_estimator_set_method(e, IINE_METHOD_SIMPLE_3D_GRADIENT));
  STATUS(IINE_OK, iine_estimator_set_border_policy(e, IINE_BORDER_POLICY_MIRROR));
  refuse(IINE_ERROR_UNSUPPORTED, e, &good_points, &good_normals, __LINE__);
  STATUS(IINE_OK, iine_estimator_set_border_policy(e, IINE_BORDER_POLICY_IGNORE));
  STATUS(IINE_OK, iine_estimator_compute(e, &good_points, &good_normals));
  iine_estimator_free(e);
}

static void test_indices(void) {
  enum { COUNT = 5 };
  static float whole[4 * PIXELS];
  static const int32_t indices[COUNT] = {12 * WIDTH + 12, 0, PIXELS - 1, 12 * WIDTH + 12, 11 * WIDTH + 30};
  float some[4 * (COUNT + 1)], some_before[4 * (COUNT + 1)];
  int32_t bad[COUNT], list[5 * COUNT], list_before[5 * COUNT];
  iine_estimator *const e = new_estimator();
  const iine_points points = cloud_points();
  const iine_normals to_whole = packed_normals(whole);
  iine_normals to_some = packed_normals(some);
  size_t k;
  STATUS(IINE_OK, iine_estimator_set_normal_smoothing_size(e, 5.0f));
  STATUS(IINE_OK, iine_estimator_compute(e, &points, &to_whole));
  memset(some, 0x5a, sizeof some);
  memcpy(some_before, some, sizeof some);

  STATUS(IINE_ERROR_NULL_POINTER, iine_estimator_compute_indices(e, &points, NULL, COUNT, &to_some));
  STATUS(IINE_ERROR_MISALIGNED,
         iine_estimator_compute_indices(e, &points, (const int32_t *)(const void *)((const char *)bad + 1), 1,
                                        &to_some));
  STATUS(IINE_ERROR_SIZE, iine_estimator_compute_indices(e, &points, indices, SIZE_MAX, &to_some));
  STATUS(IINE_ERROR_SIZE, iine_estimator_compute_indices(e, &points, indices, (size_t)INT32_MAX + 1, &to_some));
  memcpy(bad, indices, sizeof bad);
  bad[COUNT - 1] = -1;
  STATUS(IINE_ERROR_INDEX, iine_estimator_compute_indices(e, &points, bad, COUNT, &to_some));
  bad[COUNT - 1] = PIXELS;
  STATUS(IINE_ERROR_INDEX, iine_estimator_compute_indices(e, &points, bad, COUNT, &to_some));
  bad[COUNT - 1] = INT32_MIN;
  STATUS(IINE_ERROR_INDEX, iine_estimator_compute_indices(e, &points, bad, COUNT, &to_some));
  STATUS(IINE_OK, iine_estimator_compute_indices(e, &points, indices, 0, &to_some));
  STATUS(IINE_OK, iine_estimator_compute_indices(e, &points, NULL, 0, &to_some));
  STATUS(IINE_ERROR_NULL_POINTER, iine_estimator_compute_indices(e, NULL, NULL, 0, &to_some));
  STATUS(IINE_OK, iine_estimator_compute_indices(e, &points, NULL, 0, NULL)); /* no outputs */
  /* The next pixel's field, whichever of the two lies first. */
  to_some.curvature = NULL;
  to_some.nz = to_some.nx + 4;
  STATUS(IINE_ERROR_OVERLAP, iine_estimator_compute_indices(e, &points, indices, COUNT, &to_some));
  to_some.nx += 4;
  to_some.nz = some;
  STATUS(IINE_ERROR_OVERLAP, iine_estimator_compute_indices(e, &points, indices, COUNT, &to_some));
  to_some = packed_normals(some);
  CHECK(memcmp(some, some_before, sizeof some) == 0);

  to_some.row_stride = to_some.curvature_row_stride = 1; /* not used */
  STATUS(IINE_OK, iine_estimator_compute_indices(e, &points, indices, COUNT, &to_some));
  for (k = 0; k < COUNT; ++k) {
    CHECK(memcmp(&some[4 * k], &whole[4 * indices[k]], 4 * sizeof(float)) == 0);
  }
  CHECK(!isnan(some[0]) && isnan(some[4]) && isnan(some[8]));
  CHECK(memcmp(&some[4 * COUNT], &some_before[4 * COUNT], 4 * sizeof(float)) == 0);

  to_some = cloud_normals();
  to_some.nx = &cloud[3].x;
  STATUS(IINE_ERROR_OVERLAP, iine_estimator_compute_indices(e, &points, indices, COUNT, &to_some));

  memset(list, 0, sizeof list);
  memcpy(list_before, list, sizeof list);
  to_some = packed_normals((float *)(void *)list);
  STATUS(IINE_ERROR_OVERLAP, iine_estimator_compute_indices(e, &points, list + 4 * COUNT - 1, COUNT, &to_some));
  CHECK(memcmp(list, list_before, sizeof list) == 0);
  STATUS(IINE_OK, iine_estimator_compute_indices(e, &points, list + 4 * COUNT, COUNT, &to_some));
  iine_estimator_free(e);
}

static void test_window(void) {
  enum { X = 12, Y = 12 };
  float one[8], one_before[8];
  iine_estimator *const e = new_estimator();
  const iine_points points = cloud_points();
  const iine_normals whole = packed_normals(normals_out);
  iine_normals normal = packed_normals(one), bad;
  int k;
  STATUS(IINE_OK, iine_estimator_set_normal_smoothing_size(e, 6.0f));
  STATUS(IINE_OK, iine_estimator_compute(e, &points, &whole));
  memset(one, 0x5a, sizeof one);
  memcpy(one_before, one, sizeof one);

  STATUS(IINE_ERROR_NULL_POINTER, iine_estimator_compute_window(NULL, &points, X, Y, 6, 6, &normal));
  STATUS(IINE_ERROR_NULL_POINTER, iine_estimator_compute_window(e, NULL, X, Y, 6, 6, &normal));
  STATUS(IINE_ERROR_NULL_POINTER, iine_estimator_compute_window(e, &points, X, Y, 6, 6, NULL));
  STATUS(IINE_ERROR_INDEX, iine_estimator_compute_window(e, &points, WIDTH, Y, 6, 6, &normal));
  STATUS(IINE_ERROR_INDEX, iine_estimator_compute_window(e, &points, X, HEIGHT, 6, 6, &normal));
  STATUS(IINE_ERROR_INDEX, iine_estimator_compute_window(e, &points, UINT32_MAX, UINT32_MAX, 6, 6, &normal));
  STATUS(IINE_ERROR_OPTION_VALUE, iine_estimator_compute_window(e, &points, X, Y, -1, 6, &normal));
  STATUS(IINE_ERROR_OPTION_VALUE, iine_estimator_compute_window(e, &points, X, Y, 6, INT32_MIN, &normal));
  bad = normal;
  bad.struct_size = 1;
  STATUS(IINE_ERROR_STRUCT_SIZE, iine_estimator_compute_window(e, &points, X, Y, 6, 6, &bad));
  bad = normal;
  bad.nz = misaligned(one);
  STATUS(IINE_ERROR_MISALIGNED, iine_estimator_compute_window(e, &points, X, Y, 6, 6, &bad));
  bad = normal;
  bad.ny = &cloud[5].y;
  STATUS(IINE_ERROR_OVERLAP, iine_estimator_compute_window(e, &points, X, Y, 6, 6, &bad));
  CHECK(memcmp(one, one_before, sizeof one) == 0);

  normal.row_stride = normal.curvature_row_stride = 1; /* not used */
  STATUS(IINE_OK, iine_estimator_compute_window(e, &points, X, Y, 6, 6, &normal));
  for (k = 0; k < 3; ++k) {
    CHECK(fabsf(one[k] - normals_out[4 * (Y * WIDTH + X) + k]) < 1e-5f);
  }
  CHECK(memcmp(one + 4, one_before + 4, 4 * sizeof(float)) == 0);
  /* Width and height, which meet the step or do not. */
  STATUS(IINE_OK, iine_estimator_compute_window(e, &points, WIDTH / 2 - 3, Y, 3, 13, &normal));
  CHECK(one[0] > 0.9f);
  STATUS(IINE_OK, iine_estimator_compute_window(e, &points, WIDTH / 2 - 3, Y, 13, 3, &normal));
  CHECK(one[2] < one[0] && fabsf(one[0] - normals_out[4 * (Y * WIDTH + X)]) > 1e-3f);
  STATUS(IINE_OK, iine_estimator_compute_window(e, &points, 0, 0, INT32_MAX, INT32_MAX, &normal));
  STATUS(IINE_OK, iine_estimator_compute_window(e, &points, X, Y, 0, 0, &normal));
  CHECK(isnan(one[0]) && isnan(one[3]));
  CHECK(memcmp(one + 4, one_before + 4, 4 * sizeof(float)) == 0);
  iine_estimator_free(e);
}

static iine_maps no_maps(void) {
  iine_maps maps;
  memset(&maps, 0, sizeof maps);
  maps.struct_size = sizeof maps;
  return maps;
}

/* One refused call of compute_maps. */
#define REFUSE_MAPS(expected, change)                                        \
  do {                                                                       \
    iine_points points = cloud_points();                                     \
    iine_maps maps = all;                                                    \
    change;                                                                  \
    STATUS((expected), iine_estimator_compute_maps(e, &points, &maps));      \
  } while (0)

static void test_maps(void) {
  static uint8_t depth_changes[PIXELS + 4], untouched_changes[PIXELS + 4];
  static float distances[PIXELS + 1], areas[PIXELS + 1], untouched[PIXELS + 1], three[4 * PIXELS];
  iine_estimator *const e = new_estimator();
  const iine_points points = cloud_points();
  const iine_maps none = no_maps();
  iine_maps all = none, maps;
  int i;
  all.depth_changes = depth_changes;
  all.distances = distances;
  all.smoothing_areas = areas;
  memset(depth_changes, 0x5a, sizeof depth_changes);
  memset(distances, 0x5a, sizeof distances);
  memset(areas, 0x5a, sizeof areas);
  memcpy(untouched_changes, depth_changes, sizeof depth_changes);
  memcpy(untouched, distances, sizeof distances);
  memcpy(before, cloud, sizeof cloud);

  STATUS(IINE_ERROR_NULL_POINTER, iine_estimator_compute_maps(NULL, &points, &all));
  STATUS(IINE_ERROR_NULL_POINTER, iine_estimator_compute_maps(e, NULL, &all));
  STATUS(IINE_ERROR_NULL_POINTER, iine_estimator_compute_maps(e, &points, NULL));
  REFUSE_MAPS(IINE_ERROR_STRUCT_SIZE, points.struct_size = 8);
  REFUSE_MAPS(IINE_ERROR_SIZE, points.width = 0);
  REFUSE_MAPS(IINE_ERROR_STRIDE, points.point_stride = 2);
  REFUSE_MAPS(IINE_ERROR_STRUCT_SIZE, maps.struct_size += 1);
  REFUSE_MAPS(IINE_ERROR_STRUCT_SIZE, (maps.eigenvalues = three, maps.struct_size -= sizeof(float *)));
  REFUSE_MAPS(IINE_ERROR_MISALIGNED, maps.distances = misaligned(distances));
  REFUSE_MAPS(IINE_ERROR_MISALIGNED, maps.smoothing_areas = misaligned(areas));
  REFUSE_MAPS(IINE_ERROR_MISALIGNED, maps.depth_radii = misaligned(three));
  REFUSE_MAPS(IINE_ERROR_MISALIGNED, maps.eigenvalues = misaligned(three));
  REFUSE_MAPS(IINE_ERROR_OVERLAP, maps.smoothing_areas = distances);
  REFUSE_MAPS(IINE_ERROR_OVERLAP, maps.depth_changes = (uint8_t *)(distances + PIXELS) - 1);
  REFUSE_MAPS(IINE_ERROR_OVERLAP, maps.depth_changes = (uint8_t *)cloud);
  REFUSE_MAPS(IINE_ERROR_OVERLAP, maps.distances = &cloud[PIXELS - 1].z);
  REFUSE_MAPS(IINE_ERROR_OVERLAP, (maps.eigenvalues = three, maps.smoothing_areas = three + 3 * PIXELS - 1));
  REFUSE_MAPS(IINE_ERROR_OVERLAP, maps.depth_radii = distances);
  REFUSE_MAPS(IINE_ERROR_OVERLAP, (maps.depth_radii = three, maps.depth_changes = (uint8_t *)three + 2 * PIXELS));
  REFUSE_MAPS(IINE_ERROR_OVERLAP, (maps.smoothing_areas = three, maps.depth_changes = (uint8_t *)three + 2 * PIXELS));
  REFUSE_MAPS(IINE_ERROR_UNSUPPORTED, maps.depth_radii = three); /* not with PCL's semantics */
  REFUSE_MAPS(IINE_ERROR_UNSUPPORTED, maps.eigenvalues = three); /* not with this method */
  CHECK(memcmp(depth_changes, untouched_changes, sizeof depth_changes) == 0);
  CHECK(memcmp(distances, untouched, sizeof distances) == 0);
  CHECK(memcmp(areas, untouched, sizeof areas) == 0);
  CHECK(memcmp(before, cloud, sizeof cloud) == 0);

  STATUS(IINE_OK, iine_estimator_compute_maps(e, &points, &none));
  maps = none;
  maps.distances = distances;
  STATUS(IINE_OK, iine_estimator_compute_maps(e, &points, &maps));
  CHECK(memcmp(distances, untouched, sizeof *distances) != 0);
  CHECK(memcmp(depth_changes, untouched_changes, sizeof depth_changes) == 0);
  CHECK(memcmp(areas, untouched, sizeof areas) == 0);

  STATUS(IINE_OK, iine_estimator_compute_maps(e, &points, &all));
  for (i = 0; i < PIXELS; ++i) {
    const int row = i / WIDTH, column = i % WIDTH;
    const int border = row < 10 || column < 10 || row >= HEIGHT - 10 || column >= WIDTH - 10;
    CHECK(depth_changes[i] <= 1);
    CHECK((depth_changes[i] == 1) == (distances[i] == 0.0f));
    CHECK(areas[i] >= 0.0f && areas[i] <= 10.0f && areas[i] == floorf(areas[i]));
    CHECK(!border || areas[i] == 0.0f);
    CHECK(areas[i] == 0.0f || areas[i] <= distances[i]);
  }
  CHECK(depth_changes[15 * WIDTH + WIDTH / 2] == 1 && depth_changes[15 * WIDTH + WIDTH / 2 - 6] == 0);
  CHECK(memcmp(depth_changes + PIXELS, untouched_changes + PIXELS, 4) == 0);
  CHECK(memcmp(distances + PIXELS, untouched + PIXELS, sizeof(float)) == 0);
  CHECK(memcmp(areas + PIXELS, untouched + PIXELS, sizeof(float)) == 0);
  CHECK(memcmp(before, cloud, sizeof cloud) == 0);

  /* Maps may touch each other and the points: here z, three maps and x end to end, and in the other order. */
  {
    static float planes[6 * PIXELS];
    iine_points touching = points;
    touching.point_stride = sizeof(float);
    touching.y = planes;
    touching.z = planes + PIXELS;
    touching.x = planes + 5 * PIXELS;
    maps = all;
    maps.distances = planes + 2 * PIXELS;
    maps.smoothing_areas = planes + 3 * PIXELS;
    maps.depth_changes = (uint8_t *)(planes + 4 * PIXELS);
    STATUS(IINE_OK, iine_estimator_compute_maps(e, &touching, &maps));
    maps.smoothing_areas = planes + 2 * PIXELS;
    maps.distances = planes + 3 * PIXELS;
    maps.depth_changes = (uint8_t *)(planes + 5 * PIXELS) - PIXELS;
    STATUS(IINE_OK, iine_estimator_compute_maps(e, &touching, &maps));
    maps.depth_changes += 1;
    STATUS(IINE_ERROR_OVERLAP, iine_estimator_compute_maps(e, &touching, &maps));
  }

  /* A program made for the first version of the struct has no more fields: what lies there is not read. */
  maps = all;
  maps.struct_size = offsetof(iine_maps, depth_radii);
  maps.depth_radii = misaligned(distances);
  maps.eigenvalues = distances;
  memset(distances, 0x5a, sizeof distances);
  STATUS(IINE_OK, iine_estimator_compute_maps(e, &points, &maps));
  CHECK(memcmp(distances, untouched, sizeof *distances) != 0);

  /* The eigenvalues, of as many points as the windows have. */
  STATUS(IINE_OK, iine_estimator_set_method(e, IINE_METHOD_COVARIANCE_MATRIX));
  memset(three, 0x5a, sizeof three);
  maps = all;
  maps.eigenvalues = three;
  STATUS(IINE_OK, iine_estimator_compute_maps(e, &points, &maps));
  for (i = 0; i < PIXELS; ++i) {
    const float *const values = three + 3 * i;
    if (areas[i] == 0.0f) {
      CHECK(isnan(values[0]) && isnan(values[1]) && isnan(values[2]));
    } else {
      CHECK(0.0f <= values[0] && values[0] <= values[1] && values[1] <= values[2] && values[2] < 0.1f);
    }
  }
  CHECK(memcmp(three + 3 * PIXELS, untouched, sizeof *untouched) == 0);

  /* And the paper's radii. */
  STATUS(IINE_OK, iine_estimator_set_semantics(e, IINE_SEMANTICS_PAPER));
  maps.depth_radii = three;
  maps.eigenvalues = NULL;
  STATUS(IINE_OK, iine_estimator_compute_maps(e, &points, &maps));
  for (i = 0; i < PIXELS; ++i) {
    CHECK(isnan(three[i]) ? isnan(cloud[i].z) && areas[i] == 0.0f : areas[i] <= three[i] && three[i] >= 5.0f);
  }
  iine_estimator_free(e);
}

static void test_scratch(void) {
  static float expected[4 * PIXELS];
  size_t sizes[2] = {1, 1}, held;
  iine_estimator *const e = new_estimator();
  const iine_points points = cloud_points();
  const iine_normals to_expected = packed_normals(expected), to_actual = packed_normals(normals_out);
  STATUS(IINE_OK, iine_estimator_compute(e, &points, &to_expected));
  STATUS(IINE_OK, iine_estimator_scratch_size(e, &held));
  STATUS(IINE_OK, iine_estimator_compute(e, &points, &to_actual));
  STATUS(IINE_OK, iine_estimator_scratch_size(e, &sizes[0]));
  CHECK(sizes[0] == held); /* nothing more after the first frame of a size */
  STATUS(IINE_OK, iine_estimator_release_scratch(e));
  STATUS(IINE_OK, iine_estimator_scratch_size(e, &sizes[0]));
  CHECK(sizes[0] == 0);
  STATUS(IINE_OK, iine_estimator_compute(e, &points, &to_actual));
  CHECK(memcmp(expected, normals_out, sizeof expected) == 0);

  sizes[0] = sizes[1] = 1;
  STATUS(IINE_ERROR_NULL_POINTER, iine_estimator_scratch_size(NULL, sizes));
  STATUS(IINE_ERROR_NULL_POINTER, iine_estimator_scratch_size(e, NULL));
  STATUS(IINE_ERROR_MISALIGNED, iine_estimator_scratch_size(e, (size_t *)(void *)((char *)sizes + 1)));
  CHECK(sizes[0] == 1 && sizes[1] == 1);
  STATUS(IINE_ERROR_NULL_POINTER, iine_estimator_release_scratch(NULL));
  iine_estimator_free(e);
}

/* The smoothing area map R of the paper, with all options as they are. */
static void paper_radii(iine_estimator *e, float *to) {
  const iine_points points = cloud_points();
  iine_maps maps = no_maps();
  maps.smoothing_areas = to;
  STATUS(IINE_OK, iine_estimator_compute_maps(e, &points, &maps));
}

/* Pixels of the cloud: away from the step and in its corner, the missing one, and the last one before the step. */
enum { INSIDE = 12 * WIDTH + 8, CORNER = 0, HOLE = 20 * WIDTH + 10, EDGE = 15 * WIDTH + WIDTH / 2 - 1 };

/* With the paper's semantics. The plane is steep: only the step is a depth change. */
static iine_estimator *new_paper_estimator(void) {
  iine_estimator *const e = new_estimator();
  STATUS(IINE_OK, iine_estimator_set_semantics(e, IINE_SEMANTICS_PAPER));
  STATUS(IINE_OK, iine_estimator_set_paper_gamma(e, 100.0f));
  return e;
}

/* Every option of the paper's semantics has its effect, and one that is refused has none. */
static void test_paper_radii(void) {
  static float radii[PIXELS], other[PIXELS];
  iine_estimator *const e = new_paper_estimator();
  paper_radii(e, radii);
  CHECK(radii[INSIDE] == 5.0f && radii[CORNER] == 5.0f);
  CHECK(radii[HOLE] == 0.0f && radii[EDGE] == 0.0f);
  STATUS(IINE_ERROR_OPTION_VALUE, iine_estimator_set_paper_alpha(e, NAN));
  STATUS(IINE_ERROR_OPTION_VALUE, iine_estimator_set_paper_beta(e, -1.0f));
  STATUS(IINE_ERROR_OPTION_VALUE, iine_estimator_set_paper_gamma(e, 0.0f));
  STATUS(IINE_ERROR_OPTION_VALUE, iine_estimator_set_paper_radii(e, 3, 2, 1));
  STATUS(IINE_ERROR_OPTION_VALUE, iine_estimator_set_paper_distance_metric(e, 2));
  STATUS(IINE_ERROR_OPTION_VALUE, iine_estimator_set_paper_depth(e, 2));
  paper_radii(e, other);
  CHECK(memcmp(radii, other, sizeof radii) == 0);

  STATUS(IINE_OK, iine_estimator_set_paper_beta(e, 4000.0f));
  paper_radii(e, other);
  CHECK(other[CORNER] == 4000.0f * (0.0028f * cloud[CORNER].z * cloud[CORNER].z));
  STATUS(IINE_OK, iine_estimator_set_paper_alpha(e, 0.0025f));
  paper_radii(e, other);
  CHECK(other[CORNER] == 4000.0f * (0.0025f * cloud[CORNER].z * cloud[CORNER].z));
  STATUS(IINE_OK, iine_estimator_set_paper_radii(e, 1, 4, 7));
  paper_radii(e, other);
  CHECK(other[CORNER] == 7.0f);
  STATUS(IINE_OK, iine_estimator_set_paper_beta(e, 1e-3f));
  paper_radii(e, other);
  CHECK(other[CORNER] == 4.0f);
  STATUS(IINE_OK, iine_estimator_set_paper_radii(e, 4, 4, 7));
  paper_radii(e, other);
  CHECK(other[15 * WIDTH + WIDTH / 2 - 6] == 0.0f); /* 5 px from the change, 3.5 of radius */
  STATUS(IINE_OK, iine_estimator_set_paper_radii(e, 1, 4, 7));
  STATUS(IINE_OK, iine_estimator_set_paper_gamma(e, 0.1f));
  paper_radii(e, other);
  CHECK(other[CORNER] == 0.0f); /* every pixel is a change now */
  iine_estimator_free(e);
}

static void test_paper_depth_and_metric(void) {
  static float radii[PIXELS], other[PIXELS], distances[PIXELS];
  iine_estimator *const e = new_paper_estimator();
  const iine_points points = cloud_points();
  iine_maps maps = no_maps();
  /* Depth by the range is more than by z. */
  STATUS(IINE_OK, iine_estimator_set_paper_beta(e, 4000.0f));
  paper_radii(e, radii);
  STATUS(IINE_OK, iine_estimator_set_paper_depth(e, IINE_DEPTH_RANGE));
  paper_radii(e, other);
  CHECK(other[CORNER] > radii[CORNER]);
  STATUS(IINE_OK, iine_estimator_set_paper_depth(e, IINE_DEPTH_Z));
  /* The nearest depth change is two columns and one row away: 7 / 3, not the square root of 5. */
  STATUS(IINE_OK, iine_estimator_set_paper_distance_metric(e, IINE_DISTANCE_METRIC_CHAMFER));
  cloud[15 * WIDTH + 8].z -= 0.5f;
  maps.distances = distances;
  STATUS(IINE_OK, iine_estimator_compute_maps(e, &points, &maps));
  CHECK(distances[16 * WIDTH + 10] == 7.0f / 3.0f);
  iine_estimator_free(e);
}

/* SIMPLE_3D_GRADIENT is refused and writes nothing. */
static void test_paper_methods(void) {
  static float expected[4 * PIXELS];
  const int32_t indices[2] = {INSIDE, CORNER};
  iine_estimator *const e = new_paper_estimator();
  const iine_points points = cloud_points();
  const iine_normals to_expected = packed_normals(expected), to_actual = packed_normals(normals_out);
  int32_t method;
  int i, missing;
  for (method = 0; method < IINE_METHOD_SIMPLE_3D_GRADIENT; ++method) {
    STATUS(IINE_OK, iine_estimator_set_method(e, method));
    STATUS(IINE_OK, iine_estimator_compute(e, &points, &to_expected));
    CHECK(expected[4 * INSIDE] > 0.97f && expected[4 * CORNER] > 0.97f);
    CHECK(isnan(expected[4 * HOLE]) && isnan(expected[4 * EDGE]));
    CHECK(isnan(expected[4 * INSIDE + 3]) == (method != IINE_METHOD_COVARIANCE_MATRIX));
    STATUS(IINE_OK, iine_estimator_compute_indices(e, &points, indices, 2, &to_actual));
    CHECK(memcmp(normals_out, expected + 4 * INSIDE, 4 * sizeof(float)) == 0);
    CHECK(memcmp(normals_out + 4, expected + 4 * CORNER, 4 * sizeof(float)) == 0);
    STATUS(IINE_OK, iine_estimator_compute_window(e, &points, 8, 12, 11, 11, &to_actual));
    for (i = 0; i < 3; ++i) {
      CHECK(fabsf(normals_out[i] - expected[4 * INSIDE + i]) < 1e-5f);
    }

    STATUS(IINE_OK, iine_estimator_set_one_sided_windows(e, 1));
    STATUS(IINE_OK, iine_estimator_compute(e, &points, &to_actual));
    STATUS(IINE_OK, iine_estimator_set_one_sided_windows(e, 0));
    for (i = 0, missing = 0; i < PIXELS; ++i) {
      missing += isnan(normals_out[4 * i]) ? 1 : 0;
    }
    CHECK(missing == 1); /* the hole */
    CHECK(normals_out[4 * EDGE] > 0.97f && normals_out[4 * EDGE + 4] > 0.9f); /* before and behind the step */
  }
  STATUS(IINE_OK, iine_estimator_set_method(e, IINE_METHOD_SIMPLE_3D_GRADIENT));
  refuse(IINE_ERROR_UNSUPPORTED, e, &points, &to_actual, __LINE__);
  STATUS(IINE_ERROR_UNSUPPORTED, iine_estimator_compute_window(e, &points, 12, 12, 5, 5, &to_actual));
  iine_estimator_free(e);
}

/* Zeros are points, or missing. */
static void test_zeros(void) {
  static float radii[PIXELS], of_paper[4 * PIXELS];
  const iine_points points = cloud_points();
  const iine_normals to_paper = packed_normals(of_paper), to_actual = packed_normals(normals_out);
  int are_missing;
  cloud[HOLE].x = cloud[HOLE].y = cloud[HOLE].z = 0.0f;
  for (are_missing = 0; are_missing < 2; ++are_missing) {
    iine_estimator *const e = new_estimator();
    STATUS(IINE_OK, iine_estimator_set_zero_is_missing(e, are_missing));
    STATUS(IINE_OK, iine_estimator_set_one_sided_windows(e, 1));
    STATUS(IINE_OK, iine_estimator_compute(e, &points, &to_actual));
    STATUS(IINE_OK, iine_estimator_set_semantics(e, IINE_SEMANTICS_PAPER));
    STATUS(IINE_OK, iine_estimator_compute(e, &points, &to_paper));
    CHECK(isnan(normals_out[4 * HOLE]) || !are_missing);
    CHECK(isnan(of_paper[4 * HOLE]) || !are_missing);
    paper_radii(e, radii);
    CHECK(radii[HOLE - 1] > 0.0f || !are_missing);
    iine_estimator_free(e);
  }
}

/* A valley between two planes: with crease windows the normals next to it are those of the planes. */
static void test_crease_windows(void) {
  iine_estimator *const e = new_estimator();
  const iine_points points = cloud_points();
  const iine_normals normals = packed_normals(normals_out);
  float worst[2] = {0.0f, 0.0f};
  int i, pass;
  for (i = 0; i < PIXELS; ++i) {
    const float u = 0.004f * (float)(i % WIDTH - WIDTH / 2);
    cloud[i].z = 1.0f / (1.0f + fabsf(u));
    cloud[i].x = u * cloud[i].z;
    cloud[i].y = 0.004f * (float)(i / WIDTH - HEIGHT / 2) * cloud[i].z;
  }
  STATUS(IINE_OK, iine_estimator_set_method(e, IINE_METHOD_COVARIANCE_MATRIX));
  STATUS(IINE_OK, iine_estimator_set_semantics(e, IINE_SEMANTICS_PAPER));
  for (pass = 0; pass < 2; ++pass) {
    STATUS(IINE_OK, iine_estimator_set_crease_windows(e, pass));
    STATUS(IINE_OK, iine_estimator_compute(e, &points, &normals));
    for (i = 0; i < PIXELS; ++i) {
      const int column = i % WIDTH - WIDTH / 2;
      const float off = fabsf(fabsf(normals_out[4 * i]) - sqrtf(0.5f));
      if (column != 0 && !(off <= worst[pass])) {
        worst[pass] = off;
      }
    }
  }
  CHECK(worst[0] > 0.3f);
  CHECK(worst[1] < 0.05f);
  iine_estimator_free(e);
}

/* The smallest clouds: no window fits, so no normal, and no fault. */
static void test_small_clouds(void) {
  iine_estimator *const e = new_estimator();
  const iine_normals normals = packed_normals(normals_out);
  iine_points points = cloud_points();
  uint32_t width, height, i;
  for (width = 1; width <= 4; ++width) {
    for (height = 1; height <= 4; ++height) {
      points.width = width;
      points.height = height;
      STATUS(IINE_OK, iine_estimator_compute(e, &points, &normals));
      for (i = 0; i < width * height; ++i) {
        CHECK(isnan(normals_out[4 * i]) && isnan(normals_out[4 * i + 3]));
      }
    }
  }
  iine_estimator_free(e);
}

int main(void) {
  void (*const tests[])(void) = {
      test_version,  test_isa_name,   test_status_strings,
      test_new_and_free,    test_options, test_paper_options, test_refused_options_change_nothing,
      test_compute,  test_layouts,    test_threads_do_not_change_the_result,
      test_compute_refuses, test_indices, test_window, test_maps,
      test_paper_radii, test_paper_depth_and_metric, test_paper_methods, test_zeros, test_crease_windows,
      test_scratch,  test_small_clouds};
  size_t i;
  for (i = 0; i < sizeof tests / sizeof *tests; ++i) {
    fill_cloud();
    tests[i]();
  }
  printf("%d checks failed\n", failures);
  return failures == 0 ? 0 : 1;
}
