// iine against PCL, in one process and in alternation: the tables of docs/performance.md, as Markdown.
// What is compared with PCL is checked before it is timed: the same pixels have a normal, and the angles are PCL's.
//
// usage: against_pcl FRAME.pcd...

#include <iine/pcl/integral_image_normal.h>

#include <pcl/console/print.h>
#include <pcl/features/integral_image_normal.h>
#include <pcl/features/normal_3d.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

using Point = pcl::PointXYZ;
using Cloud = pcl::PointCloud<Point>;
using Normals = pcl::PointCloud<pcl::Normal>;
using Ours = iine::IntegralImageNormalEstimation<Point, pcl::Normal>;
using Pcl = pcl::IntegralImageNormalEstimation<Point, pcl::Normal>;

struct Frame
{
  std::string name;
  Cloud::Ptr cloud;
};

struct Method
{
  int number;
  const char* name;
  double asked_ignore, asked_mirror, asked_memcpy; // times faster than PCL, and at most times memcpy
};

constexpr Method METHODS[] = {{1, "AVERAGE_3D_GRADIENT", 10, 12, 2.5},
                              {0, "COVARIANCE_MATRIX", 15, 15, 4},
                              {2, "AVERAGE_DEPTH_CHANGE", 8, 12, 2.5},
                              {3, "SIMPLE_3D_GRADIENT", 10, 0, 2.5}};
constexpr bool DEPTH_DEPENDENT = true;
constexpr int SIMPLE_3D_GRADIENT = 3;
constexpr int COVARIANCE_MATRIX = 0;

[[noreturn]] void
fail (const std::string& what)
{
  std::fprintf (stderr, "against_pcl: %s\n", what.c_str ());
  std::exit (1);
}

double
quantile (std::vector<double> values, double q)
{
  if (values.empty ())
    return NAN;
  const auto at = values.begin () + static_cast<std::ptrdiff_t> (q * static_cast<double> (values.size () - 1));
  std::nth_element (values.begin (), at, values.end ());
  return *at;
}

double
median (const std::vector<double>& values)
{
  return quantile (values, 0.5);
}

double
milliseconds (const std::function<void ()>& work)
{
  const auto start = std::chrono::steady_clock::now ();
  work ();
  return std::chrono::duration<double, std::milli> (std::chrono::steady_clock::now () - start).count ();
}

// The medians of several pieces of work, in alternation, after one round to warm up. Every other round goes backwards:
// what comes after another finds the caches as that leaves them. With a pause before each, as between a camera's frames, the
// cores have gone to sleep.
std::vector<double>
alternate (int rounds, const std::vector<std::function<void ()>>& works,
           std::chrono::milliseconds pause = std::chrono::milliseconds (0))
{
  std::vector<std::vector<double>> times (works.size ());
  for (int round = -1; round < rounds; ++round)
    for (std::size_t k = 0; k < works.size (); ++k)
    {
      const std::size_t at = round % 2 == 0 ? k : works.size () - 1 - k;
      std::this_thread::sleep_for (pause);
      const double time = milliseconds (works[at]);
      if (round >= 0)
        times[at].push_back (time);
    }
  std::vector<double> medians;
  for (const auto& each : times)
    medians.push_back (median (each));
  return medians;
}

// Copies as many bytes as the points and the normals of a cloud have: 16 and 32 a pixel.
class Copy
{
  public:
    explicit Copy (std::size_t pixels) : from_ (48 * pixels, 1), to_ (48 * pixels, 2) {}

    void
    operator() ()
    {
      std::memcpy (to_.data (), from_.data (), to_.size ());
      // The compiler must believe that the copy is read.
      asm volatile ("" : : "r"(to_.data ()) : "memory");
    }

  private:
    std::vector<char> from_, to_;
};

// The C API over clouds of PCL.
class Estimator
{
  public:
    Estimator (int method, bool mirror, float size, unsigned threads = 1)
    {
      iine_estimator* made = nullptr;
      check (iine_estimator_new (&made));
      estimator_.reset (made);
      check (iine_estimator_set_method (made, method));
      check (iine_estimator_set_border_policy (made, mirror ? IINE_BORDER_POLICY_MIRROR : IINE_BORDER_POLICY_IGNORE));
      check (iine_estimator_set_normal_smoothing_size (made, size));
      check (iine_estimator_set_depth_dependent_smoothing (made, DEPTH_DEPENDENT));
      check (iine_estimator_set_threads (made, threads));
    }

