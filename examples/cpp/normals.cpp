// Normals of an organized PCD file, by iine and by PCL: how many, how fast, how far apart, and, where the true
// normals are known, how far from them. Writes the normals as PCD and as a picture.

#include <iine/pcl/integral_image_normal.h>

#include <pcl/common/point_tests.h>
#include <pcl/console/print.h>
#include <pcl/features/integral_image_normal.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <png.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Normals = pcl::PointCloud<pcl::Normal>;

// The smoothing size is in pixels.
template <typename Estimation> void
prepare (Estimation& estimation)
{
  estimation.setNormalEstimationMethod (estimation.AVERAGE_3D_GRADIENT);
  estimation.setMaxDepthChangeFactor (0.02f);
  estimation.setNormalSmoothingSize (10.0f);
  estimation.setDepthDependentSmoothing (true);
}

// One frame as a pipeline has it, in milliseconds.
template <typename Estimation> double
time (Estimation& estimation, const Cloud::ConstPtr& cloud, Normals& normals)
{
  const auto start = std::chrono::steady_clock::now ();
  estimation.setInputCloud (cloud);
  estimation.compute (normals);
  return std::chrono::duration<double, std::milli> (std::chrono::steady_clock::now () - start).count ();
}

double
quantile (std::vector<double>& values, double q)
{
  if (values.empty ())
    return NAN;
  const auto at = values.begin () + static_cast<std::ptrdiff_t> (q * static_cast<double> (values.size () - 1));
  std::nth_element (values.begin (), at, values.end ());
  return *at;
}

// The angles in degrees where both have a normal; exact for small ones too.
std::vector<double>
angles (const Normals& a, const Normals& b)
{
  std::vector<double> found;
  for (std::size_t i = 0; i < a.size (); ++i)
  {
    const Eigen::Vector3d u = a[i].getNormalVector3fMap ().cast<double> ();
    const Eigen::Vector3d v = b[i].getNormalVector3fMap ().cast<double> ();
    if (u.allFinite () && v.allFinite ())
      found.push_back (std::atan2 (u.cross (v).norm (), u.dot (v)) * 180.0 / M_PI);
  }
  return found;
}

void
printAngles (const char* what, std::vector<double> found)
{
  double sum = 0.0;
  for (const double angle : found)
    sum += angle;
  std::printf ("%s: %zu pixels, mean %.3g, median %.3g, p99 %.3g, p99.9 %.3g, maximum %.3g deg\n", what,
               found.size (), sum / static_cast<double> (found.size ()), quantile (found, 0.5),
               quantile (found, 0.99), quantile (found, 0.999), quantile (found, 1.0));
}

void
printCoverage (const char* whose, const Normals& normals, std::size_t points)
{
  const auto covered = std::count_if (normals.begin (), normals.end (), [] (const pcl::Normal& normal) {
    return std::isfinite (normal.normal_x);
  });
  std::printf ("%s: %td normals, %.1f %% of the points\n", whose, covered,
               100.0 * static_cast<double> (covered) / static_cast<double> (points));
}

// Each component of a unit normal, from -1 to 1, as a colour from 0 to 255; the one towards the camera is bright
// blue, and a pixel without a normal is black.
bool
writePicture (const std::string& path, const Normals& normals)
{
  std::vector<std::uint8_t> pixels;
  for (const pcl::Normal& normal : normals)
    for (const float component : {normal.normal_x, -normal.normal_y, -normal.normal_z})
      pixels.push_back (std::isfinite (component) ? static_cast<std::uint8_t> (127.5f * (component + 1.0f)) : 0);
  png_image image;
  std::memset (&image, 0, sizeof image);
  image.version = PNG_IMAGE_VERSION;
  image.width = normals.width;
  image.height = normals.height;
  image.format = PNG_FORMAT_RGB;
  return png_image_write_to_file (&image, path.c_str (), 0, pixels.data (), 0, nullptr) != 0;
}

int
main (int argc, char** argv)
{
  if (argc != 3 && argc != 4)
  {
    std::fprintf (stderr, "usage: normals FRAME.pcd OUTPUT_PREFIX [TRUE_NORMALS.pcd]\n");
    return 2;
  }
  pcl::console::setVerbosityLevel (pcl::console::L_ERROR); // not of fields that a file lacks
  Cloud::Ptr cloud (new Cloud);
  if (pcl::io::loadPCDFile (argv[1], *cloud) != 0 || !cloud->isOrganized ())
  {
    std::fprintf (stderr, "%s is not an organized PCD file\n", argv[1]);
    return 1;
  }
  const auto points = static_cast<std::size_t> (
      std::count_if (cloud->begin (), cloud->end (), [] (const pcl::PointXYZ& p) { return pcl::isFinite (p); }));
  std::printf ("frame: %u x %u, %zu points\n", cloud->width, cloud->height, points);

  iine::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal> ours;
  pcl::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal> pcls;
  prepare (ours);
  prepare (pcls);
  Normals our_normals, pcl_normals;
  std::vector<double> our_times, pcl_times;
  for (int round = 0; round < 15; ++round)
  {
    our_times.push_back (time (ours, cloud, our_normals));
    pcl_times.push_back (time (pcls, cloud, pcl_normals));
  }
  if (our_normals.size () != cloud->size () || pcl_normals.size () != cloud->size ())
    return 1;

  printCoverage ("iine", our_normals, points);
  printCoverage ("PCL ", pcl_normals, points);
  const double our_time = quantile (our_times, 0.5), pcl_time = quantile (pcl_times, 0.5);
  std::printf ("time, median of %zu in alternation, 1 thread: iine (%s) %.2f ms, PCL %.2f ms, ratio %.1f\n",
               our_times.size (), iine_isa_name (), our_time, pcl_time, pcl_time / our_time);
  printAngles ("angle between iine and PCL", angles (our_normals, pcl_normals));

  if (argc == 4)
  {
    Normals truth;
    if (pcl::io::loadPCDFile (argv[3], truth) != 0 || truth.size () != cloud->size ())
    {
      std::fprintf (stderr, "%s does not hold this frame's normals\n", argv[3]);
      return 1;
    }
    printAngles ("true error of iine", angles (our_normals, truth));
    printAngles ("true error of PCL ", angles (pcl_normals, truth));
  }

  const std::string prefix = argv[2];
  if (pcl::io::savePCDFileBinaryCompressed (prefix + ".pcd", our_normals) != 0 ||
      !writePicture (prefix + ".png", our_normals))
  {
    std::fprintf (stderr, "cannot write %s.pcd and %s.png\n", prefix.c_str (), prefix.c_str ());
    return 1;
  }
  std::printf ("normals: %s.pcd\npicture: %s.png\n", prefix.c_str (), prefix.c_str ());
  return 0;
}
