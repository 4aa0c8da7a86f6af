// A source that knows PCL only, compiled with PCL alone and with iine::pcl_dropin. Given a frame, it prints how
// much of it has a normal and the planes found there; it always prints the class that ran.

#include <pcl/features/integral_image_normal.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>
#include <pcl/segmentation/organized_multi_plane_segmentation.h>

#include <cmath>
#include <iostream>
#include <typeinfo>
#include <vector>

using Point = pcl::PointXYZ;
using Estimation = pcl::IntegralImageNormalEstimation<Point, pcl::Normal>;

// The tutorial's settings.
pcl::PointCloud<pcl::Normal>::Ptr
estimate(const pcl::PointCloud<Point>::ConstPtr& cloud)
{
  pcl::PointCloud<pcl::Normal>::Ptr normals(new pcl::PointCloud<pcl::Normal>);
  Estimation ne;
  ne.setNormalEstimationMethod(ne.AVERAGE_3D_GRADIENT);
  ne.setMaxDepthChangeFactor(0.02f);
  ne.setNormalSmoothingSize(10.0f);
  ne.setInputCloud(cloud);
  ne.compute(*normals);
  return normals;
}

int
main(int argc, char** argv)
{
  std::cout << "class " << typeid(Estimation).name() << "\n";
  pcl::PointCloud<Point>::Ptr cloud(new pcl::PointCloud<Point>(64, 48, Point(0.0f, 0.0f, 1.0f)));
  if (argc > 1 && pcl::io::loadPCDFile(argv[1], *cloud) != 0)
    return 1;
  if (argc == 1)
    for (unsigned row = 0; row < cloud->height; ++row)
      for (unsigned column = 0; column < cloud->width; ++column)
        cloud->at(column, row) = Point(0.01f * column, 0.01f * row, 1.0f);

  const pcl::PointCloud<pcl::Normal>::Ptr normals = estimate(cloud);
  std::size_t covered = 0;
  for (const pcl::Normal& normal : *normals)
    covered += std::isfinite(normal.normal_x);
  std::cout << "normals " << covered << "\n";

  pcl::OrganizedMultiPlaneSegmentation<Point, pcl::Normal, pcl::Label> segmentation;
  segmentation.setMinInliers(1000);
  segmentation.setAngularThreshold(0.05);
  segmentation.setDistanceThreshold(0.02);
  segmentation.setInputNormals(normals);
  segmentation.setInputCloud(cloud);
  std::vector<pcl::PlanarRegion<Point>, Eigen::aligned_allocator<pcl::PlanarRegion<Point>>> regions;
  segmentation.segmentAndRefine(regions);
  for (const auto& region : regions) {
    const Eigen::Vector4f plane = region.getCoefficients();
    std::cout << "plane " << region.getCount() << " " << plane.transpose() << "\n";
  }
  return covered > 0 ? 0 : 1;
}