    void
    compute (const Cloud& cloud, Normals& output)
    {
      iine_points points = {};
      points.struct_size = sizeof points;
      points.width = cloud.width;
      points.height = cloud.height;
      points.x = &cloud[0].x;
      points.y = &cloud[0].y;
      points.z = &cloud[0].z;
      points.point_stride = sizeof (Point);
      iine_normals normals = {};
      normals.struct_size = sizeof normals;
      normals.nx = &output[0].normal_x;
      normals.ny = &output[0].normal_y;
      normals.nz = &output[0].normal_z;
      normals.point_stride = sizeof (pcl::Normal);
      normals.curvature = &output[0].curvature;
      normals.curvature_point_stride = sizeof (pcl::Normal);
      check (iine_estimator_compute (estimator_.get (), &points, &normals));
    }

    std::size_t
    scratch () const
    {
      std::size_t bytes = 0;
      check (iine_estimator_scratch_size (estimator_.get (), &bytes));
      return bytes;
    }

  private:
    static void
    check (int status)
    {
      if (status != IINE_OK)
        fail (iine_status_string (status));
    }

    struct Free
    {
      void operator() (iine_estimator* estimator) const { iine_estimator_free (estimator); }
    };
    std::unique_ptr<iine_estimator, Free> estimator_;
};

template <typename Estimation> void
prepare (Estimation& estimation, int method, bool mirror, float size)
{
  estimation.setNormalEstimationMethod (static_cast<typename Estimation::NormalEstimationMethod> (method));
  estimation.setBorderPolicy (mirror ? Estimation::BORDER_POLICY_MIRROR : Estimation::BORDER_POLICY_IGNORE);
  estimation.setMaxDepthChangeFactor (0.02f);
  estimation.setNormalSmoothingSize (size);
  estimation.setDepthDependentSmoothing (DEPTH_DEPENDENT);
}

// What two outputs come to.
struct Comparison
{
  double p999;            // of the angle, in degrees
  std::size_t only_first; // pixels that have a normal in the first only
};

// Masks must be identical, but that the first may have `allowed` normals more.
Comparison
compare (const std::string& what, const Normals& a, const Normals& b, std::size_t allowed)
{
  if (a.size () != b.size ())
    fail (what + ": sizes differ");
  std::vector<double> angles;
  std::size_t only_first = 0, only_second = 0;
  for (std::size_t i = 0; i < a.size (); ++i)
  {
    const Eigen::Vector3d u = a[i].getNormalVector3fMap ().cast<double> ();
    const Eigen::Vector3d v = b[i].getNormalVector3fMap ().cast<double> ();
    if (u.allFinite () != v.allFinite ())
      ++(u.allFinite () ? only_first : only_second);
    else if (u.allFinite ())
      angles.push_back (std::atan2 (u.cross (v).norm (), u.dot (v)) * 180.0 / M_PI);
  }
  if (only_first > allowed || only_second > 0)
    fail (what + ": pixels that have a normal from one only: " + std::to_string (only_first) + " and " +
          std::to_string (only_second));
  if (angles.size () < a.size () / 8)
    fail (what + ": hardly a normal");
  return {quantile (angles, 0.999), only_first};
}

// The same as benches/rust/lib.rs: what is seen around a pixel does not depend on the size.
Cloud::Ptr
generated (std::uint32_t width, std::uint32_t height)
{
  Cloud::Ptr cloud (new Cloud (width, height));
  const float focal_length = 525.0f * static_cast<float> (width) / 640.0f;
  constexpr float NaN = std::numeric_limits<float>::quiet_NaN ();
  for (std::uint32_t row = 0; row < height; ++row)
    for (std::uint32_t column = 0; column < width; ++column)
    {
      const std::uint32_t in_x = column % 160, in_y = row % 120;
      const bool beside = in_y >= 30 && in_y < 80;
      const bool object = beside && in_x >= 40 && in_x < 100, shadow = beside && in_x >= 34 && in_x < 40;
      const float tau = 6.2831855f;
      float z = 2.0f + 0.15f * std::sin (tau * static_cast<float> (in_x) / 160.0f) *
                           std::cos (tau * static_cast<float> (in_y) / 120.0f) - (object ? 0.5f : 0.0f);
      const float step = 0.00285f;
      z = 1.0f / (std::round (1.0f / (z * step)) * step);
      const std::uint32_t cell = 20;
      std::uint32_t hash = column / cell * 0x9e3779b9u ^ row / cell * 0x85ebca6bu;
      hash = (hash ^ hash >> 15) * 0x2c1b3c6du;
      hash ^= hash >> 12;
      const int x = static_cast<int> (column % cell) - 10, y = static_cast<int> (row % cell) - 10;
      const int radius = 2 + static_cast<int> ((hash >> 8) % 6);
      if (shadow || (hash % 16 == 0 && x * x + y * y <= radius * radius))
        (*cloud) (column, row) = Point (NaN, NaN, NaN);
      else
        (*cloud) (column, row) =
            Point ((static_cast<float> (column) - 0.5f * static_cast<float> (width)) / focal_length * z,
                   (static_cast<float> (row) - 0.5f * static_cast<float> (height)) / focal_length * z, z);
    }
  return cloud;
}

