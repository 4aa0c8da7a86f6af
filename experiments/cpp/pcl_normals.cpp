// PCL's normals of a cloud in the format of src/exchange.rs, by one or several of its estimators, on one thread.
// Writes NAME.METHOD.normals beside NAME.cloud, and prints each METHOD with its time in milliseconds.
//
// usage: pcl_normals NAME.cloud STEP METHOD...
//   STEP    kNN at every STEP-th pixel of every STEP-th row only
//   METHOD  PCL-kNN-K for the K nearest neighbours; PCL-COV-S, PCL-A3G-S, PCL-ADC-S or PCL-S3G-S for
//           IntegralImageNormalEstimation with smoothing size S

#include <pcl/features/integral_image_normal.h>
#include <pcl/features/normal_3d.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

using Point = pcl::PointXYZ;
using Cloud = pcl::PointCloud<Point>;
using Normals = pcl::PointCloud<pcl::Normal>;
using IntegralImages = pcl::IntegralImageNormalEstimation<Point, pcl::Normal>;

[[noreturn]] void
fail (const std::string& what)
{
  std::fprintf (stderr, "pcl_normals: %s\n", what.c_str ());
  std::exit (1);
}

Cloud::Ptr
read (const std::string& path)
{
  std::ifstream file (path, std::ios::binary);
  std::uint32_t width = 0, height = 0;
  std::string rest;
  file >> width >> height;
  std::getline (file, rest);
  Cloud::Ptr cloud (new Cloud (width, height));
  cloud->is_dense = false;
  for (Point& point : *cloud)
    file.read (reinterpret_cast<char*> (point.data), 3 * sizeof (float));
  if (!file || cloud->empty ())
    fail (path + " is not a cloud");
  return cloud;
}

void
write (const std::string& path, const Normals& normals)
{
  std::ofstream file (path, std::ios::binary);
  for (const pcl::Normal& normal : normals)
    file.write (reinterpret_cast<const char*> (normal.normal), 3 * sizeof (float));
  if (!file)
    fail ("cannot write " + path);
}

// What a program waits for: the cloud handed over, and its normals computed.
template <typename Estimation> double
time (Estimation& estimation, const Cloud::Ptr& cloud, Normals& normals)
{
  const auto start = std::chrono::steady_clock::now ();
  estimation.setInputCloud (cloud);
  estimation.compute (normals);
  return std::chrono::duration<double, std::milli> (std::chrono::steady_clock::now () - start).count ();
}

double
byIntegralImages (const std::string& method, float size, const Cloud::Ptr& cloud, Normals& normals)
{
  const std::array<std::string, 4> names = {"PCL-COV", "PCL-A3G", "PCL-ADC", "PCL-S3G"};
  const std::array<IntegralImages::NormalEstimationMethod, 4> methods = {
      IntegralImages::COVARIANCE_MATRIX, IntegralImages::AVERAGE_3D_GRADIENT, IntegralImages::AVERAGE_DEPTH_CHANGE,
      IntegralImages::SIMPLE_3D_GRADIENT};
  for (std::size_t i = 0; i < names.size (); ++i)
    if (names[i] == method)
    {
      IntegralImages estimation;
      estimation.setNormalEstimationMethod (methods[i]);
      estimation.setNormalSmoothingSize (size);
      time (estimation, cloud, normals); // the memory of a pipeline is there from the frame before
      return time (estimation, cloud, normals);
    }
  fail ("unknown method: " + method);
}

double
byNeighbours (int k, int step, const Cloud::Ptr& cloud, Normals& normals)
{
  pcl::NormalEstimation<Point, pcl::Normal> estimation;
  estimation.setSearchMethod (pcl::search::KdTree<Point>::Ptr (new pcl::search::KdTree<Point>));
  estimation.setKSearch (k);
  if (step == 1)
    return time (estimation, cloud, normals);

  const pcl::IndicesPtr pixels (new pcl::Indices);
  for (std::uint32_t y = 0; y < cloud->height; y += step)
    for (std::uint32_t x = 0; x < cloud->width; x += step)
      pixels->push_back (static_cast<pcl::index_t> (y * cloud->width + x));
  estimation.setIndices (pixels);
  Normals found;
  const double milliseconds = time (estimation, cloud, found);
  const float nan = std::numeric_limits<float>::quiet_NaN ();
  normals = Normals (cloud->width, cloud->height, pcl::Normal (nan, nan, nan));
  for (std::size_t i = 0; i < pixels->size (); ++i)
    normals[(*pixels)[i]] = found[i];
  return milliseconds;
}

int
main (int argc, char** argv)
{
  if (argc < 4)
  {
    std::fprintf (stderr, "usage: pcl_normals NAME.cloud STEP METHOD...\n");
    return 2;
  }
  const std::string path = argv[1];
  const int step = std::atoi (argv[2]);
  const Cloud::Ptr cloud = read (path);
  const std::string prefix = path.substr (0, path.rfind (".cloud"));
  Normals normals;
  for (int i = 3; i < argc; ++i)
  {
    const std::string name = argv[i];
    const std::size_t dash = name.rfind ('-');
    const int size = std::atoi (name.c_str () + dash + 1);
    if (dash == std::string::npos || size <= 0 || step <= 0)
      fail ("not a method with its size, or not a step: " + name);
    const std::string method = name.substr (0, dash);
    const double milliseconds =
        method == "PCL-kNN" ? byNeighbours (size, step, cloud, normals)
                        : byIntegralImages (method, static_cast<float> (size), cloud, normals);
    write (prefix + "." + name + ".normals", normals);
    std::printf ("%s,%.3f\n", name.c_str (), milliseconds);
  }
  return 0;
}
