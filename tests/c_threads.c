/* The library's threads: how many, where it is unloaded and where the process is forked; the argument is its path. The
 * latter two are tried often: what goes wrong may do so now and then. Prints what failed; exits with 1 if anything did. */

#define _POSIX_C_SOURCE 200809L

#include <iine/iine.h>

#include <dirent.h>
#include <dlfcn.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { WIDTH = 32, HEIGHT = 32, THREADS = 8, UNLOADED = 50, FORKED = 10, SECONDS = 10 };

static float cloud[3 * WIDTH * HEIGHT], normals[3 * WIDTH * HEIGHT];
static void *library;

/* Function pointers are not made from the pointers to objects that dlsym gives, but copied from them. */
#define FUNCTION(result, name, arguments)            \
  result(*name) arguments;                           \
  {                                                  \
    void *const symbol = dlsym(library, "iine_" #name); \
    memcpy(&name, &symbol, sizeof symbol);           \
  }

static iine_estimator *new_estimator(void) {
  FUNCTION(int32_t, estimator_new, (iine_estimator **))
  FUNCTION(int32_t, estimator_set_threads, (iine_estimator *, uint32_t))
  iine_estimator *estimator = NULL;
  estimator_new(&estimator);
  estimator_set_threads(estimator, THREADS);
  return estimator;
}

static int compute(iine_estimator *estimator) {
  FUNCTION(int32_t, estimator_compute, (iine_estimator *, const iine_points *, const iine_normals *))
  const iine_points points = {sizeof points, WIDTH, HEIGHT, cloud, cloud + 1, cloud + 2, 12, 0};
  iine_normals to;
  memset(&to, 0, sizeof to);
  to.struct_size = sizeof to;
  to.nx = normals;
  to.ny = normals + 1;
  to.nz = normals + 2;
  to.point_stride = 12;
  return estimator_compute(estimator, &points, &to) == IINE_OK;
}

static int release(iine_estimator *estimator) {
  FUNCTION(int32_t, estimator_release_scratch, (iine_estimator *))
  return estimator_release_scratch(estimator) == IINE_OK;
}

static void end(iine_estimator *estimator) {
  FUNCTION(void, estimator_free, (iine_estimator *))
  estimator_free(estimator);
}

static int threads_of_process(void) {
  DIR *const tasks = opendir("/proc/self/task");
  int count = -2; /* . and .. */
  if (tasks == NULL) return 0;
  while (readdir(tasks) != NULL) ++count;
  closedir(tasks);
  return count;
}

/* A thread that was waited for may be listed a moment longer. */
static int has_threads(int count) {
  const struct timespec moment = {0, 1000000};
  int i;
  for (i = 0; i < 1000 * SECONDS && threads_of_process() != count; ++i) nanosleep(&moment, NULL);
  return threads_of_process() == count;
}

/* The calling thread computes too; the plain form computes alone. */
static int test_number(int before) {
  const char *const isa = getenv("IINE_ISA");
  const int others = isa != NULL && strcmp(isa, "scalar") == 0 ? 0 : THREADS - 1;
  iine_estimator *const estimator = new_estimator();
  const int passed = compute(estimator) && has_threads(before + others);
  end(estimator);
  return passed && has_threads(before);
}

/* What is thread-local in the library would keep it loaded while the thread lasts that used it. */
static void *use(void *passed) {
  iine_estimator *const estimator = new_estimator();
  *(int *)passed = compute(estimator);
  end(estimator);
  return NULL;
}

static int test_unloading(const char *path) {
  int i;
  for (i = 0; i < UNLOADED; ++i) {
    int passed = 0;
    pthread_t thread;
    library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL || pthread_create(&thread, NULL, use, &passed) != 0) return 0;
    pthread_join(thread, NULL);
    dlclose(library);
    /* A thread that outlived its estimator would run into nothing. */
    library = dlopen(path, RTLD_NOW | RTLD_NOLOAD);
    if (library != NULL) puts("the library stays loaded");
    if (!passed || library != NULL) return 0;
  }
  return 1;
}

/* What a fork does with an estimator of its parent's; that it can compute with it, tests/threads.rs shows. */
static void release_and_exit(iine_estimator *estimator) { _exit(release(estimator) ? 0 : 1); }
static void free_and_exit(iine_estimator *estimator) {
  end(estimator);
  _exit(0);
}

static int test_fork(void (*in_child)(iine_estimator *)) {
  iine_estimator *const estimator = new_estimator();
  int i, status = 0;
  for (i = 0; i < FORKED && status == 0; ++i) {
    pid_t child;
    if (!compute(estimator)) return 0;
    child = fork();
    if (child < 0) return 0;
    if (child == 0) {
      alarm(SECONDS); /* It is killed if it waits for threads that it does not have. */
      in_child(estimator);
    }
    waitpid(child, &status, 0);
  }
  if (status != 0) printf("fork %d: wait status %d\n", i, status);
  end(estimator);
  return status == 0;
}

static int failed(const char *name, int passed) {
  if (!passed) printf("FAILED %s\n", name);
  return !passed;
}

int main(int count, char **arguments) {
  /* Before there are any others, which might be listed still. */
  const int threads = threads_of_process();
  int i, failures = 0;
  if (count != 2) return 1;
  for (i = 0; i < WIDTH * HEIGHT; ++i) {
    cloud[3 * i] = 0.01f * (float)(i % WIDTH);
    cloud[3 * i + 1] = 0.01f * (float)(i / WIDTH);
    cloud[3 * i + 2] = 1.0f;
  }
  failures += failed("unloading", test_unloading(arguments[1]));
  library = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
  if (library == NULL) return 1;
  failures += failed("as many threads as were asked for", test_number(threads));
  failures += failed("releasing scratch memory in a fork", test_fork(release_and_exit));
  failures += failed("freeing in a fork", test_fork(free_and_exit));
  return failures > 0;
}