std::string
processor ()
{
  std::ifstream info ("/proc/cpuinfo");
  for (std::string line; std::getline (info, line);)
    if (line.compare (0, 10, "model name") == 0)
      return line.substr (line.find (':') + 2);
  return "unknown";
}

void
printSetting (int frames, int rounds)
{
  std::printf ("Processor: %s, %u cores; instruction set: %s; iine %s, PCL %s.\n", processor ().c_str (),
               std::thread::hardware_concurrency (), iine_isa_name (), iine_version_string (), PCL_VERSION_PRETTY);
  std::string load;
  std::getline (std::ifstream ("/proc/loadavg"), load);
  std::printf ("Load of the machine at the start: %s.\n", load.substr (0, load.find (' ')).c_str ());
  std::printf ("Times in ms, wall clock, medians of %d rounds in alternation; %d frames.\n\n", rounds, frames);
}

// What one configuration takes on one frame.
struct Times
{
  double copy, pcl, ours, c_api, pcl_fresh, ours_fresh;
};

Times
measure (const Frame& frame, const Method& method, bool mirror, float size, int rounds, Comparison& comparison)
{
  Pcl pcl;
  Ours ours;
  prepare (pcl, method.number, mirror, size);
  prepare (ours, method.number, mirror, size);
  Estimator c_api (method.number, mirror, size);
  Normals pcl_normals, our_normals, c_normals (frame.cloud->width, frame.cloud->height);

  const auto run = [&] (auto& estimation, Normals& output) {
    estimation.setInputCloud (frame.cloud);
    estimation.compute (output);
  };
  run (pcl, pcl_normals);
  run (ours, our_normals);
  c_api.compute (*frame.cloud, c_normals);
  const std::string what = frame.name + " " + method.name + (mirror ? " MIRROR" : " IGNORE");
  // COVARIANCE_MATRIX: PCL's own sums are f32. Its angles are off, and of a rare window it makes NaN
  // (docs/pcl-compatibility.md); cpp_tests judges both by a reference in f64.
  const bool covariance = method.number == COVARIANCE_MATRIX;
  comparison = compare (what, our_normals, pcl_normals, covariance ? 5 : 0);
  compare (what + ", C API", c_normals, our_normals, 0);
  if (!covariance && comparison.p999 > 0.01)
    fail (what + ": p99.9 of the angle to PCL's is " + std::to_string (comparison.p999));

  Copy copy (frame.cloud->size ());
  const auto fresh = [&] (auto& estimation) {
    Normals output;
    run (estimation, output);
  };
  const auto medians = alternate (rounds, {[&] { copy (); },
                                           [&] { run (pcl, pcl_normals); },
                                           [&] { run (ours, our_normals); },
                                           [&] { c_api.compute (*frame.cloud, c_normals); },
                                           [&] { fresh (pcl); },
                                           [&] { fresh (ours); }});
  return {medians[0], medians[1], medians[2], medians[3], medians[4], medians[5]};
}

std::string
number (double value, const char* format)
{
  char text[40];
  std::snprintf (text, sizeof text, format, value);
  return text;
}

void
printFrames (const std::vector<Frame>& frames, int rounds)
{
  struct Summary
  {
    std::vector<double> copy, pcl, ours, c_api, faster, c_faster, copies, c_copies, pcl_fresh, ours_fresh, fresh_faster;
  };
  std::string table, rows;
  for (const Method& method : METHODS)
    for (const bool mirror : {false, true})
    {
      if (mirror && method.number == SIMPLE_3D_GRADIENT)
        continue;
      // Each size for itself, and both together: the targets are for both.
      std::map<std::string, Summary> summaries;
      for (const float size : {10.0f, 20.0f})
        for (const Frame& frame : frames)
        {
          Comparison comparison = {};
          const Times t = measure (frame, method, mirror, size, rounds, comparison);
          char row[300];
          std::snprintf (row, sizeof row, "| %s | %s | %s | %g | %.2f | %.2f | %.2f | %.2f | %.1f | %.1f | %.2f | %.2g | %zu |\n",
                         frame.name.c_str (), method.name, mirror ? "MIRROR" : "IGNORE", size, t.copy, t.pcl, t.ours,
                         t.c_api, t.pcl / t.ours, t.pcl / t.c_api, t.c_api / t.copy, comparison.p999,
                         comparison.only_first);
          rows += row;
          for (const std::string& which : {number (size, "%g"), std::string ("10, 20")})
          {
            Summary& s = summaries[which];
            s.copy.push_back (t.copy);
            s.pcl.push_back (t.pcl);
            s.ours.push_back (t.ours);
            s.c_api.push_back (t.c_api);
            s.faster.push_back (t.pcl / t.ours);
            s.c_faster.push_back (t.pcl / t.c_api);
            s.copies.push_back (t.ours / t.copy);
            s.c_copies.push_back (t.c_api / t.copy);
            s.pcl_fresh.push_back (t.pcl_fresh);
            s.ours_fresh.push_back (t.ours_fresh);
            s.fresh_faster.push_back (t.pcl_fresh / t.ours_fresh);
          }
          std::fprintf (stderr, ".");
        }
      for (const auto& each : summaries)
      {
        const Summary& s = each.second;
        const bool is_of_both = each.first == "10, 20";
        const std::string asked = is_of_both ? number (mirror ? method.asked_mirror : method.asked_ignore, "%g") : "-";
        const std::string asked_copies = is_of_both && !mirror ? number (method.asked_memcpy, "%g") : "-";
        char row[300];
        std::snprintf (row, sizeof row, "| %s | %s | %s | %.2f | %.1f | %.2f | %.2f | %.1f | %.1f | %s | %.2f | %.2f | %s | %.1f | %.2f | %.1f |\n",
                       method.name, mirror ? "MIRROR" : "IGNORE", each.first.c_str (), median (s.copy), median (s.pcl),
                       median (s.ours), median (s.c_api), median (s.faster), median (s.c_faster), asked.c_str (),
                       median (s.copies), median (s.c_copies), asked_copies.c_str (), median (s.pcl_fresh),
                       median (s.ours_fresh), median (s.fresh_faster));
        table += row;
      }
    }
  std::fprintf (stderr, "\n");

  std::printf ("### Against PCL, one thread\n\n"
               "Medians over the frames, `setInputCloud` and `compute`, depth-dependent smoothing. Both classes write "
               "into an output cloud that is reused; in the last three columns into a fresh, empty one. The C API writes "
               "into the same kind of memory. memcpy copies 48 bytes a pixel "
               "(glibc changes to non-temporal stores above a size that depends on the cache, which shows by image size).\n\n"
               "| method | border | smoothing | memcpy | PCL | our class | C API | class: times faster | C API: times faster "
               "| asked | class: x memcpy | C API: x memcpy | asked | PCL, fresh | our class, fresh | times faster |\n"
               "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n%s", table.c_str ());
  std::printf ("\n### Frame by frame\n\n| frame | method | border | smoothing | memcpy | PCL | our class | C API "
               "| class: times faster | C API: times faster | C API: x memcpy | angle to PCL, p99.9 (deg) | normals PCL lacks |\n"
               "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n%s\n", rows.c_str ());
}

void
printNeighbours (const std::vector<Frame>& frames)
{
  std::printf ("### PCL's NormalEstimation (k nearest neighbours, kd-tree, once)\n\n| frame | k = 9 | k = 30 |\n|---|---|---|\n");
  for (const Frame& frame : frames)
  {
    std::printf ("| %s ", frame.name.c_str ());
    for (const int k : {9, 30})
    {
      pcl::NormalEstimation<Point, pcl::Normal> estimation;
      estimation.setSearchMethod (pcl::search::KdTree<Point>::Ptr (new pcl::search::KdTree<Point>));
      estimation.setKSearch (k);
      Normals normals;
      std::printf ("| %.0f ", milliseconds ([&] {
                     estimation.setInputCloud (frame.cloud);
                     estimation.compute (normals);
                   }));
    }
    std::printf ("|\n");
  }
  std::printf ("\n");
}

// Multiplications that do not wait for one another: as many as a core can make.
void
spin (long steps)
{
  std::array<std::uint64_t, 8> states = {1, 2, 3, 4, 5, 6, 7, 8};
  for (long k = 0; k < steps; ++k)
    for (std::uint64_t& state : states)
    {
      state *= 6364136223846793005u;
      asm volatile ("" : "+r"(state));
    }
}

void
printThreads ()
{
  std::printf ("### Two threads (generated cloud, smoothing 10, IGNORE, C API; asked: 1.8)\n\n"
               "Beside it, in the same rounds, a loop that keeps a core busy and shares nothing: less than 2 where other programs run, "
               "or where two processors are one core. The last columns are with a pause of 20 ms before each frame.\n\n"
               "| method | size | 1 thread | 2 threads | times faster | the loop | 1 thread, pause | 2 threads, pause | times "
               "faster |\n|---|---|---|---|---|---|---|---|---|\n");
  const long steps = 1000000;
  const auto alone = [&] { spin (2 * steps); };
  const auto shared = [&] {
    std::thread other ([&] { spin (steps); });
    spin (steps);
    other.join ();
  };
  for (const auto& size : {std::array<std::uint32_t, 2> {1280, 960}, std::array<std::uint32_t, 2> {2560, 1920}})
  {
    const Cloud::Ptr cloud = generated (size[0], size[1]);
    Normals one (size[0], size[1]), two (size[0], size[1]);
    for (const Method& method : METHODS)
    {
      Estimator single (method.number, false, 10.0f, 1), twofold (method.number, false, 10.0f, 2);
      const auto with_one = [&] { single.compute (*cloud, one); };
      const auto with_two = [&] { twofold.compute (*cloud, two); };
      const auto t = alternate (15, {with_one, with_two, alone, shared});
      for (std::size_t i = 0; i < one.size (); ++i)
        if (std::memcmp (one[i].data_n, two[i].data_n, 3 * sizeof (float)) != 0)
          fail (std::string (method.name) + ": two threads give another normal");
      const auto paused = alternate (15, {with_one, with_two}, std::chrono::milliseconds (20));
      std::printf ("| %s | %ux%u | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f |\n", method.name, size[0], size[1], t[0],
                   t[1], t[0] / t[1], t[2] / t[3], paused[0], paused[1], paused[0] / paused[1]);
    }
  }
  std::printf ("\n");
}

// The pixels that get a normal. Those at the border do not, which are more of a small image and of large windows.
double
countNormals (Estimator& estimator, const Cloud& cloud, Normals& normals)
{
  estimator.compute (cloud, normals);
  return static_cast<double> (std::count_if (normals.begin (), normals.end (), [] (const pcl::Normal& normal) {
    return std::isfinite (normal.normal_x);
  }));
}

double
largestOverSmallest (const std::vector<double>& values)
{
  const auto ends = std::minmax_element (values.begin (), values.end ());
  return *ends.second / *ends.first;
}

void
printSizes ()
{
  const std::vector<std::array<std::uint32_t, 2>> sizes = {{320, 240}, {640, 480}, {1280, 960}, {2560, 1920}, {4096, 3072}};
  std::printf ("### Cost by image size: ns a pixel (generated cloud, smoothing 10, IGNORE, C API)\n\n| method ");
  for (const auto& size : sizes)
    std::printf ("| %ux%u ", size[0], size[1]);
  std::printf ("| largest / smallest (asked: 1.15) | the same, ns a normal |\n|---|---|---|---|---|---|---|---|\n");
  // One size at a time, all methods: the largest clouds are half a gigabyte.
  std::vector<std::vector<double>> cost (5), cost_of_normal (5), bytes (4);
  for (const auto& size : sizes)
  {
    const Cloud::Ptr cloud = generated (size[0], size[1]);
    Normals normals (size[0], size[1]);
    const double pixels = static_cast<double> (cloud->size ());
    const int rounds = std::max (5, static_cast<int> (20e6 / pixels));
    Copy copy (cloud->size ());
    std::vector<std::unique_ptr<Estimator>> estimators;
    std::vector<std::function<void ()>> works = {[&] { copy (); }};
    for (const Method& method : METHODS)
    {
      estimators.emplace_back (new Estimator (method.number, false, 10.0f));
      Estimator* const estimator = estimators.back ().get ();
      works.emplace_back ([&, estimator] { estimator->compute (*cloud, normals); });
    }
    const auto t = alternate (rounds, works);
    for (std::size_t k = 0; k < t.size (); ++k)
      cost[k].push_back (t[k] * 1e6 / pixels);
    for (std::size_t k = 0; k < estimators.size (); ++k)
    {
      bytes[k].push_back (static_cast<double> (estimators[k]->scratch ()) / pixels);
      cost_of_normal[k + 1].push_back (t[k + 1] * 1e6 / countNormals (*estimators[k], *cloud, normals));
    }
  }
  for (std::size_t k = 0; k < cost.size (); ++k)
  {
    std::printf ("| %s ", k == 0 ? "memcpy" : METHODS[k - 1].name);
    for (const double value : cost[k])
      std::printf ("| %.2f ", value);
    std::printf ("| %.2f | %s |\n", largestOverSmallest (cost[k]),
                 k == 0 ? "-" : number (largestOverSmallest (cost_of_normal[k]), "%.2f").c_str ());
  }
  std::printf ("\n### Scratch memory: bytes a pixel (asked: 8, and a few dozen rows)\n\n| method ");
  for (const auto& size : sizes)
    std::printf ("| %ux%u ", size[0], size[1]);
  std::printf ("|\n|---|---|---|---|---|---|\n");
  for (std::size_t k = 0; k < bytes.size (); ++k)
  {
    std::printf ("| %s ", METHODS[k].name);
    for (const double value : bytes[k])
      std::printf ("| %.2f ", value);
    std::printf ("|\n");
  }
  std::printf ("\n");
}

void
printSmoothingSizes (const std::vector<Frame>& frames)
{
  const std::vector<float> sizes = {5, 10, 20, 30, 40, 50};
  for (const Frame& frame : frames)
  {
    std::printf ("### Cost by smoothing size: ns a pixel (%s, IGNORE, C API)\n\n| method ", frame.name.c_str ());
    for (const float size : sizes)
      std::printf ("| %g ", size);
    std::printf ("| largest / smallest (asked: 1.15) | the same, ns a normal |\n|---|---|---|---|---|---|---|---|---|\n");
    Normals normals (frame.cloud->width, frame.cloud->height);
    for (const Method& method : METHODS)
    {
      std::vector<std::unique_ptr<Estimator>> estimators;
      std::vector<std::function<void ()>> works;
      for (const float size : sizes)
      {
        estimators.emplace_back (new Estimator (method.number, false, size));
        Estimator* const estimator = estimators.back ().get ();
        works.emplace_back ([&, estimator] { estimator->compute (*frame.cloud, normals); });
      }
      const auto t = alternate (21, works);
      std::printf ("| %s ", method.name);
      std::vector<double> cost_of_normal;
      for (std::size_t k = 0; k < t.size (); ++k)
      {
        std::printf ("| %.2f ", t[k] * 1e6 / static_cast<double> (frame.cloud->size ()));
        cost_of_normal.push_back (t[k] / countNormals (*estimators[k], *frame.cloud, normals));
      }
      std::printf ("| %.2f | %.2f |\n", largestOverSmallest (t), largestOverSmallest (cost_of_normal));
    }
    std::printf ("\n");
  }
}

int
main (int argc, char** argv)
{
  pcl::console::setVerbosityLevel (pcl::console::L_ERROR); // not of fields that a file lacks
  std::setvbuf (stdout, nullptr, _IOLBF, BUFSIZ);
  const Frame surface = {"generated", generated (640, 480)};
  std::vector<Frame> frames;
  for (int k = 1; k < argc; ++k)
  {
    const std::string path = argv[k];
    const std::string file = path.substr (path.rfind ('/') + 1);
    frames.push_back ({file.substr (0, file.find ('.')), Cloud::Ptr (new Cloud)});
    if (pcl::io::loadPCDFile (path, *frames.back ().cloud) != 0 || !frames.back ().cloud->isOrganized ())
      fail (path + " is not an organized PCD file");
  }
  if (frames.empty ())
  {
    std::printf ("No real frames: the generated one.\n\n");
    frames.push_back (surface);
  }
  const int rounds = 9;
  printSetting (static_cast<int> (frames.size ()), rounds);
  printFrames (frames, rounds);
  printThreads ();
  printSizes ();
  printSmoothingSizes ({surface, frames.size () > 1 ? frames[1] : frames[0]});
  printNeighbours (frames);
  return 0;
}
